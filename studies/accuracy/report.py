#!/usr/bin/env python3
"""report.py FOLDER/accuracy.json -o FOLDER/report.html: the accuracy study as a page for a person who has to decide."""
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
from page import ELEMENTS, Page, Plot, number, study_and_output  # noqa: E402

CONTACTS = {"node": ("#c2410c", "s"), "triangle": ("#a16207", "v"), "point": ("#7c3aed", "D"), "patch": ("#0b6fa4", "o")}


class Study:
    def __init__(self, file):
        with open(file) as stream:
            self.all = json.load(stream)
        self.points = self.all["points"]
        self.base = self.all["base_resolution"]
        self.own_reference = next((p for p in self.points if p["is_reference"] and p["own_material"]
                                   and p["exercise"] == "press" and p["contacts"] == 1), None)

    def axis(self, name, **fixed):
        return [p for p in self.points if name in p["axes"].split() and all(p[k] == v for k, v in fixed.items())]

    def choices(self):
        """What a user would have (choose.h): the organ's own material, columns everywhere, one disc pressed, not in f64."""
        return [p for p in self.points if p["own_material"] and p["columns_everywhere"] and p["exercise"] == "press"
                and p["solver"] == "auto" and p["contacts"] == 1 and p["law"] == "sticking" and p["storage"] != "f64"
                and not p["is_reference"]]

    def named(self, name):
        return next(p for p in self.points if p["name"] == name)


def percent(value):
    return "unknown" if value is None else f"{number(100 * value, 2)} %"


def hundred(value):
    """A relative error in per cent for a table; nothing where it is not known."""
    return None if value is None else 100 * value


def told(point):
    """A point's own sentence, shown when the pointer is over it."""
    return (f"{point['name']} ({point['vertices']:,} vertices)\n"
            f"force {percent(point['force_error'])}, at worst {percent(point['force_error_worst'])}, {number(point['force_error_N'])} N; "
            f"field {percent(point['field_error'])}, {number(point['field_error_mm'])} mm\n"
            f"touch {number(point['touch_us'])} us (99 %: {number(point['touch_us_99'])}), shape {number(point['shape_us'])} us "
            f"(99 %: {number(point['shape_us_99'])})\n"
            f"precompute {number(point['precompute_s'])} s, {number(point['precompute_GB'])} GB; bundle {number(point['bundle_MB'])} MB")


def command(study, point):
    """How to get that setting, for a shell."""
    organ, boundary = study.all["organ"], study.all["boundary"]
    lines = [f"make -f Makefile.data ORGAN={organ} BC={boundary} RESOLUTION={point['resolution']} mesh",
             f"# organ.toml: element = \"{point['element']}\"; scene: contact = \"{point['contact']}\""]
    if point["storage"] == "f16":
        lines.append("palpate-bundle pack bundle.h5 -o small.h5 --precision f16")
    elif point["storage"].startswith("low-rank"):
        lines.append(f"palpate-bundle pack bundle.h5 -o small.h5 --low-rank {point['storage'].split()[1]}")
    return "<pre>" + "\n".join(lines) + "</pre>"


def checked(study):
    """The estimate put to the test, as a sentence."""
    check = study.all["reference"]["check"]
    if not check["vertices"]:
        return "there are too few meshes to test that."
    return (f"made without the finest mesh, the estimate is {percent(check['estimated_force'])} and {percent(check['estimated_field'])}, and the finest "
            f"mesh then was {percent(check['found_force'])} and {percent(check['found_field'])} away.")


def at_most(error, reference):
    return "" if error is None or reference is None else f"; to the truth at most about {percent(error + reference)}"


