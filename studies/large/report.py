#!/usr/bin/env python3
"""report.py FOLDER/large-deformation.json -o FOLDER/report.html: the page of the study of large deformation."""
import os
import statistics
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
import page as report  # noqa: E402
from page import Plot, number, percent  # noqa: E402

KINDS = {"linear": "#c2410c", "large": "#0b6fa4"}
WHAT = {"field": "displacement of the surface", "force": "force"}
# The targets of the method at 0.1 m/s and 20 mm, relative.
TARGET = {"field": 0.01, "force": 0.02}


class Study(report.Study):
    def __init__(self, file):
        super().__init__(file)
        self.points, self.meshes = self.all["points"], self.all["meshes"]
        self.depths = sorted({p["depth_mm"] for p in self.points})
        self.moves = list(dict.fromkeys(p["move"] for p in self.points))

    def solved(self, mesh, **fixed):
        return [p for p in self.points if p["resolution"] == mesh["resolution"] and p["poisson"] == mesh["poisson"]
                and p["unsolved"] is None and all(p[k] == v for k, v in fixed.items())]

    def unsolved(self):
        return [p for p in self.points if p["unsolved"] is not None]


def name_of(mesh):
    return f"{mesh['vertices']:,} vertices, nu {mesh['poisson']:g}"


def median_and_worst(points, key):
    values = [p[key] for p in points]
    return (statistics.median(values), max(values)) if values else (None, None)


def newton_ms(mesh):
    """Of one tick by Newton's method: factor and back-substitutions, without our assembly, which nobody has tuned."""
    newton = mesh["newton"]
    return None if newton is None else newton["steps_a_tick"] * (newton["factor_ms"] + newton["solve_ms"])


def told(point):
    return (f"{point['vertices']:,} vertices, nu {point['poisson']:g}: {point['move']} at place {point['place'] + 1}, {number(point['depth_mm'])} mm, "
            f"{number(point['force_N'])} N\nlinear: field {percent(point['linear_field'])}, force {percent(point['linear_force'])}; "
            f"large: field {percent(point['large_field'])}, force {percent(point['large_force'])}; least J {number(point['least_volume'])}")


