// SPDX-License-Identifier: Apache-2.0
// segment_correction -- subtract the error of a segment_table from every position of a scale at
// once, also in motion.
//
// latency   1 cycle from valid to done, and from shift to moved; INDEX + 23 cycles from enable to
//           moved.
// rate      one position and one shift per cycle
// method    The table computes the error at one position, and this answer is used until the next
//           one comes. The error that is subtracted belongs to a position passed at most 2 (INDEX +
//           23 cycles + the time between two positions) before. In a table that changes by s per
//           period it is therefore wrong by at most s times the distance moved in that time, and
//           the border of a rectangle comes that much later.
// behaviour The origin moves with the position at each shift: the table stays where it is on the
//           scale. moved reports every change that is no motion: a shift, and the step when the
//           correction comes into force or ends. A target that adds moved_by stays as far from the
//           position as before. A point is read back when the table is free, also while it is in
//           use: then known is high, and stored is the point of read_point.
// limits    While enable is high no other setting may change.
// source    S0: table of equal segments; at standstill the error of the position stays in force
//           while the table computes the next one
// model     tb/compensate/segment_correction.py, equal in every bit of every cycle
// proved    Between two positions corrected moves by moved_by only, and it is always position -
//           error: while out of force it is the position.
// proof     depth 12, INDEX = 2
`default_nettype none

module segment_correction #(
    parameter int INDEX = 8  // bits of a segment number: segments < 2^INDEX
) (
    input wire clk,
    input wire rst,
    input wire enable,  // level: correct; the settings are constant
    input wire linear,  // level: straight lines; 0: rectangles
    input wire origin_written,  // strobe: take origin
    input wire signed [47:0] origin,  // 2^-16 period: the first border
    input wire [47:0] segment_length,  // 2^-16 period
    input wire [INDEX-1:0] segments,  // number of segments
    input wire write,  // strobe: write value to point
    input wire [INDEX-1:0] point,  // number of a border
    input wire signed [23:0] value,  // 2^-16 period: measured less true position
    input wire read,  // strobe: read the point of read_point back
    input wire [INDEX-1:0] read_point,  // number of a border
    input wire valid,  // strobe: position is new
    input wire signed [47:0] position,  // 2^-16 period
    input wire shift,  // strobe: position grows in the next cycle
    input wire signed [31:0] shift_periods,  // periods by which it grows
    output logic done,  // strobe: corrected is new
    output logic signed [47:0] corrected,  // 2^-16 period
    output logic moved,  // strobe: corrected grows in the next cycle
    output logic signed [47:0] moved_by,  // 2^-16 period by which it grows, beyond motion
    output logic in_force,  // level: positions are corrected
    output logic outside,  // level: the last position is off the table
    output logic signed [23:0] error,  // 2^-16 period, 0 while not in force
    output logic known,  // level: stored is valid
    output logic signed [23:0] stored  // 2^-16 period: the point of read_point
);
    logic signed [47:0] first;  // origin, moved with the scale
    // the table is busy; its answer waits for the next position
    logic busy, answered;
    // enable was low: the table has dropped the position that it was busy with
    logic off;
    logic reading;  // a point is to be read back
    wire answers, beyond;  // the table is done; its position was off the table
    wire signed [23:0] answer, read_value;
    wire signed [47:0] unused_corrected;

    wire               asking = enable && !busy && !reading && (valid || !in_force);
    wire               begins = enable && answers && !in_force;
    wire               ends = !enable && in_force;
    // the error changes only together with a position
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
        .done      (answers),
        .corrected (unused_corrected),
        .outside   (beyond),
        .error     (answer),
        .read_value
    );

    always_ff @(posedge clk) begin
        if (origin_written) first <= origin;
        else if (shift) first <= first + {shift_periods, 16'd0};

        off      <= !enable;
        busy     <= asking || (busy && !answers && !off);
        answered <= (answers || (answered && !valid)) && in_force;
        if (answers) outside <= beyond;
        if (begins || (valid && answered)) error <= answer;
        if (begins) in_force <= 1'b1;

        moved <= shift || begins || ends;
        if (shift || begins || ends)
            moved_by <= (shift ? $signed({shift_periods, 16'd0}) : '0) + step;
        done <= valid;
        if (valid || moved) corrected <= position - 48'(fresh);

        reading <= read || (reading && busy);
        known   <= !read && (known || (reading && !busy));
        if (reading && !busy) stored <= read_value;
        if (rst || !enable) begin
            answered <= 1'b0;
            in_force <= 1'b0;
            outside  <= 1'b0;
            error    <= '0;
        end
        if (rst) begin
            first     <= '0;
            busy      <= 1'b0;
            done      <= 1'b0;
            moved     <= 1'b0;
            corrected <= '0;
            reading   <= 1'b0;
            known     <= 1'b0;
        end
    end

`ifdef FORMAL
    logic               past = 1'b0;
    logic signed [47:0] shifted;
    always @(posedge clk) begin
        past    <= 1'b1;
        shifted <= position + (shift ? $signed({shift_periods, 16'd0}) : 48'sd0);
        if (!past) assume (rst);
        if (past && $past(rst)) assume (position == '0);
        if (past && !$past(rst) && !valid) assume (position == shifted);
        if (past && !valid)
            assert (corrected + (moved ? moved_by : 48'sd0) == position - 48'(error));
        if (past && !in_force) assert (error == '0 && !answered);
        if (past && !$past(rst) && error != $past(error))
            assert ($past(valid) || (moved && in_force != $past(in_force)));
        if (past && !$past(rst) && !$past(valid))
            assert (corrected == $past(corrected) + ($past(moved) ? $past(moved_by) : 48'sd0));
        cover (past && moved && busy && $past(shift) && corrected < 0);
    end
`endif
endmodule

`default_nettype wire
