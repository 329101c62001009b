# The default organ's liver with two stiff tumours under its front: balls of 30 and 16 mm, 8 and 4 mm below the surface.
RESOLUTIONS := 1700 20000
RESOLUTION ?= 1700
BC ?= right-side
SCENES ?= palpate
# healthy: liver everywhere on the same mesh. calcified, tumours a million times as stiff, is made only if asked for.
MATERIALS ?= organ healthy

IMAGE ?= $(DATA)/liver-tumour/liver.inr.gz
# As for the liver. --size: largest edge inside, mm.
SURFACE_OPTIONS_1700 := --labels 255 --smooth 1.5 --triangles 1350
SURFACE_OPTIONS_20000 := --labels 255 --smooth 1 --triangles 7900
RENDER_OPTIONS ?= --labels 255 --smooth 3 --triangles 14000 --spread curvature
SIZE_1700 := 9
SIZE_20000 := 3.8
TETRAHEDRA_OPTIONS ?= --region liver=$(WORK)/surface.ply --region tumour=$(WORK)/tumours.off --size $(SIZE_$(RESOLUTION))
SHELLS = $(WORK)/tumours.off

# X,Y,Z,RADIUS and edge length, mm.
TUMOURS ?= 125,48,118,15 170,36.5,118,8
TUMOUR_EDGE_1700 := 7
TUMOUR_EDGE_20000 := 3.8

$(DATA)/liver-tumour/liver.inr.gz: $(PIPELINES)/liver/extract-image.sh
	mkdir -p $(@D)
	$< $@

VARIABLES_OF_tumours = TUMOURS TUMOUR_EDGE_$(RESOLUTION)
$(WORK)/tumours.off: $(PIPELINES)/liver-tumour/make_balls.py $(PIPELINES)/liver-tumour/organ.mk $(WORK)/tumours-options.txt
	mkdir -p $(@D)
	$(PYTHON) $< $(TUMOURS) --edge $(TUMOUR_EDGE_$(RESOLUTION)) -o $@

# ---- pictures ------------------------------------------------------------------------------------------------------

PICTURES = $(addprefix $(CASE)/pictures/,mesh.png boundary.png palpate.png)

$(CASE)/pictures/palpate.png: $(CASE)/scenes/palpate/summary.json $(call case_of,healthy)/scenes/palpate/summary.json \
                              $(PIPELINES)/pictures/palpation.py $(PIPELINES)/pictures/offscreen.py
	$(PYTHON) $(PIPELINES)/pictures/palpation.py $(CASE) $(call case_of,healthy) --region tumour -o $@
