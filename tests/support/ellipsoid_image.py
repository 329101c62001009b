"""An image to run the pipelines on: an ellipsoid where the liver is, of its size."""
import numpy as np


def write_ellipsoid(file):
    """Label 255 in voxels of 6 mm, NRRD in LPS millimetres."""
    spacing, shape = 6.0, (45, 40, 45)
    x, y, z = np.meshgrid(*(spacing * np.arange(n) for n in shape), indexing="ij")
    inside = ((x - 130) / 90) ** 2 + ((y - 100) / 72) ** 2 + ((z - 120) / 65) ** 2 < 1
    header = ("NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: %d %d %d\n"
              "space directions: (6,0,0) (0,6,0) (0,0,6)\nspace origin: (0,0,0)\nkinds: domain domain domain\n"
              "encoding: raw\nendian: little\n\n" % shape)
    with open(file, "wb") as out:
        out.write(header.encode())
        out.write((255 * inside).astype(np.uint8).tobytes(order="F"))
