# Occlusion Bake. `make help` lists what there is; everything runs in one virtual environment, made on first use.

VENV ?= .venv
# A venv that is there keeps its Python unless another is asked for.
PYTHON ?= $(if $(wildcard $(VENV)/.python-*),$(PY),python3)

BIN = $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
PY = $(BIN)/python
RELEASE := $(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null)
RELEASES := 3.11 3.13
REQUIREMENTS := requirements/common.txt $(wildcard requirements/py$(subst .,,$(RELEASE)).txt)

# A profile build (OCCLUSION_KERNEL_PROFILE=1) lies beside the plain one and takes its place in the venv.
PROFILE := $(if $(filter-out 0,$(OCCLUSION_KERNEL_PROFILE)),-profile)
WHEEL := build/kernel$(PROFILE)
KERNEL := $(wildcard $(addprefix core/kernel/,*.py *.toml src/*.cpp src/*.h include/*.h occlusion_bake_kernel/*.py)) \
	blender_manifest.toml

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help venv test lint extension extensions try-extension repository try-repository farm windows windows-zip windows-kernel arm64 release pictures sanitize bake bench bench-quick figures accuracy study clean

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 20
	@echo "  PYTHON=python3.13 chooses the Python ($(RELEASES)), VENV=folder the environment (.venv)"

venv: $(VENV)/.kernel$(PROFILE) ## the virtual environment: Blender as a module, the tools, the kernel

# Workers take over from one another what is not begun. One that hangs or crashes ends the run, as it would alone.
WORKERS ?= 2
test: venv ## the whole suite, by two workers; WORKERS=8 for others
	$(PY) -m pytest -q -n $(WORKERS) --dist worksteal --max-worker-restart 0

lint: venv ## ruff, mypy, import-linter, clang-tidy; every warning is an error
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	MYPYPATH=$(VENV)/dev $(BIN)/mypy $(addprefix -p occlusion_bake.,core addon bench samples tests.oracles)
	MYPYPATH=$(VENV)/dev:tools:core/kernel $(BIN)/mypy --explicit-package-bases $(wildcard tools/*.py)
	PYTHONPATH=$(VENV)/dev $(BIN)/lint-imports --no-cache
	$(PY) tools/check_kernel.py tidy
	$(PY) tools/check_workflows.py

extension: venv ## dist/occlusion_bake-VERSION-PLATFORM.zip, to install in Blender
	@rm -f dist/*.zip
	$(PY) tools/build_extension.py $(WHEEL)

BLENDER ?= blender
# Built on Linux for all of Blender's platforms, by a compiler that brings along what each needs.
PLATFORMS := linux-x64 windows-x64 windows-arm64 macos-arm64 macos-x64
KERNELS := $(foreach platform,$(PLATFORMS),build/kernel-$(platform)/.built)
extensions: $(KERNELS) ## the same for Linux, Windows and macOS, each kernel checked
	@rm -f dist/*.zip
	$(PY) tools/check_libraries.py $(foreach built,$(KERNELS),$(dir $(built))*.whl)
	$(foreach platform,$(PLATFORMS),$(PY) tools/build_extension.py build/kernel-$(platform) $(platform) &&) true

repository: extensions ## dist/repository, a folder for a web host that Blender installs and updates from
	$(PY) tools/make_repository.py dist/repository $(foreach platform,$(PLATFORMS),dist/*-$(subst -,_,$(platform)).zip)

ZIP ?= $(firstword $(wildcard dist/*.zip))
try-extension: $(VENV)/.requirements ## install ZIP into Blender as a module, and bake with it
	$(PY) tools/try_extension.py $(ZIP) --bpy $(PY)

try-repository: extension ## add a repository, install, update and remove the extension in a complete Blender: BLENDER=blender
	$(PY) tools/try_repository.py dist/*.zip $(BLENDER)

farm: venv $(VENV)/.farm ## a plan shared out by openjd and by Slurm, a task killed, a node drained: the bytes of one run
	$(PY) tools/try_farm.py

WINDOWS := build/kernel-windows-x64
windows: windows-zip ## Windows by Wine: the kernel's tests, the zip in Blender, the suite; skipped where Wine cannot be had
	$(PY) tools/foreign.py windows-x64 suite -n $(WORKERS) --dist worksteal tests/core tests/addon

windows-zip: windows-kernel
	@rm -f dist/*-windows_x64.zip
	$(PY) tools/build_extension.py $(WINDOWS) windows-x64
	$(PY) tools/foreign.py windows-x64 extension dist/*-windows_x64.zip
	$(PY) tools/foreign.py windows-x64 bits

windows-kernel: venv $(WINDOWS)/.built
	$(PY) tools/check_libraries.py $(WINDOWS)/*.whl
	$(PY) tools/foreign.py windows-x64 kernel

arm64: venv build/kernel-linux-arm64/.built ## processors like those of Macs, by qemu: the kernel's tests, and the same bits
	$(PY) tools/foreign.py linux-arm64 kernel
	$(PY) tools/foreign.py linux-arm64 bits

release: repository ## all that a release needs, checked: zips, repository, checksums, bill of materials
	$(PY) tools/release.py dist/repository dist/*.zip

build/kernel-%/.built: $(KERNEL) $(VENV)/.platforms
	@rm -rf $(@D)
	SOURCE_DATE_EPOCH=315532800 OCCLUSION_KERNEL_PROFILE=0 OCCLUSION_KERNEL_TARGET=$* $(PY) -m pip wheel -q --no-deps --no-build-isolation --wheel-dir $(@D) ./core/kernel
	@touch $@

pictures: extension ## the README's pictures of the window, from a session in a complete Blender: BLENDER=blender
	$(PY) tools/try_window.py dist/*.zip blender $(BLENDER)
	cp out/window/blender_baking.png docs/pictures/window.png
	cp out/window/blender_compared.png docs/pictures/compared.png
	cp out/window/blender_queue.png docs/pictures/queue.png

sanitize: venv ## the kernel's own tests and fuzzed bakes under the address and undefined-behaviour sanitizers
	$(PY) tools/check_kernel.py sanitize
	$(PY) tools/sanitize_fuzz.py --seed 20261126 # the same cases each time; make accuracy draws new ones

bake: venv ## bake the sample scenes
	$(PY) -m occlusion_bake.samples.bake

bench: venv $(VENV)/.bench ## seconds against error of ours and of others, into bench/RESULTS.md: hours; what options cost, how codes err, what large levels cost
	$(PY) -m occlusion_bake.bench.versus
	$(PY) -m occlusion_bake.bench.versus --maps ro_10 ro_100 --sizes 1024
	$(PY) -m occlusion_bake.bench.options
	$(PY) -m occlusion_bake.bench.directional
	$(PY) -m occlusion_bake.bench.size

bench-quick: venv ## the same of two scenes, small, in three minutes; into build/versus/QUICK.md
	$(PY) -m occlusion_bake.bench.versus --quick

figures: venv ## draw the figures of the documentation from measurements
	$(PY) -m occlusion_bake.bench.figures

accuracy: venv ## exact answers, a second opinion, Cycles, hard cases, fuzzing: the long forms, for hours
	$(PY) -m occlusion_bake.bench.accuracy
	$(PY) -m occlusion_bake.bench.accuracy.hard

study: venv ## how the estimators converge: plots, pictures, a page
	$(PY) -m occlusion_bake.bench.study

clean: ## remove what was built; the virtual environments stay
	rm -rf build dist core/kernel/build core/kernel/*.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis

$(VENV)/.python-$(RELEASE):
	$(if $(filter $(RELEASES),$(RELEASE)),,$(error $(PYTHON) is $(if $(RELEASE),Python $(RELEASE),no Python that runs); \
	Blender as a module needs 3.11 or 3.13: make venv PYTHON=python3.11))
	@if [ -e $(VENV) ]; then echo "$(VENV) was made by another Python: making it again with $(RELEASE)"; fi
	@rm -rf $(VENV)
	$(PYTHON) -m venv $(VENV)
	@$(PY) tools/link_checkout.py $(VENV)/dev
	@touch $@

$(VENV)/.requirements: $(VENV)/.python-$(RELEASE) $(REQUIREMENTS)
	$(PY) -m pip install -q --disable-pip-version-check -r $(lastword $(REQUIREMENTS))
	bash tools/blender_libraries.sh $(PY)
	@touch $@

$(WHEEL)/.built: $(KERNEL) | $(VENV)/.requirements
	@$(PY) core/kernel/toolchain.py
	@rm -rf $(WHEEL)
	$(PY) -m pip wheel -q --no-deps --no-build-isolation --wheel-dir $(WHEEL) ./core/kernel
	@touch $@

$(VENV)/.platforms: requirements/platforms.txt $(VENV)/.requirements
	$(PY) -m pip install -q --disable-pip-version-check --no-deps -r $<
	@touch $@

$(VENV)/.farm: requirements/farm.txt $(VENV)/.requirements
	$(PY) -m pip install -q --disable-pip-version-check -r $(lastword $(REQUIREMENTS)) -r $<
	@touch $@

# Large, and wants libraries of the system's: the bench says so and goes on without it.
$(VENV)/.bench: requirements/bench.txt $(VENV)/.requirements
	-$(PY) -m pip install -q --disable-pip-version-check -r $(lastword $(REQUIREMENTS)) \
		-r requirements/bench.txt
	@touch $@

$(VENV)/.kernel$(PROFILE): $(VENV)/.requirements $(WHEEL)/.built
	$(PY) -m pip install -q --disable-pip-version-check --no-deps --force-reinstall $(WHEEL)/*.whl
	@rm -f $(VENV)/.kernel*
	@touch $@
