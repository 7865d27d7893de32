// SPDX-License-Identifier: Apache-2.0
// outlier_filter -- hold back a sample that jumps further than the signal can, each channel
// separately.
//
// latency  1 cycle from valid to done
// rate     one sample per cycle
// source   S0, limit filter 1: |Yn - Yn-1| <= dY takes Yn, else keeps Yn-1. In the form given by
//          S0 (hold = 255) a signal that once moved by more than dY never returns; therefore the
//          next sample is taken after `hold` samples held back in a row.
// behaviour  With AXES above 1 it serves several axes: each has its own last sample and counts, and
//          step and hold must be those of the axis of the sample.
// model    tb/sense/outlier_filter.py, equal in every bit of every cycle
// proved   a channel moves by at most `step`, except at the first sample and after `hold` samples
//          held back; never are more held back
`default_nettype none

module outlier_filter #(
    parameter  int W    = 8,                            // bits of a sample, at least 8
    parameter  int AXES = 1,                            // axes that are served
    // bits of the number of an axis
    localparam int A    = AXES == 1 ? 1 : $clog2(AXES)
) (
    input  wire                 clk,
    input  wire                 rst,      // level: the next sample is taken whatever it is
    input  wire         [  7:0] step,     // counts: largest move per sample; 0: take all
    input  wire         [  7:0] hold,     // samples held back in a row at most; 255: no limit
    input  wire                 valid,    // strobe: sin and cos are new
    input  wire         [A-1:0] axis,     // number of their axis; 0 for one axis
    input  wire signed  [W-1:0] sin,      // counts, full scale = 2^(W-1)
    input  wire signed  [W-1:0] cos,      // counts, full scale = 2^(W-1)
    output logic                done,     // strobe: sin_out and cos_out are new
    output logic signed [W-1:0] sin_out,  // counts: sin or its last good value; held until done
    output logic signed [W-1:0] cos_out,  // counts: cos or its last good value; held until done
    output logic                rejected  // strobe, with done: a sample was held back
);
    if (W < 8) begin : g_check
        W_MUST_BE_AT_LEAST_8 u_error ();
    end

    logic [AXES-1:0] taken;  // there was a sample since reset
    wire [7:0] sin_held, cos_held;  // samples held back in a row, saturates at 255
    wire signed [W-1:0] sin_last, cos_last;  // last good values

    wire signed [  W:0] sin_move = sin - sin_last;
    wire signed [  W:0] cos_move = cos - cos_last;
    // If a channel moves down, its size is one too small; step - size is then reduced by one more.
    wire        [W-1:0] sin_size = sin_move[W-1:0] ^ {W{sin_move[W]}};
    wire        [W-1:0] cos_size = cos_move[W-1:0] ^ {W{cos_move[W]}};
    wire        [  W:0] most = (W + 1)'(step);
    wire                sin_far = 1'(({most, 1'b1} + {1'b1, ~sin_size, !sin_move[W]}) >> (W + 1));
    wire                cos_far = 1'(({most, 1'b1} + {1'b1, ~cos_size, !cos_move[W]}) >> (W + 1));

    wire                active = taken[axis] && step != '0;
    wire                no_end = hold == '1;
    wire                sin_stays = active && sin_far && (no_end || sin_held < hold);
    wire                cos_stays = active && cos_far && (no_end || cos_held < hold);
    wire        [  7:0] sin_stayed = !sin_stays ? '0 : sin_held == '1 ? sin_held : sin_held + 1'b1;
    wire        [  7:0] cos_stayed = !cos_stays ? '0 : cos_held == '1 ? cos_held : cos_held + 1'b1;
    wire signed [W-1:0] sin_good = sin_stays ? sin_last : sin;
    wire signed [W-1:0] cos_good = cos_stays ? cos_last : cos;

    axis_memory #(
        .AXES (AXES),
        .WIDTH(2 * W + 16)
    ) u_state (
        .clk,
        .write     (valid),
        .write_axis(axis),
        .value     ({sin_stayed, cos_stayed, sin_good, cos_good}),
        .axis,
        .stored    ({sin_held, cos_held, sin_last, cos_last})
    );

    always_ff @(posedge clk) begin
        done     <= valid;
        rejected <= valid && (sin_stays || cos_stays);
        if (valid) begin
            taken[axis] <= 1'b1;
            sin_out     <= sin_good;
            cos_out     <= cos_good;
        end
        if (rst) begin
            taken    <= '0;
            done     <= 1'b0;
            rejected <= 1'b0;
        end
    end

`ifdef FORMAL
    logic              past = 1'b0;
    logic signed [W:0] largest;  // step of the preceding cycle
    wire               sin_exhausted = sin_held >= hold && !no_end;
    wire               cos_exhausted = cos_held >= hold && !no_end;
    logic signed [W-1:0] sin_before, cos_before;
    wire signed [W:0] sin_jump = sin_out - sin_before;
    wire signed [W:0] cos_jump = cos_out - cos_before;
    always @(posedge clk) begin
        past       <= 1'b1;
        largest    <= $signed({1'b0, step});
        sin_before <= sin_out;
        cos_before <= cos_out;
        if (!past) assume (rst);
        assume (axis == '0);
        if (past && taken) assert (sin_last == sin_out && cos_last == cos_out);
        if (past && !$past(rst)) begin
            if (sin_jump > largest || -sin_jump > largest)
                assert (done && $past(!active || sin_exhausted));
            if (cos_jump > largest || -cos_jump > largest)
                assert (done && $past(!active || cos_exhausted));
            if (rejected) assert (done && $past(taken) && (sin_jump == 0 || cos_jump == 0));
            if (done && !rejected) assert (sin_out == $past(sin) && cos_out == $past(cos));
            if (sin_held != 0 && sin_held != $past(sin_held))
                assert (rejected && sin_held == $past(sin_held) + 1 && !$past(sin_exhausted));
            if (cos_held != 0 && cos_held != $past(cos_held))
                assert (rejected && cos_held == $past(cos_held) + 1 && !$past(cos_exhausted));
            cover (rejected && sin_held == 3);
            cover (done && !rejected && $past(sin_held) == 3 && $past(step) != 0);
        end
    end
`endif
endmodule

`default_nettype wire
