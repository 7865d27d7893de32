// SPDX-License-Identifier: Apache-2.0
// interpolator_bench -- samples to position, the way axis.sv strings the blocks together.
`default_nettype none

module interpolator_bench #(
    parameter int W = 8                         // bits of a sample
) (
    input  wire                  clk,
    input  wire                  rst,
    input  wire                  valid,         // strobe: sin and cos are a new sample
    input  wire signed [W-1:0]   sin,           // full scale = 2^(W-1)
    input  wire signed [W-1:0]   cos,
    output logic                 done,          // strobe: position is that of a new sample
    output logic signed [47:0]   position,      // Q32.16 periods
    output logic                 overspeed      // strobe
);
    wire               found, stepped;
    wire        [15:0] phase;
    wire signed [16:0] step;

    arctan_table #(.W(W)) u_arctan (.clk, .rst, .valid, .sin, .cos, .done(found), .phase);
    fringe_tracker u_tracker (.clk, .rst, .valid(found), .phase, .done(stepped), .step, .overspeed);
    unwrap u_position (.clk, .rst, .valid(stepped), .step, .phase, .shift(1'b0), .shift_periods(32'sd0), .done, .position);
endmodule

`default_nettype wire
