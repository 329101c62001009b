# One organ of pipelines/upper-abdomen by itself.
RESOLUTIONS := coarse medium
RESOLUTION ?= medium

include $(PIPELINES)/liver/image.mk
IMAGE ?= $(LIVER_IMAGE)
SURFACE_OPTIONS_coarse := --labels 255 --smooth 2.5 --edge-mm 18
SURFACE_OPTIONS_medium := --labels 255 --smooth 1.5 --edge-mm 13
TETRAHEDRA_OPTIONS_coarse := --region liver --size 18
TETRAHEDRA_OPTIONS_medium := --region liver --size 9
