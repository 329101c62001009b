#!/usr/bin/env python3
"""study.py MEASURED --bin BIN -o FOLDER: compares Palpate with curves that others measured, which the folder MEASURED holds (README.md says
in which form). Constants are fitted on some of them, the others are predicted. Writes FOLDER/reality.json and FOLDER/report.html (report.py).
Exit code 1: the folder cannot be used; 3: a gate is not met. --short: coarse meshes and no Cook's membrane, a few seconds."""
import argparse
import concurrent.futures
import json
import math
import os
import subprocess
import sys
import time

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import laws  # noqa: E402
import measured  # noqa: E402
from measured import FITTED  # noqa: E402

JUDGED = (0.1, 0.2, 0.3, 0.4, 0.5)
SHOWN = (0.05, *JUDGED)
CURVE = [round(0.05 + 0.025 * i, 3) for i in range(19)]  # strains at which curves are solved
DISC_CURVE = [s for s in CURVE if s <= 0.3]
POISSON = 0.499  # silicone hardly changes its volume
DIAMETER_MM = 50.0
BEAM = {"size": (0.1, 0.03, 0.03), "density": 1070.0, "gravity": 9.80709, "poisson": 0.49}
Q_TERMS = 6  # of y / x; the paper's Q is a polynomial of degree 4 to 10
GATES = {"cylinders": 0.05, "laws": 0.05, "beam": 0.05, "element": 0.03, "cook": 0.01}
# Cells along the radius: two meshes, from which the limit of fine meshes is estimated. The disc ends half way, so its cells are even.
CELLS = {"sliding": (4, 8), "sticking": (5, 8), "disc": (4, 8)}
SHORT_CELLS = {"sliding": (2, 3), "sticking": (3, 5), "disc": (2, 4)}
# Laws of more constants where plates stick: their force over that of the neo-Hookean law, on one mesh of the element that bends best.
LAW_STRAINS, LAW_CELLS, SHORT_LAW_CELLS, LAW_ELEMENT = CURVE[::2], 5, 3, "p1-ang"
# (element, linear, cells through the height); the first one is judged.
BEAMS = [("p1-anp", False, 12), ("p1-anp", False, 6), ("p1-anp", False, 3), ("p1-ang", False, 9), ("p1-ang", False, 6), ("p1-ang", False, 3), ("p1", False, 6),
         ("p1-anp", True, 6), ("p2-p0", True, 6), ("p2-p0", True, 3)]
BENDS, TRUE_OF_BEAM = "p1-ang", "p2-p0"  # elements whose finest meshes of the beam are compared: what the element itself does to the modulus
SHORT_BEAMS = [("p1-anp", False, 4), ("p2-p0", True, 2)]


def symmetric_rest(markers):
    """The mean distance, mm, that the nearest rigid motion in the upright plane of symmetry leaves: hardly less than any symmetric model."""
    before, moved = (np.array([m[key] for m in markers]) for key in ("place_mm", "measured_mm"))
    a, b = (x[:, ::2] - x[:, ::2].mean(axis=0) for x in (before, before + moved))
    turn = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    turned = a @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    return float(np.mean(np.sqrt(((turned - b) ** 2).sum(axis=1) + moved[:, 1] ** 2)))


def relative_fit(shape, force):
    """The factor that makes factor * shape nearest to force, by least squares of the relative differences."""
    share = np.asarray(shape) / np.asarray(force)
    return float(share.sum() / (share * share).sum())


class Curve:
    """Force over shear modulus against strain, m^2, for one way to press."""

    def __init__(self, name, strains, coarse, fine, cells):
        self.name, self.cells, self.nodes = name, cells, (coarse["nodes"], fine["nodes"])
        rate = 2.0  # of convergence, that of linear elements
        weight = cells[0] ** -rate / (cells[0] ** -rate - cells[1] ** -rate)
        both = [np.array([r["slope_over_shear_m2"]] + r["force_over_shear_m2"]) for r in (coarse, fine)]
        limit = both[0] + weight * (both[1] - both[0])
        self.slope, self.force = limit[0], limit[1:]
        self.strains, self.ratios = np.array(strains), self.force / np.array(strains)
        self.fine_off = both[1][1:] / self.force - 1

    def at(self, strain):
        return strain * np.interp(strain, np.r_[0, self.strains], np.r_[self.slope, self.ratios])


