# One organ of pipelines/upper-abdomen by itself.
RESOLUTIONS := coarse medium
RESOLUTION ?= medium

include $(PIPELINES)/liver/image.mk
IMAGE ?= $(LIVER_IMAGE)
SURFACE_OPTIONS_coarse := --labels 85 --edge-mm 6
SURFACE_OPTIONS_medium := --labels 85 --edge-mm 4.5
TETRAHEDRA_OPTIONS_coarse := --region gallbladder --size 5
TETRAHEDRA_OPTIONS_medium := --region gallbladder --size 4
