# Section 6.1 of the paper: a cylinder of brain. Its corrected force and radial displacement lie on the curves measured at three
# rates, with a material file for each rate (organ.toml: 500 mm/min). at-once.toml gives all three rates from one bundle, whose
# force relaxes while the plate comes down.
RESOLUTIONS := 3mm 1.5mm
RESOLUTION ?= 3mm
BC ?= compression
MATERIALS ?= organ rate-5 rate-0.005 at-once
SCENES ?= compress compress-linear

GEOMETRY := $(PIPELINES)/brain-cylinder/cylinder.geo
TETRAHEDRA_OPTIONS_3mm := --set edge=3 --set sides=32
TETRAHEDRA_OPTIONS_1.5mm := --set edge=1.5 --set sides=64

PICTURES = $(WORK)/pictures/cylinder.png
CURVES := $(PIPELINES)/brain-cylinder/curves
RELAXING := 500 5 0.005

# Fails with exit code 3 when a simulated point is farther from the measured curve than its bound.
$(WORK)/pictures/cylinder.png: $(foreach m,$(MATERIALS),$(SCENES:%=$(call case_of,$m)/scenes/%/summary.json)) \
                               $(PIPELINES)/pictures/cylinder.py $(wildcard $(CURVES)/*.csv) \
                               $(RELAXING:%=$(call case_of,at-once)/scenes/relax-%/summary.json)
	$(PYTHON) $(PIPELINES)/pictures/cylinder.py -o $@ \
	    --case 500 $(call case_of,organ) $(CURVES)/swine-brain-500-mm-min.csv \
	    --case 5 $(call case_of,rate-5) $(CURVES)/swine-brain-5-mm-min.csv \
	    --case 0.005 $(call case_of,rate-0.005) $(CURVES)/swine-brain-0.005-mm-min.csv \
	    $(foreach r,$(RELAXING),--relaxing $r $(call case_of,at-once)/scenes/relax-$r $(CURVES)/swine-brain-$r-mm-min.csv)