def first_screen(page, study):
    cards = []
    for pick in study.all["picks"]:
        if pick["pick"] is None:
            cards.append((pick["budget"], "nothing fits", [("limits", "; ".join(pick["limits"]))],
                          f"<p>{pick['why_not']}</p>"))
            continue
        point = study.named(pick["pick"])
        cards.append((pick["budget"], point["name"],
                      [("force error", f"{percent(point['force_error'])}, at worst {percent(point['force_error_worst'])}"
                                       + at_most(point["force_error"], point["reference_force_error"])),
                       ("field error", f"{percent(point['field_error'])}, at most {number(point['field_error_mm'])} mm"
                                       + at_most(point["field_error"], point["reference_field_error"])),
                       ("touch", f"{number(point['touch_us'])} us; 99 %: {number(point['touch_us_99'])} us"),
                       ("shape", f"{number(point['shape_us'])} us; 99 %: {number(point['shape_us_99'])} us"),
                       ("precompute", f"{number(point['precompute_s'])} s, {number(point['precompute_GB'])} GB"),
                       ("bundle", f"{number(point['bundle_MB'])} MB"), ("limits", "; ".join(pick["limits"]))],
                      command(study, point)))
    page.cards(cards)
    reference = study.own_reference
    if reference:
        page.words(f"Errors are against <b>{reference['name']}</b> ({reference['vertices']:,} vertices, quadratic): the finest that the "
                   f"study could afford, not the truth. Its own error is estimated at <b>{percent(reference['reference_force_error'])}</b> of "
                   f"the force and <b>{percent(reference['reference_field_error'])}</b> of the field, which the grey bands show; {checked(study)} "
                   f"Meshes that are equally good differ by about {percent(study.all['reference']['force']['scatter'])} of the force and "
                   f"{percent(study.all['reference']['field']['scatter'])} of the field: of settings nearer to one another than that in the "
                   "force, the cards take the better field, of those the shorter precompute. "
                   "<code>palpate-accuracy choose</code> with limits of your own writes the files that bake a setting. "
                   "<a href='#reference'>How it was estimated</a>.")
    page.words("All of it is linear elasticity: how deep one may push before that itself is the error stands under "
               "<a href='#large-strain'>Linear against large strain</a>." if study.all.get("large_strain") else
               "All of it is linear elasticity, whose own error is not part of these figures.")


def front_plot(study, title, x, x_label, error, error_label, reference):
    plot = Plot(title, x_label, error_label, log_x=True, log_y=True)
    points = [p for p in study.choices() if p[x] and p[error]]
    if not points:
        return plot
    for element, (colour, marker) in ELEMENTS.items():
        own = [p for p in points if p["element"] == element]
        for contact_is_patch in (True, False):
            some = [p for p in own if (p["contact"] == "patch") == contact_is_patch]
            plot.points([p[x] for p in some], [100 * p[error] for p in some], [told(p) for p in some], color=colour,
                        marker=marker, faint=not contact_is_patch,
                        label=element if contact_is_patch else f"{element}, other contacts" if some else None)
    plot.front([p[x] for p in points], [100 * p[error] for p in points], [p["name"] for p in points])
    if reference:
        plot.band(100 * reference, "the reference's own estimated error")
    return plot


def fronts(page, study):
    page.heading("What buys what")
    page.words("Each point is a setting that can be had; put the pointer on it for its name and figures. On the line are those that no "
               "other beats in both. Both axes are logarithmic.")
    own = study.own_reference or {}
    force, field = own.get("reference_force_error"), own.get("reference_field_error")
    page.plots([(front_plot(study, "Force error against touch time", "touch_us", "touch, us (median)", "force_error", "force error, %", force), "force-touch", ""),
                (front_plot(study, "Field error against shape time", "shape_us", "shape, us (median)", "field_error", "field error, %", field), "field-shape", ""),
                (front_plot(study, "Force error against precompute time", "precompute_s", "precompute, s", "force_error", "force error, %", force), "force-precompute", ""),
                (front_plot(study, "Force error against bundle size", "bundle_MB", "bundle, MB", "force_error", "force error, %", force), "force-bundle", "")])


def against_vertices(title, points, groups, key, y, y_label, scale=1, band=None, log_y=True):
    plot = Plot(title, "vertices of the mesh", y_label, log_x=True, log_y=log_y)
    for name, (colour, marker) in groups.items():
        own = sorted((p for p in points if p[key] == name and p[y]), key=lambda p: p["vertices"])
        plot.points([p["vertices"] for p in own], [scale * p[y] for p in own], [told(p) for p in own], label=name, joined=True,
                    color=colour, marker=marker)
    if band:
        plot.band(scale * band, "the reference's own estimated error")
    return plot


