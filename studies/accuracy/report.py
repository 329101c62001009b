#!/usr/bin/env python3
"""report.py FOLDER/accuracy.json -o FOLDER/report.html: the page of the accuracy study, for a reader who has to choose a setting."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
import page as report  # noqa: E402
from page import ELEMENTS, Plot, number, percent  # noqa: E402

MODELS = {"linear": ("#c2410c", "s"), "response": ("#a16207", "v"), "large": ("#0b6fa4", "o")}
# Where the viewer's server shows the report (make gallery), a point of the fronts is a link to its bundle in the viewer.
LINKS = """<script>
if (location.protocol.startsWith("http"))
  for (const point of document.querySelectorAll("[data-opens]")) {
    const here = decodeURI(location.pathname).replace(/^\\/|[^/]*$/g, ""), [bundle, setting] = point.dataset.opens.split("#");
    const link = document.createElementNS("http://www.w3.org/2000/svg", "a");
    link.setAttribute("href", `/index.html?${new URLSearchParams({ bundle: here + bundle, finer: here.replace(/accuracy\\/.*/, "render.ply") })}#${setting}`);
    point.replaceWith(link);
    link.append(point);
  }
</script>"""
CONTACTS = {"node": ("#c2410c", "s"), "triangle": ("#a16207", "v"), "point": ("#7c3aed", "D"), "patch": ("#0b6fa4", "o")}


class Study(report.Study):
    def __init__(self, file):
        super().__init__(file)
        self.points = self.all["points"]
        self.base = self.all["base_resolution"]
        self.own_reference = next((p for p in self.points if p["is_reference"] and p["own_material"]
                                   and p["exercise"] == "press" and p["contacts"] == 1), None)

    def axis(self, name, **fixed):
        return [p for p in self.points if name in p["axes"].split() and all(p[k] == v for k, v in fixed.items())]

    def choices(self):
        """The settings that a user could bake: see can_be_chosen in choose.h."""
        return [p for p in self.plain() if p["columns_everywhere"] and not p["is_reference"] and not p["shares_reference"]]

    def predicted(self):
        """Settings that were measured with columns near the sites alone, with the predicted cost of all columns. One that shares the
        reference's answer has the reference's error, at least."""
        points = []
        for p in self.plain():
            if p["columns_everywhere"] or p["full_bundle_MB"] is None:
                continue
            errors = {f"{what}_error": max(p[f"{what}_error"], p[f"reference_{what}_error"] or 0) for what in ("force", "field")}
            points.append({**p, **(errors if p["shares_reference"] else {}), "bundle_MB": p["full_bundle_MB"], "precompute_s": p["full_precompute_s"]})
        return points

    def plain(self):
        return [p for p in self.points if p["own_material"] and p["exercise"] == "press" and p["solver"] == "auto" and p["contacts"] == 1
                and p["law"] == "sticking" and p["storage"] != "f64"]

    def named(self, name):
        return next(p for p in self.points if p["name"] == name)


def hundred(value):
    """A relative error in per cent for a table; None if it is unknown."""
    return None if value is None else 100 * value


def told(point):
    """The text that the page shows while the pointer is over a point."""
    return (f"{point['name']} ({point['vertices']:,} vertices)\n"
            f"force error {percent(point['force_error'])}, worst tool {percent(point['force_error_worst'])}, {number(point['force_error_N'])} N; "
            f"field error {percent(point['field_error'])}, largest {number(point['field_error_mm'])} mm\n"
            f"touch {number(point['touch_us'])} us (99 %: {number(point['touch_us_99'])}), shape {number(point['shape_us'])} us "
            f"(99 %: {number(point['shape_us_99'])})\n"
            f"precompute {number(point['precompute_s'])} s, {number(point['precompute_GB'])} GB; bundle {number(point['bundle_MB'])} MB")


def command(study, point):
    """Shell commands that bake the setting."""
    organ, boundary = study.all["organ"], study.all["boundary"]
    lines = [f"make -f Makefile.data ORGAN={organ} BC={boundary} RESOLUTION={point['resolution']} mesh",
             f"# organ.toml: element = \"{point['element']}\"; scene: contact = \"{point['contact']}\""]
    if point["storage"] == "f16":
        lines.append("palpate-bundle pack bundle.h5 -o small.h5 --precision f16")
    elif point["storage"].startswith("low-rank"):
        lines.append(f"palpate-bundle pack bundle.h5 -o small.h5 --low-rank {point['storage'].split()[1]}")
    return "<pre>" + "\n".join(lines) + "</pre>"


def checked(study):
    """The test of the reference's error estimate, as a sentence."""
    check = study.all["reference"]["check"]
    if not check["vertices"]:
        return "the study has too few meshes to test the estimate."
    return (f"as a test, the estimate was also made without the finest mesh: it gives {percent(check['estimated_force'])} and "
            f"{percent(check['estimated_field'])}, and the distance to the finest mesh is {percent(check['found_force'])} and {percent(check['found_field'])}.")


