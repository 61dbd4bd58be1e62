# dreammat: make help

PYTHON ?= python3
VENV   ?= .venv
RUN    := $(VENV)/bin
DREAMMAT := $(RUN)/dreammat
INSTALL := $(RUN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
VALIDATOR := $(VENV)/.validator
DIFFUSION := $(VENV)/.diffusion
ENGINE  := $(VENV)/.engine
MITSUBA := $(VENV)/.mitsuba
CYCLES  := $(VENV)/.cycles
CHROMIUM := $(VENV)/.chromium
THREE   := $(VENV)/.three

# one job: make asset MESH=chair.obj PROMPT="a carved oak chair" OUT=assets/chair
MESH   ?=
PROMPT ?=
OUT    ?=
# a scene and what its objects are made of: make -j2 scene SCENE=room.glb PROMPTS=prompts.toml
SCENE   ?=
PROMPTS ?=
# a folder of jobs, each a folder with a mesh and a prompt.txt: make -j2 batch JOBS=jobs
JOBS   ?= jobs
# what `make export` writes every asset of JOBS for
FOR    ?= blender
# folder below which `make parts` and `make transfer` find armchair.obj, vintage_fan.glb, babylon_shaderball.glb, avocado.glb, spot.obj and bob_uv.obj
ASSETS ?= assets
# meshes that `make beside` lays beside Cycles and three.js, and what they are made of
BESIDE ?= demo/urn.obj bench/egg.obj bench/drum.obj
STUFF  ?= weathered copper with verdigris in the crevices

# options of each stage, to override on the command line
PREP_OPTIONS       ?=
CONDITIONS_OPTIONS ?=
DISTILL_OPTIONS    ?=
BAKE_OPTIONS       ?=

# recipes read all of these from the environment, so that names may hold blanks, quotes and signs
export MESH PROMPT OUT SCENE PROMPTS JOBS FOR ASSETS PREP_OPTIONS CONDITIONS_OPTIONS DISTILL_OPTIONS BAKE_OPTIONS
OPTIONS = --with prep "$$PREP_OPTIONS" --with conditions "$$CONDITIONS_OPTIONS" \
	--with distill "$$DISTILL_OPTIONS" --with bake "$$BAKE_OPTIONS"

.DELETE_ON_ERROR:
.PHONY: help setup demo test test-workflow test-cluster campaign pages poor hostile uvs parts lint asset batch scene export transfer docs bench beside bounces clean

help:  ## show this list
	@awk -F':.*## ' '/^[a-z-]+:.*## / {printf "  make %-13s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(VENV)/.ready  ## make the virtual environment and install everything into it

$(VENV)/.ready: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10) and "dreammat needs Python 3.10 or newer")'
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable '.[dev,report]'
	@echo "compiling kernels once, for all runs to come"
	@tiny=$$(mktemp -d) && $(RUN)/python examples/urn.py $$tiny/urn.obj && \
	$(DREAMMAT) run $$tiny/urn.obj --prompt copper -o $$tiny -q --with conditions "--views 1 --size 64" \
		--with distill "--steps 1" --with bake "--size 512" && rm -r $$tiny
	@touch $@

# the packages of --guidance sd, which its tests run on a tiny model
$(DIFFUSION): pyproject.toml constraints.txt | $(VENV)/.ready
	$(INSTALL) --editable '.[sd]'
	@touch $@

# the engine of workflow/, which its tests and `make test-workflow` run
$(ENGINE): pyproject.toml | $(VENV)/.ready
	$(INSTALL) --editable '.[batch]'
	@touch $@

# the Khronos glTF validator, where npm can get it; its test says so and skips otherwise
$(VALIDATOR): | $(VENV)/.ready
	@npm install --silent --no-audit --no-fund --prefix $(VENV) gltf-validator >/dev/null 2>&1 || \
	echo "npm cannot install gltf-validator: the test that validates model.glb will be skipped"
	@mkdir -p $(@D) && touch $@

# Chromium, in which report.html is tested: CI installs it where apt can; elsewhere the tests say so and skip without it
$(CHROMIUM): | $(VENV)/.ready
	@command -v chromedriver >/dev/null || { [ -n "$(CI)" ] && { apt-get update && apt-get install -y chromium chromium-driver; } >/dev/null 2>&1; } || \
	echo "no chromium and chromedriver here: the tests of report.html in a browser will be skipped"
	@touch $@

# ------------------------------------------------------------------------------------------ what people type

demo/urn.obj: examples/urn.py | $(VENV)/.ready
	$(RUN)/python $< $@

demo: demo/urn.obj  ## texture a mesh made by the project itself, from nothing to demo/asset
	$(DREAMMAT) run $< --prompt "weathered copper with verdigris in the crevices" -o demo --with conditions "--views 32"
	@echo "look at demo/asset/preview.png; the model is demo/asset/model.glb"

