# One rule for each step: image -> surface -> tetrahedra -> bundle -> verified -> scene, and pictures of the results.
#
# Included by Makefile.data, which defines BIN, DATA, PYTHON, RANKS, LAUNCH and how the programs in BIN are built. Each
# organ is a folder with an organ.mk: where its mesh comes from, the defaults of its variables, the rules for its pictures
# (docs/files.md lists the variables). Every program writes NAME.part and renames it at the end, so a run that was killed
# continues where it was.
PIPELINES := $(patsubst %/,%,$(dir $(lastword $(MAKEFILE_LIST))))
ORGANS := $(sort $(patsubst $(PIPELINES)/%/organ.mk,%,$(wildcard $(PIPELINES)/*/organ.mk)))

ORGAN ?= liver
RANKS ?=
ifeq ($(filter $(ORGAN),$(ORGANS)),)
$(error ORGAN=$(ORGAN): expected one of $(ORGANS))
endif

ORGAN_DIR := $(PIPELINES)/$(ORGAN)
WORK = $(DATA)/$(ORGAN)/$(RESOLUTION)
# The folder of a boundary set and a material file; plain BC for organ.toml.
case_of = $(WORK)/$(BC)$(if $(filter-out organ,$1),-$1)
CASE = $(call case_of,organ)

.PHONY: pipeline mesh show-resolutions
pipeline:

include $(ORGAN_DIR)/organ.mk
MATERIALS ?= organ

ifeq ($(wildcard $(ORGAN_DIR)/boundary/$(BC).toml),)
$(error BC=$(BC): expected one of $(basename $(notdir $(wildcard $(ORGAN_DIR)/boundary/*.toml))))
endif
ifeq ($(filter $(RESOLUTION),$(RESOLUTIONS)),)
$(error RESOLUTION=$(RESOLUTION): expected one of $(RESOLUTIONS))
endif

pipeline: $(PICTURES) $(foreach m,$(MATERIALS),$(call case_of,$m)/verified.json \
                                               $(SCENES:%=$(call case_of,$m)/scenes/%/summary.json))
	@echo "$(ORGAN): results in $(WORK); pictures: $(PICTURES)"

# ---- image -> surface -> tetrahedra, or geometry -> tetrahedra -----------------------------------------------------

ifdef IMAGE
$(WORK)/surface.ply: $(IMAGE) $(ORGAN_DIR)/organ.mk $(BIN)/palpate-surface
	mkdir -p $(@D)
	$(BIN)/palpate-surface $< -o $@ $(SURFACE_OPTIONS)

# SHELLS: more surfaces of an organ.mk, nested in the first.
$(WORK)/mesh.msh: $(WORK)/surface.ply $(SHELLS) $(BIN)/palpate-tetrahedra
	$(BIN)/palpate-tetrahedra $< $(SHELLS) -o $@ $(TETRAHEDRA_OPTIONS)
# A finer surface to draw over any of the meshes (palpate_scene_skin), where the organ.mk says how fine.
ifdef RENDER_OPTIONS
RENDER_MESH := $(DATA)/$(ORGAN)/render.ply
$(RENDER_MESH): $(IMAGE) $(ORGAN_DIR)/organ.mk $(BIN)/palpate-surface
	mkdir -p $(@D)
	$(BIN)/palpate-surface $< -o $@ $(RENDER_OPTIONS)
endif
else
$(WORK)/mesh.msh: $(GEOMETRY) $(ORGAN_DIR)/organ.mk $(BIN)/palpate-tetrahedra
	mkdir -p $(@D)
	$(BIN)/palpate-tetrahedra $< -o $@ $(TETRAHEDRA_OPTIONS)
endif

mesh: $(WORK)/mesh.msh

# For programs that make meshes by these rules: prints the default mesh size, then all of them, coarse to fine.
show-resolutions:
	@echo $(RESOLUTION) $(RESOLUTIONS)

# ---- tetrahedra -> bundle -> verified -> scene ---------------------------------------------------------------------

# How many MPI ranks the precompute runs on: RANKS=n, which mpiexec starts behind LAUNCH; else those that LAUNCH starts itself
# (LAUNCH="srun --mpi=pmix -n 4"); else those that the plan of this mesh finds useful on this machine's cores and memory.
MPIEXEC = mpiexec --bind-to none --oversubscribe -n
USEFUL_RANKS = sed -n 's/.*"useful_ranks": *\([0-9]*\).*/\1/p'
# Without this Open MPI looks up X servers by name, which takes minutes where names do not resolve.
export HWLOC_COMPONENTS ?= -gl
# Open MPI refuses to run as root, which users of containers are, unless both variables are set.
export OMPI_ALLOW_RUN_AS_ROOT := 1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM := 1

# $1: folder of the case; $2: its material file.
define case_rules
$1/bundle.h5: $(WORK)/mesh.msh $2 $(ORGAN_DIR)/boundary/$(BC).toml $(wildcard $(ORGAN_DIR)/curves/*.csv) \
              $(BIN)/palpate-precompute
	mkdir -p $$(@D)
	set -- $(BIN)/palpate-precompute $$< --organ $2 --boundary $(ORGAN_DIR)/boundary/$(BC).toml \
	    $(if $(IMAGE),--image $(IMAGE)) $(if $(MEMORY),--memory $(MEMORY)); \
	ranks=$(or $(RANKS),$(if $(LAUNCH),1,`("$$$$@" --plan --json - $(PRECOMPUTE_OPTIONS) 2> /dev/null || true) | $(USEFUL_RANKS)`)); \
	if [ "$$$${ranks:-1}" -gt 1 ]; then set -- $(MPIEXEC) "$$$$ranks" "$$$$@"; fi; \
	$(LAUNCH) "$$$$@" -o $$@ $(PRECOMPUTE_OPTIONS)

$1/verified.json: $1/bundle.h5 $(WORK)/mesh.msh $(BIN)/palpate-bundle
	$(BIN)/palpate-bundle verify $$< --mesh $(WORK)/mesh.msh --organ $2 \
	    --boundary $(ORGAN_DIR)/boundary/$(BC).toml --json > $$@.part
	mv $$@.part $$@

$1/scenes/%/summary.json: $(ORGAN_DIR)/scenes/%.toml $1/verified.json $(wildcard $(ORGAN_DIR)/scenes/*.csv) \
                          $(BIN)/palpate-run
	mkdir -p $1/scenes
	$(BIN)/palpate-run $$< --bundle $1/bundle.h5 -o $$(@D)
endef
$(foreach m,$(MATERIALS),$(eval $(call case_rules,$(call case_of,$m),$(ORGAN_DIR)/$m.toml)))
