// SPDX-License-Identifier: Apache-2.0
// profile_player_bench -- profile_player with its exact target and with a report that its next step
// is prepared; the top of sw/figures/profile_run.cpp.
`default_nettype none

module profile_player_bench (
    input  wire               clk,
    input  wire               rst,
    input  wire        [31:0] stop_deceleration,     // 2^-32 period/tick2; 0: stop in one step
    input  wire        [31:0] stop_jerk,             // 2^-40 period/tick3; 0: not limited
    input  wire        [31:0] slope,                 // 2^-32 per tick, of the rate; 0: no limit
    input  wire        [31:0] curve,                 // 2^-32 per tick2; 0: only slope limits
    input  wire        [16:0] feed_fraction,         // 2^-16; 65536 is 100 %, and the largest
    input  wire               pause,                 // level: the rate goes to 0
    input  wire               tick,                  // strobe: servo tick
    input  wire               push,                  // strobe: queue the segment
    input  wire signed [63:0] segment_velocity,      // 2^-40 period/tick, at its start
    input  wire signed [63:0] segment_acceleration,  // 2^-40 period/tick2, at its start
    input  wire signed [31:0] segment_jerk,          // 2^-40 period/tick3
    input  wire        [23:0] segment_ticks,         // ticks; 0: the segment is skipped
    input  wire               segment_last,          // level: the profile ends with this segment
    input  wire               start,                 // strobe: play the queue
    input  wire               controlled_stop,       // strobe: stop and empty the queue
    output logic       [71:0] exact,                 // 2^-40 period; valid while prepared
    output logic              moving,                // level: a profile is being played
    output logic       [ 4:0] queue_free,            // segments that still fit
    output logic              underrun,              // strobe: a segment was missing
    output logic              prepared               // level: a tick is taken
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

    // while the player waits, acc is the step, plus the fraction of the target below its LSB, plus
    // half an LSB at the end
    wire [23:0] step = u_player.memory[3][23:0];
    wire [23:0] half = {u_player.final_step, 23'd0};
    wire [23:0] fraction = u_player.acc[23:0] - step - half;
    assign exact = {u_player.target, u_player.ready ? fraction : 24'd0};
endmodule

`default_nettype wire
