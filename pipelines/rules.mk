# One rule for each step: image -> surface -> tetrahedra -> bundle -> verified -> scene, and pictures of the results.
#
# Included by Makefile.data, which defines BIN, DATA, PYTHON, RANKS, LAUNCH and how the programs in BIN are built. Each
# organ is a folder with an organ.mk: where its mesh comes from, the defaults of its variables, and the rules that no other
# organ has (docs/files.md lists the variables). Every program writes NAME.part and renames it at the end, so a run that was
# killed continues where it was.
PIPELINES := $(patsubst %/,%,$(dir $(lastword $(MAKEFILE_LIST))))
# Where the organs' folders are. new-organ writes to the first; make finds those of all.
ORGANS_DIR ?= $(PIPELINES)
# An organ's folder may hold those of the organs that it welds together.
ORGANS := $(sort $(foreach d,$(ORGANS_DIR) $(PIPELINES),$(patsubst $d/%/organ.mk,%,$(wildcard $d/*/organ.mk $d/*/*/organ.mk))))

ORGAN ?= liver
RANKS ?=
# near(WORD, WORDS): the end of a sentence with the word that was probably meant.
near = $(addprefix ; did you mean ,$(addsuffix ?,$(shell $(PYTHON) -c 'import difflib, sys; print(*difflib.get_close_matches(sys.argv[1], sys.argv[2:], 1))' '$1' $2 2> /dev/null)))
ifeq ($(filter $(ORGAN),$(ORGANS)),)
$(error ORGAN=$(ORGAN): expected one of $(ORGANS)$(call near,$(ORGAN),$(ORGANS)))
endif

ORGAN_DIR := $(patsubst %/organ.mk,%,$(firstword $(wildcard $(foreach d,$(ORGANS_DIR) $(PIPELINES),$d/$(ORGAN)/organ.mk))))
WORK = $(DATA)/$(ORGAN)/$(RESOLUTION)
# The folder of a boundary set and a material file; plain BC for organ.toml.
case_of = $(WORK)/$(BC)$(if $(filter-out organ,$1),-$1)
CASE = $(call case_of,organ)

# A path of a user's file as a prerequisite, where make wants a backslash before each character that it would read itself, and as one
# word of the shell.
empty :=
prerequisite = $(subst ;,\;,$(subst :,\:,$(subst $(empty) ,\ ,$(strip $1))))
quoted = '$(subst ','\'',$(strip $1))'

.PHONY: pipeline mesh separate show-resolutions new-organ organs
pipeline:

# What an organ is made from stands on the command line or in organ.mk, never in the environment, where other programs have such names.
$(foreach v,IMAGE IMAGES WRAP CASES LABEL LABELS SURFACE UNIT MESH GEOMETRY SHELLS SURFACE_OPTIONS TETRAHEDRA_OPTIONS PRECOMPUTE_OPTIONS RENDER_OPTIONS,\
    $(if $(filter environment,$(origin $v)),$(eval undefine $v)))
