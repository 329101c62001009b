"""godot_test.py PALPATE_IGTL PALPATE_RUN BUNDLE PROJECT GODOT: a scene of Godot 3 without a window feels the force and draws the surface that
palpate-run computes for the same press. BUNDLE is of frame LPS."""
import csv
import os
import pathlib
import re
import subprocess
import sys
import tempfile

igtl, run, bundle, project, godot = sys.argv[1:]
SCENE = """name = "press"
unit = "mm"

[effects]
collision = "deformed"

[[tool]]
name = "probe"
points = [[0, 0, 0]]
disc_radius = 4
at = "foremost"
depth = [[0, -2], [0.2, 2], [0.3, 2]]
"""


def in_ras(row, *columns):
    """Of a row of forces.csv, with the sign of OpenIGTLink's frame."""
    return [sign * float(row[column]) for sign, column in zip((-1, -1, 1), columns)]


with tempfile.TemporaryDirectory() as folder:
    scene = pathlib.Path(folder, "press.toml")
    scene.write_text(SCENE)
    subprocess.run([run, scene, "--bundle", bundle, "-o", f"{folder}/played", "--quiet"], check=True)
    with open(f"{folder}/played/forces.csv", newline="") as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    points = [",".join("%.9f" % (1e3 * x) for x in in_ras(row, "x_m", "y_m", "z_m")) for row in (rows[0], rows[-1])]
    expected = in_ras(rows[-1], "force_x_N", "force_y_N", "force_z_N")
    server = subprocess.Popen([igtl, scene, "--bundle", bundle, "--listen", "0"], stdout=subprocess.PIPE, text=True)
    try:
        port = re.search(r":(\d+)$", server.stdout.readline().strip())[1]
        said = subprocess.run([godot, "--path", project, "--port", port, "--tool", "probe", "--points", " ".join(points)], check=True, timeout=300,
                              env=dict(os.environ, HOME=folder, LC_ALL="C.UTF-8"), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout
    finally:
        server.terminate()
        server.wait()
    found = re.search(r"force (\S+) (\S+) (\S+) N, surface moved (\S+) mm, (\d+) vertices", said)
    assert found, said
    force = [float(found[axis]) for axis in (1, 2, 3)]
    print("palpate-run", expected, "Godot", force, said.splitlines()[-1])
    # Places travel as single precision, half a millionth of 0.1 m; the press is 2 mm deep.
    assert all(abs(a - b) < 2e-4 * max(map(abs, expected)) for a, b in zip(force, expected)), (force, expected)
    assert max(map(abs, expected)) > 0.01 and float(found[4]) > 0.5 and int(found[5]) > 20
