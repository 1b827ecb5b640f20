"""Force, specific energy and chips of a cut: python3 read_off.py OUT WIDTH DEPTH, width (2D: the thickness, 1) and depth in metres"""
import csv
import sys


def read(name):
    with open(name, newline="") as file:
        rows = list(csv.reader(file))
    return {key.split("[")[0]: [row[k] for row in rows[1:]] for k, key in enumerate(rows[0])}


def cut(where, width, depth):
    """Forces along the cut [N] from the first touch, energy per volume swept since then [J/m3], sizes of the fragments."""
    h = read(where + "/history.csv")
    force = next(k for k in h if k.startswith("force(") and k.endswith(".x"))
    work = next(k for k in h if k.startswith("work("))
    f, w, t = [abs(float(x)) for x in h[force]], [float(x) for x in h[work]], [float(x) for x in h["time"]]
    touch = next((k for k, x in enumerate(f) if x > 0), None)
    if touch is None:
        return None
    shift = next((k for k in h if k.startswith("displacement(") and k.endswith(".x")), None)
    way = float(h[shift][-1]) - float(h[shift][touch]) if shift else float("nan")
    return {"mean": sum(f[touch:]) / len(f[touch:]), "peak": max(f), "work": w[-1] - w[touch], "specific": (w[-1] - w[touch]) / (width * depth * way) if way else float("nan"), "touch": t[touch]}


if __name__ == "__main__":
    r = cut(sys.argv[1], float(sys.argv[2]), float(sys.argv[3]))
    if not r:
        sys.exit("the tool has touched nothing")
    print("mean %.4g N, peak %.4g N, work %.4g J, specific energy %.4g MPa" % (r["mean"], r["peak"], r["work"], 1e-6 * r["specific"]))
    print(open(sys.argv[1] + "/fragments.csv").read()[:2000])
