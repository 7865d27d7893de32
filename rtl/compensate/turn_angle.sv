// SPDX-License-Identifier: Apache-2.0
// turn_angle -- follow an incremental encoder through the turn: report position, angle from the
// reference mark, and a missing reference mark.
//
// latency   1 cycle from step or index to all outputs
// rate      one step per cycle
// accuracy  The angle is an accumulator of 2^-48 turn, set to zero at the reference mark.
//           counts_per_turn steps away from the mark it is wrong by counts_per_turn * 2^-49 turn at
//           most, which is 2^-24 turn for 2^25 counts. counts_per_turn need not be a power of two.
// behaviour Until the first step, position is the quarter that a and b show, so that a quadrature
//           encoder that follows position outputs the same levels. Until the first reference mark
//           the angle is not known.
// source    S1: theta of its error model, from A, B and Z
// model     tb/compensate/turn_angle.py, equal in every bit of every cycle
// proved    from_mark stays below counts_per_turn. known rises with an index only.
// proof     W = 6
`default_nettype none

module turn_angle #(
    parameter int W = 32  // bits of position
) (
    input  wire                clk,
    input  wire                rst,
    input  wire        [W-1:0] counts_per_turn,  // counts; 0: the angle is never known
    input  wire        [ 47:0] angle_per_count,  // 2^-48 turn: 2^48 / counts_per_turn, rounded
    input  wire                a,                // level: changes no sooner than step
    input  wire                b,                // level: changes no sooner than step
    input  wire signed [  1:0] step,             // counts: -1, 0, +1
    input  wire                index,            // strobe: this step reached the reference mark
    output logic               moved,            // level: there was a step
    output logic       [W-1:0] position,         // counts; wraps
    output logic       [ 31:0] angle,            // 2^-32 turn from the reference mark up
    output logic               known,            // level: there was an index
    output logic               referenced,       // strobe: position is at the reference mark
    output logic               missing           // strobe: a whole turn passed without index
);
    localparam logic [W-1:0] ONE = W'(1);

    logic        [W-1:0] from_mark;  // counts from the reference mark, or from the start
    logic        [W-1:0] highest;  // largest value of from_mark
    logic        [ 47:0] turned;  // 2^-48 turn
    logic signed [  1:0] turns;  // ends of a turn passed since the last index

    wire                 up = step == 2'sd1;
    wire                 down = step[1];
    wire                 used = counts_per_turn != '0;
    wire                 over = up && (from_mark >= highest || !used);
    wire                 under = down && from_mark == '0;
    wire                 to_zero = over || (down && from_mark == ONE);
    wire                 lost = (over && turns == 2'sd0) || (under && turns == -2'sd1);

    assign angle = turned[47:16];

    always_ff @(posedge clk) begin
        position   <= position + {{W-1{down}}, up || down};
        referenced <= index && used;
        missing    <= lost && !index && used;
        highest    <= counts_per_turn - ONE;
        if (over) from_mark <= '0;
        else if (under) from_mark <= used ? highest : '0;
        else from_mark <= from_mark + {{W - 1{down}}, up || down};
        if (to_zero) turned <= '0;
        else if (up || down) turned <= down ? turned - angle_per_count : turned + angle_per_count;
        if (lost) turns <= '0;
        else if (over) turns <= turns + 2'sd1;
        else if (under) turns <= turns - 2'sd1;
        if (index) begin
            from_mark <= '0;
            turned    <= '0;
            turns     <= '0;
            known     <= used;
        end
        moved <= moved || up || down;
        if (!used || rst) known <= 1'b0;
        if (rst) moved <= 1'b0;
        if (rst || !(moved || up || down)) begin
            position  <= {{W-2{1'b0}}, b, a ^ b};
            from_mark <= '0;
            turned    <= '0;
            turns     <= '0;
            missing   <= 1'b0;
        end
        if (rst) referenced <= 1'b0;
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (step != -2'sd2);
        if (past) begin
            assume (counts_per_turn == $past(counts_per_turn));
            assert (from_mark == '0 || from_mark < counts_per_turn);
            assert (turns != 2'sd1 && turns != -2'sd2);
            if (known && !$past(known)) assert ($past(index));
            cover (known && missing && step[1]);
            cover (known && from_mark == 5);
        end
    end
`endif
endmodule

`default_nettype wire
