#!/usr/bin/env python3
"""Runs the pipelines' rules with the real programs on small inputs. Usage: pipeline_test.py BIN [TEST ...]"""
import csv
import glob
import gzip
import hashlib
import html
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import unittest

import h5py
import numpy as np
from matplotlib import image

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
BIN = os.path.abspath(sys.argv.pop(1))
sys.path.insert(0, os.path.join(ROOT, "tests", "support"))
import three_organs_image  # noqa: E402
from ellipsoid_image import write_ellipsoid  # noqa: E402
from labelled_image import write_nifti  # noqa: E402


def arguments(data, *more):
    return ["make", "-C", ROOT, "-f", "pipelines/built.mk", "BIN=" + BIN, "DATA=" + data, *more]


def make(data, *more, code=0):
    """What make says; it must end with that code."""
    run = subprocess.run(arguments(data, *more), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if run.returncode != code:
        raise AssertionError("make %s ended with %d:\n%s" % (" ".join(more), run.returncode, run.stdout[-3000:]))
    return run.stdout


def file_times(data):
    files = [f for f in glob.glob(data + "/**", recursive=True) if os.path.isfile(f)]
    return {f: os.stat(f).st_mtime_ns for f in files}


def read_rows(file):
    with open(file, newline="") as stream:
        return list(csv.DictReader(line for line in stream if not line.startswith("#")))


def read_bytes(*path):
    with open(os.path.join(*path), "rb") as file:
        return file.read()


def read_json(*path):
    return json.loads(read_bytes(*path))


def summary_of(scene):
    return read_json(scene, "summary.json")


def shown_warnings(picture):
    """The PNG's text "Warnings": what its title says in red."""
    png = read_bytes(picture)
    at = png.find(b"tEXtWarnings\0")
    return png[at + 13:at + 4 + int.from_bytes(png[at - 4:at], "big")].decode() if at >= 0 else ""


def picture_colours():
    """The colours of regions in pipelines/pictures/mesh.py, which cannot be imported without starting a display."""
    text = read_bytes(ROOT, "pipelines", "pictures", "mesh.py").decode()
    tissue = re.search(r"^TISSUE, .* = (\(.*?\)),", text, re.M)[1]
    return eval(re.search(r"^OUTSIDE = (\(.*?\)\))$", text, re.M | re.S)[1], {"TISSUE": eval(tissue)})


class InFolder(unittest.TestCase):
    """Each test has a folder of its own, with one for data and one for organs."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="palpate_pipeline_")
        self.addCleanup(self.folder.cleanup)
        self.data, self.organs = os.path.join(self.folder.name, "data"), os.path.join(self.folder.name, "organs")
        os.mkdir(self.organs)

    def make(self, *more, code=0):
        return make(self.data, "ORGANS_DIR=" + self.organs, *more, code=code)

    def expect_picture(self, *path):
        self.assertEqual(read_bytes(*path)[:8], b"\x89PNG\r\n\x1a\n")


class Pipeline(InFolder):
    def test_default_organ_from_image_to_pictures_and_again_nothing(self):
        image = os.path.join(self.folder.name, "ellipsoid.nrrd")
        write_ellipsoid(image)
        case = os.path.join(self.data, "liver", "1700", "abdomen")
        pictures = [os.path.join(case, "pictures", name + ".png") for name in ("mesh", "push", "force")]
        small = ["IMAGE=" + image, "SURFACE_OPTIONS=--labels 255 --smooth 4 --triangles 500",
                 "TETRAHEDRA_OPTIONS=--region liver", "PICTURES=" + " ".join(pictures)]
        make(self.data, "-j2", *small)
        for picture in pictures:
            self.expect_picture(picture)
        text = read_bytes(case, "index.html").decode()
        for shown in ["pictures/mesh.png", "pictures/push.png", "pictures/force.png", "min dihedral degrees value", "certificate",
                      "Young&#x27;s modulus 5.4 kPa", '<td class="assumed">Poisson&#x27;s ratio 0.49', "abdomen the force is 9 % off", "1,696 vertices",
                      "<figcaption>Scene &quot;push&quot; at its largest force", "files in m and N. Axes: LPS", 'tool &quot;finger&quot; never touched', "solved again"]:
            self.assertIn(shown, text)
        for scene, least in (("push", 0.05), ("push-response", 0.05), ("drag", 0.05), ("tools", 0.05), ("stroke", 0.05)):
            summary = summary_of(os.path.join(case, "scenes", scene))
            # The liver reaches where the finger of `tools` presses; the ellipsoid of this test does not.
            self.assertEqual([w for w in summary["warnings"] if 'tool "finger" never touched' not in w], [])
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
        self.assertLessEqual({"pictures/force.png", "index.html"}, changed)
        self.assertTrue(all("push-response" in f or f in ("pictures/force.png", "index.html") for f in changed), changed)

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
        resumed = read_bytes(target)
        os.remove(target)
        make(self.data, "ORGAN=plate", target)
        self.assertEqual(read_bytes(target), resumed)  # the bytes of a run that nobody killed

    def test_plate_on_two_ranks_behind_a_launcher(self):
        launcher = os.path.join(self.folder.name, "launcher")
        log = os.path.join(self.folder.name, "launched")
        with open(launcher, "w") as script:
            script.write('#!/bin/sh\necho "$@" > "%s"\nexec "$@"\n' % log)
        os.chmod(launcher, 0o755)
        make(self.data, "ORGAN=plate", "RANKS=2", "LAUNCH=" + launcher)
        self.assertIn(b"-n 2", read_bytes(log))
        corners = os.path.join(self.data, "plate", "5mm", "corners")
        self.assertTrue(os.path.exists(os.path.join(corners, "pictures", "plate.png")))
        for scene in ("one-contact", "several-contacts"):
            self.assertEqual(summary_of(os.path.join(corners, "scenes", scene))["warnings"], [])
        last = read_rows(os.path.join(corners, "scenes", "one-contact", "forces.csv"))[-1]
        self.assertEqual(int(last["contacts"]), 1)
        self.assertGreater(float(last["force_z_N"]), 0.05)  # the plate pushes back up

    def test_pictures_are_drawn_of_scenes_without_contact_and_show_their_warnings(self):
        case = os.path.join(self.data, "plate", "5mm", "corners")
        make(self.data, "ORGAN=plate", os.path.join(case, "bundle.h5"))
        os.mkdir(os.path.join(case, "scenes"))
        scene = os.path.join(case, "scenes", "miss")
        with open(scene + ".toml", "w") as file:
            file.write('name = "miss"\nunit = "mm"\n[[tool]]\nname = "probe"\npoints = [[0, 0, 0]]\n'
                       'path = [[0, 50, 50, 40], [0.2, 50, 50, 35]]\n')
        run = [os.path.join(BIN, "palpate-run"), scene + ".toml", "--bundle", os.path.join(case, "bundle.h5"), "-o", scene]
        self.assertEqual(subprocess.run(run + ["--strict"], stderr=subprocess.DEVNULL).returncode, 3)
        (sentence,) = summary_of(scene)["warnings"]
        self.assertRegex(sentence, 'tool "probe" never touched .* 25 mm ')
        for script, words in (("touched", [scene]), ("plate", [scene]), ("force", [scene, scene]),
                              ("palpation", [case, case, "--region", "plate", "--scene", "miss"])):
            picture = os.path.join(self.folder.name, script + ".png")
            subprocess.run(["/usr/bin/python3", os.path.join(ROOT, "pipelines", "pictures", script + ".py"), *words, "-o", picture],
                           check=True, stdout=subprocess.DEVNULL)
            self.assertIn(sentence, shown_warnings(picture), script)

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
            bundles.append(read_bytes(target))
            os.remove(target)
        self.assertEqual(bundles, bundles[:1] * 3)
        self.assertIn("no-such-launcher: command not found",
                      make(self.data, "ORGAN=plate", "LAUNCH=no-such-launcher -n 2", target, code=2))
        self.assertFalse(os.path.exists(target))

    def test_tumour_is_felt_where_it_is(self):
        image = os.path.join(self.folder.name, "ellipsoid.nrrd")
        write_ellipsoid(image)
        said = make(self.data, "-j2", "ORGAN=liver-tumour", "MATERIALS=organ healthy calcified",
                    "IMAGE=" + image,
                    "SURFACE_OPTIONS=--labels 255 --smooth 4 --triangles 500", "TUMOURS=115,50,118,12 145,50,118,12")
        work = os.path.join(self.data, "liver-tumour", "1700")
        self.assertIn("times that of", said)
        self.expect_picture(work, "right-side", "pictures", "palpate.png")
        force = {}
        for case in ("right-side", "right-side-healthy", "right-side-calcified"):
            # On this coarse mesh points of the finger may lie in one triangle, which they ask for different displacements, and the discs of
            # the press nearest to the held side reach it.
            warned = summary_of(os.path.join(work, case, "scenes", "palpate"))["warnings"]
            self.assertEqual([w for w in warned if "raised REGULARISED" not in w and "raised NOT_TOUCHABLE" not in w], [])
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
        for played in glob.glob(os.path.join(work, "*", "scenes", "*", "")):
            self.assertEqual(summary_of(played)["warnings"], [], played)
        curve = read_rows(os.path.join(ROOT, "pipelines", "brain-cylinder", "curves", "swine-brain-500-mm-min.csv"))
        played = read_rows(os.path.join(work, "compression", "scenes", "compress", "forces.csv"))
        for at in curve[::11]:  # 0.55 mm apart, up to 3.85 mm
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
        for choice, answer in (("ORGAN=spleen", "brain-cylinder liver liver-tumour plate"), ("BC=none", "abdomen biopsy-breathing biopsy breathing cut diaphragm right-side"),
                               ("RESOLUTION=7", "200 600 1700 5000 10000 20000")):
            self.assertIn(answer, make(self.data, choice, code=2))


class MadeBy(InFolder):
    """What a result was made by belongs to it: another variable, or another file that a file names, makes it anew."""

    def setUp(self):
        super().setUp()
        self.elsewhere = os.path.join(self.folder.name, "else where: 1; #2 100%")
        os.mkdir(self.elsewhere)

    def own_plate(self, boundary="", scene=""):
        """An organ of the folder's own, with one scene `still`."""
        folder = os.path.join(self.organs, "own")
        os.makedirs(os.path.join(folder, "boundary"))
        os.makedirs(os.path.join(folder, "scenes"))
        plate = os.path.join(ROOT, "pipelines", "plate")
        for name in ("organ.toml", "boundary/corners.toml"):
            shutil.copy(os.path.join(plate, name), os.path.join(folder, name))
        self.append(os.path.join(folder, "boundary", "corners.toml"), boundary)
        self.write(os.path.join(folder, "scenes", "still.toml"), 'name = "still"\nunit = "mm"\n[[tool]]\nname = "probe"\n'
                   "points = [[0, 0, 0]]\n" + (scene or "path = [[0, 50, 50, 12], [0.1, 50, 50, 9]]\n"))
        self.write(os.path.join(folder, "organ.mk"),
                   read_bytes(plate, "organ.mk").decode().replace("SCENES ?=", "SCENES ?= still #"))
        return os.path.join(self.data, "own", "5mm", "corners")

    @staticmethod
    def write(file, text):
        with open(file, "w") as stream:
            stream.write(text)

    @staticmethod
    def append(file, text):
        with open(file, "a") as stream:
            stream.write(text)

    def changed(self, *more):
        """The files that make makes anew, without the folder."""
        before = file_times(self.data)
        said = self.make(*more)
        return said, {os.path.relpath(f, self.data) for f, t in file_times(self.data).items() if before.get(f) != t}

    def test_a_bundle_of_other_options_is_made_anew_and_make_says_why(self):
        bundle = os.path.join("plate", "5mm", "corners", "bundle.h5")
        target = os.path.join(self.data, bundle)
        make(self.data, "ORGAN=plate", target)
        small = os.path.getsize(target)
        said, changed = self.changed("ORGAN=plate", target, "PRECOMPUTE_OPTIONS=--store f64")
        self.assertIn(bundle, changed)
        self.assertGreater(os.path.getsize(target), 1.5 * small)
        self.assertIn("was made with PRECOMPUTE_OPTIONS =\n", said)
        self.assertIn("it is made anew with PRECOMPUTE_OPTIONS = --store f64\n", said)
        self.assertEqual(self.changed("ORGAN=plate", target, "PRECOMPUTE_OPTIONS=--store f64")[1], set())
        self.assertIn(bundle, self.changed("ORGAN=plate", target)[1])
        self.assertEqual(os.path.getsize(target), small)

    def test_what_a_scene_of_large_deformation_needs_stands_in_the_organs_folder(self):
        case = self.own_plate()
        option = "PRECOMPUTE_OPTIONS=--large-deformation"
        self.assertIn("%s/own/organ.mk keeps it: PRECOMPUTE_OPTIONS ?= --large-deformation\n" % self.organs,
                      self.make("ORGAN=own", "PICTURES=", option))
        self.assertNotIn("holds for this call", self.make("ORGAN=own", "PICTURES="))
        self.append(os.path.join(self.organs, "own", "boundary", "corners.toml"), "[store]\nlarge_deformation = true\n")
        self.append(os.path.join(self.organs, "own", "scenes", "still.toml"), '[effects]\ndeformation = "large"\n')
        self.make("ORGAN=own", "PICTURES=")
        self.assertGreater(summary_of(os.path.join(case, "scenes", "still"))["tools"][0]["peak_force_N"], 0)

    def test_a_file_that_a_file_names_belongs_to_what_is_made_from_it_wherever_it_lies(self):
        motion, path = os.path.join(self.elsewhere, "motion.csv"), os.path.join(self.elsewhere, "path.csv")
        corners = [0, 4, 8, 92, 96, 100]  # mm: the plate is held there
        self.write(motion, "x,y,z,ux,uy,uz\n" + "".join("%g,%g,%g,0,0,1\n" % (x, y, z) for x in corners for y in corners for z in (0, 5, 10)))
        self.write(path, "0,50,50,12\n0.1,50,50,9\n")
        case = self.own_plate('\n[[motion]]\nname = "m"\nkind = "field"\nfile = "%s"\n' % motion,
                              'path_csv = "%s"\n[effects]\ncollision = "deformed"\n' % path)
        bundle, summary = os.path.join(case, "bundle.h5"), os.path.join(case, "scenes", "still", "summary.json")
        self.make("ORGAN=own", "PICTURES=")
        self.assertEqual(self.changed("ORGAN=own", "PICTURES=")[1], set())
        later = time.time() + 2  # of a file system that counts whole seconds
        os.utime(path, (later, later))
        changed = self.changed("ORGAN=own", "PICTURES=", summary)[1]
        self.assertIn(os.path.relpath(summary, self.data), changed)
        self.assertNotIn(os.path.relpath(bundle, self.data), changed)
        os.utime(motion, (later, later))
        self.assertIn(os.path.relpath(bundle, self.data), self.changed("ORGAN=own", bundle)[1])
        # One that is no longer there makes no rule without an end: the program says what it misses.
        os.remove(path)
        self.assertIn("path.csv: ", self.make("ORGAN=own", "PICTURES=", code=2))

    def test_data_beside_a_header_belong_to_the_surface(self):
        header, raw = os.path.join(self.elsewhere, "scan.mhd"), os.path.join(self.elsewhere, "scan.raw")
        voxels = np.zeros((30, 30, 30), np.uint8)
        voxels[5:25, 5:25, 5:25] = 1
        voxels.tofile(raw)
        self.write(header, "ObjectType = Image\nNDims = 3\nDimSize = 30 30 30\nElementSpacing = 2 2 2\nElementType = MET_UCHAR\n"
                           "ElementByteOrderMSB = False\nElementDataFile = scan.raw\n")
        surface = os.path.join(self.data, "liver", "600", "surface.ply")
        small = ["RESOLUTION=600", "IMAGE=" + header, "SURFACE_OPTIONS=--labels 1 --triangles 300", surface]
        self.make(*small)
        self.assertEqual(self.changed(*small)[1], set())
        later = time.time() + 2
        os.utime(raw, (later, later))
        self.assertIn("liver/600/surface.ply", self.changed(*small)[1])

    def test_balls_of_other_places_are_made_anew_and_an_environment_names_no_image(self):
        balls = os.path.join(self.data, "liver-tumour", "1700", "tumours.off")
        organ = ["ORGAN=liver-tumour", balls]
        self.make(*organ)
        self.assertEqual(self.changed(*organ)[1], set())
        self.assertIn("liver-tumour/1700/tumours.off", self.changed(*organ, "TUMOURS=115,50,118,12")[1])
        shown = subprocess.run(arguments(self.data, "-pn", "show-resolutions"), stdout=subprocess.PIPE, text=True,
                               env={**os.environ, "IMAGE": "/nowhere.nii"})
        self.assertNotIn("IMAGE = /nowhere.nii", shown.stdout)


class NewOrgan(InFolder):
    """make new-organ on a small image of three organs, and what it writes through all rules."""

    def setUp(self):
        super().setUp()
        self.scans = os.path.join(self.folder.name, "my scans: (2); #1, 100%")  # what make or a shell would read itself
        os.mkdir(self.scans)
        self.image = os.path.join(self.scans, "case of A's.nii.gz")
        three_organs_image.write(self.image)

    def refused(self, *more):
        return self.make("new-organ", *more, code=2)

    def text(self, *names):
        return read_bytes(self.organs, *names).decode()

    def expect_touched(self, organ, size):
        """The organ's rules, with nothing changed in its folder."""
        self.make("ORGAN=" + organ, "RESOLUTION=" + size)
        case = os.path.join(self.data, organ, size, "held")
        summary = summary_of(os.path.join(case, "scenes", "press"))
        self.assertGreater(summary["tools"][0]["peak_force_N"], 0.05)
        self.assertEqual(summary["warnings"], [])
        for picture in ("mesh", "boundary", "press"):
            self.expect_picture(case, "pictures", picture + ".png")
        self.assertTrue(read_json(case, "verified.json")["held"])
        rows = read_rows(os.path.join(case, "scenes", "press", "forces.csv"))
        last = max(rows, key=lambda row: -float(row["force_y_N"]))
        self.assertLess(float(last["force_y_N"]), -0.05)  # the organ pushes the finger to the front
        return case

    def expect_warnings(self, case, said, beginnings):
        listed = re.findall('<li class="warning">(.*?)</li>', read_bytes(case, "index.html").decode())
        printed = re.search(r"of all steps:\n((?:  .*\n)*)", said)[1].splitlines()
        for lines in (listed, [html.escape(line[2:]) for line in printed]):
            self.assertEqual([line[:len(begin)] for line, begin in zip(lines, beginnings)], beginnings)
            self.assertEqual(len(lines), len(beginnings), lines)

    def test_image_with_blanks_in_its_path_then_its_surface_then_its_mesh(self):
        said = self.make("new-organ", "NAME=spleen", "IMAGE=" + self.image, "LABEL=spleen")
        self.assertIn("next: make -f Makefile.data ORGAN=spleen", said)
        self.assertIn("has 2 pieces; the largest is kept", said)
        self.assertEqual(sorted(os.listdir(os.path.join(self.organs, "spleen"))),
                         ["boundary", "new-organ.json", "organ.mk", "organ.toml", "scenes"])
        makefile = self.text("spleen", "organ.mk")
        self.assertNotIn("\n\t", makefile)  # rules live in rules.mk
        self.assertIn("--labels 1 --smooth 6 --components largest", makefile)  # twice the voxel of 3 mm
        case = self.expect_touched("spleen", "coarse")
        # What new-organ and the steps warn of is on the page and at the end of make, whether make has to do anything or not.
        told = ["new-organ: the organ has 2 pieces; ", "surface: dropped 1 of 2 pieces"]
        self.expect_warnings(case, self.make("ORGAN=spleen", "RESOLUTION=coarse"), told)
        render = ["ORGAN=spleen", "RESOLUTION=coarse", "RENDER_OPTIONS=--labels 1 --components largest --triangles 200"]
        self.make(*render, os.path.join(self.data, "spleen", "render.ply"))
        self.expect_warnings(case, self.make(*render), told + ["render: dropped 1 of 2 pieces"])
        # The user has looked at what new-organ warned of.
        with open(os.path.join(self.organs, "spleen", "new-organ.json"), "w") as stream:
            json.dump({"warnings": []}, stream)
        self.expect_warnings(case, self.make("ORGAN=spleen", "RESOLUTION=coarse"), told[1:])
        self.assertIn("Error 3", self.make("ORGAN=spleen", "RESOLUTION=coarse", "STRICT=1", code=2))
        work = os.path.dirname(os.path.dirname(case))

        surface, mesh = os.path.join(self.scans, "the spleen.off"), os.path.join(self.scans, "spleen's mesh.msh")
        subprocess.run([os.path.join(BIN, "palpate-surface"), os.path.join(work, "coarse", "surface.ply"), "-o", surface],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.make("new-organ", "NAME=from-surface", "SURFACE=" + surface, "UNIT=mm")
        self.expect_touched("from-surface", "coarse")
        os.rename(os.path.join(work, "coarse", "mesh.msh"), mesh)
        self.make("new-organ", "NAME=from-mesh", "MESH=" + mesh, "FRAME=none")
        self.assertIn("near = [", self.text("from-mesh", "scenes", "press.toml"))
        self.assertIn('name = "spleen"', self.text("from-mesh", "organ.toml"))  # the mesh's own region
        self.expect_touched("from-mesh", "given")

    def test_a_folder_of_images_becomes_a_folder_of_bundles(self):
        organs = os.path.join(self.folder.name, "organs")
        images = [os.path.join(self.folder.name, name) for name in ("case_1.nrrd", "case 2.b.nrrd")]
        for image in images:
            write_ellipsoid(image)
        environment = dict(os.environ, BIN=BIN, DATA=self.data, ORGANS_DIR=organs, RESOLUTION="coarse", LAUNCH="", RANKS="1", SLURM_SUBMIT_DIR=ROOT)
        cases = os.path.join(self.folder.name, "cases")
        script = [os.path.join(ROOT, "pipelines", "slurm", "organs_of_images.sh"), "255"]
        for _ in range(2):  # the second time with folders that are there
            with open(cases, "w") as file:
                subprocess.run([*script, *images], cwd=ROOT, env=environment, check=True, stdout=file)
            with open(cases) as file:
                self.assertEqual(file.read(), "".join("%s held coarse ORGANS_DIR=%s\n" % (name, organs) for name in ("case_1", "case-2-b")))
        for task in "1", "2":
            subprocess.run(["bash", os.path.join(ROOT, "pipelines", "slurm", "organ.sbatch"), cases], check=True, capture_output=True,
                           env=dict(environment, SLURM_ARRAY_TASK_ID=task, MAKEFLAGS=""))
        for name in "case_1", "case-2-b":
            case = os.path.join(self.data, name, "coarse", "held")
            self.assertTrue(read_json(case, "verified.json")["held"])
            self.assertGreater(summary_of(os.path.join(case, "scenes", "press"))["tools"][0]["peak_force_N"], 0.05)
        other = os.path.join(self.folder.name, "other", "case_1.nrrd")
        os.mkdir(os.path.dirname(other))
        write_ellipsoid(other)
        refused = subprocess.run([*script, other], cwd=ROOT, env=environment, capture_output=True, text=True)
        self.assertEqual((refused.returncode, refused.stdout), (2, ""))
        self.assertIn("another image", refused.stderr)

    def test_a_folder_of_images_is_made_and_played_by_two_commands(self):
        images = os.path.join(self.folder.name, "images")
        os.mkdir(images)
        for name in "case_1.nrrd", "case 2.b.nrrd":
            write_ellipsoid(os.path.join(images, name))
        with open(os.path.join(images, "notes.txt"), "w") as stream:
            stream.write("no image\n")
        self.assertIn("expected LABEL=", self.make("new-organ", "IMAGES=" + images, code=2))
        self.assertIn("found none", self.make("new-organ", "IMAGES=" + self.data, "LABEL=255", code=2))
        said = self.make("new-organ", "IMAGES=" + images, "LABEL=255", "RESOLUTION=coarse")
        self.assertIn("wrote 2 organs", said)
        cases = os.path.join(self.data, "cases")
        with open(cases) as stream:
            lines = stream.read()
        with open(cases, "w") as stream:
            stream.write("nothing held coarse\n" + lines)
        self.assertIn("organs: failed: nothing\n", self.make("organs", "PICTURES=", code=2))
        for name in "case_1", "case-2-b":
            self.assertTrue(read_json(self.data, name, "coarse", "held", "verified.json")["held"])

    def test_a_surface_with_a_hole_is_wrapped_on_request(self):
        surface = os.path.join(self.scans, "open.v1.off")
        image = os.path.join(self.folder.name, "ellipsoid.nrrd")
        write_ellipsoid(image)
        subprocess.run([os.path.join(BIN, "palpate-surface"), image, "--triangles", "600", "-o", surface], check=True, capture_output=True)
        with open(surface) as stream:
            lines = stream.read().splitlines()
        counts = next(i for i, line in enumerate(lines) if re.fullmatch(r"\d+ \d+ \d+", line.strip()))
        vertices, faces, edges = lines[counts].split()
        lines[counts] = "%s %d %s" % (vertices, int(faces) - 1, edges)
        with open(surface, "w") as stream:
            stream.write("\n".join(lines[:-1]) + "\n")
        self.assertIn("closed surface", self.refused("NAME=torn", "SURFACE=" + surface, "UNIT=mm", "FRAME=LPS"))
        self.make("new-organ", "NAME=torn", "SURFACE=" + surface, "UNIT=mm", "FRAME=LPS", "WRAP=yes")
        self.assertIn("open.v1-wrapped.ply", self.text("torn", "organ.mk"))
        self.expect_touched("torn", "coarse")

    def test_a_misspelled_organ_is_refused_with_the_nearest_one(self):
        self.assertIn("did you mean plate?", self.make("ORGAN=plat", code=2))
        self.assertIn("did you mean corners?", self.make("ORGAN=plate", "BC=corner", code=2))

    def test_choices_follow_the_organ(self):
        # The kidney is half as wide as the spleen: finer meshes, shallower presses.
        for label in ("1", "kidney", "40"):
            self.make("new-organ", "NAME=o-" + label, "IMAGE=" + self.image, "LABEL=" + label)

        def option(organ, name):
            return float(re.search(name + r" ([0-9.]+)", self.text(organ, "organ.mk").split("SURFACE_OPTIONS_medium")[1])[1])

        self.assertLess(option("o-kidney", "--edge-mm"), 0.8 * option("o-1", "--edge-mm"))
        # The rod of 15 mm: its thickness, not its voxels, limits the smoothing.
        self.assertLess(option("o-40", "--smooth"), option("o-1", "--smooth"))
        self.assertIn("A third of the thickness of ", self.text("o-40", "organ.mk"))
        deepest = {o: float(re.search(r"\[1, ([0-9.]+)\]", self.text(o, "scenes", "press.toml"))[1]) for o in ("o-1", "o-kidney")}
        self.assertAlmostEqual(deepest["o-1"], 4.4, delta=0.3)  # 8 % of 55 mm, in voxels of 3 mm
        self.assertAlmostEqual(deepest["o-kidney"], 2.9, delta=0.3)  # of 36 mm

    def test_refusals_say_what_is_expected_and_leave_nothing(self):
        self.assertIn("1 spleen (155.6 cm3), 2 kidney (", self.refused("NAME=a", "IMAGE=" + self.image))
        self.assertIn("found LABEL=9; ", self.refused("NAME=a", "IMAGE=" + self.image, "LABEL=9"))
        self.assertIn("nearest are 1 spleen (155.6 cm3)\n", self.refused("NAME=a", "IMAGE=" + self.image, "LABEL=Spleen"))
        many = os.path.join(self.scans, "many.nii.gz")
        write_nifti(many, np.repeat(np.arange(125, dtype=np.uint8), 8).reshape(10, 10, 10))
        said = self.refused("NAME=a", "IMAGE=" + many, "LABEL=Spleen")
        self.assertIn(" and 116 more, ", said)
        self.assertLess(max(map(len, said.split("\n"))), 500)
        self.assertIn("--name is required", self.refused("IMAGE=" + self.image, "LABEL=1"))
        self.assertIn("(IMAGE=)", self.refused("NAME=a"))
        for name in ("two words", "../a", "-a", "_a", "Milz\u00e4"):
            self.assertIn("NAME: expected letters", self.refused("NAME=" + name, "IMAGE=" + self.image, "LABEL=1"))
        self.assertEqual(os.listdir(self.organs), [])
        self.make("new-organ", "NAME=a", "IMAGE=" + self.image, "LABEL=1")
        before = file_times(self.organs)
        self.assertIn("expected no such folder yet", self.refused("NAME=a", "IMAGE=" + self.image, "LABEL=2"))
        self.assertEqual(file_times(self.organs), before)


    def boxes(self, *cubes):
        """Cubes as one surface: of each the coordinate where it begins on all axes, and its side."""
        file = os.path.join(self.scans, "box %s.off" % " ".join("%g" % side for _, side in cubes))
        with open(file, "w") as stream:
            stream.write("OFF\n%d %d 0\n" % (8 * len(cubes), 12 * len(cubes)))
            for start, side in cubes:
                for corner in range(8):
                    stream.write("%g %g %g\n" % tuple(start + side * (corner >> axis & 1) for axis in range(3)))
            for first in range(0, 8 * len(cubes), 8):
                for face in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)):
                    a, b, c, d = (first + corner for corner in face)
                    stream.write("3 %d %d %d\n3 %d %d %d\n" % (a, b, c, a, c, d))
        return "SURFACE=" + file

    def box(self, side):
        """A cube with a corner at 0, as a surface."""
        return self.boxes((0, side))

    def test_a_unit_is_said_or_warned_of_and_a_size_that_no_organ_has_is_refused(self):
        said = self.refused("NAME=a", self.box(0.1))
        self.assertIn("found one of 0.1 mm, 1e-06 cm3, in mm", said)
        self.assertIn("with UNIT=m it would be 100 mm", said)
        self.assertIn("found one of 29 km, 2.44e+19 cm3", self.refused("NAME=a", self.box(29000), "UNIT=m"))
        self.assertIn("found one of 0.9 mm", self.refused("NAME=a", self.box(0.9), "UNIT=mm"))
        self.assertIn("found one of 1 mm, 0.001 cm3", self.refused("NAME=a", self.box(1), "UNIT=mm"))
        self.assertEqual(os.listdir(self.organs), [])
        said = self.make("new-organ", "NAME=box_100", self.box(100))
        self.assertIn("warning: %s: taken to be in mm" % self.box(100)[8:], said)
        self.assertIn("left, back and head", said)
        self.assertIn("An assumption: ", self.text("box_100", "organ.mk"))
        said = self.make("new-organ", "NAME=told", self.box(100), "UNIT=mm", "FRAME=RAS")
        self.assertNotIn("warning", said)
        self.assertIn("found one of 5 mm", self.make("new-organ", "NAME=small", self.box(5), "UNIT=mm", "FRAME=none"))

    def test_a_piece_that_is_dropped_from_a_surface_is_told_with_its_volume(self):
        for name, start in (("around", -1), ("beside", 20)):  # where the second shell begins
            said = self.make("new-organ", "NAME=" + name, self.boxes((0, 10), (start, 257)), "UNIT=cm", "FRAME=LPS")
            self.assertIn("warning: the organ has 2 pieces; the largest is kept, 1.697e+07 cm3; the others have 1e+03 cm3 together", said)
            self.assertIn("found one of 2.57e+03 mm", said)

    def test_a_noisy_label_is_told_from_an_organ_before_its_bundle_fills_the_disk(self):
        x, y, z = np.meshgrid(*(np.arange(n) for n in (40, 40, 40)), indexing="ij")
        ball = (x - 20) ** 2 + (y - 20) ** 2 + (z - 20) ** 2 < 18 ** 2
        noisy = ball & (np.random.default_rng(1).random(ball.shape) < 0.6)
        for name, voxels in (("ball", ball), ("noisy", noisy)):
            scan = os.path.join(self.scans, name + ".nii.gz")
            write_nifti(scan, voxels.astype(np.uint8))
            said = self.make("new-organ", "NAME=" + name, "IMAGE=" + scan, "LABEL=1")
            warned = re.search(r"warning: the organ: .* makes a bundle of up to (\d+) MB", said)
            self.assertEqual(warned is not None, name == "noisy", said)
            self.assertRegex(self.text(name, "organ.mk"), r"# medium: about \d+ vertices, a bundle of up to [0-9.e+]+ MB\n")