asset: $(VENV)/.ready  ## one mesh and prompt: make asset MESH=chair.obj PROMPT="a carved oak chair"
	@[ -n "$$MESH" ] && [ -n "$$PROMPT" ] || { echo 'usage: make asset MESH=chair.obj PROMPT="a carved oak chair"' >&2; exit 2; }
	@name=$$(basename "$$MESH") && $(DREAMMAT) run "$$MESH" --prompt "$$PROMPT" -o "$${OUT:-assets/$${name%.*}}" $(OPTIONS)

# a target for each folder, by its number, since a target's name cannot hold what a folder's may; of the jobs that -j asks for at once
# as many as fit in memory and cores, and each the cores that are its share
batch: $(VENV)/.ready  ## every folder of JOBS with a mesh and a prompt.txt: make -j2 batch JOBS=jobs
	@count=$$($(FOLDERS) | wc -l); [ $$count -gt 0 ] || { echo "$$JOBS: no folder there holds a prompt.txt" >&2; exit 1; }; \
	room=$$($(DREAMMAT) plan "$$JOBS" --at-once $(OPTIONS)) || exit; \
	asked=$$(echo " $$MAKEFLAGS " | sed -n 's/.* -j\([0-9]*\) .*/\1/p'); \
	case " $$MAKEFLAGS " in *" -j "*) asked=$$room;; esac; \
	once=$${asked:-1}; [ $$once -le $$room ] || { once=$$room; echo "$$once at once: more do not fit in this machine's cores and memory" >&2; }; \
	export OMP_NUM_THREADS=$$((($$(nproc) + once - 1) / once)); \
	export MAKEFLAGS="$$(echo "$$MAKEFLAGS" | sed 's/ *-j[0-9]*\|--jobserver-[a-z]*=[^ ]*//g')"; \
	$(MAKE) --no-print-directory -j$$once $$(seq -f job-%.0f $$count)

FOLDERS = find "$$JOBS" -mindepth 2 -maxdepth 2 -name prompt.txt 2>/dev/null | sort
MESHES  = obj|glb|gltf|fbx|usdz|usdc|usda|usd|ply|stl|off

job-%:
	@prompt=$$($(FOLDERS) | sed -n '$*p'); folder=$$(dirname "$$prompt"); \
	mesh=$$(find "$$folder" -maxdepth 1 -type f | grep -iE '\.($(MESHES))$$' | sort | head -n 1); \
	[ -n "$$mesh" ] || [ ! -f "$$folder/prep.npz" ] || mesh="$$folder/prep.npz"; \
	[ -n "$$mesh" ] || { echo "$$folder: no mesh there ($(MESHES))" >&2; exit 1; }; \
	$(DREAMMAT) run "$$mesh" --prompt "$$(cat "$$prompt")" -o "$$folder" $(OPTIONS)

scene: $(VENV)/.ready  ## every object of a scene, in place, and the scene again: make -j2 scene SCENE=room.glb PROMPTS=prompts.toml
	@[ -n "$$SCENE" ] && [ -n "$$PROMPTS" ] || { echo 'usage: make scene SCENE=room.glb PROMPTS=prompts.toml [OUT=folder]' >&2; exit 2; }
	@name=$$(basename "$$SCENE"); folder="$${OUT:-scenes/$${name%.*}}"; \
	$(DREAMMAT) prep "$$SCENE" --split "$$folder" --prompts "$$PROMPTS" $$PREP_OPTIONS && \
	$(MAKE) --no-print-directory batch JOBS="$$folder" PREP_OPTIONS= && \
	$(DREAMMAT) assemble "$$folder"/*/asset -o "$$folder/scene.glb"

export: $(VENV)/.ready  ## every asset of JOBS for another program: make export JOBS=jobs FOR=unreal
	@for manifest in "$$JOBS"/*/asset/bake.json; do \
	[ -f "$$manifest" ] || { echo "$$JOBS: no folder there holds an asset; make batch JOBS=$$JOBS" >&2; exit 1; }; \
	job=$${manifest%/asset/bake.json}; $(DREAMMAT) export "$$job/asset" -o "$$job/$$FOR" --for "$$FOR" || exit; done

test: $(VENV)/.ready $(VALIDATOR) $(DIFFUSION) $(CHROMIUM)  ## all tests
	NODE_PATH=$(VENV)/node_modules $(RUN)/python -m pytest -q -n 2 --dist loadfile

test-workflow: $(ENGINE)  ## four tiny jobs on the workflow, killed in the middle and run again: the same bytes, nothing twice
	$(RUN)/python -m tests.batch.campaign

test-cluster: $(ENGINE)  ## twenty tiny jobs on Slurm with two virtual nodes here, of which both die once; needs root and Debian's Slurm
	$(RUN)/python -m tests.batch.cluster

campaign: $(VENV)/.ready  ## 1,100 damaged artefacts, and 100 kills at random moments
	OMP_NUM_THREADS=1 $(RUN)/python -m tests.campaign --reads 1000 --damages 100 --kills 100

pages: $(VENV)/.ready  ## every command of every page, as it is written there (some minutes)
	OMP_NUM_THREADS=1 $(RUN)/python -m tests.pages

poor: $(VENV)/.ready  ## doctor and run without GPU, without extras, in 2 GiB, with nothing that can be written but the output
	OMP_NUM_THREADS=1 $(RUN)/python -m tests.poor