def conditions(study, contact=True):
    """The conditions of a plot, as a sentence."""
    disc = f"a disc of {number(study.all['radius_mm'])} mm radius, pressed in by half its radius"
    return f"Conditions: {disc}" + (" (contact patch, sticking, unless a point says otherwise)." if contact else ", sticking; four contact models.")


def at_most(error, reference):
    return "" if error is None or reference is None else f"; with the reference's own error at most about {percent(error + reference)}"


def first_screen(page, study):
    cards = []
    for pick in study.all["picks"]:
        if pick["pick"] is None:
            cards.append((pick["budget"], "no setting fits", [("limits", "; ".join(pick["limits"]))],
                          f"<p>{pick['why_not']}</p>"))
            continue
        point = study.named(pick["pick"])
        cards.append((pick["budget"], point["name"],
                      [("force error", f"{percent(point['force_error'])}, worst tool {percent(point['force_error_worst'])}"
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
        page.words(f"Errors are relative to the reference <b>{reference['name']}</b> ({reference['vertices']:,} vertices), chosen as "
                   "<a href='#reference'>below</a>. The reference is not exact: its error is estimated at "
                   f"<b>{percent(reference['reference_force_error'])}</b> of the force and <b>{percent(reference['reference_field_error'])}</b> of the "
                   f"field. Grey bands in the plots show this estimate; {checked(study)} <a href='#reference'>How the error is estimated</a>.")
        page.words(f"Equally good meshes differ by about {percent(study.all['reference']['force']['scatter'])} of the force and "
                   f"{percent(study.all['reference']['field']['scatter'])} of the field. Smaller differences mean nothing: among settings that differ "
                   "by less in the force error, a card shows the one with the smaller field error, and among those the one with the shorter "
                   "precompute. <code>palpate-accuracy choose</code> with your own limits writes the files that bake a setting.")
    page.words("All figures are for linear elasticity. The error of linear elasticity itself grows with the depth of the push: see "
               "<a href='#large-strain'>Linear against large strain</a>." if study.all.get("large_strain") else
               "All figures are for linear elasticity; the error of linear elasticity itself is not included.")


def front_plot(study, title, x, x_label, error, error_label, reference):
    plot = Plot(title, x_label, error_label, log_x=True, log_y=True)
    measured, predicted = ([p for p in some if p[x] and p[error]] for some in (study.choices(), study.predicted()))
    points = measured + predicted
    if not points:
        return plot
    for element, (colour, marker) in ELEMENTS.items():
        for contact_is_patch in (True, False):
            def curve(some, label, hollow):
                some = [p for p in some if p["element"] == element and (p["contact"] == "patch") == contact_is_patch]
                plot.curve(some, x, lambda p: 100 * p[error], told, joined=False, color=colour, marker=marker, faint=not contact_is_patch,
                           opens=lambda p: f"{p['bundle']}#contact={p['contact']}&disc={study.all['radius_mm']:g}", label=label if some or contact_is_patch and not hollow else None, hollow=hollow)
            curve(measured, element if contact_is_patch else f"{element}, other contacts", False)
            curve(predicted, f"{element}, size and precompute predicted" if contact_is_patch else None, True)
    plot.front([p[x] for p in points], [100 * p[error] for p in points], [p["name"] for p in points])
    if reference:
        plot.band(100 * reference, "estimated error of the reference")
    return plot


def fronts(page, study):
    page.heading("Error against cost")
    page.words(f"{conditions(study)} Each point is one setting: mesh, element, storage, contact model. Put the pointer on a point for its name and "
               "figures. A setting on the dark line has no other that is both cheaper and more accurate, so choose one on the line, as far to "
               "the left as its error allows. Faint points are contacts on a node, a triangle or a point. Both axes are logarithmic. "
               "Where <code>make -f Makefile.data gallery</code> shows this page, a click on a point opens its bundle."
               + (" Hollow points were measured with columns near the sites alone; the size of their bundle and the time of their precompute are what "
                  "<code>palpate-precompute --plan</code> predicts for all columns. One on the reference's own mesh stands at the reference's estimated error."
                  if study.predicted() else ""))
    own = study.own_reference or {}
    force, field = own.get("reference_force_error"), own.get("reference_field_error")
    page.plots([(front_plot(study, "Force error against the time of touch", "touch_us", "time of one touch (haptic step), median, us", "force_error", "error of the tool's force, %", force), "force-touch", ""),
                (front_plot(study, "Field error against the time of shape", "shape_us", "time of one shape (surface update), median, us", "field_error", "error of the surface displacement, %", field), "field-shape", ""),
                (front_plot(study, "Force error against the time of the precompute", "precompute_s", "time of the precompute, s", "force_error", "error of the tool's force, %", force), "force-precompute", ""),
                (front_plot(study, "Force error against the size of the bundle", "bundle_MB", "size of the bundle, MB", "force_error", "error of the tool's force, %", force), "force-bundle", "")])
    page.words(LINKS)


def against_vertices(title, points, groups, key, y, y_label, scale=1, band=None, log_y=True):
    plot = Plot(title, "vertices of the mesh", y_label, log_x=True, log_y=log_y)
    for name, (colour, marker) in groups.items():
        own = sorted((p for p in points if p[key] == name and p[y]), key=lambda p: p["vertices"])
        plot.curve(own, "vertices", lambda p: scale * p[y], told, label=name, color=colour, marker=marker)
    if band:
        plot.band(scale * band, "estimated error of the reference")
    return plot


def mesh_and_element(page, study):
    if not study.axis("mesh") and not study.axis("poisson"):
        return
    page.heading("Mesh size, element and Poisson's ratio")
    page.words(f"{conditions(study)} Plain linear tetrahedra (p1) lock as Poisson's ratio approaches one half: a finer mesh hardly reduces their error, so "
               "take p1-anp or p2-p0 for soft tissue. Each mesh also has its own triangulated surface, so part of a coarse mesh's error is its "
               "shape.")
    ratios = sorted({p["poisson"] for p in study.axis("poisson") if p["poisson"] is not None})
    plots = []
    for ratio in ratios:
        points = [p for p in study.axis("poisson", poisson=ratio) if not p["is_reference"]]
        band = next((p["reference_force_error"] for p in points), None)
        plots.append((against_vertices(f"Force error, all tissue at Poisson's ratio {ratio:g}", points, ELEMENTS, "element", "force_error",
                                       "error of the tool's force, %", 100, band), f"force-mesh-nu-{ratio:g}", ""))
    points = [p for p in study.axis("mesh") if not p["is_reference"]]
    if not points:
        page.plots(plots)
        return
    if not ratios:
        plots.append((against_vertices("Force error, the organ's own material", points, ELEMENTS, "element", "force_error", "error of the tool's force, %",
                                       100, (study.own_reference or {}).get("reference_force_error")), "force-mesh", ""))
    plots.append((against_vertices("Field error, the organ's own material", points, ELEMENTS, "element", "field_error", "error of the surface displacement, %",
                                   100, (study.own_reference or {}).get("reference_field_error")), "field-mesh", ""))
    plots.append((against_vertices("Time of the precompute", [p for p in points if p["columns_everywhere"]], ELEMENTS, "element",
                                   "precompute_s", "time of the precompute, s"), "precompute-mesh", "Columns of every touchable vertex, one rank."))
    page.plots(plots)


def contact_models(page, study):
    points = study.axis("contact")
    if not points:
        return
    page.heading("Contact model")
    page.words(f"{conditions(study, contact=False)} A single point of an elastic body has no stiffness: the force on a node, a triangle or a point depends on "
               "the mesh and falls as the mesh is refined. The force on a patch, a disc of the tool's radius, converges to that of the organ, so "
               "give tools a radius.")
    force = against_vertices("Force on the tool, by contact model", points, CONTACTS, "contact", "force_N", "mean force on the tool, N", log_y=False)
    if study.own_reference:
        force.line(force.axes.get_xlim(), [study.own_reference["force_N"]] * 2, "reference", color="#1c2530", linestyle="--", linewidth=1)
    page.plots([(force, "contact-force", ""),
                (against_vertices("Error of that force", points, CONTACTS, "contact", "force_error", "error of the tool's force, %", 100,
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
    text = ("Mesh " + study.base + ". With multigrid, the conjugate gradients stop at the tolerance. The default, used if it fits into memory, is a "
            "Cholesky factor, which meets every tolerance in one or two iterations")
    if factor:
        text += (f": with a tolerance of {number(max(p['tolerance'] for p in factor))} the true residual is "
                 f"{number(max(p['worst_residual'] for p in factor))}, so a larger tolerance saves no time")
    page.words(text + ".")
    error = Plot("Error left by the solver tolerance", "tolerance on the true relative residual", "relative error", log_x=True, log_y=True)
    for key, name in (("added_force_error", "force"), ("added_field_error", "field"), ("reciprocity_error", "reciprocity of far entries")):
        own = [p for p in iterative if p[key]]
        error.curve(own, "tolerance", key, lambda p, name=name: f"{name}: {told(p)}", label=name)
    cost = Plot("Time of the precompute", "tolerance on the true relative residual", "time of the precompute, s", log_x=True)
    for own, name in ((iterative, "multigrid"), (factor, "factor")):
        cost.curve(own, "tolerance", "precompute_s", told, label=name)
    for plot in (error, cost):
        plot.axes.invert_xaxis()
    page.plots([(error, "tolerance-error", "Relative to the same mesh solved to 1e-12 and stored as f64. Stricter tolerances are to the right."), (cost, "tolerance-cost", "")])


def storage(page, study):
    points = study.axis("storage")
    if not points:
        return
    page.heading("Storage")
    page.words(f"{conditions(study)} Errors here are relative to the same mesh without compression. Compare them with the error of the mesh itself: if that "
               "is a per cent, half precision (f16) halves the bundle without a difference that can be felt.")
    added = Plot("Force error added by storage", "size of the bundle, MB", "added error of the tool's force, %", log_x=True, log_y=True)
    for form in sorted({p["storage"] for p in points}):
        own = [p for p in points if p["storage"] == form and p["added_force_error"]]
        added.curve(own, "bundle_MB", lambda p: 100 * p["added_force_error"], told, label=form)
    time = Plot("Time of shape by storage", "size of the bundle, MB", "time of one shape, median, us", log_x=True, log_y=True)
    for form in sorted({p["storage"] for p in points}):
        own = [p for p in points if p["storage"] == form]
        time.curve(own, "bundle_MB", "shape_us", told, label=form)
    page.plots([(added, "storage-error", ""), (time, "storage-shape", "")])
    page.table(("storage", "mesh", "bundle, MB", "added force error, %", "added field error, %", "force error, %", "touch, us", "shape, us", "open, ms"),
               [(p["storage"], p["resolution"], p["bundle_MB"], hundred(p["added_force_error"]), hundred(p["added_field_error"]), hundred(p["force_error"]),
                 p["touch_us"], p["shape_us"], p["open_ms"]) for p in sorted(points, key=lambda p: (p["vertices"], p["bundle_MB"]))],
               folded="The same as a table")


def scene_effects(page, study):
    if not any(study.axis(axis) for axis in ("law", "contacts", "collision", "response", "relaxation")):
        return
    page.heading("Effects of a scene")
    page.words(f"Mesh {study.base}, disc of {number(study.all['radius_mm'])} mm radius. Each row is compared with the reference in the same situation, played with "
               "every effect on: the error shows what an effect is worth, the times show what it costs.")
    for axis, title in (("law", "Contact law: a disc presses, then moves along the surface"), ("contacts", "Number of contacts"),
                        ("collision", "Collision at rest or deformed: a second disc presses beside the first"),
                        ("response", "Measured response"), ("relaxation", "Relaxation: the disc stays for a second")):
        points = [p for p in study.axis(axis) if p["resolution"] == study.base and not p["is_reference"]]
        if not points:
            continue
        page.heading(title, 3)
        if axis == "law":
            page.words("A sticking disc stays at its site. A sliding disc is pushed below the surface at its present position, along the normal there. "
                       "Position and normal are those of the surface that tools meet. Where that is the mesh's own, it shows bumps and edges poorly if the "
                       "mesh is coarse, and this causes most of the error of the sliding laws. Where it is a fine surface bound to the mesh, here that of "
                       "the study's finest mesh, only the elastic solution's error is left. The reference has the fine surface.")
        if axis == "contacts":
            page.words("Each contact is a disc at its own site. Up to 8 contacts have a tool each; more are divided among 8 tools, and the errors are "
                       "those of the tools' total forces. The touchable surface of this organ has room for "
                       f"{study.all['room_for_contacts']} discs. The error of the field grows with the number of contacts and falls with a finer mesh.")
        page.table((axis, "mean force, N", "force error, %", "worst, N", "field error, %", "reference's own, %", "touch, us", "touch 99 %, us",
                    "shape, us", "nodes under contact"),
                   [(str(f"{p['law']}, {p['surface']} surface" if axis == "law" else p[axis] if axis in ("contacts", "collision") else "on" if p[axis] else "off"),
                     p["force_N"], hundred(p["force_error"]), p["force_error_N"], hundred(p["field_error"]),
                     hundred(p["reference_force_error"]), p["touch_us"], p["touch_us_99"],
                     p["shape_us"], p["contact_nodes"]) for p in points])


def told_step(step):
    return (f"{number(step['depth_mm'])} mm: force {percent(step['force_error'])} ({number(step['force_N'])} N, "
            f"large strain {number(step['force_large_N'])} N), field {percent(step['field_error'])}, {number(step['field_error_mm'])} mm")


def large_strain(page, study):
    pushes = [p for p in study.all.get("large_strain", []) if p["steps"]]
    if not pushes:
        return
    page.heading("Linear against large strain", anchor="large-strain")
    page.words(f"The nodes under a disc on the mesh {pushes[0]['resolution']} are pushed in: by Palpate with linear elasticity (p1), and by CalculiX with "
               f"large strain (neo-Hookean, C3D4: the same mesh and element, nu {pushes[0]['poisson']:g}). The difference is the error of linear "
               "elasticity, which no finer mesh reduces: keep pushes shallower than the depth at which it exceeds your limit.")
    plots = []
    for error, what in (("force_error", "force"), ("field_error", "surface displacement")):
        plot = Plot(f"Error of linear elasticity: {what}", "depth of the push, mm", f"error of the {what}, %", log_x=True, log_y=True)
        for push in pushes:
            site = f"site {push['site'] + 1}"
            plot.curve(push["steps"], "depth_mm", lambda s: 100 * s[error], lambda s: f"{site}, {told_step(s)}", label=site)
        plots.append((plot, f"large-strain-{error.split('_')[0]}", ""))
    page.plots(plots)
    deformation(page, pushes)
    deepest = {p["site"]: number(p["steps"][-1]["depth_mm"]) for p in pushes}
    page.table(("site", "force off by 1 % at, mm", "5 %", "10 %", "field off by 1 % at, mm", "5 %", "10 %", "solved to, mm"),
               [(str(p["site"] + 1),
                 *(number(p["depth_mm_at"][share][what]) if p["depth_mm_at"][share][what] is not None else "deeper"
                   for what in ("force", "field") for share in ("1", "5", "10")), deepest[p["site"]]) for p in pushes])


def worst_at(pushes, model, depth, what):
    """The largest error of a model at a depth, over the sites that CalculiX solved so deep; None where there is none."""
    errors = [step[what] for push in pushes for step in push["models"].get(model, {"steps": []})["steps"] if step["depth_mm"] == depth]
    return max(errors) if errors else None


def deformation(page, pushes):
    """The three ways to answer a deep push: superposition, with P and Q, hyperelastic."""
    page.heading("Which deformation for which depth", 3, anchor="deformation")
    page.words("The same pushes answered by superposition (<i>linear</i>), with the corrections P and Q of the measured curve (<i>response</i>), and as the "
               "hyperelastic body with CalculiX's law (<i>large</i>, 0.1 m/s, a touch each millisecond). Worst site at each depth. P and Q are fitted to "
               "one compressed cylinder and its tissue, which is not the neo-Hookean one here. "
               "<code>palpate-accuracy choose --depth 20mm</code> names the cheapest of the three within your limits.")
    depths = sorted({step["depth_mm"] for push in pushes for step in push["steps"]})
    models = [m for m in MODELS if any(m in push["models"] for push in pushes)]
    plots = []
    for what, text in (("force_error", "force"), ("field_error", "surface displacement")):
        plot = Plot(f"Error at the worst site: {text}", "depth of the push, mm", f"error of the {text}, %", log_x=True, log_y=True)
        for model in models:
            colour, marker = MODELS[model]
            known = [(d, worst_at(pushes, model, d, what)) for d in depths]
            known = [(d, e) for d, e in known if e]
            plot.points([d for d, _ in known], [100 * e for _, e in known], [f"{model}, {number(d)} mm: {percent(e)}" for d, e in known],
                        label=model, joined=True, color=colour, marker=marker)
        plots.append((plot, f"deformation-{text.split()[-1]}", ""))
    page.plots(plots)
    page.table(("deformation", *(f"{number(d)} mm: force, field" for d in depths if d >= 5), "touch, us", "99 %, us", "shape, us", "bundle, MB", "scene, MB"),
               [(model, *(f"{percent(worst_at(pushes, model, d, 'force_error'))}, {percent(worst_at(pushes, model, d, 'field_error'))}" for d in depths if d >= 5),
                 *(max(push["models"][model][cost] for push in pushes if model in push["models"])
                   for cost in ("touch_us", "touch_us_99", "shape_us", "bundle_MB", "scene_MB"))) for model in models], whole=True)


def reference_error(page, study):
    page.heading("The error of the reference", anchor="reference")
    reference = study.all["reference"]
    element, other = reference["element"], reference["other"]
    page.words("The reference is the finest mesh that p2-p0 can solve within the study's memory and time. Where p1-anp can solve a finer one, and the estimated "
               f"errors of its force and its field are both smaller, it is that one. Here it is <b>{reference['name']}</b>." +
               (f" The finest mesh of the other element, {other['name']}, is estimated to be off by {percent(other['force']['error'])} of the force and "
                f"{percent(other['field']['error'])} of the field; it lies {percent(other['force_distance'])} and {percent(other['field_distance'])} from the "
                "reference." if other else ""))
    page.words(f"The pipeline's meshes are not nested, and each has its own surface and its own held vertices. The distances of all coarser {element} meshes to "
               "the finest one are therefore fitted by c (h<sup>p</sup> - 1), where h is the edge length over that of the finest mesh: the least-squares "
               "form of Richardson's extrapolation (Eca and Hoekstra 2014). The estimated error is 1.25 c plus the scatter about the fit if the fitted "
               "order p lies between 0.5 and 2; otherwise it is 3 c, with p = 1, plus the scatter.")
    page.table(("quantity", "estimated error, %", "order p", "order observed", "scatter, %"),
               [(what, hundred(reference[what]["error"]), reference[what]["order"], "yes" if reference[what]["order_observed"] else "no: p = 1",
                 hundred(reference[what]["scatter"])) for what in ("force", "field")])
    points = sorted((p for p in study.points if "reference" in p["axes"].split() and p["own_material"] and p["exercise"] == "press"
                     and p["contacts"] == 1 and p["element"] == element and not p["is_reference"]), key=lambda p: p["vertices"])
    without_one = reference["without_one"]
    if without_one["most_force"] is not None:
        page.words("With one of the coarser meshes left out, whichever it is, the estimate lies between "
                   f"{percent(without_one['least_force'])} and {percent(without_one['most_force'])} of the force, and between "
                   f"{percent(without_one['least_field'])} and {percent(without_one['most_field'])} of the field.")
    plot = Plot(f"Distance of coarser {element} meshes to the reference", "vertices of the mesh", "distance to the reference, %", log_x=True, log_y=True)
    for key, name in (("force_error", "force"), ("field_error", "field")):
        plot.curve(points, "vertices", lambda p: 100 * p[key], told, label=name)
    page.plot(plot, "reference", checked(study).capitalize())


def everything(page, study):
    page.heading("Every point, every setting")
    machine = study.all["machine"]
    page.words(f"{machine['processor']}, {machine['cores']} cores, {number(machine['memory_GB'])} GB; load when the study ended: "
               f"{number(machine['load'])} (times vary on a busy machine). palpate {study.all['program_version']}. The tool: a disc of "
               f"{number(study.all['radius_mm'])} mm radius, pressed in by half its radius at {study.all['sites']} sites, the same points of space on every mesh, in the middle of equal "
               f"shares of the free surface. The displacement is compared at {study.all['samples']} points spread over the whole surface. Force error: "
               "length of the force's difference over the largest force of the exercise, root mean square over the sites. Field error: the 2-norm over the "
               "points, relative, root mean square over the exercises. Touch and shape: median and 99th percentile of the steps in contact, wall clock, warm "
               "caches. A precompute of less than 3 s: the median of several. This run of the study took " +
               (", ".join(f"{number(s)} s for {stage}" for stage, s in study.all["took_s"].items()) or "no time") +
               "; points kept from an earlier run took no time.")
    keys = [k for k in study.points[0] if k not in ("is_reference", "axes")]
    page.table(keys, [[p[k] for k in keys] for p in study.points], folded=f"{len(study.points)} points")
    if study.all.get("left_out"):
        page.table(("left out", "why"), [(p["name"], p["why"]) for p in study.all["left_out"]], folded="Settings left out, with the reason")
    page.words("The figures as data: <code>accuracy.json</code> and <code>accuracy.csv</code> beside this page.")


def title_and_lead(study):
    return (f"What accuracy costs: {study.all['organ']}, held at {study.all['boundary']}",
            "What each choice costs in accuracy and in time, measured on this organ and this machine. First: a setting for each of three budgets.")


if __name__ == "__main__":
    report.write_report(__doc__, Study, title_and_lead, first_screen, fronts, mesh_and_element, contact_models, solver_tolerance, storage,
                        scene_effects, large_strain, reference_error, everything)