class Response:
    """The paper's Q: measured force against that of linear elasticity, y / x a polynomial, beyond its range a straight line."""

    def __init__(self, linear, force):
        linear, force = np.asarray(linear), np.asarray(force)
        self.end = float(linear.max())
        terms = min(Q_TERMS, len(set(linear.tolist())))
        powers = np.vander(linear / self.end, terms) * (linear / force)[:, None]
        self.ratio = np.poly1d(np.linalg.lstsq(powers, np.ones_like(force), rcond=None)[0])

    def __call__(self, x):
        t = min(x / self.end, 1.0)
        slope = self.ratio(1.0) + self.ratio.deriv()(1.0)
        return self.end * t * self.ratio(t) + slope * max(x - self.end, 0.0)


class Study:
    def __init__(self, arguments):
        self.arguments, self.folder = arguments, os.path.abspath(arguments.output)
        self.silicones, self.height_mm, self.beam_rows = measured.read_folder(arguments.measured)
        os.makedirs(self.folder, exist_ok=True)

    def run(self, *command, codes=(0,)):
        done = subprocess.run([str(c) for c in command], env=dict(os.environ, OMP_NUM_THREADS="1"), stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True)
        if done.returncode not in codes:
            sys.exit("study.py: %s ended with %d:\n%s" % (" ".join(map(str, command)), done.returncode, done.stderr[-3000:]))
        return done.stdout

    def program(self, name, *arguments, **options):
        return self.run(os.path.join(self.arguments.bin, name), *arguments, **options)

    def solved(self, *arguments):
        return json.loads(self.program("reality_solves", *arguments))

    def solved_if_possible(self, *arguments):
        """None where Newton's method finds no balance."""
        return json.loads(self.program("reality_solves", *arguments, codes=(0, 1)) or "null")

    # ---- cylinders ----

    def pressed(self, press, cells, strains=None, *law, solve=None):
        strains = strains or (DISC_CURVE if press == "disc" else CURVE)
        return (solve or self.solved)("cylinder", "--radius", DIAMETER_MM / 2000, "--height", self.height_mm / 1000, "--poisson", POISSON, "--press", press,
                           "--cells", cells, "--strains", ",".join(map(str, strains)), *law)

    def curves(self):
        cells = SHORT_CELLS if self.arguments.short else CELLS
        with concurrent.futures.ThreadPoolExecutor(self.arguments.jobs) as pool:
            runs = {(press, n): pool.submit(self.pressed, press, n) for press, both in cells.items() for n in sorted(both, reverse=True)}
        return {press: Curve(press, DISC_CURVE if press == "disc" else CURVE, *(runs[press, n].result() for n in both), both)
                for press, both in cells.items()}

    def law_branches(self):
        """{(law, plates): [(rows, ratio(rows, strains))]}, and by how much the tables' polynomials miss their own bodies;
        and how many bodies of the tables have no balance: these are left out."""
        cells, element = SHORT_LAW_CELLS if self.arguments.short else LAW_CELLS, ("--element", LAW_ELEMENT)
        options = {law: [[(f"--{law}", ",".join(map(str, laws.constants(law, row)))) for row in rows] for rows in laws.branches(law)] for law in laws.LAWS}
        with concurrent.futures.ThreadPoolExecutor(self.arguments.jobs) as pool:
            def start(*law, solve):
                return pool.submit(self.pressed, "sticking", cells, LAW_STRAINS, *element, *law, solve=solve)
            runs = {law: [[start(*one, solve=self.solved_if_possible) for one in branch] for branch in own] for law, own in options.items()}
            plain = start(solve=self.solved)
        plain, result, off, unsolved = np.array(plain.result()["force_over_shear_m2"]), {}, 0.0, 0
        for law, own in runs.items():
            result[law, "sliding"] = [(rows, lambda rows, strains, law=law: laws.sliding_ratio(law, rows, strains)) for rows in laws.branches(law)]
            tables = []
            for rows, branch in zip(laws.branches(law), own):
                # Constants at the edge of what a law takes: it hardly stiffens, the strain gathers in a few cells, and there is no balance.
                solved = [(row, run.result()) for row, run in zip(rows, branch) if run.result()]
                unsolved += len(rows) - len(solved)
                tables.append(laws.Table(np.array([row for row, _ in solved]), LAW_STRAINS,
                                         np.array([one["force_over_shear_m2"] for _, one in solved]) / plain))
            result[law, "sticking"] = [(rows, table.ratio) for rows, table in zip(laws.branches(law), tables)]
            off = max([off] + [table.off for table in tables])
        return result, off, unsolved

    def cylinders(self, curves):
        branches, table_off, unsolved = self.law_branches()
        plates = {press: curves[press] for press in ("sliding", "sticking")}
        silicones = [self.silicone(name, specimens, plates, branches) for name, specimens in self.silicones.items()]
        models = {}
        for model in silicones[0]["errors"][0]["errors"]:
            errors = {s: [e["errors"][model] for one in silicones for e in one["errors"] if e["strain"] == s] for s in SHOWN}
            models[model] = {"median": [float(np.median(np.abs(errors[s]))) if errors[s] else None for s in SHOWN],
                             "signed": [float(np.median(errors[s])) if errors[s] else None for s in SHOWN],
                             "worst": [float(np.max(np.abs(errors[s]))) if errors[s] else None for s in SHOWN]}
        fits = {press: float(np.median([one["residual"][press] for one in silicones])) for press in plates}
        nearer = min(fits, key=fits.get)
        def worst(one, model):  # of a silicone: over the judged strains, the median of its predicted specimens
            return max(float(np.median([abs(e["errors"][model]) for e in one["errors"] if e["strain"] == s] or [0])) for s in JUDGED)
        kinds = {press: {law: press if law == "neo-hookean" else f"{law}, {press}" for law in ("neo-hookean", *laws.LAWS)} for press in plates}
        served = {press: {law: {"serves": sum(worst(one, model) <= GATES["laws"] for one in silicones),
                                "nearest": sum(model == min(own.values(), key=lambda m: worst(one, m)) for one in silicones),
                                "residual": float(np.median([one["residual"][model] for one in silicones]))} for law, model in own.items()}
                  for press, own in kinds.items()}
        return {"served": served, "table_off": table_off, "unsolved": unsolved, "diameter_mm": DIAMETER_MM, "height_mm": self.height_mm, "poisson": POISSON, "strains": SHOWN, "models": models, "fit_residual": fits,
                "nearer": nearer, "silicones": silicones,
                "moduli_ratio": float(np.median([one["shear_Pa"]["sliding"] / one["shear_Pa"]["sticking"] for one in silicones])),
                "sticking_fits_better": sum(one["residual"]["sticking"] < one["residual"]["sliding"] for one in silicones),
                "curves": {c.name: {"cells": c.cells, "nodes": c.nodes, "strains": c.strains.tolist(), "force_over_shear_m2": c.force.tolist(),
                                    "slope_over_shear_m2": float(c.slope), "fine_mesh_off": float(np.max(np.abs(c.fine_off)))}
                           for c in curves.values()}}

    def silicone(self, name, specimens, plates, branches):
        names = sorted(specimens)
        fitted, predicted = names[:(len(names) + 1) // 2], names[(len(names) + 1) // 2:]
        rows = [(s, f) for specimen in fitted for s, f in specimens[specimen].items() if FITTED[0] <= s <= FITTED[1]]
        strains, forces = map(np.array, zip(*rows))
        shear = {press: relative_fit(c.at(strains), forces) for press, c in plates.items()}
        residual = {press: float(np.sqrt(np.mean((shear[press] * c.at(strains) / forces - 1) ** 2))) for press, c in plates.items()}
        fits = {f"{law}, {press}": laws.fit(own, plates[press].at(strains), strains, forces) for (law, press), own in branches.items()}
        residual.update({model: found[3] for model, found in fits.items()})
        slope = plates["sliding"].slope
        linear_own = relative_fit(slope * strains, forces)
        response = Response(shear["sliding"] * slope * strains, forces)
        mean = {s: float(np.mean([f for t, f in rows if t == s])) for s in set(strains.tolist())}
        errors = []
        for specimen in predicted:
            own = specimens[specimen]
            for s in SHOWN:
                if not min(own) <= s <= max(own):
                    continue
                force = float(np.interp(s, list(own), list(own.values())))
                among = float(np.interp(s, sorted(mean), [mean[t] for t in sorted(mean)]))
                found = {"scatter": among, "sliding": shear["sliding"] * plates["sliding"].at(s), "sticking": shear["sticking"] * plates["sticking"].at(s),
                         "linear": shear["sliding"] * slope * s, "linear, own constant": linear_own * slope * s,
                         "Q": response(shear["sliding"] * slope * s)}
                for model, (modulus, row, ratio, _) in fits.items():
                    found[model] = modulus * plates[model.split(", ")[1]].at(s) * ratio(row[None, :], [s])[0, 0]
                errors.append({"specimen": specimen, "strain": s, "force_N": force, "errors": {k: float(v / force - 1) for k, v in found.items()}})
        return {"silicone": name, "fitted": fitted, "predicted": predicted, "shear_Pa": shear, "residual": residual, "errors": errors,
                "laws": {model: {"shear_Pa": found[0], "constants": laws.constants(model.split(", ")[0], found[1])} for model, found in fits.items()},
                "measured": {n: [list(specimens[n]), list(specimens[n].values())] for n in names}}

    # ---- Q on a support that it was not measured on ----

    def supports(self, cylinders, curves):
        """For each other way to press: Q of the measured curve, taken for one between sliding plates, against the large body with its constant."""
        result = {}
        for press in ("sticking", "disc"):
            curve, rows = curves[press], {s: [] for s in JUDGED if s <= curves[press].strains[-1] + 1e-9}
            for one in cylinders["silicones"]:
                shear, slope = one["shear_Pa"]["sliding"], curves["sliding"].slope
                points = [(s, f) for n in one["fitted"] for s, f in zip(*one["measured"][n]) if FITTED[0] <= s <= FITTED[1]]
                response = Response(*map(np.array, zip(*((shear * slope * s, f) for s, f in points))))
                for s, errors in rows.items():
                    errors.append((response(shear * curve.slope * s) / (shear * curve.at(s)) - 1, curve.slope * s / curve.at(s) - 1))
            result[press] = [{"strain": s, "q": float(np.median([e[0] for e in errors])), "linear": float(np.median([e[1] for e in errors]))}
                             for s, errors in rows.items()]
        one = cylinders["silicones"][0]
        points = [(s, f) for n in one["fitted"] for s, f in zip(*one["measured"][n]) if FITTED[0] <= s <= FITTED[1]]
        shear, slope = one["shear_Pa"]["sliding"], curves["sliding"].slope
        response = Response(*map(np.array, zip(*((shear * slope * s, f) for s, f in points))))
        drawn = {press: {"strains": curves[press].strains.tolist(), "large_N": (shear * curves[press].force).tolist(),
                         "q_N": [response(shear * curves[press].slope * s) for s in curves[press].strains]} for press in curves}
        return {"errors": result, "example": one["silicone"], "drawn": drawn}

    # ---- the beam ----

    def beam(self):
        tips = [r for r in self.beam_rows if r["nominal_x_mm"] > -BEAM["size"][0] * 500]
        own = [r for r in tips if r["load_N"] == 0]
        loads = sorted({r["load_N"] for r in tips if r["load_N"] > 0})
        if not own or not loads:
            raise measured.Refused(f"{self.arguments.measured}: expected markers at the beam's free half under its own weight and under a load, found none")
        mean = {key: float(np.mean([r[key] for r in own])) for key in ("nominal_x_mm", "nominal_z_mm", "moved_z_mm")}
        if mean["moved_z_mm"] >= 0:
            raise measured.Refused(f"{own[0].file}: expected markers that sag under the own weight (moved_z_mm below 0), found {mean['moved_z_mm']:g} mm")
        models = SHORT_BEAMS if self.arguments.short else BEAMS
        with concurrent.futures.ThreadPoolExecutor(self.arguments.jobs) as pool:
            runs = [pool.submit(self.solved, "beam", "--size", ",".join(map(str, BEAM["size"])), "--density", BEAM["density"], "--gravity", BEAM["gravity"],
                                "--poisson", BEAM["poisson"], "--loads", ",".join(map(str, loads)), "--sag", -mean["moved_z_mm"] / 1000, "--above",
                                mean["nominal_z_mm"] / 1000, "--beyond", mean["nominal_x_mm"] / 1000, "--cells", cells, "--element", element,
                                *(["--linear"] if linear else [])) for element, linear, cells in models]
        result = []
        for (element, linear, cells), run in zip(models, runs):
            found = run.result()
            markers = [self.marker(r, found["end"][0 if r["load_N"] == 0 else 1 + loads.index(r["load_N"])]) for r in tips]
            cases = []
            for load in [0.0, *loads]:
                ours = [m for m in markers if m["load_N"] == load]
                cases.append({"load_N": load, "measured_mm": float(np.mean([np.linalg.norm(m["measured_mm"]) for m in ours])),
                              "off_mm": float(np.mean([m["off_mm"] for m in ours])), "symmetric_mm": symmetric_rest(ours),
                              "plane_off_mm": float(np.mean([math.dist(m["measured_mm"][::2], m["predicted_mm"][::2]) for m in ours])),
                              "down_off_mm": float(np.mean([m["predicted_mm"][2] - m["measured_mm"][2] for m in ours]))})
            result.append({"element": element, "linear": linear, "cells": cells, "nodes": found["nodes"], "young_Pa": found["young_Pa"],
                           "seconds": found["seconds"], "cases": cases, "markers": markers})
        base = [r for r in self.beam_rows if r not in tips]
        return {**{k: v for k, v in BEAM.items()}, "loads_N": loads, "models": result,
                "base_moved_mm": float(max((math.dist((0, 0, 0), [r[f"moved_{a}_mm"] for a in "xyz"]) for r in base), default=0)),
                "sideways_mm": float(max(abs(r["moved_y_mm"]) for r in tips)), "rest_mm": float(max(r["sd_last_second_mm"] for r in tips))}

    def marker(self, row, end):
        """A marker moves with the end as one rigid body: it stands on a stem of its own."""
        x, z, turn = row["nominal_x_mm"], row["nominal_z_mm"], end["turn"]
        predicted = (1000 * end["along_m"] + x * (math.cos(turn) - 1) - z * math.sin(turn), 0.0,
                     -1000 * end["down_m"] + x * math.sin(turn) + z * (math.cos(turn) - 1))
        moved = [row[f"moved_{axis}_mm"] for axis in "xyz"]
        return {"case": row["case"], "repeat": row["repeat"], "load_N": row["load_N"], "marker": row["marker"],
                "place_mm": [row[f"nominal_{axis}_mm"] for axis in "xyz"], "measured_mm": moved, "predicted_mm": predicted, "off_mm": math.dist(moved, predicted)}

    # ---- Cook's membrane, by the validation study ----

    def cook(self):
        folder = os.path.join(self.folder, "cook")
        self.program("palpate-validation", "--only", "cook", "--only", "large-cook", "-o", folder, "--python", sys.executable, codes=(0, 3))
        with open(os.path.join(folder, "validation.json")) as stream:
            points = json.load(stream)["points"]
        finest = {}
        for p in points:
            if p["element"] != "p1":
                finest[p["case"], p["element"]] = {key: p[key] for key in ("case", "element", "vertices", "value", "exact", "error")}
        return list(finest.values())

    # ---- all ----

    def gates(self, result):
        def gate(name, what, found):
            return {"gate": name, "what": what, "bound": GATES[name], "found": found, "holds": found <= GATES[name]}
        if "cylinders" in result:
            c = result["cylinders"]
            medians = [c["models"][c["nearer"]]["median"][SHOWN.index(s)] for s in JUDGED]
            yield gate("cylinders", f"cylinders: the largest median error of the predicted force from {JUDGED[0]:.0%} to {JUDGED[-1]:.0%} of strain, "
                       f"{c['nearer']} platens, which fit better", max(m for m in medians if m is not None))
            medians = [m for press in ("sliding", "sticking") for s in JUDGED if (m := c["models"][f"yeoh, {press}"]["median"][SHOWN.index(s)]) is not None]
            yield gate("laws", f"cylinders with Yeoh's law: the largest median error of the predicted force from {JUDGED[0]:.0%} to {JUDGED[-1]:.0%} of strain, "
                       "platens that slide and platens that stick", max(medians))
        if "beam" in result:
            judged = result["beam"]["models"][0]
            off = {key: max(c[key] / c["measured_mm"] for c in judged["cases"][1:]) for key in ("off_mm", "symmetric_mm")}
            yield gate("beam", f"beam: the mean distance of the predicted markers over their measured way, the worst load, {judged['element']}, "
                       f"{judged['cells']} cells through the height; no symmetric model comes nearer than {off['symmetric_mm']:.1%}", off["off_mm"])
            finest = {m["element"]: m for m in sorted(result["beam"]["models"], key=lambda m: m["cells"])}
            if BENDS in finest and TRUE_OF_BEAM in finest:
                yield gate("element", f"beam: Young's modulus that its own weight gives with {BENDS}, {finest[BENDS]['nodes']} nodes, beside {TRUE_OF_BEAM}, "
                           f"{finest[TRUE_OF_BEAM]['nodes']} nodes", abs(finest[BENDS]["young_Pa"] / finest[TRUE_OF_BEAM]["young_Pa"] - 1))
        if result.get("cook"):
            yield gate("cook", "Cook's membrane, linear and finite strain, p1-anp and p2-p0: the largest error", max(c["error"] for c in result["cook"]))

    def all(self):
        begin, short, result = time.time(), self.arguments.short, {}
        if self.silicones:
            print("cylinders", file=sys.stderr, flush=True)
            curves = self.curves()
            result["cylinders"] = self.cylinders(curves)
            result["supports"] = self.supports(result["cylinders"], curves)
        if self.beam_rows:
            print("the beam", file=sys.stderr, flush=True)
            result["beam"] = self.beam()
        if not short:
            print("Cook's membrane", file=sys.stderr, flush=True)
            result["cook"] = self.cook()
        return {"short": short, "gates": list(self.gates(result)), "program_version": self.program("reality_solves", "--version").split()[-1],
                "machine": self.machine(), "seconds": time.time() - begin, **result}

    def machine(self):
        with open("/proc/cpuinfo") as stream:
            names = [line.split(":", 1)[1].strip() for line in stream if line.startswith("model name")]
        return {"processor": names[0] if names else "unknown processor", "cores": os.cpu_count(), "load": os.getloadavg()[0]}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("measured", help="the folder with the measured curves")
    parser.add_argument("--bin", required=True)
    parser.add_argument("--short", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="solutions beside one another")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    arguments.bin = os.path.abspath(arguments.bin)
    try:
        study = Study(arguments)
        result = study.all()
    except measured.Refused as refused:
        sys.exit(f"study.py: {refused}")
    file = os.path.join(study.folder, "reality.json")
    with open(file + ".part", "w") as stream:
        json.dump(result, stream, indent=1)
    os.replace(file + ".part", file)
    page = os.path.join(study.folder, "report.html")
    study.run(sys.executable, os.path.join(HERE, "report.py"), file, "-o", page)
    print(f"{page}: the report, after {result['seconds']:.0f} s", file=sys.stderr)
    failed = [g for g in result["gates"] if not g["holds"]]
    for g in failed:
        print(f"study.py: {g['what']}: {100 * g['found']:.2g} %, above {100 * g['bound']:.2g} %", file=sys.stderr)
    sys.exit(3 if failed else 0)


if __name__ == "__main__":
    main()
