"""Which tangential spring made the published curves of oblique impacts?  python3 bench/contact_springs.py [REFERENCE]

Hertz impacts of a sphere on a rigid plane, as in tests/dem/test_contact.c, with three springs: `elastic` keeps its force while the
normal force grows and its stretch while that falls, eq. (5.26) (what we use); `total` is F = k_t(overlap) s, which makes energy; `steps`
adds k_t ds. Each with the stiffness k_t = kappa S for a range of kappa. Prints the largest distance from the digitised curves.
"""
import math
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
STEPS = 300  # through one impact


def curve(folder, name, series):
    rows = [line.split(",") for line in open(os.path.join(folder, name)) if not line.startswith("#")]
    return [(float(row[1]), float(row[2])) for row in rows if row[0] == series]


def damping(e):
    """Fraction of critical damping, eq. (5.24)."""
    low, high = 1e-12, 1.0
    for _ in range(60):
        zeta = 0.5 * (low + high)
        b = math.acos(zeta)
        low, high = (zeta, high) if -2 * b / math.tan(b) > math.log(e) else (low, zeta)
    return 0.5 * (low + high)


def impact(law, kappa, young, poisson, density, r, vn, vt, mu, e):
    """Tangential velocity and spin after the impact."""
    mass, modulus, zeta = density * 4 / 3 * math.pi * r ** 3, young / (1 - poisson ** 2), damping(e) if e < 1 else 0.0
    deepest = (15 * mass * vn * vn / (16 * modulus * math.sqrt(r))) ** 0.4
    dt, inertia, v, d, u, w, s, force, before = 2.94 * deepest / vn / STEPS, 0.4 * mass * r * r, -vn, 0.0, vt, 0.0, 0.0, 0.0, 0.0
    while True:
        d -= v * dt
        if d <= 0:
            return u, w
        stiff = 2 * modulus * math.sqrt(r * d)
        normal, k, slip, arm = max(0.0, 2 / 3 * stiff * d - 2 * zeta * math.sqrt(5 / 6 * stiff * mass) * v), kappa * stiff, (u - (r - d / 2) * w) * dt, r - d / 2
        if law == "steps":
            force += k * slip
            force = max(-mu * normal, min(mu * normal, force))
        else:
            if law == "elastic" and stiff > before:
                s *= before / stiff
            s = max(-mu * normal / k, min(mu * normal / k, s + slip))
            force = k * s
        before = stiff
        v, u, w = v + dt * normal / mass, u - dt * force / mass, w + dt * arm * force / inertia


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else os.path.join(HERE, "..", "tests", "dem", "reference")
    print("largest distance from the curve of    test 5, spin R w/(mu v_n)      test 4, e_t\n%-10s%8s%18s%14s%14s%14s" % ("spring", "kappa", "steel", "polyethylene", "from 5 deg", "from 8 deg"))
    for law in ("elastic", "total", "steps"):
        for kappa in (0.2, 0.25, 2 / 7, 0.32, 0.4, 0.55, "Mindlin", 1.0):
            worst = []
            for series, young, poisson, density in (("steel", 208e9, 0.3, 7850), ("polyethylene", 1e9, 0.38, 1000)):
                k = 2 * (1 - poisson) / (2 - poisson) if kappa == "Mindlin" else kappa
                worst.append(max(abs(-impact(law, k, young, poisson, density, 1e-5, 5, 1.5 * x, 0.3, 1)[1] * 1e-5 / 1.5 - y) for x, y in curve(folder, "chung_ooi_test5_spin.csv", series)))
            k, off = 2 * 0.77 / 1.77 if kappa == "Mindlin" else kappa, []
            for x, y in curve(folder, "chung_ooi_test4_tangential_restitution.csv", "al_oxide"):
                c, s = math.cos(math.radians(x)), math.sin(math.radians(x))
                off.append((x, abs(impact(law, k, 380e9, 0.23, 4000, 2.5e-3, 3.9 * c, 3.9 * s, 0.092, 0.98)[0] / (3.9 * s) - y)))
            print("%-10s%8s%18.2f%14.2f%14.3f%14.3f" % (law, kappa if kappa == "Mindlin" else "%.3f" % kappa, *worst, max(d for x, d in off), max(d for x, d in off if x >= 8)), flush=True)


main()