include $(ORGAN_DIR)/organ.mk
# What an organ.mk leaves out: the first mesh size, the first boundary set, all scenes, the options of the mesh size.
toml_names = $(basename $(notdir $(sort $(wildcard $(ORGAN_DIR)/$1/*.toml))))
MATERIALS ?= organ
RESOLUTION ?= $(firstword $(RESOLUTIONS))
BC ?= $(firstword $(call toml_names,boundary))
SCENES ?= $(call toml_names,scenes)
SURFACE_OPTIONS ?= $(SURFACE_OPTIONS_$(RESOLUTION))
TETRAHEDRA_OPTIONS ?= $(TETRAHEDRA_OPTIONS_$(RESOLUTION))
PRECOMPUTE_OPTIONS ?= $(PRECOMPUTE_OPTIONS_$(RESOLUTION))

ifeq ($(wildcard $(ORGAN_DIR)/boundary/$(BC).toml),)
$(error BC=$(BC): expected one of $(call toml_names,boundary)$(call near,$(BC),$(call toml_names,boundary)))
endif
# LARGER_RESOLUTIONS: those that a study of all sizes leaves out unless it is asked for them. Of new-organ IMAGES it is the new organs'.
ifeq ($(filter $(RESOLUTION),$(RESOLUTIONS) $(LARGER_RESOLUTIONS))$(filter new-organ,$(MAKECMDGOALS)),)
$(error RESOLUTION=$(RESOLUTION): expected one of $(strip $(RESOLUTIONS) $(LARGER_RESOLUTIONS)))
endif

PICTURES ?= $(addprefix $(CASE)/pictures/,$(addsuffix .png,mesh boundary $(SCENES)))

# The warnings of all steps, of all materials: on the page, and at the end of make. STRICT=1: make ends with an error if there is one.
# A folder that nobody made with new-organ has no report of it; a finer surface is made when somebody looks at it.
WARNINGS = $(PIPELINES)/pictures/case_warnings.py
optional_reports = $(wildcard $(ORGAN_DIR)/new-organ.json $(if $(wildcard $(RENDER_MESH)),$(RENDER_REPORT)))
optional_report = $(addprefix $1=,$(filter %/$2.json,$(optional_reports)))
reports = --reports $(call optional_report,new-organ,new-organ) $(if $(parts)$(MESH),,$(if $(SOURCE),surface=$(WORK)/surface-quality.json)) \
    $(if $(MESH),,mesh=$(WORK)/mesh-quality.json) $(call optional_report,render,render-quality) \
    --cases $(foreach m,$(MATERIALS),$(call case_of,$m))

pipeline: $(CASE)/index.html $(foreach m,$(MATERIALS),$(call case_of,$m)/verified.json \
                                               $(SCENES:%=$(call case_of,$m)/scenes/%/summary.json))
	@echo "$(ORGAN): results in $(WORK); all pictures, figures and warnings: $(CASE)/index.html"
	@$(if $(filter command,$(origin PRECOMPUTE_OPTIONS)),echo "$(ORGAN): PRECOMPUTE_OPTIONS holds for this call of make alone; a line of $(ORGAN_DIR)/organ.mk keeps it:" \
	    $(call quoted,PRECOMPUTE_OPTIONS ?= $(PRECOMPUTE_OPTIONS)))
	@$(PYTHON) $(WARNINGS) $(call quoted,$(ORGAN)) $(reports) $(if $(STRICT),--strict)

# ---- several organs of one image ----------------------------------------------------------------------------------

# LABELS: "5=liver 2=right-kidney". Welded: one mesh with a region for each, which share their triangles where they touch.
# separate: a bundle for each, by the rules and the folder of that organ alone. All are in the frame of the image.
comma := ,
parts := $(foreach l,$(LABELS),$(if $(filter 2,$(words $(subst =, ,$l))),$(lastword $(subst =, ,$l)),\
    $(error LABELS="$(LABELS)": expected VALUE=NAME VALUE=NAME (5=liver 2=right-kidney), found "$l")))
ifneq ($(parts),)
part_bundles = $(parts:%=$(DATA)/$(ORGAN)/%/$(RESOLUTION)/$(BC)/bundle.h5)
.PHONY: $(parts:%=separate-%)
$(parts:%=separate-%): $(call prerequisite,$(IMAGE)) $(BIN)/palpate-precompute
$(parts:%=separate-%): separate-%:
	+$(MAKE) -f $(PIPELINES)/built.mk ORGAN=$(ORGAN)/$* LABELS= RESOLUTION=$(RESOLUTION) BC=$(BC) BIN=$(BIN) DATA=$(DATA) \
	    PYTHON=$(PYTHON) ORGANS_DIR=$(ORGANS_DIR)
$(part_bundles): $(DATA)/$(ORGAN)/%/$(RESOLUTION)/$(BC)/bundle.h5: separate-%
	@test -f $@

# Scenes of all of them together, and their pictures.
WORLDS ?= $(call toml_names,worlds)
worlds = $(WORK)/separate-$(BC)
-include $(wildcard $(worlds)/*.d)
$(worlds)/%/summary.json: $(ORGAN_DIR)/worlds/%.toml $(part_bundles) $(BIN)/palpate-run
	mkdir -p $(worlds)
	$(BIN)/palpate-run $< --make-rule $@ $(worlds)/$*.d $(foreach p,$(parts),--bundle $p=$(DATA)/$(ORGAN)/$p/$(RESOLUTION)/$(BC)/bundle.h5) -o $(@D)
$(worlds)/%.png: $(worlds)/%/summary.json $(addprefix $(PIPELINES)/pictures/,touched.py mesh.py offscreen.py views.py picture_file.py)
	$(PYTHON) $(PIPELINES)/pictures/touched.py $(<D) -o $@

part_reports = $(addprefix $1:new-organ=,$(wildcard $(ORGAN_DIR)/$1/new-organ.json)) $1:surface=$2/surface-quality.json $1:mesh=$2/mesh-quality.json
separate: $(WORK)/separate-$(BC).png $(WORLDS:%=$(worlds)/%/summary.json) $(WORLDS:%=$(worlds)/%.png)
	@echo "$(ORGAN): $(words $(parts)) bundles in one frame: $(part_bundles); all in one picture: $<$(if $(WORLDS),; scenes of all of them: $(worlds))"
	@$(PYTHON) $(WARNINGS) $(call quoted,$(ORGAN)) --reports $(foreach p,$(parts),$(call part_reports,$p,$(DATA)/$(ORGAN)/$p/$(RESOLUTION))) \
	    $(foreach w,$(WORLDS),$w=$(worlds)/$w/summary.json) --cases $(foreach p,$(parts),$p=$(DATA)/$(ORGAN)/$p/$(RESOLUTION)/$(BC)) $(if $(STRICT),--strict)
$(WORK)/separate-$(BC).png: $(part_bundles) $(addprefix $(PIPELINES)/pictures/,organs.py mesh.py \
                            offscreen.py views.py picture_file.py)
	mkdir -p $(@D)
	$(PYTHON) $(PIPELINES)/pictures/organs.py $(part_bundles) -o $@
else
separate:
	$(error separate: expected an organ of several, with LABELS in its organ.mk (ORGAN=upper-abdomen), found ORGAN=$(ORGAN))
endif

# ---- image or surface -> surface -> tetrahedra; geometry -> tetrahedra; or a mesh as it is -------------------------

# What a file is made by beside other files. Make sees files alone: NAME-options.txt changes where one of the variables in
# VARIABLES_OF_NAME has another value than at the last run, so that a mesh of other labels or a bundle of other options is never taken for
# this one. The last run's values and these are then printed. Jobs on several machines may ask at once, so each writes a file of its
# own first. MESH_IS_MADE: of a job that has made the mesh under a lock and does not hold it any more, so that it must not make it anew.
VARIABLES_OF_mesh = IMAGE SURFACE MESH GEOMETRY LABELS SURFACE_OPTIONS SHELLS TETRAHEDRA_OPTIONS
VARIABLES_OF_bundle = IMAGE PRECOMPUTE_OPTIONS
VARIABLES_OF_render = IMAGE SURFACE RENDER_OPTIONS
VARIABLES_OF_page = PICTURES optional_reports
made_by = $(VARIABLES_OF_$(patsubst %-options.txt,%,$(@F)))
.PHONY: force
force:
%-options.txt: force
	@mkdir -p $(@D)
	@now=$@.$$(uname -n).$$$$; printf '%s\n' $(foreach v,$(made_by),$(call quoted,$v = $(strip $($v)))) > $$now; \
	if cmp -s $$now $@; then rm $$now; exit; fi; \
	$(if $(filter mesh-options.txt,$(and $(MESH_IS_MADE),$(@F))),rm $$now; echo "$@: another job has made this mesh with other options; give each of them a DATA of its own" >&2; exit 2;) \
	if [ -f $@ ]; then (diff $@ $$now || true) | sed -n 's,^< ,$(@:-options.txt=) was made with ,p; s,^> ,it is made anew with ,p'; fi; \
	mv $$now $@
MADE_BY = $(WORK)/mesh-options.txt
MESH_IS_MADE ?=
# The programs write which files they have read: data files of a header, what a TOML file names.
-include $(wildcard $(WORK)/*.d $(DATA)/$(ORGAN)/*.d)

SOURCE = $(or $(IMAGE),$(SURFACE))
mesh_results = -o $@ --report $(@D)/mesh-quality.json --make-rule $@ $(@D)/mesh.d
ifneq ($(parts),)
$(WORK)/mesh.msh: $(call prerequisite,$(IMAGE)) $(ORGAN_DIR)/organ.mk $(MADE_BY) $(BIN)/palpate-tetrahedra
	mkdir -p $(@D)
	$(BIN)/palpate-tetrahedra $(call quoted,$(IMAGE)) $(mesh_results) --labels $(call quoted,$(subst $(empty) $(empty),$(comma),$(strip $(LABELS)))) \
	    $(TETRAHEDRA_OPTIONS)
else ifneq ($(SOURCE),)
$(WORK)/surface.ply: $(call prerequisite,$(SOURCE)) $(ORGAN_DIR)/organ.mk $(MADE_BY) $(BIN)/palpate-surface
	mkdir -p $(@D)
	$(BIN)/palpate-surface $(call quoted,$(SOURCE)) -o $@ --report $(@D)/surface-quality.json --make-rule $@ $(@D)/surface.d $(SURFACE_OPTIONS)

# SHELLS: more surfaces of an organ.mk, nested in the first.
$(WORK)/mesh.msh: $(WORK)/surface.ply $(SHELLS) $(MADE_BY) $(BIN)/palpate-tetrahedra
	$(BIN)/palpate-tetrahedra $< $(SHELLS) $(mesh_results) $(TETRAHEDRA_OPTIONS)
# A finer surface to draw over any of the meshes (palpate_scene_skin), where the organ.mk says how fine.
ifdef RENDER_OPTIONS
RENDER_MESH := $(DATA)/$(ORGAN)/render.ply
RENDER_REPORT := $(DATA)/$(ORGAN)/render-quality.json
$(RENDER_MESH): $(call prerequisite,$(SOURCE)) $(ORGAN_DIR)/organ.mk $(DATA)/$(ORGAN)/render-options.txt $(BIN)/palpate-surface
	mkdir -p $(@D)
	$(BIN)/palpate-surface $(call quoted,$(SOURCE)) -o $@ --report $(RENDER_REPORT) --make-rule $@ $(@D)/render.d $(RENDER_OPTIONS)
endif
else ifneq ($(MESH),)
$(WORK)/mesh.msh: $(call prerequisite,$(MESH)) $(MADE_BY)
	mkdir -p $(@D)
	cp $(call quoted,$(MESH)) $@.part
	mv $@.part $@
else
$(WORK)/mesh.msh: $(GEOMETRY) $(ORGAN_DIR)/organ.mk $(MADE_BY) $(BIN)/palpate-tetrahedra
	mkdir -p $(@D)
	$(BIN)/palpate-tetrahedra $< $(mesh_results) $(TETRAHEDRA_OPTIONS)
endif

mesh: $(WORK)/mesh.msh

# For programs that make meshes by these rules: prints the default mesh size, then all of them, coarse to fine, then, behind a
# slash, those of LARGER_RESOLUTIONS.
show-resolutions:
	@echo $(RESOLUTION) $(RESOLUTIONS) / $(LARGER_RESOLUTIONS)

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
-include $(wildcard $1/*.d $1/scenes/*.d)
$1/bundle.h5: $(WORK)/mesh.msh $2 $(ORGAN_DIR)/boundary/$(BC).toml $1/bundle-options.txt $(BIN)/palpate-precompute
	mkdir -p $$(@D)
	set -- $(BIN)/palpate-precompute $$< --organ $2 --boundary $(ORGAN_DIR)/boundary/$(BC).toml \
	    $(if $(IMAGE),--image $(subst $$,$$$$,$(call quoted,$(IMAGE)))) $(if $(MEMORY),--memory $(MEMORY)); \
	ranks=$(or $(RANKS),$(if $(LAUNCH),1,`("$$$$@" --plan --json - $(PRECOMPUTE_OPTIONS) 2> /dev/null || true) | $(USEFUL_RANKS)`)); \
	if [ "$$$${ranks:-1}" -gt 1 ]; then set -- $(MPIEXEC) "$$$$ranks" "$$$$@"; fi; \
	$(LAUNCH) "$$$$@" -o $$@ --json $$(@D)/bundle-report.json --make-rule $$@ $$(@D)/bundle.d $(PRECOMPUTE_OPTIONS)

$1/verified.json: $1/bundle.h5 $(WORK)/mesh.msh $(BIN)/palpate-bundle
	$(BIN)/palpate-bundle verify $$< --mesh $(WORK)/mesh.msh --organ $2 \
	    --boundary $(ORGAN_DIR)/boundary/$(BC).toml $(if $(IMAGE),--image $(subst $$,$$$$,$(call quoted,$(IMAGE)))) \
	    --json > $$@.part
	mv $$@.part $$@

$1/scenes/%/summary.json: $(ORGAN_DIR)/scenes/%.toml $1/verified.json $(BIN)/palpate-run
	mkdir -p $1/scenes
	$(BIN)/palpate-run $$< --make-rule $$@ $1/scenes/$$*.d --bundle $1/bundle.h5 -o $$(@D)
endef
$(foreach m,$(MATERIALS),$(eval $(call case_rules,$(call case_of,$m),$(ORGAN_DIR)/$m.toml)))

# ---- pictures ------------------------------------------------------------------------------------------------------

# An organ.mk has rules for pictures of its own.
DRAW = $(PIPELINES)/pictures
$(CASE)/pictures/mesh.png: $(CASE)/bundle.h5 $(DRAW)/mesh.py $(DRAW)/offscreen.py $(DRAW)/views.py $(DRAW)/picture_file.py
	$(PYTHON) $(DRAW)/mesh.py $< -o $@

$(CASE)/pictures/boundary.png: $(CASE)/bundle.h5 $(DRAW)/boundary.py $(DRAW)/mesh.py $(DRAW)/offscreen.py $(DRAW)/views.py $(DRAW)/picture_file.py
	$(PYTHON) $(DRAW)/boundary.py $< -o $@

# The organ at the largest force of a scene.
$(CASE)/pictures/%.png: $(CASE)/scenes/%/summary.json $(DRAW)/touched.py $(DRAW)/offscreen.py $(DRAW)/views.py $(DRAW)/picture_file.py
	$(PYTHON) $(DRAW)/touched.py $(<D) -o $@

# One page with every picture, the mesh's quality, the certificate and the warnings. A mesh that was given has no report of its own.
$(CASE)/index.html: $(PICTURES) $(foreach m,$(MATERIALS),$(call case_of,$m)/verified.json \
                                                         $(SCENES:%=$(call case_of,$m)/scenes/%/summary.json)) \
                    $(optional_reports) $(CASE)/page-options.txt $(DRAW)/contact_sheet.py $(WARNINGS) $(BIN)/palpate-bundle
	$(PYTHON) $(DRAW)/contact_sheet.py $(CASE) -o $@ --palpate-bundle $(BIN)/palpate-bundle --pictures $(PICTURES) \
	    $(if $(MESH),,--mesh-quality $(WORK)/mesh-quality.json) $(reports)

# ---- a new organ's folder ------------------------------------------------------------------------------------------

# Make takes names and paths from the command line alone: some systems have an environment variable NAME.
option = $(if $(filter command,$(origin $2)),$1 $(call quoted,$($2)))
LABEL ?=
IMAGES ?=
WRAP ?=
ifneq ($(IMAGES),)
# IMAGES: a folder of images, or its files; an organ of each, named as the image's file. CASES: the file with a line of each, for `organs` and
# for jobs of Slurm. Organs that are there stay.
new-organ: $(BIN)/palpate-organ
	$(if $(LABEL),,$(error new-organ: expected LABEL=, the organ's label in all IMAGES))
	mkdir -p $(dir $(CASES))
	BIN=$(BIN) ORGANS_DIR=$(firstword $(ORGANS_DIR)) $(PIPELINES)/slurm/organs_of_images.sh $(call quoted,$(LABEL)) \
	    $(if $(shell [ -d $(call quoted,$(IMAGES)) ] && echo yes),$(call quoted,$(IMAGES)),$(foreach i,$(IMAGES),$(call quoted,$i))) > $(CASES).part
	@mv $(CASES).part $(CASES)
	@echo "wrote $$(wc -l < $(CASES)) organs, and a line of each to $(CASES); next: make -f Makefile.data organs"
else
# WRAP: of a surface that is open or crosses itself: yes, or the radius of the wrapping ball, mm. The wrapped one, in mm, stands beside it.
wrapped = $(shell file=$(call quoted,$(SURFACE)); echo "$${file%.*}")-wrapped.ply
new-organ: $(BIN)/palpate-organ $(if $(WRAP),$(BIN)/palpate-surface)
	@$(if $(WRAP),$(BIN)/palpate-surface $(call quoted,$(SURFACE)) --wrap $(if $(filter-out yes,$(WRAP)),--wrap-mm $(WRAP)) \
	    $(call option,--unit,UNIT) -o $(call quoted,$(wrapped)))
	@$(BIN)/palpate-organ $(call option,--name,NAME) $(call option,--image,IMAGE) $(call option,--label,LABEL) $(call option,--labels,LABELS) \
	    $(if $(WRAP),--surface $(call quoted,$(wrapped)) --unit mm,$(call option,--surface,SURFACE) $(call option,--unit,UNIT)) \
	    $(call option,--mesh,MESH) $(call option,--frame,FRAME) --folder $(firstword $(ORGANS_DIR))
endif

# Every organ of CASES, one after the other; those that fail are named at the end.
CASES ?= $(DATA)/cases
organs: $(addprefix $(BIN)/,palpate-surface palpate-tetrahedra palpate-precompute palpate-bundle palpate-run)
	@test -r $(CASES) || { echo "$(CASES): expected a file of lines ORGAN BC RESOLUTION, as new-organ IMAGES=FOLDER LABEL=1 writes it" >&2; exit 2; }
	+@failed=; while read -r organ bc resolution more <&3; do \
	    $(MAKE) --no-print-directory -f $(PIPELINES)/built.mk ORGAN=$$organ BC=$$bc RESOLUTION=$$resolution BIN=$(BIN) DATA=$(DATA) PYTHON=$(PYTHON) $$more || \
	        failed="$$failed $$organ"; \
	done 3< $(CASES); \
	test -z "$$failed" || { echo "organs: failed:$$failed" >&2; exit 2; }
