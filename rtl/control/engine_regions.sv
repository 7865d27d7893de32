// SPDX-License-Identifier: Apache-2.0
// engine_regions -- report which part of the microcode a line belongs to, for the proof of
// engine_sequencer.
//
// latency   0 cycles, combinational
// rate      one line per cycle
// model     tb/control/engine_regions.py, equal for every line
// made      by tables/engine_microcode.py, not to be edited
`default_nettype none

module engine_regions (
    input wire [9:0] line,  // number of a line
    output logic [2:0] region  // 0 idle, 1 idle and service, 2 service, 3 to the next axis, 4 begin
);
    always_comb begin
        region = 3'd0;
        if (line >= 10'd44 && line <= 10'd44) region = 3'd4;  // enter
        if (line >= 10'd45 && line <= 10'd50) region = 3'd2;  // serve
        if (line >= 10'd53 && line <= 10'd62) region = 3'd1;  // shared
        if (line >= 10'd89 && line <= 10'd94) region = 3'd1;  // shared
        if (line >= 10'd109 && line <= 10'd632) region = 3'd2;  // serve
        if (line >= 10'd633 && line <= 10'd635) region = 3'd3;  // leave
    end
endmodule

`default_nettype wire