def mesh_and_element(page, study):
    page.heading("Mesh size, element and Poisson's ratio")
    page.words("Plain linear tetrahedra (p1) lock as Poisson's ratio nears one half: their error stops falling with the mesh. A mesh of "
               "the pipeline also has its own surface, so part of a coarse mesh's error is its shape.")
    ratios = sorted({p["poisson"] for p in study.axis("poisson") if p["poisson"] is not None})
    plots = []
    for ratio in ratios:
        points = [p for p in study.axis("poisson", poisson=ratio) if not p["is_reference"]]
        band = next((p["reference_force_error"] for p in points), None)
        plots.append((against_vertices(f"Poisson's ratio {ratio:g}", points, ELEMENTS, "element", "force_error",
                                       "force error, %", 100, band), f"force-mesh-nu-{ratio:g}", ""))
    points = [p for p in study.axis("mesh") if not p["is_reference"]]
    plots.append((against_vertices("Field, the organ's own material", points, ELEMENTS, "element", "field_error", "field error, %",
                                   100, (study.own_reference or {}).get("reference_field_error")), "field-mesh", ""))
    plots.append((against_vertices("What it costs to bake", [p for p in points if p["columns_everywhere"]], ELEMENTS, "element",
                                   "precompute_s", "precompute, s"), "precompute-mesh", "With the columns of every touchable vertex."))
    page.plots(plots)


def contact_models(page, study):
    points = study.axis("contact")
    if not points:
        return
    page.heading("Contact model")
    page.words("A displaced point has no stiffness: the force on a node, a triangle or a point belongs to the mesh and falls as the mesh is "
               "refined. A patch - a disc of the tool's radius - has the organ's force on every mesh.")
    force = against_vertices("Force on the tool", points, CONTACTS, "contact", "force_N", "mean force, N", log_y=False)
    if study.own_reference:
        force.line(force.axes.get_xlim(), [study.own_reference["force_N"]] * 2, "reference", color="#1c2530", linestyle="--", linewidth=1)
    page.plots([(force, "contact-force", ""),
                (against_vertices("Its error", points, CONTACTS, "contact", "force_error", "force error, %", 100,
                                  (study.own_reference or {}).get("reference_force_error")), "contact-error", "")])
    page.table(("contact", "mesh", "force, N", "force error, %", "field error, %", "touch, us", "touch 99 %, us", "nodes under contact"),
               [(p["contact"], p["resolution"], p["force_N"], hundred(p["force_error"]), hundred(p["field_error"]), p["touch_us"], p["touch_us_99"],
                 p["contact_nodes"]) for p in points], folded="The same as a table")


def solver_tolerance(page, study):
    points = study.axis("tolerance")
    if not points:
        return
    page.heading("Solver tolerance")
    factor = [p for p in points if p["solver"] == "auto"]
    iterative = [p for p in points if p["solver"] != "auto"]
    text = ("Measured with multigrid, whose iterations stop at the tolerance, on the mesh " + study.base + ". The default where it fits, a "
            "Cholesky factor, passes every tolerance at once")
    if factor:
        text += (f": asked for {number(max(p['tolerance'] for p in factor))} it ends at a true residual of "
                 f"{number(max(p['worst_residual'] for p in factor))}, so there the tolerance buys no time")
    page.words(text + ".")
    error = Plot("What a tolerance leaves", "tolerance on the true relative residual", "relative error", log_x=True, log_y=True)
    for key, name in (("added_force_error", "force"), ("added_field_error", "field"), ("reciprocity_error", "reciprocity of far entries")):
        own = [p for p in iterative if p[key]]
        error.points([p["tolerance"] for p in own], [p[key] for p in own], [f"{name}: {told(p)}" for p in own], label=name, joined=True)
    cost = Plot("What it costs", "tolerance on the true relative residual", "precompute, s", log_x=True)
    for own, name in ((iterative, "multigrid"), (factor, "factor")):
        cost.points([p["tolerance"] for p in own], [p["precompute_s"] for p in own], [told(p) for p in own], label=name, joined=True)
    for plot in (error, cost):
        plot.axes.invert_xaxis()
    page.plots([(error, "tolerance-error", "Against the same mesh solved to 1e-12 and stored in double."), (cost, "tolerance-cost", "")])


