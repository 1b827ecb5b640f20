"""The notched beam of examples/notched_beam with one cohesive crack, in finite elements alone: python3 bench/plane_crack.py [CRACKS.CSV]

Squares of 0.5 mm with incompatible modes, the scene's softening curve between the lips of a vertical crack at mid-span; with the cracks.csv
of a finished run the crack is led along that run's way (mean place of its broken facets by heights of 5 mm) in steps of an element. The
body is condensed once to the lips, the load and the mouth; damage is found by secant iteration at each displacement of the load. Prints
the peak and the force at openings of the mouth. No mass, so no drag. Needs numpy and scipy.
"""
import csv, sys

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sl

YOUNG, POISSON, THICKNESS = 37e9, 0.2, 50e-3
TENSILE, ENERGY, KNEE_STRESS, KNEE_OPENING = 3.3e6, 143.0, 0.2, 0.45
H, NX, NY, NOTCH, HALF_NOTCH = 0.5e-3, 350, 100, 50, 2  # element; elements along, over the depth, deep in the notch, half its width
OPENINGS = [0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15]  # of the mouth [mm]
MIDDLE, SUPPORTS, BEARING = NX // 2, (50, 300), 1  # columns of nodes; half width of the bearing in elements
INTACT, SPRING = 1e14, 1e9  # penalty of an intact facet [Pa/m]; springs that hold the body while it is condensed [N/m]


def element():
    """Stiffness of a square in plane stress, incompatible modes condensed; nodes counter-clockwise."""
    law = YOUNG / (1 - POISSON**2) * np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, (1 - POISSON) / 2]])
    uu, ua, aa = np.zeros((8, 8)), np.zeros((8, 4)), np.zeros((4, 4))
    for x in (-3**-0.5, 3**-0.5):
        for y in (-3**-0.5, 3**-0.5):
            slope = np.array([[-(1 - y), 1 - y, 1 + y, -(1 + y)], [-(1 - x), -(1 + x), 1 + x, 1 - x]]) / 2 / H
            strain, modes = np.zeros((3, 8)), np.zeros((3, 4))
            strain[0, 0::2] = strain[2, 1::2] = slope[0]
            strain[1, 1::2] = strain[2, 0::2] = slope[1]
            modes[0, 0] = modes[2, 1] = -4 * x / H
            modes[2, 2] = modes[1, 3] = -4 * y / H
            weight = THICKNESS * H * H / 4
            uu += weight * strain.T @ law @ strain
            ua += weight * strain.T @ law @ modes
            aa += weight * modes.T @ law @ modes
    return uu - ua @ np.linalg.solve(aa, ua.T)


def way(file):
    """Column of the crack in each row of elements."""
    if not file:
        return [MIDDLE] * NY
    with open(file) as lines:
        rows = [[float(r[k]) for k in ("x[m]", "y[m]", "broken[-]")] for r in csv.DictReader(lines)]
    heights, places = [], []
    for low in np.arange(25e-3, 50e-3, 5e-3):
        inside = [x for x, y, broken in rows if low <= y < low + 5e-3 and broken > 0.5]
        if inside:
            heights.append(low + 2.5e-3)
            places.append(np.mean(inside))
    return [int(round(np.interp((j + 0.5) * H, heights, places) / H)) for j in range(NY)]


