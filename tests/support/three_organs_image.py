#!/usr/bin/env python3
"""three_organs_image.py FILE.nii.gz: a small label image of three organs, with their names in the header's extension.

Labels 1 (spleen, 55 x 60 x 90 mm, in one piece and a speck beside it), 2 (kidney, 40 x 36 x 70 mm) and 40 (vessel, a rod of
15 mm that leaves the image)."""
import struct
import sys

import numpy as np

from labelled_image import SPACING, write_nifti

SHAPE = (60, 36, 44)
NAMES = {1: "spleen", 2: "kidney", 40: "vessel"}


def labels():
    """[x, y, z], LPS millimetres from the first voxel."""
    x, y, z = np.meshgrid(*(SPACING * np.arange(n) for n in SHAPE), indexing="ij")
    image = np.zeros(SHAPE, np.uint8)
    image[((x - 45) / 27.5) ** 2 + ((y - 50) / 30) ** 2 + ((z - 65) / 45) ** 2 < 1] = 1
    image[1:3, 1:3, 1:3] = 1
    image[((x - 115) / 20) ** 2 + ((y - 55) / 18) ** 2 + ((z - 65) / 35) ** 2 < 1] = 2
    image[(x - 155) ** 2 + (y - 55) ** 2 < 7.5 ** 2] = 40
    return image


def extension():
    """A label table as segmentation tools write it, padded to 16 bytes."""
    rows = "".join('<Label Key="%d" Red="1" Green="0" Blue="0" Alpha="1"><![CDATA[%s]]></Label>\n' % row for row in NAMES.items())
    text = ('<?xml version="1.0" encoding="UTF-8"?> <CaretExtension> <VolumeInformation Index="0"> <LabelTable>\n' + rows
            + "</LabelTable> </VolumeInformation> </CaretExtension>").encode()
    size = -(-(len(text) + 8) // 16) * 16
    return struct.pack("<4Bii", 1, 0, 0, 0, size, 0) + text.ljust(size - 8, b"\0")


def write(file):
    write_nifti(file, labels(), extension())


if __name__ == "__main__":
    if len(sys.argv) != 2 or not sys.argv[1].endswith(".nii.gz"):
        sys.exit("usage: three_organs_image.py FILE.nii.gz")
    write(sys.argv[1])
