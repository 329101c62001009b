"""outputs_page.py PAGE PALPATE_RUN WRITE_TINY_BUNDLE: docs/outputs.md names what palpate-run writes, and nothing else: each column of each CSV file, each
array of each VTU file, each key of summary.json. Scenes with every effect that has output are played on the tiny box."""
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PAGE, PALPATE_RUN, WRITE_TINY_BUNDLE = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
SCRATCH = tempfile.TemporaryDirectory()
FOLDER = pathlib.Path(SCRATCH.name)

LINKS = """
[[link]]
name = "ligament"
kind = "spring"
places = [[60, 25, 20]]
world = [100, 25, 20]
rest_length = 30
stiffness = 20
"""
LOAD = """
[[load]]
name = "swab"
near = [45, 10, 40]
radius = 6
force = [0, 0, -0.1]
"""
NEEDLE = """near = [60, 24, 19]
depth = [[0, -2], [0.1, 5]]
[tool.needle]
radius = 0.5
friction = 1
puncture_force = 0.01
"""
PLATE = """
[[obstacle]]
name = "plate"
kind = "disc"
radius = 20
position = [30, 25, -0.05]
"""
# The box is 60 x 50 x 40 mm, held at x = 0.
ONE_ORGAN = """
name = "one"
bundle = "corridor.h5"
unit = "mm"
[effects]
shape = "volume"
inside = true
crossings = true
[[tool]]
name = "needle"
""" + NEEDLE + """[[tool]]
name = "forceps"
path = [[0, 30, 25, 40], [0.1, 30, 25, 41]]
[tool.grasp]
near = [30, 25, 40]
radius = 6
[[tool]]
name = "finger"
path = [[0, 45, 40, 44], [0.1, 45, 40, 39]]
disc_radius = 4
[tool.capsule]
length = 8
radius = 2
axis = [0, 1, 0]
samples = 2
[[tool]]
name = "pusher"
path = [[0, 40, 10, 40.1], [0.1, 40, 10, 40.1]]
points = [[0, 0, 0]]
[tool.given_force]
force = [0, 0, -0.02]
[[carried]]
name = "tumour"
file = "tumour.ply"
within = 1
""" + LINKS + LOAD + PLATE
ORGANS = """
name = "several"
unit = "mm"
[world]
pairs = 60
[[organ]]
name = "below"
bundle = "box.h5"
[[organ]]
name = "above"
bundle = "box.h5"
position = [0, 0, 40.1]
[organ.effects]
crossings = true
[[organ]]
name = "pierced"
bundle = "corridor.h5"
position = [200, 0, 0]
[[tool]]
name = "needle"
organ = "pierced"
""" + NEEDLE + """[[tool]]
name = "finger"
organ = "above"
points = [[0, 0, 0]]
disc_radius = 5
near = [45, 25, 40]
depth = [[0, -1], [0.1, 4]]
[[tool]]
name = "forceps"
organ = "below"
path = [[0, 60, 25, 20], [0.1, 61, 25, 20]]
[tool.grasp]
near = [60, 25, 20]
radius = 6
""" + "".join(held.replace("name =", 'organ = "below"\nname =') for held in (LINKS, LOAD)) + PLATE + """
[[link]]
name = "thread"
kind = "thread"
organs = ["below", "above"]
places = [[60, 24, 19], [60, 26, 19]]
rest_length = 10
"""
LARGE = """
name = "large"
bundle = "large.h5"
unit = "mm"
[effects]
deformation = "large-beside"
[[tool]]
name = "finger"
points = [[0, 0, 0]]
disc_radius = 5
path = [[0, 45, 25, 42], [0.1, 45, 25, 37]]
"""
# It may be cut everywhere.
CUT = """
name = "cut"
bundle = "cut.h5"
unit = "mm"
[[tool]]
name = "finger"
points = [[0, 0, 0]]
path = [[0, 45, 25, 60]]
[[blade]]
name = "scalpel"
edge = [[0, -40, 0], [0, 40, 0]]
path = [[0, 40, 25, 45], [0.1, 40, 25, 20]]
toughness = 100
direction = [0, 0, -1]
"""
CUT_WORLD = CUT.replace('bundle = "cut.h5"', "").replace("[[tool]]", """[[organ]]
name = "box"
bundle = "cut.h5"
[[tool]]""").replace('name = "scalpel"', 'name = "scalpel"\norgan = "box"')
TETRAHEDRON = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
30 25 20
32 25 20
30 27 20
30 25 22
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""