def body(crack):
    """Stiffness condensed to openings along x and y of the crack's pairs of nodes, the load and the mouth's opening; tributary areas."""
    sides = {}
    for i in range(NX):
        for j in range(NOTCH, NY):
            for node in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                sides.setdefault(node, set()).add(i >= crack[j])
    number, rows, columns, values, K = {}, [], [], [], element().ravel()
    for i in range(NX):
        for j in range(NY):
            if MIDDLE - HALF_NOTCH <= i < MIDDLE + HALF_NOTCH and j < NOTCH:
                continue
            right = j >= NOTCH and i >= crack[j]
            dof = []
            for node in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                k = number.setdefault(node + (bool(right and len(sides.get(node, ())) == 2),), len(number))
                dof += [2 * k, 2 * k + 1]
            rows.append(np.repeat(dof, 8))
            columns.append(np.tile(dof, 8))
            values.append(K)
    whole = sp.csc_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))))
    fixed = [2 * number[SUPPORTS[0], 0, False] + 1, 2 * number[SUPPORTS[1], 0, False] + 1, 2 * number[SUPPORTS[1], 0, False]]
    loaded = [2 * k + 1 for (i, j, side), k in number.items() if j == NY and abs(i - MIDDLE) <= BEARING]
    free = np.setdiff1d(np.arange(whole.shape[0]), fixed + loaded)
    load = len(free)
    tie = sp.lil_matrix((whole.shape[0], load + 1))
    tie[free, np.arange(load)] = 1
    for k in loaded:
        tie[k, load] = 1
    place = {k: n for n, k in enumerate(free)}

    area = {}
    for j in range(NOTCH, NY):
        for node in ((crack[j], j), (crack[j], j + 1)):
            area[node] = area.get(node, 0) + H * THICKNESS / 2
    pairs = sorted(area, key=lambda node: (node[1], node[0]))
    couples = [(place[2 * number[n + (False,)] + d], place[2 * number[n + (True,)] + d], d, q)
               for d in range(2) for q, n in enumerate(pairs) if 2 * number[n + (True,)] + d in place]  # loaded nodes do not part upwards
    springs = sp.lil_matrix((load + 1, load + 1))
    pick = np.zeros((load + 1, len(couples) + 2))
    for c, (left, right, _, _) in enumerate(couples):
        for a, b, sign in ((left, left, 1), (right, right, 1), (left, right, -1), (right, left, -1)):
            springs[a, b] += sign * SPRING
        pick[right, c], pick[left, c] = 1, -1
    springs[load, load] += SPRING
    pick[load, -2] = 1
    pick[place[2 * number[MIDDLE + HALF_NOTCH, 0, False]], -1], pick[place[2 * number[MIDDLE - HALF_NOTCH, 0, False]], -1] = 1, -1
    tie = tie.tocsc()
    flexible = pick.T @ sl.splu((tie.T @ whole @ tie + springs).tocsc()).solve(pick)
    stiff = np.linalg.inv(flexible)
    held = np.arange(len(couples) + 1)
    stiff[held, held] -= SPRING
    return stiff, couples, np.array([area[n] for n in pairs])


def traction(w):
    first = KNEE_OPENING * ENERGY / TENSILE
    last = (2 * ENERGY / TENSILE - first) / KNEE_STRESS
    soft = np.where(w < first, TENSILE * (1 - (1 - KNEE_STRESS) * w / first), np.maximum(0, KNEE_STRESS * TENSILE * (last - w) / (last - first)))
    return np.where(w < TENSILE / INTACT, INTACT * w, soft)


def main():
    stiff, couples, area = body(way(sys.argv[1] if len(sys.argv) > 1 else None))
    pair = np.array([q for _, _, _, q in couples])
    along = np.array([c for c, (_, _, d, _) in enumerate(couples) if d == 0])
    load, mouth = len(couples), len(couples) + 1
    unknown = np.array([k for k in range(len(couples) + 2) if k != load])
    secant = least = np.full(len(area), INTACT)
    curve = []
    for down in np.concatenate([np.linspace(0, 0.03e-3, 100)[1:], np.linspace(0.03e-3, 0.2e-3, 200)]):
        for _ in range(500):
            K = stiff.copy()
            K[np.arange(load), np.arange(load)] += (secant * area)[pair]
            u = np.zeros(load + 2)
            u[load] = -down
            u[unknown] = np.linalg.solve(K[np.ix_(unknown, unknown)], K[unknown, load] * down)
            w = np.maximum(u[along], 1e-12)
            new = np.minimum(traction(w) / w, least)
            change = np.max(np.abs(new - secant) * w)
            if change < 2e-3 * TENSILE:
                break
            secant = new
        least = secant
        curve.append((1e3 * u[mouth], -(K[load] @ u)))
    opening, force = np.array(curve).T
    print("peak %.0f N at %.3f mm; at" % (force.max(), opening[force.argmax()]), ", ".join("%.3f mm %.0f N" % (c, np.interp(c, opening, force)) for c in OPENINGS))


main()
