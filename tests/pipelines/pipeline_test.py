#!/usr/bin/env python3
"""Runs the pipelines' rules with the real programs on small inputs. Usage: pipeline_test.py BIN [TEST ...]"""
import csv
import glob
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
BIN = os.path.abspath(sys.argv.pop(1))
sys.path.insert(0, os.path.join(ROOT, "tests", "support"))
from ellipsoid_image import write_ellipsoid  # noqa: E402


def arguments(data, *more):
    return ["make", "-C", ROOT, "-f", "pipelines/built.mk", "BIN=" + BIN, "DATA=" + data, *more]


def make(data, *more):
    run = subprocess.run(arguments(data, *more), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if run.returncode != 0:
        raise AssertionError("make %s ended with %d:\n%s" % (" ".join(more), run.returncode, run.stdout[-3000:]))
    return run.stdout


def file_times(data):
    files = [f for f in glob.glob(data + "/**", recursive=True) if os.path.isfile(f)]
    return {f: os.stat(f).st_mtime_ns for f in files}


def read_rows(file):
    with open(file, newline="") as stream:
        return list(csv.DictReader(line for line in stream if not line.startswith("#")))


class Pipeline(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="palpate_pipeline_")
        self.data = os.path.join(self.folder.name, "data")

    def tearDown(self):
        self.folder.cleanup()

    def test_default_organ_from_image_to_pictures_and_again_nothing(self):
        image = os.path.join(self.folder.name, "ellipsoid.nrrd")
        write_ellipsoid(image)
        case = os.path.join(self.data, "liver", "1700", "right-side")
        pictures = [os.path.join(case, "pictures", name + ".png") for name in ("mesh", "push", "force")]
        small = ["IMAGE=" + image, "SURFACE_OPTIONS=--labels 255 --smooth 4 --triangles 500",
                 "TETRAHEDRA_OPTIONS=--region liver", "PICTURES=" + " ".join(pictures)]
        make(self.data, "-j2", *small)
        for picture in pictures:
            with open(picture, "rb") as png:
                self.assertEqual(png.read(8), b"\x89PNG\r\n\x1a\n")
        for scene, least in (("push", 0.05), ("push-response", 0.05), ("drag", 0.05), ("tools", 0.05), ("stroke", 0.05)):
            with open(os.path.join(case, "scenes", scene, "summary.json")) as file:
                summary = json.load(file)
            self.assertGreater(max(t["peak_force_N"] for t in summary["tools"]), least)  # the path meets the organ
            self.assertNotIn("BAD_INPUT", summary["touches_with_flag"])
        self.assertEqual(glob.glob(self.data + "/**/*.part", recursive=True), [])

        before = file_times(self.data)
        self.assertNotIn(BIN, make(self.data, "-j2", *small))  # no program is started
        self.assertEqual(file_times(self.data), before)

        # One scene's file changes: its run and its picture are redone, nothing else. (-W tells make that the file is new, so
        # that the sources stay as they are.)
        make(self.data, "-W", "pipelines/liver/scenes/push-response.toml", *small)
        changed = {os.path.relpath(f, case) for f, t in file_times(self.data).items() if before.get(f) != t}
        self.assertIn("pictures/force.png", changed)
        self.assertTrue(all("push-response" in f or f == "pictures/force.png" for f in changed), changed)

    def test_killed_run_resumes_where_it_was(self):
        target = os.path.join(self.data, "plate", "5mm", "corners", "bundle.h5")
        run = subprocess.Popen(arguments(self.data, "ORGAN=plate", target), stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL, start_new_session=True)
        deadline = time.time() + 60
        while not glob.glob(target + "*.part") and time.time() < deadline:
            time.sleep(0.001)
        os.killpg(run.pid, signal.SIGKILL)
        run.wait()
        self.assertFalse(os.path.exists(target))
        mesh = os.path.join(self.data, "plate", "5mm", "mesh.msh")
        written = os.stat(mesh).st_mtime_ns
        make(self.data, "ORGAN=plate", target)
        self.assertEqual(os.stat(mesh).st_mtime_ns, written)  # the mesh is not made again
        with open(target, "rb") as bundle:
            resumed = bundle.read()
        os.remove(target)
        make(self.data, "ORGAN=plate", target)
        with open(target, "rb") as bundle:
            self.assertEqual(bundle.read(), resumed)  # the bytes of a run that nobody killed

    def test_plate_on_two_ranks_behind_a_launcher(self):
        launcher = os.path.join(self.folder.name, "launcher")
        log = os.path.join(self.folder.name, "launched")
        with open(launcher, "w") as script:
            script.write('#!/bin/sh\necho "$@" > "%s"\nexec "$@"\n' % log)
        os.chmod(launcher, 0o755)
        make(self.data, "ORGAN=plate", "RANKS=2", "LAUNCH=" + launcher)
        with open(log) as launched:
            self.assertIn("-n 2", launched.read())
        corners = os.path.join(self.data, "plate", "5mm", "corners")
        self.assertTrue(os.path.exists(os.path.join(corners, "pictures", "plate.png")))
        last = read_rows(os.path.join(corners, "scenes", "one-contact", "forces.csv"))[-1]
        self.assertEqual(int(last["contacts"]), 1)
        self.assertGreater(float(last["force_z_N"]), 0.05)  # the plate pushes back up

    def test_ranks_are_those_that_the_plan_finds_useful_unless_they_are_given(self):
        target = os.path.join(self.data, "plate", "5mm", "corners", "bundle.h5")
        self.assertIn("PETSc CG on 1 rank, preconditioner", make(self.data, "ORGAN=plate", target))  # less than a second
        # The same programs, except that the plan of this palpate-precompute says that two ranks are useful.
        programs = os.path.join(self.folder.name, "bin")
        os.mkdir(programs)
        for name in os.listdir(BIN):
            os.symlink(os.path.join(BIN, name), os.path.join(programs, name))
        program = os.path.join(programs, "palpate-precompute")
        os.remove(program)
        with open(program, "w") as script:
            script.write('#!/bin/sh\ncase "$*" in *--plan*) echo \'{ "useful_ranks": 2 }\';; *) exec "%s" "$@";; esac\n'
                         % os.path.join(BIN, "palpate-precompute"))
        os.chmod(program, 0o755)
        for ranks, said in (([], "PETSc CG on 2 ranks,"), (["RANKS=1"], "PETSc CG on 1 rank,")):
            os.remove(target)
            self.assertIn(said, make(self.data, "BIN=" + programs, "ORGAN=plate", *ranks, target))

    def test_any_launcher_gives_the_same_bytes_or_its_own_error(self):
        target = os.path.join(self.data, "plate", "5mm", "corners", "bundle.h5")
        bundles = []
        for launcher, said in (("", "touchable"), ("nice -n 5", "touchable"),
                               ("mpiexec --bind-to none --oversubscribe -n 2", "each of 2 ranks")):
            self.assertIn(said, make(self.data, "ORGAN=plate", "LAUNCH=" + launcher, target))
            with open(target, "rb") as bundle:
                bundles.append(bundle.read())
            os.remove(target)
        self.assertEqual(bundles, bundles[:1] * 3)
        missing = subprocess.run(arguments(self.data, "ORGAN=plate", "LAUNCH=no-such-launcher -n 2", target),
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.assertEqual(missing.returncode, 2)
        self.assertIn("no-such-launcher: command not found", missing.stdout)
        self.assertFalse(os.path.exists(target))

    def test_tumour_is_felt_where_it_is(self):
        image = os.path.join(self.folder.name, "ellipsoid.nrrd")
        write_ellipsoid(image)
        said = make(self.data, "-j2", "ORGAN=liver-tumour", "MATERIALS=organ healthy calcified",
                    "IMAGE=" + image,
                    "SURFACE_OPTIONS=--labels 255 --smooth 4 --triangles 500", "TUMOURS=115,50,118,12 145,50,118,12")
        work = os.path.join(self.data, "liver-tumour", "1700")
        self.assertIn("times that of", said)
        with open(os.path.join(work, "right-side", "pictures", "palpate.png"), "rb") as png:
            self.assertEqual(png.read(8), b"\x89PNG\r\n\x1a\n")
        force = {}
        for case in ("right-side", "right-side-healthy", "right-side-calcified"):
            self.assertTrue(os.path.exists(os.path.join(work, case, "verified.json")))
            for row in read_rows(os.path.join(work, case, "scenes", "palpate", "forces.csv")):
                if float(row["y_m"]) == 0.034:  # the end of a press
                    force[case, round(1e3 * float(row["x_m"]))] = -float(row["force_y_N"])
        for place in (115, 130, 145):
            healthy, stiff, rigid = (force["right-side" + m, place] for m in ("-healthy", "", "-calcified"))
            self.assertGreater(stiff, 1.05 * healthy)
            # The calcified inclusion is a million times as stiff as the liver and hardly differs from the one of six times: an
            # inclusion is nearly rigid already at ten times.
            self.assertTrue(stiff < rigid < 1.5 * stiff, (stiff, rigid))

    def test_brain_cylinder_lies_on_the_measured_curves(self):
        said = make(self.data, "-j2", "ORGAN=brain-cylinder")  # cylinder.py holds its bounds, or make fails
        self.assertIn("0.005 mm/min: force within", said)
        self.assertIn("0.005 mm/min, relaxing: force within", said)
        work = os.path.join(self.data, "brain-cylinder", "3mm")
        curve = read_rows(os.path.join(ROOT, "pipelines", "brain-cylinder", "curves", "swine-brain-500-mm-min.csv"))
        played = read_rows(os.path.join(work, "compression", "scenes", "compress", "forces.csv"))
        for at in curve[::13]:  # 0.65 mm apart: 5 % of the height
            row = min(played, key=lambda r: abs(13 - 1e3 * float(r["z_m"]) - float(at["displacement_mm"])))
            # The bound is 0.1 % of the largest force, as in cylinder.py. No force acts sideways.
            self.assertAlmostEqual(float(row["force_z_N"]), float(at["force_N"]), delta=0.001 * 2.7358)
            self.assertAlmostEqual(float(row["force_x_N"]), 0, delta=1e-9)
        # The check of cylinder.py can fail: it refuses the curve of another rate with exit code 3 and draws no picture.
        picture = os.path.join(self.folder.name, "wrong.png")
        curves = [os.path.join(ROOT, "pipelines", "brain-cylinder", "curves", "swine-brain-%s-mm-min.csv" % rate)
                  for rate in ("500", "5")]
        relaxing = os.path.join(work, "compression-at-once", "scenes", "relax-500")
        for wrong in (["--case", "500", os.path.join(work, "compression"), curves[1]],
                      ["--case", "500", os.path.join(work, "compression"), curves[0], "--relaxing", "500", relaxing, curves[1]]):
            refused = subprocess.run(
                ["/usr/bin/python3", os.path.join(ROOT, "pipelines", "pictures", "cylinder.py"), "-o", picture, *wrong],
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            self.assertEqual(refused.returncode, 3)
            self.assertIn("expected force", refused.stderr)
            self.assertFalse(os.path.exists(picture))

    def test_unknown_choices_are_refused_with_those_there_are(self):
        for choice, answer in (("ORGAN=spleen", "brain-cylinder liver liver-tumour plate"), ("BC=none", "right-side"),
                               ("RESOLUTION=7", "200 600 1700 5000 10000 20000")):
            run = subprocess.run(arguments(self.data, choice), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            self.assertEqual(run.returncode, 2)
            self.assertIn(answer, run.stdout)


class Curves(unittest.TestCase):
    FOLDER = os.path.join(ROOT, "pipelines", "brain-cylinder", "curves")

    def test_curves_are_what_their_script_writes(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["/usr/bin/python3", os.path.join(self.FOLDER, "make_curves.py"), folder], check=True)
            files = sorted(os.listdir(folder))
            self.assertEqual(len(files), 4)
            for file in files:
                with open(os.path.join(folder, file)) as new, open(os.path.join(self.FOLDER, file)) as kept:
                    self.assertEqual(new.read(), kept.read())

    def test_curves_have_the_stresses_of_the_published_constants(self):
        # Nominal stress, Pa, at 5, 10 .. 30 % (computed from the same constants by another program, to 1 Pa).
        table = {"500": (170, 394, 735, 1294, 2242, 3870), "5": (98, 219, 402, 703, 1213, 2089),
                 "0.005": (33, 78, 148, 264, 460, 798)}
        for rate, stresses in table.items():
            rows = read_rows(os.path.join(self.FOLDER, "swine-brain-%s-mm-min.csv" % rate))
            for stress, row in zip(stresses, rows[13::13]):
                area = np.pi * 0.015**2
                self.assertAlmostEqual(float(row["force_N"]) / area, stress, delta=0.5 + 0.001 * stress)


if __name__ == "__main__":
    unittest.main()
