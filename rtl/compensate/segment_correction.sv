// SPDX-License-Identifier: Apache-2.0
// segment_correction -- take the error of a segment_table off every position of a scale at once,
// also of one that moves.
//
// latency  1 clk from valid to done, from shift to moved; INDEX + 23 clk from enable to moved
// rate     one position and one shift per clk
// method   the table is asked for the place of a position, and its answer held until the next one
//          comes. The error that is taken off is that of a place passed at most 2 (INDEX + 23 clk +
//          the time between two positions) before: with a table that changes by s a period it is
//          wrong by s times the way of that time, and a rectangle's border comes so much later
// scale    origin moves with the position at each shift: the table stays where it lies on the scale
// moved    what is no motion: a shift, and the step when the correction comes into force or is
//          given up. A target that takes moved_by with it is as far from the position as before
// reading  stored is the point of read_point when known stands: as soon as the table is free, also
//          while it is in use
// source   S0: table of equal segments; the rest keeps the error of its place for the time that it
//          takes to read the next one up
// model    tb/compensate/segment_correction.py, equal in every bit of every cycle
// proved   between two positions corrected moves by moved_by only, and it is never farther from
//          position than error: out of force it is the position
// proof    depth 12, INDEX = 2
`default_nettype none

module segment_correction #(
    parameter int INDEX = 8  // segments < 2^INDEX
) (
    input wire clk,
    input wire rst,
    input wire enable,  // level; while it is 1 all other settings stand still
    input wire linear,  // 0: rectangle
    input wire origin_written,  // strobe: take origin
    input wire signed [47:0] origin,  // 2^-16 period: the first border
    input wire [47:0] segment_length,  // 2^-16 period
    input wire [INDEX-1:0] segments,
    input wire write,  // strobe: value goes to point
    input wire [INDEX-1:0] point,  // border
    input wire signed [23:0] value,  // 2^-16 period: position there less the true one
    input wire read,  // strobe: read the point of read_point back
    input wire [INDEX-1:0] read_point,
    input wire valid,  // strobe: position is new
    input wire signed [47:0] position,  // Q32.16 periods
    input wire shift,  // strobe: position grows by shift_periods in the next clk
    input wire signed [31:0] shift_periods,  // periods
    output logic done,  // strobe: corrected is that of a new position
    output logic signed [47:0] corrected,  // Q32.16 periods
    output logic moved,  // strobe: corrected grows by moved_by in the next clk, besides its motion
    output logic signed [47:0] moved_by,  // 2^-16 period
    output logic in_force,  // level
    output logic outside,  // level: the last place asked for is beyond the table
    output logic signed [23:0] error,  // 2^-16 period, taken off; 0 while not in force
    output logic known,  // level: stored is what was asked for
    output logic signed [23:0] stored  // 2^-16 period
);
    logic signed [47:0] first;  // origin, moved with the scale
    // the table works; its answer is to come into force
    logic asked, answered;
    // enable was 0: what the table was asked is forgotten
    logic off;
    logic looking;
    wire told, beyond;
    wire signed [23:0] answer, read_value;
    wire signed [47:0] unused_corrected;

    wire               asking = enable && !asked && !looking && (valid || !in_force);
    wire               begins = enable && told && !in_force;
    wire               ends = !enable && in_force;
    // it changes with a position alone
    wire signed [23:0] fresh = enable && valid && answered ? answer : error;
    wire signed [47:0] step = begins ? 48'sd0 - 48'(answer) : ends ? 48'(error) : '0;
    wire               unused = &{1'b0, unused_corrected};

    segment_table #(
        .INDEX(INDEX)
    ) u_table (
        .clk,
        .rst       (rst || !enable),
        .enable    (1'b1),
        .linear,
        .origin    (first),
        .segment_length,
        .segments,
        .write,
        .point,
        .value,
        .read_point(read_point),
        .valid     (asking),
        .position,
        .done      (told),
        .corrected (unused_corrected),
        .outside   (beyond),
        .error     (answer),
        .read_value
    );

    always_ff @(posedge clk) begin
        if (origin_written) first <= origin;
        else if (shift) first <= first + {shift_periods, 16'd0};

        off      <= !enable;
        asked    <= asking || (asked && !told && !off);
        answered <= (told || (answered && !valid)) && in_force;
        if (told) outside <= beyond;
        if (begins || (valid && answered)) error <= answer;
        if (begins) in_force <= 1'b1;

        moved <= shift || begins || ends;
        if (shift || begins || ends)
            moved_by <= (shift ? $signed({shift_periods, 16'd0}) : '0) + step;
        done <= valid;
        if (valid || moved) corrected <= position - 48'(fresh);

        looking <= read || (looking && asked);
        known   <= !read && (known || (looking && !asked));
        if (looking && !asked) stored <= read_value;
        if (rst || !enable) begin
            answered <= 1'b0;
            in_force <= 1'b0;
            outside  <= 1'b0;
            error    <= '0;
        end
        if (rst) begin
            first     <= '0;
            asked     <= 1'b0;
            done      <= 1'b0;
            moved     <= 1'b0;
            corrected <= '0;
            looking   <= 1'b0;
            known     <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && $past(rst)) assume (position == '0);
        if (past && !$past(rst) && !valid)
            assume (position == $past(
                position
            ) + ($past(
                shift
            ) ? $signed(
                {$past(shift_periods), 16'd0}
            ) : 48'sd0));
        if (past && !valid)
            assert (corrected + (moved ? moved_by : 48'sd0) == position - 48'(error));
        if (past && !in_force) assert (error == '0 && !answered);
        if (past && !$past(rst) && error != $past(error))
            assert ($past(valid) || (moved && in_force != $past(in_force)));
        if (past && !$past(rst) && !$past(valid))
            assert (corrected == $past(corrected) + ($past(moved) ? $past(moved_by) : 48'sd0));
        cover (past && moved && asked && $past(shift) && corrected < 0);
    end
`endif
endmodule

`default_nettype wire
