#!/usr/bin/env python3
"""report.py FOLDER/played.json -o FOLDER/report.html: the page of a played scene beside its own converged solution."""
import os
import statistics
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "report"))
import page as report  # noqa: E402
from page import Plot, number, percent  # noqa: E402

# N: a relative error of a smaller force says nothing.
LEAST_FORCE = 0.1


class Study(report.Study):
    def __init__(self, file):
        super().__init__(file)
        self.points = self.all["points"]
        self.solved = [p for p in self.points if not p["unsolved"]]
        self.moving = [p for p in self.solved if p["moved_mm"] > 0.1]

    def forces(self, tool):
        """(state, relative error) where the tool's force is large enough."""
        return [(p, p[f"{tool}_missed_N"] / p[f"{tool}_N"]) for p in self.solved if p[f"{tool}_N"] >= LEAST_FORCE]


def median_and_worst(values):
    return f"{percent(statistics.median(values))}; {percent(max(values))}" if values else "none"


def first_screen(page, study):
    every = study.all
    facts = [("surface, median; worst", median_and_worst([p["field"] for p in study.moving])),
             ("a node, worst", f"{number(max(p['worst_mm'] for p in study.solved))} mm of {number(max(p['moved_mm'] for p in study.solved))} mm")]
    for tool in every["tools"]:
        some = study.forces(tool)
        most = max((p[f"{tool}_N"] for p, _ in some), default=0)
        facts.append((f"force of {tool}, median; worst", f"{median_and_worst([e for _, e in some])} (largest force {number(most)} N)"))
    touch = every["touch"]
    facts += [("touch, median; 99.9 %; worst", f"{number(touch['median_us'])}; {number(touch['most_us'])}; {number(touch['worst_us'])} us"),
              ("touches with a flag", f"{every['flagged_touches']:,} of {touch['calls']:,}: {every['touches_with_flag'] or 'none'}"),
              ("states without a converged solution", str(len(study.points) - len(study.solved)))]
    page.cards([(every["scene"], f"{number(every['duration_s'])} s, {len(study.points)} states", facts, "")])
    page.words(f"{every['vertices']:,} vertices, {every['surface_vertices']:,} on the surface; {number(every['touch_hz'])} touches in a second of the scene. "
               "Each state is compared with Newton's method in double precision on the same mesh and law, at the places of the "
               "contacts that hold in this step. The surface's error is the 2-norm over its nodes, relative to what they move beyond their supports, "
               f"where some node moves by 0.1 mm or more; a force counts from {LEAST_FORCE} N on. {study.machine()}.")


def in_time(page, study):
    page.heading("In time")
    times = [p["time_s"] for p in study.solved]
    field = Plot("Error of the surface", "time, s", "error of the surface, %", log_y=True, size=(11, 4))
    field.points([p["time_s"] for p in study.moving], [100 * max(p["field"], 1e-6) for p in study.moving],
                 [f"{number(p['time_s'])} s: {percent(p['field'])}, worst node {number(p['worst_mm'])} mm {p['flags']}" for p in study.moving],
                 label="relative", joined=True)
    page.plot(field, "field", "Of what the nodes of the surface move beyond their supports.")
    moved = Plot("How far the surface moves", "time, s", "mm", size=(11, 4))
    moved.points(times, [p["moved_mm"] for p in study.solved], [f"{number(p['time_s'])} s: {number(p['moved_mm'])} mm" for p in study.solved],
                 label="largest displacement beyond the supports", joined=True)
    moved.points(times, [p["worst_mm"] for p in study.solved], [f"{number(p['time_s'])} s: {number(p['worst_mm'])} mm" for p in study.solved],
                 label="largest error of a node", joined=True)
    page.plot(moved, "moved")
    force = Plot("Forces", "time, s", "N", size=(11, 4))
    missed = Plot("Error of the forces", "time, s", "error of the force, %", log_y=True, size=(11, 4))
    for tool in study.all["tools"]:
        force.points(times, [p[f"{tool}_N"] for p in study.solved], [f"{number(p['time_s'])} s: {number(p[f'{tool}_N'])} N" for p in study.solved],
                     label=tool, joined=True)
        some = study.forces(tool)
        missed.points([p["time_s"] for p, _ in some], [100 * max(e, 1e-6) for _, e in some],
                      [f"{number(p['time_s'])} s: {percent(e)} {p['flags']}" for p, e in some], label=tool, joined=True)
    page.plot(force, "forces", "The length of each tool's force.")
    page.plot(missed, "force-errors", f"The length of its difference from the converged one, over it, from {LEAST_FORCE} N on.")


def everything(page, study):
    page.heading("Every state")
    keys = list(study.points[0])
    page.table(keys, [[p[k] for k in keys] for p in study.points], folded=f"{len(study.points)} states")


def title_and_lead(study):
    return (f"Played: {study.all['scene']}", "A scene under large deformation as it is played in real time, beside the converged solution of the same targets.")


if __name__ == "__main__":
    report.write_report(__doc__, Study, title_and_lead, first_screen, in_time, everything)
