#!/usr/bin/env python3
"""report.py FOLDER/validation.json -o FOLDER/report.html: the page of palpate-validation."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
import page as report  # noqa: E402
from page import ELEMENTS, Plot, number  # noqa: E402

EXACT = 1e-5  # smaller bounds stand for rounding, printed digits or f32: there is no error of the mesh to draw


def size_of(error):
    """A relative error: in per cent, or as a power of ten if it is below 1e-5."""
    if error is None:
        return "not a number"
    return f"{number(100 * error, 2)} %" if error >= 1e-5 else f"{error:.0e}".replace("e-0", "e-")


def span(values, text):
    least, most = text(min(values)), text(max(values))
    return least if least == most else f"{least} to {most}"


def theory_of(series):
    """The order of convergence in theory, as text."""
    if series["order_least"] is None:
        return ""
    least, most = series["order_least"], series["order_most"]
    return f"{least:g}" if least == most else f"{least:g} to {most:g}"


class Study(report.Study):
    def __init__(self, file):
        super().__init__(file)
        self.cases, self.calculix, self.points = self.all["cases"], self.all["calculix"], self.all["points"]

    def points_of(self, case, series):
        return [p for p in self.points if p["case"] == case["id"] and all(p[k] == series[k] for k in ("element", "poisson", "quantity"))]

    def judged(self):
        return [s for c in self.cases for s in c["series"] if s["judged"]]

    def seconds(self):
        solved = {(p["case"], p["element"], p["poisson"], p["cells"]): p["assemble_s"] + p["solve_s"] for p in self.points}
        return sum(solved.values()) + sum(a["assemble_s"] + a["solve_s"] + a["calculix_s"] for a in self.calculix)


# ---- first screen ----


def cell(case, element):
    """For each quantity: an element's error on the finest mesh and its order, with ranges over Poisson's ratios."""
    lines = []
    for quantity in dict.fromkeys(s["quantity"] for s in case["series"]):
        own = [s for s in case["series"] if s["element"] == element and s["quantity"] == quantity and s["judged"]]
        if not own:
            continue
        line = span([s["error"] for s in own], size_of) if all(s["error"] is not None for s in own) else "not a number"
        if own[0]["order_least"] is not None and all(s["order"] is not None for s in own):
            line += f"; order {span([s['order'] for s in own], lambda x: f'{x:.2f}')} ({'; '.join(dict.fromkeys(map(theory_of, own)))})"
        lines.append(line)
    return lines


def quantities(case):
    return list(dict.fromkeys(s["quantity"] for s in case["series"] if s["judged"]))


def verdict(rows):
    failed = sum(not r["holds"] for r in rows)
    return "holds" if not failed else f"{failed} FAIL{'S' if failed == 1 else ''}"


def bounds(case):
    by_quantity = []
    for quantity in quantities(case):
        own = {s["bound"] for s in case["series"] if s["quantity"] == quantity and s["judged"] and s["bound"] is not None}
        by_quantity.append(span(sorted(own), size_of) if own else "")
    return by_quantity


def first_screen(page, study):
    judged = study.judged()
    ordered = [s for s in judged if s["order_least"] is not None]
    failed = study.all["failed"]
    same = [a for a in study.calculix if a["bound"] <= EXACT]
    cards = [("All checks", f"{study.all['checks'] - len(failed)} of {study.all['checks']} checks hold",
              [("closed forms", f"{len(study.cases)} cases; {len(judged)} errors compared with bounds"),
               ("time", f"{number(study.seconds())} s of processor time")], "".join(f"<p>Fails: {f}</p>" for f in failed[:5]))]
    if ordered:
        within = sum(s["holds"] for s in ordered)
        cards.append(("Orders of convergence", f"{within} of {len(ordered)} within {study.all['order_tolerance']:g} of theory"
                      if not study.all["brief"] else f"{within} of {len(ordered)} errors fall",
                      [("measured between", "the two finest meshes of each case"), ("theory", "for each case, element and norm: below, with its source")], ""))
    if same:
        cards.append(("The same problem in CalculiX", f"{sum(a['holds'] for a in same)} of {len(same)} meshes agree",
                      [("largest difference", f"{max(a['difference'] for a in same):.1e} of the largest displacement"),
                       ("digits that CalculiX prints", "seven"),
                       ("vertices", f"{min(a['vertices'] for a in same):,} to {max(a['vertices'] for a in same):,}")], ""))
    page.cards(cards)
    if study.all["brief"]:
        page.words("<b>A short run</b>: only the two coarsest meshes of each case. It checks that errors fall and that exact answers are exact; the bounds "
                   "of the finest meshes are not checked.")
    rows = []
    for case in study.cases:
        names = quantities(case)
        columns = {e: cell(case, e) for e in ELEMENTS}
        for i, name in enumerate(names):
            own = [s for s in case["series"] if s["quantity"] == name and s["judged"]]
            rows.append((case["title"] if i == 0 else "", verdict(own), name, *(columns[e][i] if i < len(columns[e]) else "" for e in ELEMENTS),
                         bounds(case)[i], f"{case['closed_form']} - {case['source']}" if i == 0 else ""))
    if study.calculix:
        rows.append(("CalculiX, the same mesh", verdict(study.calculix), "largest difference", *calculix_cells(study),
                     size_of(same[0]["bound"]) if same else "", f"{len(study.calculix)} meshes - CalculiX 2.20, C3D4 and C3D10"))
    page.heading("Summary of the cases")
    page.words("Relative error on the finest mesh and, if the error comes from the mesh, the measured order of convergence with the order of theory in "
               "brackets. A range covers several Poisson's ratios. An empty cell: the element is not judged in this case. What follows: where the "
               "verdict is <i>holds</i>, assembly and solver give the answer of elasticity to the error shown, and a finer mesh reduces the error as "
               "theory says.")
    page.table(("case", "verdict", "quantity", *ELEMENTS, "bound", "closed form, source"), rows, whole=True)


def calculix_cells(study):
    cells = []
    for element in ELEMENTS:
        own = [a["difference"] for a in study.calculix if a["element"] == element and a["bound"] <= EXACT]
        cells.append(span(own, size_of) if own else "no such element")
    return cells


# ---- case by case ----


def told(point):
    known = f", {number(point['value'], 5)} for {number(point['exact'], 5)}" if point["value"] is not None and point["exact"] is not None else ""
    return (f"{point['element']}, nu {point['poisson']:g}, {point['cells']} cells, {point['vertices']:,} vertices\n{point['quantity']}: "
            f"error {size_of(point['error'])}{known}\nassembled in {number(point['assemble_s'])} s, solved in {number(point['solve_s'])} s")


def slope(plot, points, order, colour):
    """A line with the slope of theory through the finest point."""
    fine = points[-1]
    cells = [points[0]["cells"], fine["cells"]]
    plot.line(cells, [100 * fine["error"] * (fine["cells"] / n) ** order for n in cells], None, color=colour, linestyle=":", linewidth=1.2)


def drawn(case):
    """The quantities for which theory gives an order; if there are none, those whose error comes from the mesh."""
    ordered = [s["quantity"] for s in case["series"] if s["order_least"] is not None]
    return list(dict.fromkeys(ordered or [s["quantity"] for s in case["series"] if s["bound"] is None or s["bound"] > EXACT]))


def plots_of(study, case, quantity):
    own = [s for s in case["series"] if s["quantity"] == quantity and all(p["error"] for p in study.points_of(case, s))]
    if not own:
        return []
    against_cells = Plot(f"{quantity}: error against mesh size", "cells along an edge of the body", "relative error, %", log_x=True, log_y=True)
    against_time = Plot(f"{quantity}: error against time", "assembly and solution, processor time, s", "relative error, %", log_x=True, log_y=True)
    for s in own:
        points = study.points_of(case, s)
        colour, marker = ELEMENTS[s["element"]]
        ratios = sorted({o["poisson"] for o in own if o["element"] == s["element"]})
        faint = s["poisson"] != ratios[0]
        label = f"{s['element']}, nu {s['poisson']:g}" + (" (locks)" if not s["judged"] else "")
        for plot, x in ((against_cells, "cells"), (against_time, lambda p: max(p["assemble_s"] + p["solve_s"], 1e-3))):
            plot.curve(points, x, lambda p: 100 * p["error"], told, label=label, faint=faint, color=colour, marker=marker)
        if s["order_least"] is not None and not faint:
            slope(against_cells, points, s["order_least"], colour)
    name = f"{case['id']}-{quantity.split(',')[0].replace(' ', '-').replace('(', '').replace(')', '')}"
    return [(against_cells, f"{name}-mesh", "Dotted: the order of theory, the smallest if theory gives a range. Points parallel to the dotted line converge as theory says." if any(s["order_least"] for s in own) else ""),
            (against_time, f"{name}-time", "")]


SHELLS = "two-shells"
# Puso and Laursen 2004, Areias et al. 2015, Zimmerman and Ateshian 2018, Abaqus: depth, mm; least, median and most force on the quarter, N.
FOUR_CODES = ((2, 0.66, 0.72, 0.80), (3, 1.07, 1.23, 1.27), (4, 1.64, 1.81, 1.82), (5, 2.24, 2.36, 2.44))
SHELL_FORMS = {"linear": ("#c2410c", "s"), "large": ("#0b6fa4", "o"), "large beside": ("#7c3aed", "D")}


def shells_plot(study, case):
    """The force on the two shells against the depth: our finest mesh of the element that is judged, and the four codes."""
    plot = Plot("Two shells under a plate", "the plate has gone down by, mm", "force on the quarter, N")
    judged = next(s for s in case["series"] if s["judged"])
    for form, (colour, marker) in SHELL_FORMS.items():
        points = [finest for depth, *_ in FOUR_CODES for finest in [p for p in study.points if p["case"] == SHELLS and p["element"] == judged["element"]
                                                                    and p["quantity"] == f"{form}: force at {depth} mm, N"][-1:]]
        plot.curve(points, lambda p: float(p["quantity"].split()[-3]), "value", told, label=f"ours, {form}", color=colour, marker=marker)
    depths, least, median, most = zip(*FOUR_CODES)
    plot.axes.errorbar(depths, median, [[m - a for m, a in zip(median, least)], [b - m for m, b in zip(median, most)]], fmt="_", color="#1c2530",
                       markersize=14, capsize=7, linewidth=1.6, label="four codes: least, median, most", zorder=5)
    return plot, SHELLS, ("The bars are the spread of four published codes. Large deformation, in the touch and beside it, is the same body; linear "
                          "organs are too stiff, by more the deeper the plate goes.")


def series_rows(study, case):
    rows = []
    for s in case["series"]:
        points = study.points_of(case, s)
        for p in points:
            last = p is points[-1]
            rows.append((s["quantity"], s["element"], s["poisson"], p["cells"], p["vertices"], p["unknowns"], p["assemble_s"], p["solve_s"],
                         p["value"], p["exact"], size_of(p["error"]), s["order"] if last else None, theory_of(s) if last else "",
                         ("holds" if s["holds"] and s["judged"] else s["why"]) if last else ""))
    return rows


def case_by_case(page, study):
    for case in study.cases:
        page.heading(case["title"], anchor=case["id"])
        page.words(f"Known answer: {case['closed_form']}. <i>{case['source']}</i>. Expected order: {case['theory']}.")
        plots = [shells_plot(study, case)] if case["id"] == SHELLS else [plot for quantity in drawn(case) for plot in plots_of(study, case, quantity)]
        if plots:
            page.plots(plots)
        page.table(("quantity", "element", "nu", "cells", "vertices", "unknowns", "assemble, s", "solve, s", "found", "exact", "error",
                    "order", "theory", "verdict"), series_rows(study, case), folded="Every mesh: error and time")


def against_calculix(page, study):
    if not study.calculix:
        return
    page.heading("CalculiX on the same mesh", anchor="calculix")
    page.words("One load on each mesh. Difference: the largest difference of a node's displacement, over the largest displacement. p1 is the element C3D4 of "
               "CalculiX, so the two must agree to the seven digits that CalculiX prints. p2-p0 averages the dilatation over a cell and C3D10 does not: "
               "without a bulk modulus (nu near -1) they are the same element and must agree; at nu 0.3 they only come closer on finer meshes. CalculiX "
               "integrates curved cells with four points, Palpate with fourteen. CalculiX has no element like p1-anp. <i>Large strain</i>: a disc of 10 mm is pushed in, "
               "and the energy of the runtime's large deformation, minimised by Newton's method to its end, is compared with CalculiX's *HYPERELASTIC, NEO HOOKE: "
               "the displacements of the surface, and the force; on the block also with its YEOH and OGDEN. The first law is mu/2 (J^(-2/3) I - 3) + kappa/2 (J - 1)^2 in each tetrahedron, which is ours with p1 and a "
               "stiffening near zero; p1-anp averages J over nodes, and p1 without stiffening has the compressible law. Times are processor time of one "
               "thread; those of CalculiX include reading and writing text files.")
    page.table(("mesh", "element", "nu", "vertices", "tetrahedra", "difference", "bound", "ours, s", "CalculiX, s", "verdict"),
               [(a["mesh"], a["element"], a["poisson"], a["vertices"], a["tetrahedra"], f"{a['difference']:.1e}", f"{a['bound']:g}",
                 a["assemble_s"] + a["solve_s"], a["calculix_s"], "holds" if a["holds"] else "FAILS") for a in study.calculix])
    time = Plot("Time of one solution, linear elements", "vertices of the mesh", "processor time, s", log_x=True, log_y=True)
    for label, seconds, colour, marker in (("CalculiX", lambda a: a["calculix_s"], "#c2410c", "s"),
                                           ("Palpate", lambda a: a["assemble_s"] + a["solve_s"], "#0b6fa4", "o")):
        own = sorted((a for a in study.calculix if a["element"] == "p1" and "large strain" not in a["mesh"]), key=lambda a: a["vertices"])
        time.curve(own, "vertices", lambda a: max(seconds(a), 1e-3), lambda a: f"{a['mesh']}: {label} {number(seconds(a))} s", joined=False,
                   label=f"{label}, linear", color=colour, marker=marker)
    page.plot(time, "calculix-time", "Palpate: assembly, factor, solution. CalculiX: the same, with its text files.")


def everything(page, study):
    page.heading("How it was measured")
    page.words(f"{study.machine()}. Assembly and solver are those of palpate-precompute; the "
               "solver's true residual, 1e-10, is below every error except those of exact answers. Times are processor time of one thread. Norms are "
               "integrals over the cells, 14 points each, relative to the norm of the exact field. The figures as data: "
               "<code>validation.json</code> and <code>validation.csv</code> beside this page.")


def title_and_lead(_):
    return ("Is the solver right?", "Palpate's three elements compared with closed-form solutions of linear elasticity on meshes of increasing "
            "fineness, and with CalculiX on the same meshes.")


if __name__ == "__main__":
    report.write_report(__doc__, Study, title_and_lead, first_screen, case_by_case, against_calculix, everything)