def play(text, out, *more):
    (FOLDER / f"{out}.toml").write_text(text)
    run = subprocess.run([PALPATE_RUN, f"{out}.toml", "-o", out, "--quiet", *more], cwd=FOLDER, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return FOLDER / out


def setUpModule():
    for form in "", "large", "corridor", "cut":
        subprocess.run([WRITE_TINY_BUNDLE, FOLDER / f"{form or 'box'}.h5", *filter(None, [form])], check=True)
    (FOLDER / "tumour.ply").write_text(TETRAHEDRON)
    play(ONE_ORGAN, "one", "--render-mesh", "tumour.ply")
    play(ORGANS, "several")
    play(LARGE, "large")
    play(CUT, "cuts")
    play(CUT_WORLD, "cut_world")
    play(LARGE, "clock", "--realtime", "--rate", "500", "--seconds", "0.2")


def tearDownModule():
    SCRATCH.cleanup()


def sections():
    """By heading: the names in the first cells of the section's tables. A cell may hold several, as `force_x_N`, `force_y_N`."""
    found = {}
    for heading, body in re.findall(r"^## (`.*?)\n(.*?)(?=^## |\Z)", PAGE.read_text(), re.S | re.M):
        found[heading.replace("`", "")] = [name for cell in re.findall(r"^\| (`[^|]*) \|", body, re.M) for name in re.findall(r"`([^`]+)`", cell)]
    return found


def written_columns(name):
    columns = []
    for file in FOLDER.glob(f"*/{name}"):
        columns += file.read_text().splitlines()[0].split(",")
    return columns


def written_arrays(kind):
    arrays = []
    for file in FOLDER.glob(f"*/shapes/{kind}_*.vtu"):
        head = file.read_bytes().split(b"<AppendedData")[0].decode("latin1")
        data = re.findall(r"<(?:PointData|CellData).*?</(?:PointData|CellData)>", head, re.S)
        arrays += [name for part in data for name in re.findall(r'<DataArray [^>]*?Name="(\w+)"', part)]
    return arrays


SAME_AS_OF_THE_SCENE = ("organs[].links", "organs[].loads", "organs[].obstacles", "organs[].crossings", "organs[].blades", "organs[].cut")


def keys(value, path=""):
    """tools[].peak_force_N of {"tools": [{"peak_force_N": 1}]}. The links, loads, obstacles, crossings, blades and cut of an organ are as those of the scene, and names of flags and of
    percentiles stand alone, as on the page."""
    if isinstance(value, list):
        for each in value:
            yield from keys(each, path + "[]")
    elif isinstance(value, dict) and not path.endswith(("provenance", "_with_flag")):
        for key, each in value.items():
            below = key if "p50" in value else f"{path}.{key}".lstrip(".")
            yield below
            yield from keys(each, below.removeprefix("organs[].") if below in SAME_AS_OF_THE_SCENE else below)


class OutputsPage(unittest.TestCase):
    def compare(self, heading, written):
        on_page = sections()[heading]
        self.assertEqual(len(on_page), len(set(on_page)), f"{heading}: a name stands twice")
        self.assertTrue(written, f"no scene wrote {heading}")
        self.assertEqual(sorted(set(written)), sorted(on_page), heading)

    def test_columns(self):
        for name in sorted({file.name for file in FOLDER.glob("*/*.csv")}):
            with self.subTest(name):
                self.compare(name, written_columns(name))

    def test_arrays(self):
        kinds = {re.match(r"[a-z]+", file.name)[0] for file in FOLDER.glob("*/shapes/*.vtu")}
        for kind in sorted(kinds):
            with self.subTest(kind):
                self.compare(f"shapes/{kind}_*.vtu", written_arrays(kind))

    def test_keys(self):
        for heading, folders in (("summary.json", ("one", "several", "large", "cuts", "cut_world")), ("summary.json of --realtime", ("clock",))):
            with self.subTest(heading):
                self.compare(heading, [key for folder in folders for key in keys(json.loads((FOLDER / folder / "summary.json").read_text()))])

    def test_each_section_is_of_a_file(self):
        files = {file.name for file in FOLDER.glob("*/*.csv")} | {"summary.json", "summary.json of --realtime"}
        kinds = {re.match(r"[a-z]+", file.name)[0] for file in FOLDER.glob("*/shapes/*.vtu")}
        self.assertEqual(set(sections()), files | {f"shapes/{kind}_*.vtu" for kind in kinds})


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
