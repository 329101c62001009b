#!/usr/bin/env python3
"""contacts.py -o FILE.png: what each contact model holds where a tool meets a triangle; the size of a dot is the node's weight."""
import argparse
import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.patches import Circle  # noqa: E402

INK, HELD, TOOL = "#1c2530", "#c2410c", "#0b6fa4"
BARYCENTRIC = (0.55, 0.3, 0.15)
RADIUS = 1.1  # of the disc, in edges of the mesh


def nodes():
    return [(i + 0.5 * (j % 2), j * math.sqrt(3) / 2) for j in range(5) for i in range(5)]


def triangles():
    found = []
    for j in range(4):
        for i in range(4):
            a, b, c, d = 5 * j + i, 5 * j + i + 1, 5 * j + i + 5, 5 * j + i + 6
            found += [(a, b, c), (b, d, c)] if j % 2 == 0 else [(a, d, c), (a, b, d)]
    return found


def barycentric(p, corners):
    (xa, ya), (xb, yb), (xc, yc) = corners
    area = (xb - xa) * (yc - ya) - (yb - ya) * (xc - xa)
    kb = ((p[0] - xa) * (yc - ya) - (p[1] - ya) * (xc - xa)) / area
    kc = ((xb - xa) * (p[1] - ya) - (yb - ya) * (p[0] - xa)) / area
    return 1 - kb - kc, kb, kc


def disc_weights(centre):
    """As runtime/contact/contact_patch.cpp: rings at Gauss points of sqrt(1 - r^2), each point shared by its triangle's vertices."""
    ring = (0.033765242898423986, 0.16939530676686775, 0.38069040695840155, 0.61930959304159845, 0.83060469323313225, 0.96623475710157601)
    share = (0.085662246189585173, 0.18038078652406930, 0.23395696728634552, 0.23395696728634552, 0.18038078652406930, 0.085662246189585173)
    weight = {}
    for s, w in zip(ring, share):
        for spoke in range(20):
            r, turn = RADIUS * math.sqrt(1 - s * s), math.radians(18 * spoke)
            p = (centre[0] + r * math.cos(turn), centre[1] + r * math.sin(turn))
            for triangle in triangles():
                k = barycentric(p, [nodes()[n] for n in triangle])
                if min(k) >= 0:
                    for n, kn in zip(triangle, k):
                        weight[n] = weight.get(n, 0) + kn * w / 20
                    break
    return weight


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", required=True)
    output = parser.parse_args().o
    met = (12, 13, 17)
    corners = [nodes()[n] for n in met]
    centre = tuple(sum(k * c[d] for k, c in zip(BARYCENTRIC, corners)) for d in range(2))
    squares = sum(k * k for k in BARYCENTRIC)
    models = {
        "node": ("the nearest vertex is\nmoved by d", {met[0]: 1}),
        "triangle (the paper)": ("vertex v is moved by\n$\\alpha_v d$, $\\alpha_v = k_v + 1 - \\Sigma k^2$", {n: k + 1 - squares for n, k in zip(met, BARYCENTRIC)}),
        "point": ("the weighted mean\n$\\Sigma k_v u_v$ is moved by d", dict(zip(met, BARYCENTRIC))),
        "patch": ("the mean over the disc\nis moved by d", disc_weights(centre)),
    }
    figure, panels = plt.subplots(1, 4, figsize=(11, 3.3))
    for axes, (name, (words, weight)) in zip(panels, models.items()):
        axes.set_aspect("equal")
        axes.axis("off")
        for triangle in triangles():
            x, y = zip(*(nodes()[n] for n in (*triangle, triangle[0])))
            axes.plot(x, y, color="#9aa7b4", linewidth=0.8)
        if name == "patch":
            axes.add_patch(Circle(centre, RADIUS, facecolor=TOOL, alpha=0.15, edgecolor=TOOL, linewidth=1.2))
        for n, w in weight.items():
            axes.plot(*nodes()[n], "o", markersize=16 * math.sqrt(w), color=HELD, alpha=0.85)
        axes.plot(*centre, "x", color=TOOL, markersize=9, markeredgewidth=2)
        axes.set_title(name, fontsize=10.5, fontweight="bold", color=INK)
        axes.text(2.2, -0.35, words, ha="center", va="top", fontsize=8.6, color=INK)
        axes.set_xlim(-0.1, 4.6)
        axes.set_ylim(-1.25, 3.6)
    figure.savefig(output, dpi=110, bbox_inches="tight", facecolor="white")


main()
