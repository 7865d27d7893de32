// SPDX-License-Identifier: Apache-2.0
// tracking_bench -- test bench: phase and comparator count of one scale to position and its two
// alarms, with the blocks connected as in axis.sv.
//
`default_nettype none

module tracking_bench (
    input  wire                clk,
    input  wire                rst,          // level: position becomes 0
    input  wire         [19:0] limit,        // 2^-16 period
    input  wire                valid,        // strobe: phase is new
    input  wire         [15:0] phase,        // 2^-16 period
    input  wire signed  [31:0] count,        // 1/4 period
    output logic               done,         // strobe: position belongs to a new phase
    output logic signed [47:0] position,     // Q32.16 periods
    output logic               overspeed,    // strobe: the speed is too high
    output logic               disagreement  // level: position and count disagree
);
    wire               stepped;
    wire signed [16:0] step;
    wire        [15:0] tracked_phase;

    fringe_tracker u_tracker (
        .clk,
        .rst,
        .valid,
        .axis     (1'b0),
        .phase,
        .done     (stepped),
        .step,
        .phase_out(tracked_phase),
        .overspeed
    );
    unwrap u_position (
        .clk,
        .rst,
        .valid        (stepped),
        .step,
        .phase        (tracked_phase),
        .shift_periods(32'sd0),
        .done,
        .position
    );
    count_phase_check u_count_phase_check (
        .clk,
        .rst,
        .learn(1'b0),
        .valid(stepped),
        .axis (1'b0),
        .step,
        .count,
        .limit,
        .disagreement
    );
endmodule

`default_nettype wire
