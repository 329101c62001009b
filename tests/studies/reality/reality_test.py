#!/usr/bin/env python3
"""The comparison with measured curves, on curves made here, with the real program. Usage: reality_test.py BIN [TEST ...]"""
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import numpy as np  # noqa: E402
from study_test import BIN, ROOT, StudyTest, run_program  # noqa: E402

sys.path.insert(0, os.path.join(ROOT, "studies", "reality"))
import laws  # noqa: E402

SHEAR_PA = {"soft": 2000, "stiff": 40000}
STRAINS = (0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5)
SPECIMENS = {"A1": 0.99, "A2": 1.01, "A3": 1.0, "B1": 1.01, "B2": 0.99}  # the first three are fitted
LOADS_N = (0.0, 0.5, 1.0)
SAG_MM = 6.4
MARKERS = {"tip1": (0, 15, 36), "tip2": (0, -6, 8)}  # their mean stands 22 mm above the base


def compressed(shear, strain, stiffening=0.0):
    """The force on an incompressible cylinder of 50 mm between plates that slide, N. Stiffening: the exponential law's b."""
    s = 1 - strain
    return shear * math.pi * 0.025 ** 2 * (1 / s ** 2 - s) * math.exp(stiffening * (s * s + 2 / s - 3))


def cylinder_text(stiffening=0.0):
    lines = ["# made by a test", "silicone,specimen,strain,compression_mm,force_N"]
    for name, shear in SHEAR_PA.items():
        for specimen, factor in SPECIMENS.items():
            lines += [f"{name},{specimen},{s},{30 * s:g},{factor * compressed(shear, s, stiffening):.6g}" for s in STRAINS]
    return "\n".join(lines) + "\n"


def beam_text():
    """Markers on the end of the beam that the short study solves: the study must find their ways again."""
    end = json.loads(run_program("reality_solves", "beam", "--size", "0.1,0.03,0.03", "--density", "1070", "--gravity", "9.80709", "--poisson", "0.49", "--loads",
                                 "0.5,1", "--sag", str(SAG_MM / 1000), "--above", "0.022", "--beyond", "0", "--cells", "4", "--element", "p1-anp"))["end"]
    axes = [f"{what}_{axis}_mm" for what in ("nominal", "start", "moved") for axis in "xyz"]
    lines = ["case,repeat,load_N,marker," + ",".join(axes) + ",sd_last_second_mm"]
    for load, moved in zip(LOADS_N, end):
        for marker, (x, y, z) in MARKERS.items():
            c, s = math.cos(moved["turn"]), math.sin(moved["turn"])
            to = (1000 * moved["along_m"] + c * x - s * z - x, 0, -1000 * moved["down_m"] + s * x + c * z - z)
            lines.append(",".join(map(str, ("own" if load == 0 else f"load{load}", "a", load, marker, x, y, z, x, y, z, *to, 0.01))))
        lines.append(f"{'own' if load == 0 else f'load{load}'},a,{load},base,-94,0,0,-94,0,0,0,0,0,0.01")
    return "\n".join(lines) + "\n"


