# SPDX-License-Identifier: Apache-2.0
# `make` says what there is to do.
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-print-directory --no-builtin-rules

VENV   := build/venv
PYTHON := $(VENV)/bin/python
SETUP  := $(VENV)/stamp
JOBS   ?= 2
export PATH := $(CURDIR)/$(VENV)/bin:$(PATH)
# each of the hundreds of simulations and commands imports what was compiled once
export PYTHONDONTWRITEBYTECODE :=

RTL      := $(shell find rtl -name '*.sv' | sort)
# tops of figures; the one of the Ethernet core contains what LiteX generates
BENCHES  := $(filter-out %/ethernet_bench.sv,$(wildcard sw/figures/*_bench.sv))
LINTED   := $(patsubst %.sv,build/lint/%.ok,$(RTL) $(BENCHES))
FIRMWARE := build/firmware/firmware.hex
LITEX    := build/litex/stamp
GOWIN    := build/gowin/stamp
DOCS     := build/docs_tools/stamp
MUTATORS := build/mutators/stamp
LOADER_STAMP := build/loader/stamp
UPLOT    := sw/host/moire/web/uplot/integrity

say = @printf '%s\n' '--- $(1)'

help:             ## this list
	@printf 'make TARGET, with TARGET one of\n\n'
	@sed -nE 's/^([a-z]+): [^#]*## (.*)/  \1\t\2/p; s/^([a-z]+): *## (.*)/  \1\t\2/p' $(MAKEFILE_LIST) | sort -u -k1,1 | expand -t 14
	@printf '\nThe first target that needs them fetches the tools into build/venv (tools/setup.sh).\n'

demo: $(SETUP) $(FIRMWARE) $(UPLOT)   ## the S0 stage: home it, move it, show where it went
	@$(PYTHON) -m experiments.s0_stage

test: $(SETUP) $(FIRMWARE) $(UPLOT)   ## all tests; K=part of a name, SIM=icarus|verilator, SEED=number|random, WAVES=1, NETLIST=ecp5|ice40, CROSSINGS=seed
	$(call say,tests$(if $K, of $K)$(if $(SIM), under $(SIM))$(if $(NETLIST), on netlists for $(NETLIST))$(if $(SEED), with SEED=$(SEED)))
	@SIM='$(SIM)' SEED='$(SEED)' WAVES='$(WAVES)' NETLIST='$(NETLIST)' POWER_UP='$(POWER_UP)' CROSSINGS='$(CROSSINGS)' $(PYTHON) -m pytest -q -n $(JOBS) --dist loadfile --no-loadscope-reorder $(if $K,-k '$K') tb

check: fresh lint proofs test quick  ## what every change must pass
	@echo 'check: all passed'

# what has one long part and many short ones, side by side
proofs: $(SETUP)
	@$(MAKE) -j$(JOBS) --output-sync=target promises prove

promises: $(SETUP)  ## what the project promises of its code: units, latencies, size casts, imports, tests, types
	$(call say,promises: columns; units of ports; latencies; size casts; imports; tests that can fail; strict types)
	@printf '%s\n' $(PROMISES) | xargs -P $(JOBS) -I{} $(PYTHON) -m tools.check_{}
PROMISES := types imports tests columns ports latency casts

lint: $(SETUP)   ## verilator -Wall over every module and bench, ruff over the Python, the layout of all code
	$(call say,lint: verilator -Wall over $(words $(RTL)) modules and $(words $(BENCHES)) benches; ruff; the formatters)
	@$(MAKE) -k -j$(JOBS) $(LINTED)
	@$(PYTHON) -m ruff check -q --output-format concise .
	@$(PYTHON) -m ruff format -q --check .
	@$(CLANG_FORMAT) --dry-run -Werror $(C_SOURCES)
	@$(VERIBLE) --verify --inplace $(SV_SOURCES)

types: $(SETUP)  ## mypy --strict over all Python that ships or measures
	$(call say,types: mypy)
	@$(PYTHON) -m tools.check_types

format: $(SETUP) ## lay out all code as `make lint` wants it
	@$(PYTHON) -m ruff format -q .
	@$(CLANG_FORMAT) -i $(C_SOURCES)
	@$(VERIBLE) --inplace $(SV_SOURCES)

C_SOURCES    = $(shell git ls-files '*.c' '*.h' '*.cpp' ':!sw/firmware/made' ':!sw/linuxcnc/made')
SV_SOURCES   = $(shell git ls-files '*.sv')
CLANG_FORMAT = $(VENV)/bin/clang-format
VERIBLE      = $(VENV)/bin/verible-verilog-format --flagfile=tools/verible.flags

VERILATOR = VERILATOR_ROOT=$$(echo $(CURDIR)/$(VENV)/lib/python3*/site-packages/verilator); \
            $$VERILATOR_ROOT/bin/verilator_bin
ROOMS     = $(foreach d,$(sort $(dir $(RTL))),-y $d) -y $$VERILATOR_ROOT/../pythondata_cpu_picorv32/verilog -y $$VERILATOR_ROOT/../pythondata_cpu_serv/verilog/rtl

build/lint/%.ok: %.sv $(RTL) rtl/cpu/cores.vlt Makefile | $(SETUP)
	@mkdir -p $(@D)
	@export $(VERILATOR) --lint-only -Wall --quiet --timescale 1ns/1ps $(ROOMS) +libext+.sv+.v --top-module $(*F) rtl/cpu/cores.vlt $< \
		> $@.log 2>&1 && ! grep -q . $@.log || { cat $@.log; false; }
	@touch $@

prove: $(SETUP)   ## the properties in the modules that carry any; K=part of a path
	$(call say,proofs)
	@$(PYTHON) -m tools.prove $(if $K,-k '$K') -j $(JOBS)

LATE       := tables/linuxcnc.py tables/commands.py tables/faults.py tables/modules.py tables/readme_figures.py # read what others make
GENERATORS := $(filter-out tables/__init__.py tables/made_files.py $(LATE),$(sort $(wildcard tables/*.py))) $(LATE)
module      = $(subst /,.,$(basename $(1)))
tables: $(SETUP)  ## write the made files again: registers, line, tables of numbers, the list of modules
	@for table in $(call module,$(GENERATORS)); do $(PYTHON) -m $$table || exit 1; done

fresh: $(SETUP)
	$(call say,made files are fresh)
	@printf '%s\n' $(call module,$(GENERATORS)) | xargs -P $(JOBS) -I{} $(PYTHON) -m {} --check

firmware: $(SETUP)   ## the soft core's program, build/firmware/firmware.hex; BOARD=x MACHINE=y: into the bitstream of `make board`
	@$(if $(BOARD)$(MACHINE),$(PYTHON) -m boards.build --firmware --board '$(BOARD)' --machine '$(MACHINE)',$(PYTHON) -m firmware.build --out build/firmware)

$(FIRMWARE): $(shell find sw/firmware -type f) | $(SETUP)
	$(call say,firmware)
	@$(PYTHON) -m firmware.build --out build/firmware

FORM = $(if $(QUICK),--quick) $(if $(SEED),--seed $(SEED))

figure: $(SETUP) $(FIRMWARE) $(UPLOT)   ## NAME=x measures one figure: `x VALUE UNIT`; QUICK=1 in short, SEED=n
	@$(PYTHON) -m figures.figure $(or $(NAME),$(error say which: make figure NAME=x)) $(FORM)

quick: $(SETUP) $(FIRMWARE) $(UPLOT)    ## every figure in its short form
	$(call say,figures in their short forms)
	@$(PYTHON) -m figures.figure --all --quick

figures: $(SETUP) $(FIRMWARE) $(UPLOT)  ## all figures, and their page; QUICK=1 in their short forms
	@$(PYTHON) -m figures.figure --all $(FORM)

SOAK = $(if $(LIST),--list) $(if $(SCHEDULER),--scheduler '$(SCHEDULER)') $(if $(RESULTS),--results '$(RESULTS)') \
       $(if $(WORKERS),--workers $(WORKERS)) $(if $(SEED),--seed $(SEED)) $(if $(SCALE),--scale $(SCALE)) \
       $(if $(MINUTES),--minutes $(MINUTES)) $(if $(PART),--part $(PART))

soak: $(SETUP) $(FIRMWARE)     ## the long campaigns: K=names, SCHEDULER=tcp://… of a cluster, RESULTS=url; docs/campaigns.md
	@$(PYTHON) -m campaigns.soak $K $(SOAK)

coverage: $(SETUP) $(FIRMWARE) ## what the tests reach of RTL, firmware and host: docs/coverage.md and figures; MINUTES=n
	@$(PYTHON) -m code_coverage --jobs $(JOBS) $(if $(MINUTES),--minutes $(MINUTES))
	@$(PYTHON) -m figures.figure coverage_line_pct coverage_branch_pct

load: $(SETUP)    ## the bitstream of `make board` into a board, until power-off: BOARD=x MACHINE=y; OPTIONS=… of openFPGALoader
	@$(PYTHON) -m boards.load --board '$(BOARD)' --machine '$(MACHINE)' -- $(OPTIONS)

flash: $(SETUP)   ## the same into the flash of the board
	@$(PYTHON) -m boards.load --flash --board '$(BOARD)' --machine '$(MACHINE)' -- $(OPTIONS)

board: $(SETUP)   ## the bitstream and the wiring page of a machine on a board: BOARD=x MACHINE=y; docs/boards.md
	@$(PYTHON) -m boards.build --board '$(BOARD)' --machine '$(MACHINE)' $(if $(SEED),--seed $(SEED))

boards: $(SETUP)  ## all machines on all boards placed with 3 seeds into docs/placements.toml, for hours; K=names, SEEDS=n, MINUTES=n; docs/boards.md
	@$(PYTHON) -m boards.placements $K --jobs $(JOBS) $(if $(SEEDS),--seeds $(SEEDS)) $(if $(MINUTES),--minutes $(MINUTES))

docs: $(DOCS)     ## the pages and the reference of the host package as a site in build/docs/site, every link checked
	@$(PYTHON) -m tools.docs_site

$(DOCS): tools/docs.lock | $(SETUP)
	@rm -rf $(@D)
	@$(PYTHON) -m pip --disable-pip-version-check --no-input -q install --no-deps --target $(@D) -r $<
	@touch $@

mutators: $(MUTATORS)   ## Cosmic Ray and libclang into build/mutators, for mutants of host and firmware; docs/mutation.md

$(MUTATORS): sw/mutation/mutators.lock | $(SETUP)
	@rm -rf $(@D)
	@$(PYTHON) -m pip --disable-pip-version-check --no-input -q install --no-deps --target $(@D) -r $<
	@touch $@

sigrok:           ## sigrok-cli by apt-get, for the figure ps2_bytes_wrong and the tests that let it judge waveforms
	@command -v sigrok-cli > /dev/null || { mkdir -p build; $(AS_ROOT) apt-get -q update && $(AS_ROOT) env DEBIAN_FRONTEND=noninteractive \
		apt-get -qy install --no-install-recommends sigrok-cli; } > build/sigrok.log 2>&1 < /dev/null \
		|| { echo "apt-get could not install sigrok-cli, see build/sigrok.log: install it and run this again" >&2; false; }

litex: $(LITEX)   ## LiteX and LiteEth into build/litex, for sw/embed/litex_soc.py and the link over Ethernet; docs/embedding.md, docs/link.md

$(LITEX): sw/embed/litex.lock tools/scapy.lock | $(SETUP)
	@rm -rf $(@D)
	@$(PYTHON) -m pip --disable-pip-version-check --no-input -q install --no-deps --target $(@D) -r $<
	@$(PYTHON) -m pip --disable-pip-version-check --no-input -q install --no-deps -r tools/scapy.lock
	@touch $@

page: $(SETUP)    ## uPlot (npm), which draws the plots of the live page, into sw/host/moire/web/uplot; docs/page.md
	@$(PYTHON) -m tools.page

# what needs no plots goes on without them, and the next run tries again
$(UPLOT): sw/host/moire/web/package-lock.json | $(SETUP)
	@$(PYTHON) -m tools.page --try

chromium: $(SETUP) ## Chromium by apt-get, and Playwright, which drives it in the tests of the live page; docs/page.md
	@command -v chromium > /dev/null || { $(AS_ROOT) apt-get -q update && $(AS_ROOT) env DEBIAN_FRONTEND=noninteractive \
		apt-get -qy install --no-install-recommends chromium fonts-dejavu-core; } > build/chromium.log 2>&1 < /dev/null \
		|| { echo "apt-get could not install chromium, see build/chromium.log: install it and run this again" >&2; false; }
	@$(PYTHON) -m pip --disable-pip-version-check --no-input -q install --no-deps -r tools/chromium.lock

ngspice:          ## ngspice by apt-get, for `make spice`; docs/front_ends.md
	@command -v ngspice > /dev/null || { mkdir -p build; $(AS_ROOT) apt-get -q update && $(AS_ROOT) env DEBIAN_FRONTEND=noninteractive \
		apt-get -qy install --no-install-recommends ngspice; } > build/ngspice.log 2>&1 < /dev/null \
		|| { echo "apt-get could not install ngspice, see build/ngspice.log: install it and run this again" >&2; false; }

linuxcnc:         ## LinuxCNC by apt-get, for the driver in sw/linuxcnc and its tests; docs/linuxcnc.md
	@command -v linuxcnc > /dev/null && command -v halcompile > /dev/null && [ -e /usr/include/zlib.h ] || { mkdir -p build; \
		{ $(AS_ROOT) apt-get -q update && $(AS_ROOT) env DEBIAN_FRONTEND=noninteractive \
		apt-get -qy install --no-install-recommends linuxcnc-uspace linuxcnc-uspace-dev zlib1g-dev; } > build/linuxcnc.log 2>&1 < /dev/null \
		|| { echo "apt-get could not install linuxcnc-uspace, linuxcnc-uspace-dev and zlib1g-dev, see build/linuxcnc.log: install them and run this again" >&2; false; }; }

spice: $(SETUP) ngspice   ## the 1 Vpp front end checked with ngspice; its numbers for the twin; docs/front_ends.md
	@$(PYTHON) -m boards.spice

AS_ROOT = $$([ "$$(id -u)" = 0 ] || echo sudo -n)

gowin: $(GOWIN)   ## placement and bitstreams for Gowin parts into build/gowin, for `make board`; docs/boards.md

$(GOWIN): sw/boards/gowin.lock | $(SETUP)
	@rm -rf $(@D)
	@$(PYTHON) -m pip --disable-pip-version-check --no-input -q install --no-deps --target $(@D) -r $<
	@touch $@

loader: $(LOADER_STAMP) ## openFPGALoader into build/loader, for `make load` and `make flash`; docs/boards.md

$(LOADER_STAMP): sw/boards/loader.lock | $(SETUP)
	@rm -rf $(@D)
	@$(PYTHON) -m pip --disable-pip-version-check --no-input -q install --no-deps --target $(@D) -r $<
	@ldconfig -p | grep -q libftdi1.so.2 || { $(AS_ROOT) apt-get -q update && $(AS_ROOT) env DEBIAN_FRONTEND=noninteractive \
		apt-get -qy install --no-install-recommends libftdi1-2; } > build/loader.log 2>&1 < /dev/null \
		|| { echo "apt-get could not install libftdi1-2, see build/loader.log: install it and run this again" >&2; false; }
	@touch $@

clean:            ## remove what was built; the tools in build/venv stay (rm -rf build removes them too)
	@[ ! -d build ] || find build -mindepth 1 -maxdepth 1 ! -name venv -exec rm -rf {} +
	@find . -name __pycache__ -not -path './build/*' -prune -exec rm -rf {} +
	@echo 'clean: build/venv stays; rm -rf build removes it too'

$(SETUP): requirements.lock pyproject.toml sw/host/pyproject.toml tools/setup.sh
	@tools/setup.sh

.PHONY: help demo test check proofs lint types promises format prove tables fresh firmware figure quick figures soak coverage board boards load flash docs litex mutators sigrok gowin loader linuxcnc chromium page ngspice spice clean
