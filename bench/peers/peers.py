#!/usr/bin/env python3
"""peers.py PEERS.json -o FOLDER: the table of peers.mjs as peers.md, and a picture of where each system's surface is off, peers.png."""
import argparse
import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402


def few(value):
    return f"{value:.0f}" if value >= 100 else f"{value:.2g}"


def table(push):
    lines = ["| | a step, ms | its time, ms | surface off after .5 s | peak force, N |", "|---|---|---|---|---|"]
    for row in push["rows"]:
        error, force = row["error"], row["peak_force_N"]
        off = f"{100 * error:.0f} %" if error > 1e-3 else f"{error:.0e}".replace("e-0", "e-")
        lines.append(f"| {row['name']} | {few(row['step_ms'])} | {few(row['time_ms'])} | {off} | "
                     f"{'tells none' if force is None else format(force, '.3f')} |")
    lines.append(f"| *the static answer* | | | | {push['exact_force_N']:.3f} |")
    return "\n".join(lines)


def picture(push, file):
    """The pushed side of the organ, seen along the push: how far the static answer moves it, and how far off the systems are that
    are not within a thousandth of that."""
    rest = np.array(push["nodes"])[: push["surface_count"]]
    exact = np.array(push["exact"]).reshape(-1, 3)
    off = [(row["name"], np.array(row["surface"]).reshape(-1, 3)) for row in push["rows"] if row["error"] > 1e-3]
    outward = np.array(push["outward"])
    up = np.eye(3)[2 if abs(outward[2]) < 0.9 else 1]
    right = np.cross(up, outward) / np.linalg.norm(np.cross(up, outward))
    corners = rest[push["triangles"]]
    towards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ outward > 0
    farthest_first = np.argsort(corners[towards].mean(axis=1) @ outward)
    triangles = np.array(push["triangles"])[towards][farthest_first]
    figure, axes = plt.subplots(1, 1 + len(off), figsize=(4 * (1 + len(off)), 4.4), layout="constrained")
    axes = np.atleast_1d(axes)

    def draw(axis, title, moved, vector, most):
        place = 1e3 * (rest + moved)
        x, y = place @ right, place @ np.cross(outward, right)
        drawn = axis.tripcolor(x, y, triangles, 1e3 * np.linalg.norm(vector, axis=1), shading="gouraud", vmin=0, vmax=most)
        axis.plot(x[push["node"]], y[push["node"]], "o", color="#b2182b", markersize=5)
        axis.set_title(title)
        axis.set_aspect("equal")
        axis.set_axis_off()
        return drawn

    moves = 1e3 * np.linalg.norm(exact, axis=1).max()
    figure.colorbar(draw(axes[0], "the static answer", exact, exact, moves), ax=axes[0], label="displacement, mm", shrink=0.8)
    if off:
        most = max(1e3 * np.linalg.norm(moved - exact, axis=1).max() for _, moved in off)
        for axis, (name, moved) in zip(axes[1:], off):
            drawn = draw(axis, name, moved, moved - exact, most)
        figure.colorbar(drawn, ax=axes[1:], label="distance from the static answer, mm", shrink=0.8)
    figure.savefig(file, dpi=90)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("peers", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    push = json.loads(arguments.peers.read_text())
    text = table(push)
    (arguments.output / "peers.md").write_text(text + "\n")
    picture(push, arguments.output / "peers.png")
    print(text)


if __name__ == "__main__":
    main()