def study(measured, folder, code=0):
    run = subprocess.run([sys.executable, os.path.join(ROOT, "studies", "reality", "study.py"), measured, "--bin", BIN, "--short", "-o", folder],
                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if run.returncode != code:
        raise AssertionError("study.py ended with %d:\n%s" % (run.returncode, run.stdout[-3000:]))
    return run.stdout


class Reality(StudyTest):
    result = "reality.json"

    @classmethod
    def run_study(cls):
        cls.measured = os.path.join(cls.scratch.name, "measured")
        os.mkdir(cls.measured)
        cls.texts = {"cylinder-compression-A.csv": cylinder_text(), "beam-markers-a.csv": beam_text()}
        for name, text in cls.texts.items():
            cls.write(name, text)
        study(cls.measured, cls.folder)

    @classmethod
    def write(cls, name, text):
        with open(os.path.join(cls.measured, name), "w") as file:
            file.write(text)

    def with_file(self, name, text, code):
        """What the study prints where one measured file has another text (None: is not there)."""
        whole = tempfile.mkdtemp(dir=self.scratch.name)
        for other, own in self.texts.items():
            if (text if other == name else own) is not None:
                with open(os.path.join(whole, other), "w") as file:
                    file.write(text if other == name else own)
        out = os.path.join(whole, "study")
        printed = study(whole, out, code)
        self.addCleanup(shutil.rmtree, whole)
        return printed, out

    def test_the_modulus_of_the_first_half_of_the_specimens_predicts_the_second_half(self):
        cylinders = self.all["cylinders"]
        self.assertEqual(cylinders["nearer"], "sliding")  # as the curves were made
        for one in cylinders["silicones"]:
            self.assertEqual((one["fitted"], one["predicted"]), (["A1", "A2", "A3"], ["B1", "B2"]))
            # nu is 0.499 and not 0.5, and the mesh has three cells: 1 % at most
            self.assertAlmostEqual(one["shear_Pa"]["sliding"] / SHEAR_PA[one["silicone"]], 1, delta=0.01)
        for error in cylinders["models"]["sliding"]["median"] + cylinders["models"]["Q"]["median"]:
            self.assertLess(error, 0.02)  # specimens differ by 1 %
        # Linear: 3 e of 1 / (1 - e)^2 - (1 - e), which is 1.5 of 3.5 at 0.5
        self.assertAlmostEqual(cylinders["models"]["linear"]["signed"][-1], 1.5 / 3.5 - 1, delta=0.02)
        self.assertGreater(cylinders["moduli_ratio"], 1.2)

    def test_laws_of_more_constants_follow_the_curves_too(self):
        cylinders = self.all["cylinders"]
        for law in ("yeoh", "ogden"):
            # The curves are neo-Hookean, which both laws come near: Yeoh's with c2 = c3 = 0, Ogden's with the exponent 2
            for error in cylinders["models"][f"{law}, sliding"]["median"]:
                self.assertLess(error, 0.02)
            self.assertEqual(cylinders["served"]["sliding"][law]["serves"], len(SHEAR_PA))
        self.assertLess(cylinders["table_off"], 0.1)

    def test_the_constants_of_made_curves_are_found_again(self):
        strains = np.arange(0.05, 0.51, 0.05)
        plain = np.array([compressed(1.0, s) for s in strains])
        for law, row in (("yeoh", (-0.083, 0.03)), ("ogden", (-4.7,)), ("ogden", (3.8,))):
            branches = [(rows, lambda rows, s, law=law: laws.sliding_ratio(law, rows, s)) for rows in laws.branches(law)]
            shear, found, _, residual = laws.fit(branches, plain, strains, 3e4 * plain * laws.sliding_ratio(law, np.array([row]), strains)[0])
            self.assertLess(residual, 1e-3, law)
            self.assertAlmostEqual(shear, 3e4, delta=100)
            for a, b in zip(found, row):
                self.assertAlmostEqual(a, b, delta=0.005 * max(1, abs(b)))
        # A table whose ratios are those of the closed form gives them between its rows.
        for rows in laws.branches("yeoh"):
            table = laws.Table(rows, strains, laws.sliding_ratio("yeoh", rows, strains))
            between = np.array([[-0.05, 0.04]])
            np.testing.assert_allclose(table.ratio(between, strains), laws.sliding_ratio("yeoh", between, strains), rtol=0.05)

    def test_q_is_right_on_its_own_support_alone(self):
        for press, rows in self.all["supports"]["errors"].items():
            self.assertTrue(rows, press)
            self.assertGreater(max(abs(r["q"]) for r in rows), 0.05, press)

    def test_the_beams_markers_are_found_again(self):
        judged, quadratic = self.all["beam"]["models"]
        for marker in judged["markers"]:
            self.assertLess(marker["off_mm"], 0.01)  # the sag is met to 1e-4, of 27 mm
        self.assertGreater(quadratic["young_Pa"], 1.1 * judged["young_Pa"])  # four cells of linear elements are too stiff in bending
        self.assertEqual([g["gate"] for g in self.all["gates"]], ["cylinders", "laws", "beam"])

    def test_the_report_is_one_file_with_five_figures_that_say_what_was_fitted(self):
        page = self.page()
        self.assertEqual(page.count("<figure>"), 5)
        for figure in page.split("<figure>")[1:]:
            caption = figure[figure.index("<figcaption>"):]
            self.assertTrue(caption.startswith("<figcaption>") and "Fitted on:" in caption[:caption.index("</figcaption>")])
        self.assertIn("What could not be played", page)
        self.assert_pictures("cylinders-error", "cylinders-force", "supports", "beam-markers", "beam-modulus")

    def test_a_gate_that_is_not_met_ends_with_3_and_says_by_how_much(self):
        printed, out = self.with_file("cylinder-compression-A.csv", cylinder_text(stiffening=2.0), 3)
        self.assertRegex(printed, r"cylinders: .*: \d+ %, above 5 %")
        with open(os.path.join(out, "report.html")) as file:
            self.assertIn("DOES NOT HOLD", file.read())

    def test_a_file_that_is_missing_is_in_the_last_table(self):
        for name, what in (("beam-markers-a.csv", "the beam"), ("cylinder-compression-A.csv", "compressed cylinders")):
            _, out = self.with_file(name, None, 0)
            with open(os.path.join(out, "report.html")) as file:
                self.assertIn(f"<td>{what}</td><td>the folder has no such file</td>", file.read())

    def test_bad_rows_are_refused_in_one_sentence_with_file_row_and_cell(self):
        cylinder, beam = "cylinder-compression-A.csv", "beam-markers-a.csv"
        lines, markers = (self.texts[name].splitlines() for name in (cylinder, beam))

        def edited(rows, row, text):
            return "\n".join(rows[:row - 1] + ([text] if text is not None else []) + rows[row:]) + "\n"
        cases = [
            (cylinder, edited(lines, 5, "soft,A1,0.1,3,much"), ("row 5", "force_N", "much")),
            (cylinder, edited(lines, 5, "soft,A1,0.1,3,nan"), ("row 5", "force_N", "nan")),
            (cylinder, edited(lines, 5, "soft,A1,0.1,3,-1"), ("row 5", "force_N", "-1")),
            (cylinder, edited(lines, 5, "soft,A1,1.1,33,5"), ("row 5", "strain", "1.1")),
            (cylinder, edited(lines, 5, "soft,A1,0.1,4,5"), ("row 5", "height", "40")),
            (cylinder, edited(lines, 5, "soft,A1,0.01,0.3,5"), ("row 5", "strain above 0.05", "0.01")),
            (cylinder, edited(lines, 5, ",A1,0.1,3,5"), ("row 5", "silicone", "empty")),
            (cylinder, edited(lines, 5, "soft,A1,0.1,3"), ("row 5", "5 cells", "4")),
            (cylinder, edited(lines, 2, "silicone,specimen,strain,force_N"), ("row 2", "compression_mm", "specimen")),
            (cylinder, "", ("row 1", "columns", "no row")),
            (cylinder, "\n".join(lines[:2]) + "\n", ("row 3", "measured row", "end of the file")),
            (cylinder, "\n".join(lines[:2 + len(STRAINS)]) + "\n", ("two specimens", "soft", "1")),
            (cylinder, "\n".join(lines[:5]) + "\n" + lines[9] + "\n", ("three strains", "soft A1", "2")),
            (beam, edited(markers, 3, markers[1]), ("row 3", "own a tip1", "second time")),
            (beam, edited(markers, 3, markers[2].replace("own,a,0.0", "own,a,0.3")), ("row 3", "load 0 N", "0.3")),
            (beam, "\n".join(markers[:4]) + "\n", ("load_N 0", "one with more")),
        ]
        for name, text, nouns in cases:
            printed, _ = self.with_file(name, text, 1)
            self.assertEqual(printed.count("\n"), 1, printed)
            for noun in nouns:
                self.assertIn(noun, printed)
        self.assertIn("expected cylinder-compression*.csv", study(tempfile.mkdtemp(dir=self.scratch.name), self.folder + "-none", 1))


if __name__ == "__main__":
    unittest.main(verbosity=2)
