# The liver, the right kidney and the gallbladder of the default organ's image, welded: one mesh, whose organs share their triangles
# where they touch, so that they cannot slide or part. `make -f Makefile.data separate ORGAN=upper-abdomen` makes a bundle of each
# organ, from the folders in this one. RESOLUTIONS and boundary sets have the same names in all four
# folders, but for held-breathing, which is of the welded mesh alone.
RESOLUTIONS := coarse medium
RESOLUTION ?= medium
BC ?= held

include $(PIPELINES)/liver/image.mk
IMAGE ?= $(LIVER_IMAGE)
# 84, five voxels by five, is left out.
LABELS := 255=liver 127=right-kidney 85=gallbladder

# Edges in mm: --edge-mm on the surfaces, --size inside. The gallbladder is 20 mm wide and gets edges of 5 mm by itself.
TETRAHEDRA_OPTIONS_coarse := --edge-mm 18 --size 18
TETRAHEDRA_OPTIONS_medium := --edge-mm 10 --size 10
