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


elastic()
alpha_beta()
rates()
published()
