// SPDX-License-Identifier: Apache-2.0
// profile_bench -- motion_engine with one axis, whose profile is played, and its exact target; the
// top of sw/figures/profile_run.cpp.
`default_nettype none

module profile_bench #(
    parameter int ANCHOR = 0,  // address of this word of the engine
    parameter int MOVED  = 0   // address of this word of the engine
) (
    input  wire               clk,
    input  wire               rst,
    input  wire               tick,             // strobe: servo tick
    input  wire               setting_write,    // strobe: write a setting
    input  wire        [ 6:0] setting_word,     // number of its word
    input  wire signed [63:0] setting,          // value
    output logic              setting_waits,    // level: it is not written yet
    input  wire               push,             // strobe: queue the segment of the settings
    input  wire               start,            // strobe: play the queue
    input  wire               controlled_stop,  // strobe: stop and empty the queue
    output logic              ready,            // level: settings may be written
    output logic              busy,             // level: a tick is being served
    output logic              pending,          // level: a request is not done and shown
    output logic       [71:0] exact,            // 2^-40 period
    output logic              moving,           // level: a profile is being played
    output logic       [ 4:0] queue_free,       // segments that still fit
    output logic              underrun          // strobe: a segment was missing
);
    wire waits, result_valid, result_flag;
    wire        [ 2:0] result_kind;
    wire signed [47:0] result;

    /* verilator lint_off PINCONNECTEMPTY */
    motion_engine u_engine (
        .clk,
        .rst,
        .tick,
        .now                   (32'd0),
        .setting_write,
        .setting_axis          (3'd0),
        .setting_word,
        .setting_filter        (2'd0),
        .setting,
        .setting_waits,
        .position              (48'd0),
        .stepped               (1'b0),
        .downward              (1'b0),
        .block_up              (1'b0),
        .block_down            (1'b0),
        .closed_loop           (1'b1),
        .take_up               (24'd0),
        .start,
        .arm                   (1'b0),
        .controlled_stop,
        .set_target_to_position(1'b0),
        .push,
        .gains_changed         (1'b0),
        .shift                 (1'b0),
        .shift_by              (48'd0),
        .waits,
        .result_valid,
        .integral_valid        (),
        .result_axis           (),
        .result_kind,
        .result,
        .result_flag,
        .ready,
        .busy,
        .overrun               (),
        .cycles                ()
    );
    engine_outputs u_outputs (
        .clk,
        .rst,
        .valid        (result_valid),
        .kind         (result_kind),
        .result,
        .flag         (result_flag),
        .waits,
        .line_start   (1'b0),
        .moving,
        .armed        (),
        .queue_free,
        .pending,
        .target       (),
        .line_up      (),
        .line_down    (),
        .underrun,
        .velocity     (),
        .error        (),
        .saturated    (),
        .error_valid  (),
        .too_far      (),
        .command_valid(),
        .command      ()
    );
    /* verilator lint_on PINCONNECTEMPTY */

    wire [71:0] anchor = u_engine.u_memory.words[ANCHOR];
    assign exact = {anchor[47:0], 24'd0} + u_engine.u_memory.words[MOVED];

    wire unused = &{1'b0, anchor};
endmodule

`default_nettype wire