def first_screen(page, study):
    depth = 20.0 if 20.0 in study.depths else study.depths[len(study.depths) // 2]
    cards = []
    for mesh in study.meshes:
        points = study.solved(mesh, depth_mm=depth)
        if not points:
            continue
        (field, field_worst), (force, force_worst) = (median_and_worst(points, f"large_{w}") for w in WHAT)
        (_, linear_field), (_, linear_force) = (median_and_worst(points, f"linear_{w}") for w in WHAT)
        large = mesh["touch"]["large"]
        facts = [("field, median; worst", f"{percent(field)}; {percent(field_worst)} (linear: {percent(linear_field)})"),
                 ("force, median; worst", f"{percent(force)}; {percent(force_worst)} (linear: {percent(linear_force)})"),
                 ("touch", f"{number(large['median_us'])} us; 99.9 %: {number(large['most_us'])} us"),
                 ("linear touch", f"{number(mesh['touch']['linear']['median_us'])} us")]
        if newton_ms(mesh):
            facts.append(("a tick by Newton's method", f"{number(newton_ms(mesh))} ms"))
        met = field_worst <= TARGET["field"] and force_worst <= TARGET["force"]
        cards.append((name_of(mesh), f"at {number(depth)} mm within {percent(TARGET['field'])} and {percent(TARGET['force'])}"
                      if met else f"at {number(depth)} mm beyond {percent(TARGET['field'])} or {percent(TARGET['force'])}", facts, ""))
    page.cards(cards)
    page.words(f"Discs of {number(study.all['radius_mm'])} mm radius move at {number(study.all['speed_mm_s'])} mm/s, a touch each millisecond, at "
               f"{study.all['places']} places of the surface. Each state on the way is compared with the converged solution of the same mesh, law and "
               "contacts: Newton's method in double precision, run to its end. So the errors are those of the method, not of the mesh. "
               "Field: the 2-norm over the nodes of the surface, relative. Force: the length of the difference of all discs' forces, relative.")
    if study.unsolved():
        page.words(f"<b>{len(study.unsolved())} states have no converged solution</b> and are left out; the table at the end names them.")


def errors(page, study):
    page.heading("Error against depth")
    page.words("Lines: the median over all moves and places; dashed: the worst. What follows: linear elasticity is a fair answer for a few millimetres; "
               "large deformation is as near to the converged solution at the deepest push as at the shallowest.")
    for mesh in study.meshes:
        plots = []
        for what, text in WHAT.items():
            plot = Plot(f"{name_of(mesh)}: {what}", "depth of the move, mm", f"error of the {text}, %", log_y=True)
            for kind, colour in KINDS.items():
                some = [(d, median_and_worst(study.solved(mesh, depth_mm=d), f"{kind}_{what}")) for d in study.depths]
                some = [(d, m) for d, m in some if m[0]]
                plot.points([d for d, _ in some], [100 * m[0] for _, m in some], [f"{kind}, {number(d)} mm: median {percent(m[0])}" for d, m in some],
                            label=f"{kind}, median", joined=True, color=colour)
                plot.line([d for d, _ in some], [100 * m[1] for _, m in some], f"{kind}, worst", color=colour, linestyle="--", linewidth=1.2)
            plot.axes.set_xticks(study.depths)
            plots.append((plot, f"{what}-{mesh['resolution']}-nu-{mesh['poisson']:g}", ""))
        page.plots(plots)
    rows = []
    for mesh in study.meshes:
        for depth in study.depths:
            points = study.solved(mesh, depth_mm=depth)
            cells = [median_and_worst(points, f"{kind}_{what}") for what in WHAT for kind in KINDS]
            rows.append((f"{mesh['vertices']:,}", mesh["poisson"], depth, len(points), *(percent(v) for pair in cells for v in pair)
                         ) if points else (f"{mesh['vertices']:,}", mesh["poisson"], depth, 0, *[""] * 8))
    page.table(("vertices", "nu", "depth, mm", "states", *(f"{what}: {kind}, {which}" for what in WHAT for kind in KINDS
                                                          for which in ("median", "worst"))), rows, whole=True)


def by_move(page, study):
    page.heading("Error by move")
    rows = []
    for mesh in study.meshes:
        for move in study.moves:
            points = study.solved(mesh, move=move)
            if points:
                rows.append((f"{mesh['vertices']:,}", mesh["poisson"], move, len(points),
                             *(percent(v) for what in WHAT for kind in KINDS for v in median_and_worst(points, f"{kind}_{what}"))))
    page.words("All depths together. A pair is two discs beside each other; a pinch is two discs on opposite sides of a part that is thin enough.")
    page.table(("vertices", "nu", "move", "states", *(f"{what}: {kind}, {which}" for what in WHAT for kind in KINDS for which in ("median", "worst"))),
               rows, folded="Each mesh and move")
    plots = []
    for what, text in WHAT.items():
        plot = Plot(f"Large deformation, every state: {what}", "smallest volume of a tetrahedron, over its volume at rest", f"error of the {text}, %", log_y=True)
        for move in study.moves:
            points = [p for p in study.points if p["move"] == move and p["unsolved"] is None and p[f"large_{what}"] > 0]
            plot.curve(points, "least_volume", lambda p, what=what: 100 * p[f"large_{what}"], told, joined=False, label=move)
        plots.append((plot, f"every-{what}", ""))
    page.plots(plots)


WITH = {"grasp": "jaws that draw and turn", "organs": "a copy of the organ that presses it"}
MODELS = {"linear": KINDS["linear"], "large": KINDS["large"], "beside": "#7c3aed", "renewed": "#3f7d20"}


def composed(page, study):
    """Large deformation beside a grasp, and in a world of two organs."""
    meshes = [m for m in study.meshes if m.get("composed")]
    if not meshes:
        return
    page.heading("With jaws, and with two organs")
    page.words("Jaws of the discs' radius draw a place outwards and turn by 0.01 rad a millimetre; a copy of the organ, which faces a place, comes nearer by the "
               "depth after both touch first. Beside and renewed solve each body once in 10 touches. Lines: the median over the places; dashed: the worst. "
               "Each state is compared with the converged solution of the coupled problem: Newton's method on all bodies, with the jaws' rows, or with the "
               "places and normals at which the organs meet.")
    rows = []
    for mesh in meshes:
        states = [s for s in mesh["composed"]["states"] if "unsolved" not in s]
        plots = []
        for with_, what_is in WITH.items():
            some = [s for s in states if s["with"] == with_]
            depths = sorted({s["depth_mm"] for s in some})
            at = {d: [s for s in some if s["depth_mm"] == d] for d in depths}
            for what, text in WHAT.items():
                plot = Plot(f"{name_of(mesh)}: {what_is}, {what}", "depth, mm", f"error of the {text}, %", log_y=True)
                for model, colour in MODELS.items():
                    values = [median_and_worst(at[d], f"{model}_{what}") for d in depths]
                    plot.points(depths, [100 * v[0] for v in values], [f"{model}, {number(d)} mm: median {percent(v[0])}" for d, v in zip(depths, values)],
                                label=f"{model}, median", joined=True, color=colour)
                    plot.line(depths, [100 * v[1] for v in values], f"{model}, worst", color=colour, linestyle="--", linewidth=1.2)
                plot.axes.set_xticks(depths)
                plots.append((plot, f"{with_}-{what}-{mesh['resolution']}-nu-{mesh['poisson']:g}", ""))
            for d in depths:
                rows.append((f"{mesh['vertices']:,}", mesh["poisson"], with_, d, len(at[d]),
                             *("; ".join(percent(v) for v in median_and_worst(at[d], f"{model}_{what}")) for model in MODELS for what in WHAT)))
        page.plots(plots)
    page.words("Errors: median; worst of the places.")
    page.table(("vertices", "nu", "with", "depth, mm", "places", *(f"{model}: {what}" for model in MODELS for what in WHAT)), rows, whole=True)
    page.words("Processor time of a touch, us: median; 99.9 %. The last two columns: of one solution of one body beside the touch, median.")
    page.table(("vertices", "nu", "with", *MODELS, "solution, beside", "renewed"),
               [(f"{m['vertices']:,}", m["poisson"], with_, *("; ".join(number(t[model][k]) for k in ("median_us", "most_us")) for model in MODELS),
                 *(number(m["composed"]["deform"][with_][model]["median_us"]) for model in ("beside", "renewed")))
                for m in meshes for with_, t in m["composed"]["touch"].items()], whole=True)


def times(page, study):
    page.heading("Time of a touch")
    page.words("By the clock, all touches of all moves but the first of each. Thread: processor time of the touching thread, which other programs on the "
               "machine do not lengthen; asking for it takes about 0.3 us, which a linear touch shows. Newton's method: what a program would do for "
               "the same tick without Palpate, from the last tick's state until the residual is 0.1 % of the inner force, with the analysis kept: factor (CHOLMOD) and "
               "back-substitutions. Its assembly of the tangent, which is ours and simple, is shown and not counted.")
    rows = []
    for mesh in study.meshes:
        linear, large, newton = mesh["touch"]["linear"], mesh["touch"]["large"], mesh["newton"]
        tick = newton_ms(mesh)
        rows.append((f"{mesh['vertices']:,}", mesh["poisson"], linear["median_us"], linear["most_us"], large["median_us"], large["most_us"],
                     large["thread_most_us"], large["worst_us"], large["median_us"] / linear["median_us"],
                     newton and newton["assembly_ms"], newton and newton["factor_ms"], newton and newton["solve_ms"],
                     newton and newton["steps_a_tick"], tick, tick and 1e3 * tick / large["median_us"]))
    page.table(("vertices", "nu", "linear, us", "99.9 %", "large, us", "99.9 %", "thread 99.9 %", "worst", "large / linear", "Newton: assembly, ms",
                "factor, ms", "solves, ms", "steps a tick", "a tick, ms", "Newton / large"), rows, whole=True)
    plot = Plot("Time of one tick", "vertices of the mesh", "us", log_x=True, log_y=True)
    for poisson in sorted({m["poisson"] for m in study.meshes}):
        own = sorted((m for m in study.meshes if m["poisson"] == poisson), key=lambda m: m["vertices"])
        first = poisson == min(m["poisson"] for m in study.meshes)
        for label, value, colour, marker in (
                ("linear touch", lambda m: m["touch"]["linear"]["median_us"], KINDS["linear"], "s"),
                ("large touch", lambda m: m["touch"]["large"]["median_us"], KINDS["large"], "o"),
                ("large touch, 99.9 %, thread", lambda m: m["touch"]["large"]["thread_most_us"], "#7c3aed", "^"),
                ("Newton's method", lambda m: 1e3 * newton_ms(m) if newton_ms(m) else float("nan"), "#3f7d20", "D")):
            plot.curve(own, "vertices", value, lambda m, label=label: f"{name_of(m)}: {label}", label=label if first else None,
                       color=colour, marker=marker, faint=not first)
    plot.line(plot.axes.get_xlim(), [1000, 1000], "a tick of 1 kHz", color="#1c2530", linestyle=":", linewidth=1)
    page.plot(plot, "times", "Medians, and the thread's time where it says so; faint: the larger Poisson's ratios.")
    page.table(("vertices", "nu", "bundle, MB", "scene made in, ms: linear", "large", "shape, us: linear", "large", "moves beside one another"),
               [(f"{m['vertices']:,}", m["poisson"], m["bundle_MB"], m["create_ms"]["linear"], m["create_ms"]["large"],
                 m["shape"]["linear"]["median_us"], m["shape"]["large"]["median_us"], m["threads"]) for m in study.meshes])


def everything(page, study):
    page.heading("Every state")
    page.words(f"{study.machine()}; {study.all['organ']}, held at {study.all['boundary']}, {study.all['element']}; "
               f"took {number(study.all['took_s'])} s. As data: <code>large-deformation.json</code> and <code>large-deformation.csv</code>.")
    keys = list(study.points[0])
    page.table(keys, [[p[k] for k in keys] for p in study.points], folded=f"{len(study.points)} states")
    if study.unsolved():
        page.table(("mesh", "nu", "move", "place", "depth, mm", "why there is no converged solution"),
                   [(p["resolution"], p["poisson"], p["move"], str(p["place"] + 1), p["depth_mm"], p["unsolved"]) for p in study.unsolved()])


def title_and_lead(study):
    return (f"Large deformation: {study.all['organ']}, held at {study.all['boundary']}",
            "How near the runtime's large deformation comes to the converged solution while tools move, what linear elasticity would have given, and "
            "what both take.")


if __name__ == "__main__":
    report.write_report(__doc__, Study, title_and_lead, first_screen, errors, by_move, composed, times, everything)
