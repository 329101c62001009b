#!/usr/bin/env python3
"""labelled_image.py FILE.nii.gz: a label image to try the programs on, as a segmentation tool writes it.

A NIfTI image in voxels of 3 mm with the labels 1 (spleen), 2 (liver), 3 (kidney) and 7 (a tumour in the liver). The shapes
are smooth bodies of about the organs' sizes, not those of a patient. docs/your-organ.md works on it."""
import gzip
import struct
import sys

import numpy as np

SPACING = 3.0  # mm
SHAPE = (92, 64, 64)
LABELS = {"spleen": 1, "liver": 2, "kidney": 3, "tumour": 7}


def ball(points, centre, radii):
    """0 at the centre, 1 on the surface of the ellipsoid."""
    return np.sqrt(sum(((points[d] - centre[d]) / radii[d]) ** 2 for d in range(3)))


def labels():
    """[x, y, z], LPS millimetres from the first voxel."""
    points = np.meshgrid(*(SPACING * np.arange(n) for n in SHAPE), indexing="ij")
    right_lobe = ball(points, (75, 100, 95), (62, 70, 72))
    left_lobe = ball(points, (140, 80, 115), (62, 42, 36))
    # Two lobes that grow together: the soft minimum of their distances.
    liver = -np.log(np.exp(-8 * right_lobe) + np.exp(-8 * left_lobe)) / 8 < 1
    image = np.zeros(SHAPE, np.uint8)
    image[ball(points, (240, 125, 110), (24, 40, 50)) < 1] = LABELS["spleen"]
    image[ball(points, (150, 150, 60), (24, 22, 45)) < 1] = LABELS["kidney"]
    image[liver] = LABELS["liver"]
    image[ball(points, (75, 58, 110), (16, 16, 16)) < 1] = LABELS["tumour"]
    return image


def write_nifti(file, image, extension=bytes(4)):
    """NIfTI-1 with its axes from an affine to RAS: x and y of the voxels run to the left and to the back. extension: the bytes between
    the header and the voxels."""
    header = bytearray(348)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, *image.shape, 1, 1, 1, 1)
    struct.pack_into("<hh", header, 70, 2, 8)  # unsigned char
    struct.pack_into("<8f", header, 76, 1, SPACING, SPACING, SPACING, 0, 0, 0, 0)
    struct.pack_into("<fff", header, 108, 348 + len(extension), 1, 0)
    struct.pack_into("<B", header, 123, 2)  # millimetres
    struct.pack_into("<hh", header, 252, 0, 1)  # the affine is that of the scanner
    for row, axis in enumerate(((-SPACING, 0, 0, 0), (0, -SPACING, 0, 0), (0, 0, SPACING, 0))):
        struct.pack_into("<4f", header, 280 + 16 * row, *axis)
    header[344:348] = b"n+1\0"
    with open(file, "wb") as out, gzip.GzipFile("", "wb", 6, out, mtime=0) as stream:
        stream.write(bytes(header) + extension + image.tobytes(order="F"))


if __name__ == "__main__":
    if len(sys.argv) != 2 or not sys.argv[1].endswith(".nii.gz"):
        sys.exit("usage: labelled_image.py FILE.nii.gz")
    write_nifti(sys.argv[1], labels())
