// SPDX-License-Identifier: Apache-2.0
// backlash_compensation -- take up the backlash between motor and table when the target reverses.
//
// latency   1 cycle from tick to take_up, 0 cycles from position to table_position
// rate      one tick per cycle
// behaviour take_up is how far the motor must be ahead of the table: it moves to backlash while the
//           target moves up, and to 0 while it moves down, by take_up_rate at most in each tick;
//           with 0 at once. The target has reversed when it has come back from its farthest point
//           by more than hysteresis, not counting ticks in which it moved by less than 2^-16
//           period; while it rests, take_up continues to where it was moving.
//           With motor_side the sensor is on the motor's side of the backlash, and the position of
//           the table is take_up below that of the sensor; else both are equal.
// source    the play of a screw and its nut
// model     tb/compensate/backlash_compensation.py, equal in every bit of every cycle
// proved    take_up changes only with a tick, never by more than the rate, and never beyond the end
//           to which it moves. Only a motion of the target reverses it.
// proof     depth 6
`default_nettype none

module backlash_compensation (
    input  wire                clk,
    input  wire                rst,
    input  wire                tick,            // strobe: servo tick
    // settings
    input  wire         [23:0] backlash,        // 2^-16 period
    input  wire         [23:0] take_up_rate,    // 2^-16 period/tick; 0: at once
    input  wire         [ 6:0] hysteresis,      // 2^-8 period
    input  wire                motor_side,      // level: the sensor is on the motor's side
    // motion_engine
    input  wire                valid,           // strobe: result is new, and of this axis
    input  wire         [ 2:0] kind,            // number of what it is
    input  wire signed  [47:0] result,          // value
    // position
    input  wire signed  [47:0] position,        // 2^-16 period, of the sensor
    output logic signed [47:0] table_position,  // 2^-16 period
    output logic        [23:0] take_up          // 2^-16 period, of the motor ahead of the table
);
    localparam [2:0] TARGET_VELOCITY = 3'd2;  // as in tables/engine_microcode.py

    logic        up;  // the way on which the target moves
    logic [14:0] back;  // 2^-16 period, how far it has come back from its farthest point

    wire         downward = result[47];
    wire  [31:0] distance = downward ? ~result[31:0] : result[31:0];  // 2^-16 period
    wire         moves = valid && kind == TARGET_VELOCITY && distance != '0;
    wire         against = up == downward;
    wire  [32:0] farther = {1'b0, distance} + 33'(back);
    wire         reverses = against && farther > 33'({hysteresis, 8'd0});
    wire  [23:0] goal = up ? backlash : '0;
    wire         falls = take_up > goal;
    wire  [23:0] left = falls ? take_up - goal : goal - take_up;
    wire         arrives = take_up_rate == '0 || left <= take_up_rate;

    assign table_position = position - (motor_side ? 48'(take_up) : 48'd0);

    always_ff @(posedge clk) begin
        if (tick)
            take_up <= arrives ? goal : falls ? take_up - take_up_rate : take_up + take_up_rate;
        if (moves) begin
            if (reverses) {up, back} <= {!up, 15'd0};
            else if (against) back <= farther[14:0];
            else back <= distance > 32'(back) ? '0 : back - distance[14:0];
        end
        if (rst) {up, back, take_up} <= '0;
    end

    wire unused = &{1'b0, result[46:32]};

`ifdef FORMAL
    logic        past = 1'b0;
    logic [23:0] take_up_q;
    wire  [23:0] moved = take_up > take_up_q ? take_up - take_up_q : take_up_q - take_up;
    always @(posedge clk) begin
        past      <= 1'b1;
        take_up_q <= take_up;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if (!$past(tick)) assert (take_up == take_up_q);
            if ($past(take_up_rate) != '0) assert (moved <= $past(take_up_rate));
            if (take_up > take_up_q) assert ($past(up) && take_up <= $past(backlash));
            if (take_up < take_up_q && $past(up)) assert (take_up >= $past(backlash));
            if (up != $past(up)) assert ($past(moves));
            cover ($past(take_up_rate) == 24'd2 && take_up == 24'd5 && back != 0);
        end
    end
`endif
endmodule

`default_nettype wire
