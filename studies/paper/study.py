#!/usr/bin/env python3
"""study.py --bin BIN --data DATA -o FOLDER: repeats the measurements of Cotin, Delingette and Ayache 1999 with the programs that
users run. Writes FOLDER/paper.json and FOLDER/report.html (report.py). --short: tiny meshes, a few seconds."""
import argparse
import json
import os
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.join(HERE, "..", "..")
ORGAN, HELD = os.path.join(HERE, "liver.toml"), os.path.join(HERE, "held.toml")

# The paper's numbers of vertices and tetrahedra, and options that give nearly these: smoothing (mm), triangles, longest edge (mm).
MESHES = {"193": ((193, 725), (4, 250, 20)), "1400": ((1400, 6500), (1.5, 1160, 9.6)), "1735": ((1735, 8124), (1.5, 1350, 8.85))}
SHORT = {"193": (4, 150, 40), "1400": (4, 220, 36), "1735": (4, 260, 34)}
# Figure 10: two points of the plate, 12 mm apart, pushed by 5 mm. If their answers are added, the plate moves too far. In m.
PLATE_CONTACTS, PLATE_PUSH = ((0.044, 0.050, 0.010), (0.056, 0.050, 0.010)), (0, 0, -0.005)
# Figure 13: the measured rates of compression, mm/min, and the pipeline's scene for each.
CYLINDERS = (("500", "3mm/compression/scenes/%s/summary.json"), ("5", "3mm/compression-rate-5/scenes/%s/summary.json"),
             ("0.005", "3mm/compression-rate-0.005/scenes/%s/summary.json"))
CURVES = os.path.abspath(os.path.join(ROOT, "pipelines", "brain-cylinder", "curves"))
REPEATS = 5  # of a precompute; the median counts


