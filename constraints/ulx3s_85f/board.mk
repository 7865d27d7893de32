# SPDX-License-Identifier: Apache-2.0
# ULX3S with LFE5U-85F. Load it with: openFPGALoader -b ulx3s build/boards/ulx3s_85f/moire.bit
PART := --85k --package CABGA381 --speed 6
MHZ  := 50
include constraints/ecp5.mk