def storage(page, study):
    points = study.axis("storage")
    if not points:
        return
    page.heading("Storage")
    page.words("What storing fewer bits adds, against the same mesh with nothing saved. Compare with the error of the mesh itself: where "
               "that is a per cent, halves cost nothing that can be felt.")
    added = Plot("What storage adds to the force error", "bundle, MB", "added force error, %", log_x=True, log_y=True)
    for form in sorted({p["storage"] for p in points}):
        own = [p for p in points if p["storage"] == form and p["added_force_error"]]
        added.points([p["bundle_MB"] for p in own], [100 * p["added_force_error"] for p in own], [told(p) for p in own], label=form, joined=True)
    time = Plot("What it does to the shape's time", "bundle, MB", "shape, us (median)", log_x=True, log_y=True)
    for form in sorted({p["storage"] for p in points}):
        own = [p for p in points if p["storage"] == form]
        time.points([p["bundle_MB"] for p in own], [p["shape_us"] for p in own], [told(p) for p in own], label=form, joined=True)
    page.plots([(added, "storage-error", ""), (time, "storage-shape", "")])
    page.table(("storage", "mesh", "bundle, MB", "added force error, %", "added field error, %", "force error, %", "touch, us", "shape, us", "open, ms"),
               [(p["storage"], p["resolution"], p["bundle_MB"], hundred(p["added_force_error"]), hundred(p["added_field_error"]), hundred(p["force_error"]),
                 p["touch_us"], p["shape_us"], p["open_ms"]) for p in sorted(points, key=lambda p: (p["vertices"], p["bundle_MB"]))],
               folded="The same as a table")


def scene_effects(page, study):
    page.heading("Effects of a scene")
    page.words(f"On the mesh {study.base}. Each row is set against the reference under the same situation, modelled as well as the runtime can: "
               "what is left out shows as an error, what is kept as a cost.")
    for axis, title in (("law", "Sticking against sliding: pressed, then dragged"), ("contacts", "Number of contacts"),
                        ("collision", "Collision at rest or deformed: a second tool beside the first"),
                        ("response", "Measured response"), ("relaxation", "Relaxation: held for a second")):
        points = [p for p in study.axis(axis) if p["resolution"] == study.base and not p["is_reference"]]
        if not points:
            continue
        page.heading(title, 3)
        if axis == "law":
            page.words("What sticks keeps the place it met. What slides is pushed to its depth under the surface where it now stands, along the "
                       "surface's normal there: both belong to each mesh's own surface, and the less a mesh shows of bumps and edges, the farther "
                       "off they are. That, not the solution, is most of the error of the laws that slide, the reference's own too.")
        if axis == "contacts":
            page.words("Each contact is a disc pressed at its own place. Up to 8 tools each hold one; more are shared out among 8 tools, and "
                       "the forces compared are the tools' resultants. What can be touched of this organ has room for "
                       f"{study.all['room_for_contacts']} discs of that radius. The field's error is the mesh's: with the contacts it grows, "
                       "with finer meshes it falls (every point has its figures below).")
        page.table((axis, "mean force, N", "force error, %", "worst, N", "field error, %", "reference's own, %", "touch, us", "touch 99 %, us",
                    "shape, us", "nodes under contact"),
                   [(str(p["law"] if axis == "law" else p[axis] if axis in ("contacts", "collision") else "on" if p[axis] else "off"),
                     p["force_N"], hundred(p["force_error"]), p["force_error_N"], hundred(p["field_error"]),
                     hundred(p["reference_force_error"]), p["touch_us"], p["touch_us_99"],
                     p["shape_us"], p["contact_nodes"]) for p in points])


def large_strain(page, study):
    pushes = [p for p in study.all.get("large_strain", []) if p["steps"]]
    if not pushes:
        return
    page.heading("Linear against large strain", anchor="large-strain")
    page.words(f"A disc's nodes on the mesh {pushes[0]['resolution']} are pushed in, linearly by Palpate (p1) and with large strain by "
               f"CalculiX (neo-Hookean, C3D4: the same mesh and element, nu {pushes[0]['poisson']:g}). No mesh, solver or storage mends "
               "this error: it is the method's.")
    plots = []
    for error, what in (("force_error", "force"), ("field_error", "surface displacement")):
        plot = Plot(f"How far linear elasticity is off in the {what}", "depth of the push, mm", "error, %", log_x=True, log_y=True)
        for push in pushes:
            steps = push["steps"]
            plot.points([s["depth_mm"] for s in steps], [100 * s[error] for s in steps],
                        [f"place {push['place'] + 1}, {number(s['depth_mm'])} mm: force {percent(s['force_error'])} ({number(s['force_N'])} N, "
                         f"large strain {number(s['force_large_N'])} N), field {percent(s['field_error'])}, {number(s['field_error_mm'])} mm"
                         for s in steps], label=f"place {push['place'] + 1}", joined=True)
        plots.append((plot, f"large-strain-{error.split('_')[0]}", ""))
    page.plots(plots)
    deepest = {p["place"]: number(p["steps"][-1]["depth_mm"]) for p in pushes}
    page.table(("place", "force off by 1 % at, mm", "5 %", "10 %", "field off by 1 % at, mm", "5 %", "10 %", "solved to, mm"),
               [(str(p["place"] + 1),
                 *(number(p["depth_mm_at"][share][what]) if p["depth_mm_at"][share][what] is not None else "deeper"
                   for what in ("force", "field") for share in ("1", "5", "10")), deepest[p["place"]]) for p in pushes])