def sha256(file):
    return hashlib.sha256(read_bytes(file)).hexdigest()


def tissues_of(bundle):
    """{name: (volume in cm3, centre of volume in mm, LPS)} of the regions, the image's hash, the frame."""
    with h5py.File(bundle, "r") as file:
        names = file["material/names"].asstr()[()].split()
        corners = file["mesh/nodes"][:][file["mesh/tetrahedra"][:]] * 1e3
        region, attributes = file["mesh/region"][:], dict(file.attrs)
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
    found = {}
    for r, name in enumerate(names):
        own = region == r
        centre = (corners[own].mean(axis=1) * volume[own, None]).sum(axis=0) / volume[own].sum()
        found[name] = volume[own].sum() / 1000, centre
    return found, attributes["image_sha256"], attributes["frame"]


class SeveralOrgans(InFolder):
    """LABELS: several organs of one image, welded into one bundle or a bundle each."""

    LABELS = {"liver": 255, "right-kidney": 127, "gallbladder": 85}

    def setUp(self):
        super().setUp()
        self.image = os.path.join(self.data, "liver", "liver.inr.gz")

    def voxels(self):
        """{name: (volume in cm3, centre in mm)} of the shipped image, read here."""
        with gzip.open(self.image) as stream:
            values = np.frombuffer(stream.read()[256:], np.uint8).reshape(165, 353, 438)
        step = np.array([0.6171875, 0.6171875, 4 / 3])
        found = {}
        for name, label in self.LABELS.items():
            places = np.argwhere(values == label)[:, ::-1] * step
            found[name] = len(places) * step.prod() / 1000, places.mean(axis=0)
        return found

    def expect_volumes(self, found, share):
        for name, (volume, centre) in self.voxels().items():
            self.assertAlmostEqual(found[name][0] / volume, 1, delta=share, msg=name)
            self.assertLess(np.linalg.norm(found[name][1] - centre), 1.5, name)  # mm; a voxel is 1.3 mm high

    def expect_colours(self, picture, colours):
        """Each colour covers a part of the picture: pixels of about its hue, however bright."""
        pixels = image.imread(picture)[..., :3].reshape(-1, 3)
        pixels = pixels[(pixels.max(axis=1) > 0.2) & (np.ptp(pixels, axis=1) > 0.08)]
        directions = pixels / np.linalg.norm(pixels, axis=1, keepdims=True)
        for colour in colours:
            near = directions @ (np.array(colour) / np.linalg.norm(colour)) > 0.9985
            self.assertGreater(near.sum(), 300, "%s lacks the colour %s" % (picture, colour))

    def test_welded_organs_keep_names_volumes_and_places_and_then_nothing_is_redone(self):
        organ = ["ORGAN=upper-abdomen", "RESOLUTION=coarse"]
        said = make(self.data, "-j2", *organ)
        self.assertNotIn("of its voxels'", said)
        case = os.path.join(self.data, "upper-abdomen", "coarse", "held")
        found, image_hash, frame = tissues_of(os.path.join(case, "bundle.h5"))
        self.assertEqual(list(found), list(self.LABELS))
        self.expect_volumes(found, 0.02)
        self.assertEqual((image_hash, frame), (sha256(self.image), "LPS"))
        quality = os.path.join(self.data, "upper-abdomen", "coarse", "mesh-quality.json")
        gallbladder = read_json(quality)["regions"][2]
        self.assertLess(gallbladder["meshed_volume"], 0.98 * gallbladder["voxel_volume"])  # what moving the surface gives back
        summary = summary_of(os.path.join(case, "scenes", "press"))
        self.assertEqual(summary["warnings"], [])
        self.assertEqual([tool["peak_force_N"] > 0.02 for tool in summary["tools"]], [True, True])
        for picture in ("mesh", "boundary"):
            self.expect_colours(os.path.join(case, "pictures", picture + ".png"), picture_colours()[:3])
        before = file_times(self.data)
        self.assertNotIn(BIN, make(self.data, "-j2", *organ))
        self.assertEqual(file_times(self.data), before)
        # Other labels make another mesh, not the one that is there.
        make(self.data, *organ, "mesh", "LABELS=255=liver 85=gallbladder")
        self.assertEqual([region["name"] for region in read_json(quality)["regions"]], ["liver", "gallbladder"])

    def test_separate_organs_lie_where_the_image_has_them(self):
        organ = ["separate", "ORGAN=upper-abdomen", "RESOLUTION=coarse"]
        said = make(self.data, "-j2", *organ)
        self.assertIn("3 bundles in one frame", said)
        self.assertRegex(said, r"upper-abdomen: (no step has a warning\n|\d+ warnings? of all steps:\n  [a-z-]+: )")
        found = {}
        for name in self.LABELS:
            case = os.path.join(self.data, "upper-abdomen", name, "coarse", "held")
            regions, image_hash, frame = tissues_of(os.path.join(case, "bundle.h5"))
            self.assertEqual((list(regions), image_hash, frame), ([name], sha256(self.image), "LPS"))
            self.assertEqual(summary_of(os.path.join(case, "scenes", "press"))["warnings"], [])
            found.update(regions)
        self.expect_volumes(found, 0.02)
        self.expect_colours(os.path.join(self.data, "upper-abdomen", "coarse", "separate-held.png"), picture_colours()[:3])
        # All of them in one scene: the probe presses the liver on the kidney, and the forceps hold the gallbladder.
        together = os.path.join(self.data, "upper-abdomen", "coarse", "separate-held", "breathing")
        summary = summary_of(together)
        self.assertEqual([each["name"] for each in summary["organs"]], list(self.LABELS))
        # The held bed of the gallbladder is finer than this liver: a few touches miss a law by more than 1e-6.
        flagged = summary["touches_with_flag"]
        self.assertLessEqual(set(flagged), {"REGULARISED", "SOLVE_INEXACT"})
        self.assertLess(sum(flagged.values()), 0.02 * summary["touches"])
        for organ_name in ("liver", "right-kidney"):
            self.assertGreater(next(each for each in summary["organs"] if each["name"] == organ_name)["peak_pressed_N"], 0.1)
        self.assertGreater(min(tool["peak_force_N"] for tool in summary["tools"]), 0.1)
        self.assertTrue(os.path.exists(together + ".png"))
        before = file_times(self.data)
        make(self.data, *organ)
        self.assertEqual(file_times(self.data), before)

    def test_a_new_folder_of_several_organs_goes_both_ways(self):
        scan = os.path.join(self.folder.name, "case of A's.nii.gz")
        three_organs_image.write(scan)
        said = self.make("new-organ", "NAME=case", "IMAGE=" + scan, "LABELS=spleen=milz 2=right-kidney")
        self.assertIn("next: make -f Makefile.data ORGAN=case ", said)
        self.assertIn("milz has 2 pieces; the largest is kept", said)
        self.assertEqual(sorted(os.listdir(os.path.join(self.organs, "case"))),
                         ["boundary", "milz", "new-organ.json", "organ.mk", "organ.toml", "right-kidney", "scenes"])
        self.make("ORGAN=case", "RESOLUTION=coarse")
        welded, image_hash, _ = tissues_of(os.path.join(self.data, "case", "coarse", "held", "bundle.h5"))
        listed = self.make("separate", "ORGAN=case", "RESOLUTION=coarse").rpartition("case: ")[2]  # the list behind those of the organs
        self.assertRegex(listed, r"^2 warnings of all steps:\n  milz: new-organ: milz has 2 pieces; .*\n  milz: surface: dropped 1 of 2 pieces.*\n(?!  )")
        self.assertEqual(image_hash, sha256(scan))
        for name, volume in (("milz", 155.4), ("right-kidney", 52.6)):  # of the largest pieces
            (own, _, _) = tissues_of(os.path.join(self.data, "case", name, "coarse", "held", "bundle.h5"))
            for found in (welded, own):
                self.assertAlmostEqual(found[name][0] / volume, 1, delta=0.02)
            self.assertLess(np.linalg.norm(welded[name][1] - own[name][1]), 1)
        for scene in (("case", "coarse", "held"), ("case", "milz", "coarse", "held")):
            summary = summary_of(os.path.join(self.data, *scene, "scenes", "press"))
            self.assertEqual(summary["warnings"], [])
            self.assertGreater(summary["tools"][0]["peak_force_N"], 0.05)

    def test_refusals_name_what_is_wrong_and_leave_nothing(self):
        scan = os.path.join(self.folder.name, "scan.nii.gz")
        three_organs_image.write(scan)

        def refused(*more):
            return self.make(*more, code=2)

        new = ["new-organ", "NAME=case", "IMAGE=" + scan]
        self.assertIn("found LABELS=9; ", refused(*new, "LABELS=1=spleen 9=pancreas"))
        self.assertIn('found "kidney"', refused(*new, "LABELS=1=spleen kidney"))
        self.assertIn('found "2=../kidney"', refused(*new, "LABELS=1=spleen 2=../kidney"))
        self.assertIn("each name once", refused(*new, "LABELS=1=spleen 2=spleen"))
        self.assertIn("found 1 (spleen)", refused(*new, "LABELS=1=spleen spleen=milz"))
        self.assertIn("expected two organs or more", refused(*new, "LABELS=1=spleen"))
        self.assertIn("--label excludes --labels", refused(*new, "LABELS=1=spleen 2=kidney", "LABEL=1"))
        self.assertEqual(os.listdir(self.organs), [])
        self.assertIn("expected an organ of several", refused("separate", "ORGAN=plate"))
        for labels, answer in (("255=liver 9=spleen", "9"), ("255=liver 127", 'found "127"')):
            self.assertIn(answer, refused("ORGAN=upper-abdomen", "RESOLUTION=coarse", "LABELS=" + labels))
        self.assertEqual(glob.glob(self.data + "/**/mesh.msh*", recursive=True), [])