hostile: $(VENV)/.ready  ## large meshes that nobody means well with, through prep within their time (half an hour)
	OMP_NUM_THREADS=1 $(RUN)/python -m tests.prep.hostile

uvs: $(VENV)/.ready | $(CYCLES)  ## models laid out in seventeen ways: UVs kept bit for bit, and the same picture in Cycles (half an hour)
	OMP_NUM_THREADS=1 $(RUN)/python -m tests.uv_campaign -o uvs $$(cat $(CYCLES))

parts: $(VENV)/.ready  ## parts with prompts of their own on real models below ASSETS, held against what their words mean
	OMP_NUM_THREADS=1 $(RUN)/python -m tests.parts_campaign --assets "$$ASSETS" -o parts

transfer: $(VENV)/.ready  ## texture transfer of six models, three of them below ASSETS on its meshes (an hour)
	OMP_NUM_THREADS=1 $(RUN)/python -m tests.transfer_campaign --assets "$$ASSETS" -o transfer

lint: $(VENV)/.ready  ## ruff and mypy
	$(RUN)/ruff check .
	$(RUN)/mypy

docs: $(VENV)/.ready  ## the pages as a site in .site; a dead link is an error
	$(INSTALL) --editable '.[docs]'
	$(RUN)/python docs/reference.py
	$(RUN)/mkdocs build --strict --quiet
	@echo "look at .site/index.html"

bench: demo/urn.obj | $(MITSUBA) $(CYCLES)  ## speed against error of the light transport, beside Mitsuba 3 and Cycles
	$(DREAMMAT) prep $< -o demo/prep.npz
	$(DREAMMAT) report conditions demo/prep.npz -o bench $$(cat $(MITSUBA) $(CYCLES))
	@echo "look at bench/conditions.png"
	$(MAKE) beside

bounces: bench/bowl.npz bench/urn.npz | $(MITSUBA)  ## light between surfaces beside Mitsuba's path tracer, six materials (minutes)
	[ ! -s $(MITSUBA) ] || $(RUN)/python -m stages.report.bounces $$(sed 's/--mitsuba //' $(MITSUBA)) bench/bounces.csv studio $^
	@echo "look at bench/bounces.csv"

bench/urn.npz: demo/urn.obj
	$(DREAMMAT) prep $< -o $@

bench/bowl.npz: examples/bowl.py | $(VENV)/.ready
	$(RUN)/python $< bench/bowl.obj && $(DREAMMAT) prep bench/bowl.obj -o $@

bench/egg.obj: examples/convex.py | $(VENV)/.ready
	$(RUN)/python $< bench

bench/drum.obj: bench/egg.obj ;

beside: $(BESIDE) | $(CYCLES) $(THREE) $(CHROMIUM)  ## assets in Cycles and three.js beside their preview: make beside BESIDE="a.obj b.glb"
	@for mesh in $(BESIDE); do name=$$(basename "$${mesh%.*}"); $(MAKE) --no-print-directory asset MESH="$$mesh" OUT="bench/$$name" \
	PROMPT="$(STUFF)" CONDITIONS_OPTIONS='--views 16 --size 128' BAKE_OPTIONS='--size 1024' || exit; done
	[ ! -s $(CYCLES) -a ! -s $(THREE) ] || $(DREAMMAT) report preview -o bench $$(cat $(CYCLES) $(THREE)) \
	$(foreach mesh,$(BESIDE),bench/$(basename $(notdir $(mesh)))/asset)
	@echo "look at bench/preview_*.png: ours, theirs, eight times the difference"

# other renderers, each in a virtual environment of its own; an empty file where it cannot be had or does not run
$(MITSUBA): | $(VENV)/.ready
	@$(PYTHON) -m venv $(VENV)/mitsuba && $(VENV)/mitsuba/bin/python -m pip install --quiet mitsuba numpy && \
	$(VENV)/mitsuba/bin/python -c 'import mitsuba; mitsuba.set_variant("llvm_ad_rgb"); print(mitsuba.Float(1) + 1)' >/dev/null && \
	echo --mitsuba $(VENV)/mitsuba/bin/python > $@ || { echo "mitsuba does not run here: no side-by-side with it"; : > $@; }

$(CYCLES): | $(VENV)/.ready
	@$(PYTHON) -m venv $(VENV)/cycles && $(VENV)/cycles/bin/python -m pip install --quiet 'bpy>=4.2,<5' && \
	$(VENV)/cycles/bin/python -c 'import bpy' && \
	echo --cycles $(VENV)/cycles/bin/python > $@ || { echo "bpy does not run here: no side-by-side with Cycles"; : > $@; }

$(THREE): | $(VENV)/.ready
	@npm install --silent --no-audit --no-fund --prefix $(VENV) three >/dev/null 2>&1 && command -v chromium >/dev/null && \
	echo --three $(VENV)/node_modules > $@ || { echo "no three.js or no chromium here: no side-by-side with it"; : > $@; }

clean:  ## remove the virtual environment and the demo
	rm -rf $(VENV) demo