def reference_error(page, study):
    page.heading("How good the reference is", anchor="reference")
    reference = study.all["reference"]
    page.words("The pipeline's meshes are not nested, each has its own surface, and the boundary set picks each mesh's own vertices. So the distances "
               "of all coarser p2-p0 meshes to the finest are fitted by c (h<sup>p</sup> - 1), h the spacing over the finest one's, in the least-squares form of "
               "Richardson's extrapolation (Eca and Hoekstra 2014). The finest one's error is c, times 1.25 where an order p between 0.5 "
               "and 2 was observed, else with p = 1 times 3, plus the scatter about the fit.")
    page.table(("of the", "estimated error, %", "order p", "observed", "scatter, %"),
               [(what, hundred(reference[what]["error"]), reference[what]["order"], "yes" if reference[what]["order_observed"] else "no: 1 is taken",
                 hundred(reference[what]["scatter"])) for what in ("force", "field")])
    points = sorted((p for p in study.points if "reference" in p["axes"].split() and p["own_material"] and p["exercise"] == "press"
                     and p["contacts"] == 1 and not p["is_reference"]), key=lambda p: p["vertices"])
    plot = Plot("Coarser p2-p0 meshes", "vertices of the mesh", "distance to the reference, %", log_x=True, log_y=True)
    for key, name in (("force_error", "force"), ("field_error", "field")):
        plot.points([p["vertices"] for p in points], [100 * p[key] for p in points], [told(p) for p in points], label=name, joined=True)
    page.plot(plot, "reference", checked(study).capitalize())


def everything(page, study):
    page.heading("Every point, every setting")
    machine = study.all["machine"]
    page.words(f"{machine['processor']}, {machine['cores']} cores, {number(machine['memory_GB'])} GB; load when the study ended: "
               f"{number(machine['load'])} (times on a busy machine swing). palpate {study.all['program_version']}. The tool: a disc of "
               f"{number(study.all['radius_mm'])} mm radius, pressed in by half of that at {study.all['places']} places in the middle of equal "
               f"shares of the free surface, the same points of space on every mesh; the field is looked at in {study.all['samples']} places "
               "spread over the whole surface. Force error: length of the difference over the largest force of the exercise, root mean square over places. Field error: "
               "2-norm over the sample places, likewise. Touch and shape: median and 99 % of steps in contact, wall clock. Precompute of less "
               "than 3 s: the median of several. This run of the study took " +
               (", ".join(f"{number(s)} s for {stage}" for stage, s in study.all["took_s"].items()) or "no time") +
               "; what an earlier one had measured took nothing.")
    keys = [k for k in study.points[0] if k not in ("is_reference", "axes")]
    page.table(keys, [[p[k] for k in keys] for p in study.points], folded=f"{len(study.points)} points")
    if study.all.get("left_out"):
        page.table(("left out", "why"), [(p["name"], p["why"]) for p in study.all["left_out"]], folded="What was left out, and why")
    page.words("The same as data: <code>accuracy.json</code> and <code>accuracy.csv</code> beside this page.")


def main():
    arguments = study_and_output(__doc__)
    study = Study(arguments.study)
    page = Page(f"What accuracy costs: {study.all['organ']}, held at {study.all['boundary']}",
                "Each choice that trades accuracy for time, measured on this organ on this machine. What to pick, for three budgets:")
    first_screen(page, study)
    fronts(page, study)
    mesh_and_element(page, study)
    contact_models(page, study)
    solver_tolerance(page, study)
    storage(page, study)
    scene_effects(page, study)
    large_strain(page, study)
    reference_error(page, study)
    everything(page, study)
    page.write(arguments.output)


if __name__ == "__main__":
    main()