class Plain(unittest.TestCase):
    """make without -f, from the top folder."""

    def test_plain_make_is_that_of_makefile_data(self):
        said = [subprocess.run(["make", "-s", "-C", ROOT, *named, "help"], stdout=subprocess.PIPE, text=True, check=True).stdout
                for named in ([], ["-f", "Makefile.data"])]
        self.assertEqual(said[0], said[1])
        self.assertIn("new-organ", said[0])


class ShippedScenes(unittest.TestCase):
    def test_tools_touch_with_discs_whose_force_does_not_belong_to_the_mesh(self):
        folders = os.path.join(ROOT, "pipelines", "**")
        files = [f for kind in ("scenes", "worlds") for f in glob.glob(os.path.join(folders, kind, "*.toml"), recursive=True)]
        self.assertGreater(len(files), 15)
        for file in files:
            if "brain-cylinder" in file:
                continue  # plates that move whole faces, all nodes of them
            with open(file, "rb") as stream:
                for tool in tomllib.load(stream)["tool"]:
                    self.assertTrue({"disc_radius", "grasp", "needle"} & set(tool), (file, tool["name"]))


class Curves(unittest.TestCase):
    FOLDER = os.path.join(ROOT, "pipelines", "brain-cylinder", "curves")

    def test_curves_are_what_their_script_writes(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["/usr/bin/python3", os.path.join(self.FOLDER, "make_curves.py"), folder], check=True)
            files = sorted(os.listdir(folder))
            self.assertEqual(len(files), 4)
            for file in files:
                self.assertEqual(read_bytes(folder, file), read_bytes(self.FOLDER, file))

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
