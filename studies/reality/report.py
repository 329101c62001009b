#!/usr/bin/env python3
"""report.py FOLDER/reality.json -o FOLDER/report.html: the page of the comparison with measured curves."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
import page as report  # noqa: E402
from page import COLOURS, ELEMENTS, Plot, number, percent  # noqa: E402

MODELS = {"scatter": ("the fitted specimens' mean force", COLOURS[6], "D"),
          "sliding": ("large, platens that slide", COLOURS[0], "o"),
          "sticking": ("large, platens that stick", COLOURS[3], "s"),
          "yeoh, sliding": ("large, Yeoh, slide", COLOURS[0], "*"),
          "yeoh, sticking": ("large, Yeoh, stick", COLOURS[3], "*"),
          "ogden, sliding": ("large, Ogden, slide", COLOURS[5], "o"),
          "ogden, sticking": ("large, Ogden, stick", COLOURS[5], "s"),
          "linear": ("linear, the constant of large, sliding", COLOURS[1], "^"),
          "linear, own constant": ("linear, its own constant", COLOURS[4], "v"),
          "Q": ("the paper's Q, same support", COLOURS[2], "P")}
PRESSES = {"sliding": "plates that slide", "sticking": "plates that stick", "disc": "glued to a table, a disc of half its radius"}
FITTED_ON, PREDICTED = "<b>Fitted on:</b>", "<b>Predicted:</b>"

# What was not played. The page adds what the folder lacks.
NOT_PLAYED = [
    ("compression below 5 % of strain", "the contact closes over the whole face only there (the curve's toe), which changes the force by more than a law does"),
    ("compression above 50 %", "nothing of it is fitted, and a law that was fitted to smaller strains promises nothing of it"),
    ("the platens' friction", "the data do not state it: both limits are shown, and one curve cannot tell them apart"),
    ("unloading, other rates, relaxation", "the curves are of one loading at 10 mm/min; the large body is elastic"),
    ("the beam's motion to the side", "the load hung off the middle, by an unknown amount; the model is symmetric"),
    ("the clamp's own motion", "markers beside the clamp move too, by less than a millimetre; the model's clamp is rigid"),
    ("the beam with quadratic elements under large strain", "the large body has linear tetrahedra alone; p2-p0 is shown with linear elasticity"),
    ("Q against a second measured support", "the same silicone was measured on one support only: Q on the other ones is compared with the large body"),
]


def of(share):
    return "" if share is None else percent(share)


def millimetres(value):
    return f"{value:.2f}"


# ---- first screen ----


def lead(study):
    return ("Held against reality", "Palpate compared with what others measured on silicone. Each figure says what constants were fitted on and what was "
            "predicted with them.")


def gates(page, study):
    page.cards([(g["gate"].replace("cook", "Cook's membrane").capitalize(), f"{percent(g['found'])}: {'holds' if g['holds'] else 'DOES NOT HOLD'}",
                 [("at most", percent(g["bound"]))], f"<p>{g['what'][0].upper() + g['what'][1:]}</p>") for g in study.all["gates"]])
    if study.all["short"]:
        page.words("<b>A short run</b> on coarse meshes, without Cook's membrane: the errors hold those of the meshes.")


# ---- cylinders ----


def cylinders(page, study):
    c = study.all.get("cylinders")
    if not c:
        return
    page.heading("Silicone cylinders between two plates", anchor="cylinders")
    fitted, predicted = ({len(one[key]) for one in c["silicones"]} for key in ("fitted", "predicted"))
    strains = [f"{s:.0%}" for s in c["strains"]]

    def span(values):
        return "-".join(str(v) for v in sorted({min(values), max(values)}))
    page.words(f"{len(c['silicones'])} silicones, diameter {c['diameter_mm']:g} mm, height {c['height_mm']:.3g} mm. {FITTED_ON} one shear modulus for each silicone, "
               f"on {span(fitted)} specimens from 5 to 50 % of strain, by least squares of relative differences. {PREDICTED} the force on "
               f"{span(predicted)} other specimens. Neo-Hookean where no other law is named, nu {c['poisson']:g}. The median over the silicones and specimens of the error without its sign.")
    plot = Plot("Error of the predicted force", "compression, % of the height", "median error, %")
    for model, (name, colour, marker) in MODELS.items():
        if model == "linear, own constant":
            continue  # the table has it
        ys = c["models"][model]["median"]
        own = [(100 * s, 100 * y) for s, y in zip(c["strains"], ys) if y is not None]
        plot.points([x for x, _ in own], [y for _, y in own], [f"{name}: {y:.2g} % at {x:g} %" for x, y in own], label=name, joined=True, color=colour, marker=marker)
    plot.axes.set_ylim(0, 40)
    examples = Plot("Measured and predicted force", "compression, % of the height", "force, N")
    by_stiffness = sorted(c["silicones"], key=lambda one: one["shear_Pa"]["sliding"])
    for k, one in enumerate(dict((id(o), o) for o in (by_stiffness[0], by_stiffness[len(by_stiffness) // 2], by_stiffness[-1])).values()):
        for i, n in enumerate(one["predicted"]):
            own = [(100 * s, f) for s, f in zip(*one["measured"][n]) if c["strains"][0] <= s <= c["strains"][-1]]
            examples.points([x for x, _ in own], [y for _, y in own], [f"{one['silicone']} {n}: {y:.3g} N" for _, y in own],
                            label=f"{one['silicone']}: measured, not fitted" if i == 0 else None, hollow=True, color=COLOURS[k], marker="o")
        for press, style in (("sliding", "-"), ("sticking", "--")):
            curve = c["curves"][press]
            examples.line([100 * s for s in curve["strains"]], [one["shear_Pa"][press] * f for f in curve["force_over_shear_m2"]],
                          f"predicted, {PRESSES[press]}" if k == 0 else None, color=COLOURS[k], linestyle=style, linewidth=1.3)
    examples.axes.set_yscale("log")
    page.plots([(plot, "cylinders-error", f"{FITTED_ON} other specimens of the same silicone. {PREDICTED} these. The axis ends at 40 %."),
                (examples, "cylinders-force", f"The softest, the middle and the stiffest silicone. {FITTED_ON} other specimens. {PREDICTED} the lines.")])
    page.table(("median error", *(f"at {s}" for s in strains), *(f"worst at {s}" for s in strains)),
               [(MODELS[m][0], *map(of, e["median"]), *map(of, e["worst"])) for m, e in c["models"].items()])
    page.table(("plates", "law", "constants", "residual of the fit, median", f"serves: predicted within {percent(0.05)} from 10 to 50 %", "nearest of the three laws"),
               [(PRESSES[press], law, {"neo-hookean": "1", "ogden": "2", "yeoh": "3"}[law], percent(v["residual"]), f"{v['serves']} of {len(c['silicones'])} silicones",
                 f"{v['nearest']} of {len(c['silicones'])}") for press, own in c["served"].items() for law, v in own.items()])
    page.words(f"{FITTED_ON} the same specimens, all constants of Yeoh's law (shear modulus, c2, c3) and of Ogden's (shear modulus, exponent). {PREDICTED} the other "
               "specimens. Between sliding plates the ratio to the neo-Hookean force is a closed form. Where plates stick, bodies are solved for a table of constants, and "
               f"polynomials go between them, which miss their own bodies by {percent(c['table_off'])} at most. "
               f"{c['unsolved']} of these bodies are left out, because Newton's method finds no balance there: with such constants a law hardly stiffens.")
    page.words("The fitted specimens' mean force is the best that any law could predict: what it is off, specimens differ by. Q has six constants for each silicone "
               "and follows the curve on the support that it was measured on; the next section plays it on others. With one constant, linear elasticity is right at "
               "one strain alone.")
    page.table(("silicone", "fitted on", "predicted", "shear modulus, kPa: sliding", "sticking", *(f"error at {s}, median" for s in strains)),
               [(one["silicone"], ", ".join(one["fitted"]), ", ".join(one["predicted"]), one["shear_Pa"]["sliding"] / 1000, one["shear_Pa"]["sticking"] / 1000,
                 *(of(middle([e["errors"][c["nearer"]] for e in one["errors"] if e["strain"] == s])) for s in c["strains"])) for one in c["silicones"]],
               folded=f"Every silicone ({PRESSES[c['nearer']]})")


def middle(values):
    values = sorted(map(abs, values))
    return (values[(len(values) - 1) // 2] + values[len(values) // 2]) / 2 if values else None


# ---- plates and supports ----


def supports(page, study):
    s, c = study.all.get("supports"), study.all.get("cylinders")
    if not s:
        return
    page.heading("One force curve, two moduli", anchor="supports")
    page.words(f"{FITTED_ON} the same curves, once with plates that slide and once with plates that stick. The moduli differ by a factor of "
               f"{c['moduli_ratio']:.3g} (median). The root mean square of what the fit misses is {percent(c['fit_residual']['sliding'])} with sliding and "
               f"{percent(c['fit_residual']['sticking'])} with sticking plates; {c['sticking_fits_better']} of {len(c['silicones'])} silicones are nearer to sticking "
               "ones. That is so for a neo-Hookean body alone: a law that stiffens less would fit sticking plates, so a curve does not tell the plates and the modulus "
               "both. State how the plates were prepared.")
    page.words(f"{FITTED_ON} Q, on the measured curve, taken for one between plates that slide. {PREDICTED} by Q, the force where the same silicone is pressed in "
               "another way; compared with the large body that has the constant of the same curve. Q knows the force of a linear body alone, not its support.")
    plot = Plot(f"Q on other supports: {s['example']}", "depth, % of the height", "force, N")
    for k, (press, drawn) in enumerate(s["drawn"].items()):
        xs = [100 * x for x in drawn["strains"]]
        plot.line(xs, drawn["large_N"], f"large body: {PRESSES[press]}", color=COLOURS[k], linewidth=1.6)
        plot.line(xs, drawn["q_N"], "Q" + (", where it was fitted" if press == "sliding" else ""), color=COLOURS[k], linestyle="--", linewidth=1.3)
    plot.axes.set_yscale("log")
    page.plot(plot, "supports", f"{FITTED_ON} the curve between sliding plates (blue). {PREDICTED} the other two.")
    page.table(("pressed", "depth over height", "Q against the large body", "linear against the large body"),
               [(PRESSES[press], f"{e['strain']:.0%}", f"{100 * e['q']:+.0f} %", f"{100 * e['linear']:+.0f} %") for press, rows in s["errors"].items() for e in rows])


# ---- the beam ----


def name_of(model):
    return f"{model['element']}, {'linear elasticity' if model['linear'] else 'large strain'}, {model['cells']} cells"


def beam(page, study):
    b = study.all.get("beam")
    if not b:
        return
    page.heading("A silicone beam, clamped at one end", anchor="beam")
    size = " x ".join(f"{1000 * x:g}" for x in b["size"])
    judged = b["models"][0]
    page.words(f"{size} mm, {b['density']:g} kg/m3, nu {b['poisson']:g}, neo-Hookean. {FITTED_ON} Young's modulus, on the mean sag of the end's markers under the own "
               f"weight. {PREDICTED} the markers under loads of {' and '.join(f'{x:.2f} N' for x in b['loads_N'])} more. Markers move with the beam's end as one rigid "
               f"body. Markers at rest vary by {b['rest_mm']:.2g} mm; those beside the clamp move by up to {b['base_moved_mm']:.2g} mm, and the end moves by up to "
               f"{b['sideways_mm']:.2g} mm to the side, which a symmetric model cannot. Any motion of the end in the plane of symmetry leaves the markers off by about "
               + " and ".join(f"{c['symmetric_mm']:.2g} mm ({c['symmetric_mm'] / c['measured_mm']:.1%} of their way) at {c['load_N']:.2f} N" for c in judged["cases"][1:])
               + ", whatever its size.")
    where = Plot("Markers at the end", "along the beam from its end, mm", "height, mm")
    for k, load in enumerate([0.0, *b["loads_N"]]):
        own = [m for m in judged["markers"] if m["load_N"] == load]
        label = "own weight (fitted)" if load == 0 else f"{load:.2f} N more (predicted)"
        for key, hollow in (("measured_mm", True), ("predicted_mm", False)):
            where.points([m["place_mm"][0] + m[key][0] for m in own], [m["place_mm"][2] + m[key][2] for m in own],
                         [f"{m['marker']}, {label}: {'measured' if hollow else 'ours'}, {m['off_mm']:.2g} mm apart" for m in own],
                         label=f"{'measured' if hollow else 'ours'}: {label}", hollow=hollow, color=COLOURS[k], marker="o" if hollow else "x")
    where.axes.set_aspect("equal", adjustable="datalim")
    modulus = Plot("Young's modulus that the mesh finds", "nodes of half the beam", "E, kPa", log_x=True)
    for key in dict.fromkeys((m["element"], m["linear"]) for m in b["models"]):
        own = sorted((m for m in b["models"] if (m["element"], m["linear"]) == key), key=lambda m: m["nodes"])
        colour, marker = ELEMENTS[key[0]]
        modulus.curve(own, "nodes", lambda m: m["young_Pa"] / 1000, lambda m: f"{name_of(m)}: {m['young_Pa'] / 1000:.4g} kPa",
                      label=f"{key[0]}, {'linear elasticity' if key[1] else 'large strain'}", color=colour, marker=marker, hollow=key[1])
    modulus.axes.set_ylim(bottom=0)
    page.plots([(where, "beam-markers", f"{name_of(judged)}. {FITTED_ON} the own weight. {PREDICTED} the loads."),
                (modulus, "beam-modulus", f"{FITTED_ON} the own weight, on each mesh: an element that is too stiff in bending finds too soft a silicone.")])
    cases = [c for c in judged["cases"] if c["load_N"] > 0]
    page.table(("element", "cells", "nodes", "E, kPa", *(f"{what} at {c['load_N']:.2f} N" for c in cases for what in ("markers off by, mm", "of their way", "in the plane", "down alone, mm"))),
               [(name_of(m), m["cells"], m["nodes"], m["young_Pa"] / 1000, *(x for c in m["cases"][1:] for x in
                 (millimetres(c["off_mm"]), percent(c["off_mm"] / c["measured_mm"]), percent(c["plane_off_mm"] / c["measured_mm"]), f"{c['down_off_mm']:+.2f}"))) for m in b["models"]])
    page.table(("case", "repeat", "marker", "measured x, y, z, mm", "ours", "apart, mm"),
               [(m["case"], m["repeat"], m["marker"], *(", ".join(map(millimetres, m[key])) for key in ("measured_mm", "predicted_mm")), millimetres(m["off_mm"]))
                for m in judged["markers"]], folded=f"Every marker ({name_of(judged)})")


# ---- Cook's membrane, what was not played, sources ----


def cook(page, study):
    if study.all.get("cook"):
        page.heading("Cook's membrane", anchor="cook")
        page.words("Other programs' numbers, nothing fitted; docs/accuracy.md, \"Against published numbers\", has the others.")
        page.table(("case", "element", "vertices", "published, mm", "ours, mm", "error"),
                   [("linear elasticity" if c["case"] == "cook" else "large strain", c["element"], c["vertices"], f"{1000 * c['exact']:.2f}", f"{1000 * c['value']:.2f}",
                     percent(c["error"])) for c in study.all["cook"]])


def not_played(page, study):
    page.heading("What could not be played, and why", anchor="not-played")
    missing = [(what, "the folder has no such file") for key, what in (("cylinders", "compressed cylinders"), ("beam", "the beam")) if key not in study.all]
    page.table(("what", "why"), missing + NOT_PLAYED, whole=True)
    page.heading("Sources")
    page.words("Cylinders: A. B. Dawood et al., tissue-phantom-material-database, 2026, data under CC BY 4.0. Beam: srl-ethz/diffPD_sim2real, motion capture, MIT. Both "
               "are on GitHub under these names; studies/reality/README.md says what a folder for this study holds.")
    curves = study.all.get("cylinders", {}).get("curves", {})
    told = "".join(f" {PRESSES[name].capitalize()}: {v['nodes'][1]:,} nodes, whose forces are up to {percent(v['fine_mesh_off'])} above that limit." for name, v in curves.items())
    page.words(f"{study.machine()}; {study.all['seconds']:.0f} s. Solutions: Newton's method on the runtime's own energy, run to its end; element p1-anp where nothing else is "
               f"said. Forces on cylinders are the limit of two meshes, their errors taken for quadratic in the cell size.{told}")


if __name__ == "__main__":
    report.write_report(__doc__, report.Study, lead, gates, cylinders, supports, beam, cook, not_played)
