"""Draws the tables of this folder.  python3 docs/validation/plot.py"""
import csv
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

HERE = os.path.dirname(os.path.abspath(__file__))


def table(name):
    path = os.path.join(HERE, name)
    if not os.path.exists(path):
        return []
    with open(path) as file:
        return list(csv.DictReader(file))


def save(figure, name):
    figure.tight_layout()
    figure.savefig(os.path.join(HERE, name), dpi=110)


def ticks(axes, values):
    for axis in axes:
        axis.set_xticks(values, [f"{v:g}" for v in values])
        axis.set_xticks([], minor=True)


def elastic():
    rows = [r for r in table("elastic.csv") if r["platens"] == "smooth" and r["shape"] == "box"]
    figure, axes = plt.subplots(1, 2, figsize=(10, 4))
    for rule, mark in (("exact", "o"), ("kdem", "s"), ("kdem+poisson", "v"), ("onate2015", "^")):
        own = [r for r in rows if r["rule"] == rule]
        axes[0].plot([float(r["poisson"]) for r in own], [float(r["E"]) for r in own], mark, label=rule, mfc="none")
        axes[1].plot([float(r["poisson"]) for r in own], [float(r["nu"]) for r in own], mark, label=rule, mfc="none")
    axes[0].axhline(1, color="k", lw=0.5)
    axes[1].plot([0, 0.45], [0, 0.45], "k", lw=0.5)
    axes[0].set(xlabel="Poisson's ratio given", ylabel="Young's modulus measured / given")
    axes[1].set(xlabel="Poisson's ratio given", ylabel="measured")
    axes[0].legend()
    save(figure, "elastic.png")


def alpha_beta():
    figure, axes = plt.subplots(1, 2, figsize=(10, 4))
    for mesh in "12345":
        own = [r for r in table("alpha-beta.csv") if r["mesh"] == mesh]
        label = f"{own[0]['discs']} discs" + (", lattice" if mesh == "5" else "")
        axes[0].plot([float(r["beta"]) for r in own], [float(r["E"]) for r in own], "o-", label=label)
        axes[1].plot([float(r["beta"]) for r in own], [float(r["nu"]) for r in own], "o-", label=label)
    axes[0].set(xlabel="beta", ylabel="Young's modulus measured / given, alpha = 1")
    axes[1].set(xlabel="beta", ylabel="Poisson's ratio measured (0.25 given)")
    axes[1].axhline(0.25, color="k", lw=0.5)
    axes[0].legend()
    save(figure, "alpha-beta.png")


def rates():
    rows = table("rates.csv")
    if not rows:
        return
    figure, axis = plt.subplots(figsize=(6, 4))
    for scene in dict.fromkeys(r["scene"] for r in rows):
        own = [r for r in rows if r["scene"] == scene]
        slow = float(own[-1]["peak_MPa"])
        axis.semilogx([float(r["rate"]) for r in own], [float(r["peak_MPa"]) / slow for r in own], "o-", label=scene)
    axis.axhspan(0.98, 1.02, color="0.9")
    axis.set(xlabel="loading rate / shipped", ylabel="peak / peak at the slowest")
    ticks([axis], (0.5, 1, 2))
    axis.legend()
    save(figure, "rates.png")


def published():
    rows = table("published.csv")
    if not rows:
        return
    figure, axis = plt.subplots(figsize=(6, 4))
    for name in dict.fromkeys(r["set"] for r in rows):
        own = [r for r in rows if r["set"] == name]
        axis.semilogx([float(r["spheres"]) for r in own], [float(r["peak/experiment"]) for r in own], "o-", label=name)
    axis.axhspan(0.9, 1.1, color="0.9")
    axis.set(xlabel="spheres", ylabel="peak / experiment")
    axis.legend()
    save(figure, "published.png")


def convergence():
    rows = table("convergence.csv")
    if not rows:
        return
    figure, axes = plt.subplots(1, 3, figsize=(13, 4))
    for axis, what, label in zip(axes, ("spheres", "step", "rate"), ("spheres", "step / (0.9 of critical)", "rate / (0.1 m/s a platen, 300 mm)")):
        for rule, mark in (("published", "^-"), ("exact", "o-")):
            own = sorted((float(r["spheres"] if what == "spheres" else r["factor"]), float(r["peak_MPa"])) for r in rows if r["what"] == what and r["rule"] == rule)
            axis.semilogx([x for x, _ in own], [y for _, y in own], mark, label=rule, mfc="none")
        axis.set(xlabel=label, ylabel="peak [MPa]", ylim=(0, None))
        if what != "spheres":
            ticks([axis], (0.25, 0.5, 1, 2))
        axis.legend()
    axes[0].axhline(32.8, color="0.7", lw=1)
    save(figure, "convergence.png")


def confinement():
    rows = table("confinement.csv")
    if not rows:
        return
    p = [float(r["pressure_MPa"]) for r in rows]
    figure, axes = plt.subplots(1, 2, figsize=(10, 4))
    axes[0].plot(p, [float(r["peak_MPa"]) for r in rows], "o-", mfc="none")
    axes[1].plot(p, [1e3 * float(r["strain_at_peak"]) for r in rows], "o-", mfc="none", label="at the peak")
    axes[1].plot(p, [1e3 * float(r["strain_at_0.9_after"]) for r in rows], "s-", mfc="none", label="where a tenth is lost")
    axes[0].set(xlabel="pressure from the side [MPa]", ylabel="peak axial stress [MPa]")
    axes[1].set(xlabel="pressure from the side [MPa]", ylabel="axial strain [1e-3]")
    axes[1].legend()
    save(figure, "confinement.png")


def notched():
    rows = table("notched.csv")
    if not rows:
        return
    figure, axes = plt.subplots(1, 2, figsize=(10, 4))
    for dim, mark in (("2", "o"), ("3", "s")):
        own = [r for r in rows if r["dim"] == dim]
        for axis, column in zip(axes, ("peak", "energy")):
            axis.plot([float(r["cell_mm"]) for r in own], [float(r[column]) for r in own], mark, mfc="none", label="plane" if dim == "2" else "solid")
    axes[0].axhspan(0.98, 1.02, color="0.9")
    axes[1].axhspan(0.97, 1.03, color="0.9")
    axes[0].set(xlabel="cell [mm], ligament 10 mm", ylabel="peak / tensile strength")
    axes[1].set(xlabel="cell [mm], ligament 10 mm", ylabel="energy / fracture energy x projected area")
    axes[0].legend()
    save(figure, "notched.png")


elastic()
alpha_beta()
rates()
published()
convergence()
confinement()
notched()
