#!/usr/bin/env python3
"""report.py FOLDER/scene-costs.json -o FOLDER/report.html: the page of the study of scenes."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
import page as report  # noqa: E402
from page import Plot, number, percent  # noqa: E402

AXES = {"organs": ("Organs", "organs in the world"), "pairs": ("Places where two organs press", "places that press"),
        "modes": ("Motions and loads", "modes"), "links": ("Links between two organs", "links"),
        "grips": ("Grips", "points that a tool holds"), "needle": ("A needle", "places that the needle holds")}


# As palpate.h has them, from bit 0 on.
FLAGS = ("BAD_INPUT", "CONTACTS_DROPPED", "REGULARISED", "RESPONSE_RANGE", "FORCE_LIMITED", "BUNDLE_LOST", "NOT_TOUCHABLE", "UNSOLVED", "OTHER_BUNDLE",
         "TRACKING_LOST", "WORK_DEFERRED", "SOLVE_INEXACT", "DISCS_THINNED", "DEFORMATION_BEHIND", "LINK_BROKE", "MOTION_LIMITED",
         "FRICTION_JAMS", "SURFACE_CROSSES")


def flags_of(row):
    """The names of the flags that the touches of a row raised."""
    return ", ".join(name for bit, name in enumerate(FLAGS) if row["flags"] >> bit & 1)


def told(row):
    return (f"{row['count']} {row['axis']}, {row['setting']}: median {number(row['median_us'])} us, 90 % {number(row['p90_us'])}, worst {number(row['worst_us'])} us, "
            f"{number(row['ratio'])} times one organ with one tool" + (f"; {flags_of(row)}" if row["flags"] else ""))


def costs(page, study):
    page.heading("What a touch takes")
    reference = next(p for p in study.all["points"] if p["axis"] == "reference")
    page.words(f"Processor time of the touching thread, medians of {study.all['steps']:,} touches. The ratio is that to the touch of one organ with one "
               f"tool that presses it, which took {number(reference['median_us'])} us and is measured anew before each axis. Worst: the longest "
               "single touch; on a busy machine it says more about the machine.")
    plots = []
    for axis, (title, label) in AXES.items():
        rows = [p for p in study.all["points"] if p["axis"] == axis]
        if not rows:
            continue
        plot = Plot(title, label, "touch, us", log_y=True)
        for setting in dict.fromkeys(p["setting"] for p in rows):
            own = [p for p in rows if p["setting"] == setting]
            colour = plot.series
            plot.curve(own, "count", "median_us", told, label=f"{setting}, median")
            plot.series = colour
            plot.curve(own, "count", "worst_us", told, joined=False, faint=True)
        plots.append((plot, f"touch-{axis}", "Lines: medians. Faint: the longest touch."))
    page.plots(plots)
    stand = [p for p in study.all["points"] if "unrest" in p]
    page.words("Where two pressed organs stand, the force between them changes in a step by this share of itself, the mean of 300 steps after 300 others: "
               + "; ".join(f"{p['count']} places {percent(p['unrest'])}" for p in stand) + ".")
    beside = [p for p in study.all["points"] if "solutions_hz" in p]
    if beside:
        page.words("Bodies beside the touch have large deformation, each solved in a thread of its own while the touch goes on 1,000 times a second. Solutions "
                   "of each in a second: " + "; ".join(f"{p['count']} places that {p['setting'].split(',')[0]} {number(p['solutions_hz'])}" for p in beside) + ".")
    page.table(("axis", "setting", "count", "median, us", "90 %", "worst, us", "ratio", "step flags"),
               [(p["axis"], p["setting"], p["count"], p["median_us"], p["p90_us"], p["worst_us"], p["ratio"], flags_of(p)) for p in study.all["points"]],
               folded="Every time")


def errors(page, study):
    page.heading("Each effect against a full solve")
    page.words("The full solve has all nodes of all organs, a direct factor of each stiffness matrix in double precision, and the conditions of the "
               "effect as rows of one system. Force: length of the difference over the force. Field: the 2-norm over the surface nodes of all organs, "
               "relative. Single precision of what a bundle stores is 6e-8. The rows of a grasp, and what a disc gives way by "
               "below the mesh's resolution, are the runtime's. Organs that press: once with the surface between the nodes smooth, as the runtime takes it, and once flat.")
    page.table(("effect", "force, N", "error of the force", "of the torque", "largest displacement, mm", "error of the field"),
               [(e["effect"], e["force_N"], e["force_error"], e.get("torque_error"), e["field_mm"], e["field_error"])
                for e in study.all["errors"]], whole=True)
    rows = [e for e in study.all["errors"] if e["field_error"]]
    plot = Plot("Error against a full solve", "relative error", "", log_x=True, size=(10.5, 0.8 + 0.45 * len(rows)))
    plot.points([e["field_error"] for e in rows], list(range(len(rows)))[::-1],
                [f"{e['effect']}: field {percent(e['field_error'])}" for e in rows], label="field")
    forces = [(e, len(rows) - 1 - i) for i, e in enumerate(rows) if e["force_error"]]
    plot.points([e["force_error"] for e, _ in forces], [y for _, y in forces],
                [f"{e['effect']}: force {percent(e['force_error'])}" for e, _ in forces], label="force")
    plot.axes.set_yticks(range(len(rows)), [e["effect"] for e in rows][::-1])
    page.plot(plot, "errors")


def everything(page, study):
    page.heading("How it was measured")
    page.words(f"{study.machine()}; {study.all['mesh']}, held as {study.all['boundary']} says; took {number(study.all['took_s'])} s. All organs are "
               "copies of this one. As data: <code>scene-costs.json</code> and <code>scene-costs.csv</code>.")


def title_and_lead(study):
    return (f"Scenes of several organs and effects: {study.all['vertices']:,} vertices of the surface",
            "What a touch takes by what a scene has, and what each effect is off against a full solve of the coupled system.")


if __name__ == "__main__":
    report.write_report(__doc__, report.Study, title_and_lead, errors, costs, everything)
