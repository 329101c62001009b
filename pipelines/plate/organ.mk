# Figure 5 of the paper: a plate with fixed corners under one and several contacts.
RESOLUTIONS := 5mm 2.5mm
RESOLUTION ?= 5mm
BC ?= corners
SCENES ?= one-contact several-contacts

GEOMETRY := $(PIPELINES)/plate/plate.geo
TETRAHEDRA_OPTIONS_5mm := --set edge=5 --set layers=3
TETRAHEDRA_OPTIONS_2.5mm := --set edge=2.5 --set layers=5

PICTURES = $(CASE)/pictures/plate.png

$(CASE)/pictures/plate.png: $(SCENES:%=$(CASE)/scenes/%/summary.json) $(PIPELINES)/pictures/plate.py \
                            $(PIPELINES)/pictures/offscreen.py
	$(PYTHON) $(PIPELINES)/pictures/plate.py $(SCENES:%=$(CASE)/scenes/%) -o $@