class Study:
    def __init__(self, arguments):
        self.arguments = arguments
        self.folder = os.path.abspath(arguments.output)
        os.makedirs(self.folder, exist_ok=True)
        # One thread, because the paper's machine had one processor.
        self.environment = dict(os.environ, OMP_NUM_THREADS="1", OMPI_ALLOW_RUN_AS_ROOT="1",
                                OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", HWLOC_COMPONENTS="-gl")

    def say(self, text):
        print(text, file=sys.stderr, flush=True)

    def run(self, *command):
        """A command's standard output. If the command fails, exits with its error message."""
        done = subprocess.run([str(c) for c in command], cwd=ROOT, env=self.environment, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            sys.exit("study.py: %s ended with %d:\n%s" % (" ".join(map(str, command)), done.returncode, done.stderr[-3000:]))
        return done.stdout

    def program(self, name, *arguments):
        return self.run(os.path.join(self.arguments.bin, name), *arguments)

    def pipeline(self, *goals):
        a = self.arguments
        self.run("make", "-s", "--no-print-directory", "-f", "pipelines/built.mk", "BIN=" + a.bin, "DATA=" + a.data,
                 "PYTHON=" + sys.executable, *goals)

    def made(self, organ, target):
        """A file of the organ's pipeline. The pipeline makes it if it is missing."""
        file = os.path.join(self.arguments.data, organ, target)
        self.pipeline("ORGAN=" + organ, file)
        return file

    def measured(self, what, *arguments):
        return json.loads(self.program("paper_bench", what, *arguments))

    def image(self):
        if self.arguments.image:
            return self.arguments.image
        return self.made("liver", "liver.inr.gz")

    def mesh(self, name, image):
        """Makes a mesh with nearly the paper's numbers and its bundle with the displacement of all nodes; returns their figures."""
        smooth, triangles, size = SHORT[name] if self.arguments.short else MESHES[name][1]
        base = os.path.join(self.folder, "liver-" + name)
        surface, mesh, bundle, report = base + ".ply", base + ".msh", base + ".h5", base + ".json"
        self.program("palpate-surface", image, "-o", surface, "--labels", 255, "--smooth", smooth, "--triangles", triangles)
        self.program("palpate-tetrahedra", surface, "-o", mesh, "--region", "liver", "--size", size)
        runs = []
        for _ in range(REPEATS):
            self.program("palpate-precompute", mesh, "--organ", ORGAN, "--boundary", HELD, "-o", bundle,
                         "--json", report)
            with open(report) as stream:
                runs.append(json.load(stream))
        os.remove(report)
        run = sorted(runs, key=lambda r: r["seconds"])[REPEATS // 2]
        return {"mesh": mesh, "bundle": bundle, "paper_counts": MESHES[name][0], "vertices": run["nodes"],
                "tetrahedra": run["tetrahedra"], "columns": run["columns"], "seconds": run["seconds"],
                "peak_GB": run["peak_bytes"] / 1e9, "bundle_MB": run["bundle_bytes"] / 1e6,
                "worst_residual": run["certificate"]["worst_residual"], "solver": run["solver"]}

    def preprocessing(self, name, mesh):
        self.say("preprocessing as the paper did, %s vertices" % mesh["vertices"])
        way = self.measured("columns", mesh["mesh"], "--organ", ORGAN, "--boundary", HELD, "--seconds",
                            0.5 if self.arguments.short else 150)
        return dict(mesh, paper_way=way)

    def moves(self, mesh):
        self.say("a move as a full solve and as touch and shape")
        return self.measured("moves", mesh["mesh"], "--organ", ORGAN, "--boundary", HELD, "--bundle", mesh["bundle"], "--seconds",
                             0.2 if self.arguments.short else 8)

    def superposition(self):
        bundle = os.path.join(self.arguments.data, "plate", "5mm", "corners", "bundle.h5")
        return self.measured("superposition", bundle, *(c for p in PLATE_CONTACTS for c in ("--at", *p)), "--by", *PLATE_PUSH)

    def all(self):
        begin = time.time()
        image = self.image()
        self.say("three livers")
        livers = {name: self.mesh(name, image) for name in MESHES}
        result = {"machine": self.machine(), "short": self.arguments.short, "data": os.path.abspath(self.arguments.data),
                  "preprocessing": {name: self.preprocessing(name, livers[name]) for name in ("193", "1735")},
                  "moves": dict(livers["1400"], **self.moves(livers["1400"]))}
        self.say("the plate and the cylinder")
        result["plate_picture"] = self.made("plate", "5mm/corners/pictures/plate.png")
        result["superposition"] = self.superposition()
        result["cylinders"] = [dict(zip(("rate", "curve"), (rate, os.path.join(CURVES, "swine-brain-%s-mm-min.csv" % rate))),
                                    scenes=os.path.dirname(os.path.dirname(self.made("brain-cylinder", scene % "compress"))))
                               for rate, scene in CYLINDERS[:1 if self.arguments.short else None]]
        self.made("brain-cylinder", CYLINDERS[0][1] % "compress-linear")
        result["seconds"] = time.time() - begin
        return result

    def machine(self):
        with open("/proc/cpuinfo") as stream:
            names = [line.split(":", 1)[1].strip() for line in stream if line.startswith("model name")]
        return {"processor": names[0] if names else "unknown processor", "cores": os.cpu_count(), "load": os.getloadavg()[0],
                "version": self.program("palpate-precompute", "--version").strip()}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", required=True)
    parser.add_argument("--data", required=True)
    parser.add_argument("--image", help="a label image; default: the liver pipeline's")
    parser.add_argument("--short", action="store_true")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    arguments.bin, arguments.data = os.path.abspath(arguments.bin), os.path.abspath(arguments.data)
    study = Study(arguments)
    result = study.all()
    file = os.path.join(study.folder, "paper.json")
    with open(file + ".part", "w") as stream:
        json.dump(result, stream, indent=1)
    os.replace(file + ".part", file)
    page = os.path.join(study.folder, "report.html")
    study.run(sys.executable, os.path.join(HERE, "report.py"), file, "-o", page)
    study.say("%s: the report, after %.0f s" % (page, result["seconds"]))


if __name__ == "__main__":
    main()
