// SPDX-License-Identifier: Apache-2.0
// position_source -- select what the position is made of: the phases of sine and cosine, or the
// counts of A and B.
//
// latency  0 cycles, combinational
// rate     one step per cycle
// behaviour  Without sine and cosine the position is made of counts, whatever the setting says.
//          While it is made of counts, the ADC is not started.
// model    tb/position/position_source.py, equal for all inputs
`default_nettype none

module position_source #(
    parameter int HAS_SINE = 1  // 0: sine and cosine are not built
) (
    input  wire                use_counts,     // setting: the position is made of counts
    input  wire                sample_tick,    // strobe: take a sample
    input  wire                tracked,        // strobe: tracked_step leads to tracked_phase
    input  wire signed  [16:0] tracked_step,   // 2^-16 period
    input  wire         [15:0] tracked_phase,  // 2^-16 period
    input  wire                counted,        // strobe: counted_step leads to counted_phase
    input  wire signed  [16:0] counted_step,   // 2^-16 period
    input  wire         [15:0] counted_phase,  // 2^-16 period
    output logic               by_counts,      // level: the position is made of counts
    output logic               convert,        // strobe: start the ADC
    output logic               valid,          // strobe: step leads to phase
    output logic signed [16:0] step,           // 2^-16 period
    output logic        [15:0] phase           // 2^-16 period
);
    assign by_counts = use_counts || HAS_SINE == 0;
    assign convert   = sample_tick && !by_counts;
    assign valid     = by_counts ? counted : tracked;
    assign step      = by_counts ? counted_step : tracked_step;
    assign phase     = by_counts ? counted_phase : tracked_phase;
endmodule

`default_nettype wire
