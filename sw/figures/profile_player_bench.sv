// SPDX-License-Identifier: Apache-2.0
// profile_player_bench -- profile_player with its exact target as an output, and whether its next
// step is prepared: the top module of sw/figures/profile_run.cpp.
`default_nettype none

module profile_player_bench (
    input  wire               clk,
    input  wire               rst,
    input  wire        [31:0] stop_deceleration,
    input  wire        [31:0] stop_jerk,
    input  wire        [31:0] slope,
    input  wire        [31:0] curve,
    input  wire        [16:0] feed_fraction,
    input  wire               pause,
    input  wire               tick,
    input  wire               push,
    input  wire signed [63:0] segment_velocity,
    input  wire signed [63:0] segment_acceleration,
    input  wire signed [31:0] segment_jerk,
    input  wire        [23:0] segment_ticks,
    input  wire               segment_last,
    input  wire               start,
    input  wire               controlled_stop,
    output logic       [71:0] exact,                 // 2^-40 period; valid while prepared
    output logic              moving,
    output logic       [ 4:0] queue_free,
    output logic              underrun,
    output logic              prepared               // level: the next tick may come
);
    /* verilator lint_off PINCONNECTEMPTY */
    profile_player u_player (
        .clk,
        .rst,
        .stop_deceleration,
        .stop_jerk,
        .slope,
        .curve,
        .feed_fraction,
        .pause,
        .tick,
        .push,
        .segment_velocity,
        .segment_acceleration,
        .segment_jerk,
        .segment_ticks,
        .segment_last,
        .start,
        .arm                   (1'b0),
        .start_at              (32'd0),
        .now                   (32'd0),
        .controlled_stop,
        .set_target_to_position(1'b0),
        .position              (48'd0),
        .shift                 (1'b0),
        .shift_by              (48'd0),
        .target                (),
        .target_velocity       (),
        .target_acceleration   (),
        .moving,
        .armed                 (),
        .queue_free,
        .underrun
    );
    /* verilator lint_on PINCONNECTEMPTY */
    assign prepared = u_player.job == u_player.WAIT;

    // While the player waits, acc holds the step and the fraction of the target below its LSB, and
    // half an LSB at the end.
    wire [23:0] half = {u_player.final_step, 23'd0};
    wire [23:0] fraction = u_player.acc[23:0] - u_player.memory[3][23:0] - half;
    assign exact = {u_player.target, u_player.ready ? fraction : 24'd0};
endmodule

`default_nettype wire
