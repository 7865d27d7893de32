// SPDX-License-Identifier: Apache-2.0
// shift_delay -- delay a shift of the origin by one cycle, for blocks behind the segment table.
//
// latency  1 cycle
// rate     one shift per cycle
// model    tb/position/shift_delay.py, equal in every bit of every cycle
`default_nettype none

module shift_delay (
    input  wire                clk,
    input  wire                rst,
    input  wire                shift,           // strobe: move the origin by shift_periods
    input  wire signed  [31:0] shift_periods,   // period
    output logic               shifted,         // strobe: shift, one cycle later
    output logic signed [31:0] shifted_periods  // period; holds its value until the next shift
);
    always_ff @(posedge clk) begin
        shifted <= shift && !rst;
        if (shift) shifted_periods <= shift_periods;
    end
endmodule

`default_nettype wire
