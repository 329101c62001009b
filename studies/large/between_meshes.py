#!/usr/bin/env python3
"""between_meshes.py FOLDER/between-meshes.json -o FOLDER/between-meshes.html: the force of the same push on every mesh."""
import json
import math
import os
import statistics
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
from page import ELEMENTS, Page, Plot, number, percent, study_and_output  # noqa: E402

# The disc with the compliance that the mesh cannot resolve, as the runtime has it, and without.
DISCS = {"": "disc of the runtime", "_plain": "mean displacement alone"}
LAWS = ("linear", "large")


class Study:
    def __init__(self, file):
        with open(file) as stream:
            self.all = json.load(stream)
        self.points = self.all["points"]
        sizes = {p["mesh"]: p["vertices"] for p in self.points}
        self.vertices = sizes
        self.split = next(m for m in sizes if m.endswith("-split"))
        self.meshes = sorted((m for m in sizes if m != self.split), key=sizes.get)  # coarse to fine, each of its own shape
        self.poisson = sorted({p["poisson"] for p in self.points})
        self.depths = sorted({p["depth_mm"] for p in self.points})
        self.places = sorted({p["place"] for p in self.points})
        self.by_key = {(p["mesh"], p["element"], p["poisson"], p["depth_mm"], p["place"]): p for p in self.points}

    def force(self, mesh, element, poisson, depth, place, law, disc):
        """N, a vector; None where no solution was found."""
        row = self.by_key.get((mesh, element, poisson, depth, place))
        force = row and [row[f"{law}{disc}_{axis}_N"] for axis in "xyz"]
        return None if force is None or None in force else force

    def elements(self, law):
        return [e for e in ELEMENTS if law == "linear" or e != "p2-p0"]

    def apart(self, one, other):
        """|one - other| / |other| over the places, each a function of a place. Median, worst, number of places."""
        values = []
        for place in self.places:
            a, b = one(place), other(place)
            if a and b:
                values.append(math.dist(a, b) / math.hypot(*b))
        return (statistics.median(values), max(values), len(values)) if values else (None, None, 0)


def models(study):
    for law in LAWS:
        for element in study.elements(law):
            for disc, text in DISCS.items():
                yield law, element, disc, f"{law}, {element}, {text}"


def of(study, mesh, poisson, depth, law, element, disc):
    return lambda place: study.force(mesh, element, poisson, depth, place, law, disc)


def against_the_finest(page, study, poisson, depth):
    finest = study.meshes[-1]
    rows = []
    for law, element, disc, text in models(study):
        best = of(study, finest, poisson, depth, law, study.elements(law)[-1], "")
        own = [study.apart(of(study, mesh, poisson, depth, law, element, disc), best) for mesh in study.meshes]
        rows.append((text, *(f"{percent(median)}, {percent(worst)}" if count else "" for median, worst, count in own)))
    page.table(("model", *(f"{study.vertices[m]:,} vertices" for m in study.meshes)), rows, whole=True)


def between_neighbours(page, study, poisson, depth):
    rows = []
    for law, element, disc, text in models(study):
        cells = []
        for coarse, fine in zip(study.meshes, study.meshes[1:]):
            median, worst, count = study.apart(of(study, coarse, poisson, depth, law, element, disc),
                                               of(study, fine, poisson, depth, law, element, disc))
            cells.append(f"{percent(median)}, {percent(worst)}" if count else "")
        rows.append((text, *cells))
    page.table(("model", *(f"{study.vertices[a]:,} against {study.vertices[b]:,}" for a, b in zip(study.meshes, study.meshes[1:]))), rows, whole=True)


def of_the_shape(page, study, poisson, depth):
    coarsest, finest = study.meshes[0], study.meshes[-1]
    rows = []
    for law, element, disc, text in models(study):
        one = [of(study, mesh, poisson, depth, law, element, disc) for mesh in (coarsest, study.split, finest)]
        resolution, shape = study.apart(one[0], one[1]), study.apart(one[1], one[2])
        if resolution[2]:
            rows.append((text, *(percent(v) for pair in (resolution, shape) for v in pair[:2])))
    page.table(("model", f"{study.vertices[coarsest]:,} against the same cut: median", "worst",
                f"cut ({study.vertices[study.split]:,}) against {study.vertices[finest]:,}: median", "worst"), rows, whole=True)


def curves(page, study, depth):
    finest = study.meshes[-1]
    plots = []
    for poisson in study.poisson:
        plot = Plot(f"nu {poisson:g}, {number(depth)} mm", "vertices of the mesh", "force over that of the best model, median over the places", log_x=True)
        best = of(study, finest, poisson, depth, "large", study.elements("large")[-1], "")
        for element in study.elements("large"):
            for disc, text in DISCS.items():
                ratios = []
                for mesh in study.meshes:
                    own = of(study, mesh, poisson, depth, "large", element, disc)
                    values = [math.hypot(*own(p)) / math.hypot(*best(p)) for p in study.places if own(p) and best(p)]
                    ratios.append(statistics.median(values) if values else float("nan"))
                colour, marker = ELEMENTS[element]
                xs = [study.vertices[m] for m in study.meshes]
                plot.points(xs, ratios, [f"{element}, {text}, {x:,} vertices: {number(r)}" for x, r in zip(xs, ratios)],
                            label=f"{element}, {text}", color=colour, marker=marker, faint=bool(disc))
                plot.line(xs, ratios, None, color=colour, linestyle="--" if disc else "-", linewidth=1.2)
        plots.append((plot, f"between-meshes-nu-{poisson:g}", ""))
    page.plots(plots)


def main():
    arguments = study_and_output(__doc__)
    study = Study(arguments.study)
    page = Page(f"Forces between meshes: {study.all['organ']}, held at {study.all['boundary']}",
                "How much of the difference between two meshes is the element, the disc, and the shape of the mesh.")
    page.words(f"A disc of {number(study.all['radius_mm'])} mm radius goes in at {study.all['places']} places, the same points of space on every mesh. Linear "
               "elasticity, and the converged solution of large deformation (Newton's method; p2-p0 has none). "
               "<b>Mean displacement alone</b>: the mean over the disc is prescribed; the pressure is uniform, and the mesh's resolution decides how far it "
               "spreads. <b>Disc of the runtime</b>: the same with the compliance that lies below the mesh's resolution. Differences: the length of the "
               "difference of the force vectors over the length of the second; median and worst over the places.")
    depth = 20.0 if 20.0 in study.depths else study.depths[-1]
    curves(page, study, depth)
    for poisson in study.poisson:
        for depth in study.depths:
            page.heading(f"nu {poisson:g}, {number(depth)} mm")
            page.heading("Against the best element on the finest mesh", 3)
            against_the_finest(page, study, poisson, depth)
            page.heading("Between a mesh and the next, the same model", 3)
            between_neighbours(page, study, poisson, depth)
            page.heading("Resolution or shape", 3)
            page.words("The coarsest mesh with each tetrahedron cut into eight has the same shape: its distance from the coarsest mesh is resolution alone. "
                       "Its distance from the finest mesh is mostly shape.")
            of_the_shape(page, study, poisson, depth)
    machine = study.all["machine"]
    page.words(f"{machine['processor']}, {machine['cores']} cores; palpate {study.all['program_version']}; took {number(study.all['took_s'])} s. As data: "
               "<code>between-meshes.json</code> and <code>between-meshes.csv</code>.")
    page.write(arguments.output)


if __name__ == "__main__":
    main()
