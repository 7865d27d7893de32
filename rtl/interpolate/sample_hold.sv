// SPDX-License-Identifier: Apache-2.0
// sample_hold -- hold the last sample and the last phase of one axis, as an interpolation_chain of
// several axes computes them.
//
// latency  1 cycle from sampled to sin and cos, and from tracked to phase
// rate     one sample per cycle
// model    tb/interpolate/sample_hold.py, equal in every bit of every cycle
`default_nettype none

module sample_hold #(
    parameter int W = 8  // bits of a sample
) (
    input  wire                 clk,
    // from the chain
    input  wire                 sampled,        // strobe: sampled_sin and sampled_cos are new
    input  wire signed  [W-1:0] sampled_sin,    // ADC counts
    input  wire signed  [W-1:0] sampled_cos,    // ADC counts
    input  wire                 tracked,        // strobe: tracked_phase is new
    input  wire         [ 15:0] tracked_phase,  // 2^-16 period
    // last values of this axis
    output logic signed [W-1:0] sin,            // ADC counts
    output logic signed [W-1:0] cos,            // ADC counts
    output logic        [ 15:0] phase           // 2^-16 period
);
    always_ff @(posedge clk) begin
        if (sampled) {sin, cos} <= {sampled_sin, sampled_cos};
        if (tracked) phase <= tracked_phase;
    end
endmodule

`default_nettype wire
