# One organ of pipelines/upper-abdomen by itself.
RESOLUTIONS := coarse medium
RESOLUTION ?= medium

include $(PIPELINES)/liver/image.mk
IMAGE ?= $(LIVER_IMAGE)
SURFACE_OPTIONS_coarse := --labels 127 --edge-mm 13
SURFACE_OPTIONS_medium := --labels 127 --edge-mm 9
TETRAHEDRA_OPTIONS_coarse := --region right-kidney --size 12
TETRAHEDRA_OPTIONS_medium := --region right-kidney --size 7
