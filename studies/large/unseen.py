#!/usr/bin/env python3
"""Bodies that no tolerance of large deformation was chosen with, beside the kidney of pipelines/upper-abdomen, and what is worst on them.

unseen.py bodies FOLDER BIN    label images of a slab, a tube and an organ of two lobes, and their organs' folders in FOLDER/organs
unseen.py table FILE...        a table of large-deformation.json files: for each body and depth the worst state that no flag tells

Slab: 100 x 60 x 20 mm, held at one end. Tube: 120 mm long, 50 mm wide, its wall 12 mm, held at both ends. Lobes: the liver of
tests/support/labelled_image.py, held where palpate-organ holds it."""
import json
import os
import subprocess
import sys

# mm, in the frame of the image, LPS: a point of the plane and the way out of the held side.
ENDS = {"slab": [((30, 60, 30), (1, 0, 0))], "tube": [((20, 60, 95), (1, 0, 0)), ((130, 60, 95), (-1, 0, 0))]}
# Image and label of each.
BODIES = {"slab": ("bodies", 1), "tube": ("bodies", 2), "lobes": ("lobes", 2)}


def write_images(folder):
    import numpy as np
    sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tests", "support"))
    import labelled_image
    x, y, z = np.meshgrid(*(labelled_image.SPACING * np.arange(n) for n in (50, 40, 50)), indexing="ij")
    image = np.zeros(x.shape, np.uint8)
    image[(abs(x - 75) < 50) & (abs(y - 60) < 30) & (abs(z - 30) < 10)] = BODIES["slab"][1]
    from_axis = np.hypot(y - 60, z - 95)
    image[(abs(x - 75) < 60) & (from_axis < 25) & (from_axis > 13)] = BODIES["tube"][1]
    labelled_image.write_nifti(os.path.join(folder, "bodies.nii.gz"), image)
    labelled_image.write_nifti(os.path.join(folder, "lobes.nii.gz"), labelled_image.labels())


def boundary(ends):
    return 'name = "ends"\n' + "".join(
        '\n[[fixed]]\ndofs = "xyz"\nselect = { half_space = { point = [%g, %g, %g], normal = [%g, %g, %g] } }\n' % (*point, *normal)
        for point, normal in ends)


def bodies(folder, programs):
    organs = os.path.join(os.path.abspath(folder), "organs")
    os.makedirs(organs, exist_ok=True)
    write_images(folder)
    for name, (image, label) in BODIES.items():
        if not os.path.exists(os.path.join(organs, name)):
            subprocess.run([os.path.join(programs, "palpate-organ"), "--quiet", "--name", name, "--label", str(label), "--folder", organs,
                            "--image", os.path.join(os.path.abspath(folder), image + ".nii.gz")], check=True)
        if name in ENDS:
            with open(os.path.join(organs, name, "boundary", "ends.toml"), "w", encoding="utf-8") as out:
                out.write(boundary(ENDS[name]))


def worst(points):
    """Field and force, %, each the worst of all."""
    return ", ".join("%.1f" % (100 * max(p["large_" + key] for p in points)) for key in ("field", "force")) if points else ""


def table(files):
    print("| body, vertices | nu | depth, mm | states | flagged: field, force, % | flag 0: field, force, % | without Newton's |\n|---|---|---|---|---|---|---|")
    for file in files:
        with open(file, encoding="utf-8") as stream:
            study = json.load(stream)
        for mesh in study["meshes"]:
            own = [p for p in study["points"] if (p["resolution"], p["poisson"]) == (mesh["resolution"], mesh["poisson"])]
            for depth in sorted({p["depth_mm"] for p in own}):
                here = [p for p in own if p["depth_mm"] == depth]
                solved = [p for p in here if p["unsolved"] is None]
                flagged = [p for p in solved if p["flags"]]
                print("| %s, %d | %g | %g | %d | %d: %s | %s | %d, flagged %d |" % (
                    os.path.basename(study["organ"]), mesh["vertices"], mesh["poisson"], depth, len(here), len(flagged), worst(flagged),
                    worst([p for p in solved if not p["flags"]]), len(here) - len(solved),
                    sum(1 for p in here if p["unsolved"] is not None and p["flags"])))


if __name__ == "__main__":
    if len(sys.argv) == 4 and sys.argv[1] == "bodies":
        bodies(*sys.argv[2:])
    elif len(sys.argv) > 2 and sys.argv[1] == "table":
        table(sys.argv[2:])
    else:
        sys.exit("usage: unseen.py bodies FOLDER BIN, or unseen.py table FILE...")
