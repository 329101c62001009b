# The default organ: a segmented liver.
RESOLUTIONS := 200 600 1700 5000 10000 20000
LARGER_RESOLUTIONS := 100000
RESOLUTION ?= 1700
# The goals that print the documents' figures take the set with which these were measured.
BC ?= $(if $(filter accuracy large-deformation bench% docs-speed,$(MAKECMDGOALS)),right-side,abdomen)
SCENES ?= push push-response drag tools stroke lift suture retract $(filter breathing biopsy biopsy-breathing cut,$(BC))

# A resolution is about the number of vertices: 1700 has 1,696 and a smallest dihedral angle of 25 degrees, 20000 has 19,656 and
# 22 degrees. --size: largest edge inside, mm.
include $(PIPELINES)/liver/image.mk
IMAGE ?= $(LIVER_IMAGE)
SURFACE_OPTIONS_200 := --labels 255 --smooth 4 --triangles 274
SURFACE_OPTIONS_600 := --labels 255 --smooth 2.5 --triangles 680
SURFACE_OPTIONS_1700 := --labels 255 --smooth 1.5 --triangles 1350
SURFACE_OPTIONS_5000 := --labels 255 --smooth 1.5 --triangles 2950
SURFACE_OPTIONS_10000 := --labels 255 --smooth 1.2 --triangles 4760
SURFACE_OPTIONS_20000 := --labels 255 --smooth 1 --triangles 7900
SURFACE_OPTIONS_100000 := --labels 255 --smooth 0.5 --triangles 28000
TETRAHEDRA_OPTIONS_200 := --region liver --size 26
TETRAHEDRA_OPTIONS_600 := --region liver --size 14
TETRAHEDRA_OPTIONS_1700 := --region liver --size 9
TETRAHEDRA_OPTIONS_5000 := --region liver --size 6
TETRAHEDRA_OPTIONS_10000 := --region liver --size 4.7
TETRAHEDRA_OPTIONS_20000 := --region liver --size 3.8
TETRAHEDRA_OPTIONS_100000 := --region liver --size 2.2
PRECOMPUTE_OPTIONS_100000 := --low-rank 1e-3
# The default organ can be cut open and pressed deeply: 42 MB in place of 17. On finer meshes the interior would take gigabytes.
ifeq ($(RESOLUTION)-$(BC),1700-abdomen)
PRECOMPUTE_OPTIONS ?= --interior --large-deformation
endif

# The surface that is drawn over any of the meshes: 14,000 triangles, denser where the liver is curved.
RENDER_OPTIONS ?= --labels 255 --smooth 3 --triangles 14000 --spread curvature

# ---- pictures ------------------------------------------------------------------------------------------------------

PICTURES = $(addprefix $(CASE)/pictures/,$(addsuffix .png,mesh boundary $(filter-out push-response,$(SCENES)) \
                                                          $(if $(filter push-response,$(SCENES)),force)))

$(CASE)/pictures/force.png: $(CASE)/scenes/push/summary.json $(CASE)/scenes/push-response/summary.json \
                            $(PIPELINES)/pictures/force.py
	$(PYTHON) $(PIPELINES)/pictures/force.py $(CASE)/scenes/push $(CASE)/scenes/push-response -o $@
