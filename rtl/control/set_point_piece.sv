// SPDX-License-Identifier: Apache-2.0
// set_point_piece -- turn a set-point into a piece of constant jerk for the queue of motion_engine.
//
// latency   323 + 2 * ticks cycles from begin_piece to valid, if the set-point is accepted, 3 for a
//           piece of one tick; at most as many if it is refused
// rate      one set-point, then the next one from the cycle of valid on
// accuracy  Acceleration and jerk are rounded down to 2^-40 period. So the piece ends less than
//           ticks * ticks * ticks units of 2^-40 period from its set-point. end_position and
//           end_velocity are exactly what the engine plays: if the next piece begins there, the
//           error does not add up.
// method    The engine adds, in each tick, the velocity to the position, the acceleration to the
//           velocity and the jerk to the acceleration. Two equations for the end of the piece give
//           acceleration and jerk. All divisors are products of ticks - 1, ticks and ticks + 1, so
//           one divider divides by them one after the other, a bit per cycle. The piece is then
//           played, one tick per cycle, and each tick is compared with the limits.
// behaviour The engine outputs the mean of two ticks, which is half a tick ahead, so the piece ends
//           half a tick of velocity before its set-point. A set-point is refused if it is 2^14
//           periods or more away, or if velocity or acceleration of any tick is above its limit.
//           Positions are rounded to 2^-16 period by the caller, which may add up to
//           6 / ticks^2 of that to the acceleration at an end of a piece. A piece of one tick has
//           constant velocity, end_velocity, with which it begins: the step of the velocity is
//           compared with the limit of the acceleration.
// limits    ticks is 1 to 255. The inputs stay as they are until valid. begin_velocity and velocity
//           are in the range of 2^47 units.
// source    forward differences of a cubic, as in docs/stream.md
// model     tb/control/set_point_piece.py: busy and valid are equal in every cycle, refused and the
//           piece in every bit in the cycle of valid
`default_nettype none

module set_point_piece (
    input  wire                clk,
    input  wire                rst,
    input  wire                begin_piece,         // strobe: compute a piece
    // limits
    input  wire         [46:0] velocity_limit,      // 2^-40 period/tick
    input  wire         [46:0] acceleration_limit,  // 2^-40 period/tick2
    // set-point
    input  wire         [ 7:0] ticks,               // ticks, duration of the piece
    input  wire signed  [47:0] position,            // 2^-16 period
    input  wire signed  [47:0] velocity,            // 2^-40 period/tick
    // where the piece begins
    input  wire signed  [71:0] begin_position,      // 2^-40 period
    input  wire signed  [47:0] begin_velocity,      // 2^-40 period/tick
    // the piece
    output logic               busy,                // level: a piece is being computed
    output logic               valid,               // strobe: the piece is known, or refused
    output logic               refused,             // level: with valid, there is no piece
    output logic signed [47:0] acceleration,        // 2^-40 period/tick2, at its beginning
    output logic signed [31:0] jerk,                // 2^-40 period/tick3
    output logic signed [71:0] end_position,        // 2^-40 period
    output logic signed [47:0] end_velocity         // 2^-40 period/tick
);
    localparam signed [72:0] FARTHEST = 73'sd1 << 54;  // 2^-40 period

    enum logic [2:0] {
        REST,
        COAST,
        SINGLE,
        PREPARE,
        DIVIDE,
        PLAY
    } state;
    logic [7:0] left;  // ticks that are still to be played
    logic [5:0] bits_left;  // of a quotient, less one
    logic [2:0] division;  // 0, 1: of the acceleration; 2 to 4: of the jerk
    // 2^-40 period: distance beyond that at constant velocity; velocity change times ticks
    logic signed [63:0] more, changes;
    logic        negative;  // the dividend is below 0
    logic [63:0] digits;  // bits of the dividend that are still to come, then of the quotient
    logic [ 8:0] remainder;
    logic signed [49:0] played_acceleration, played_velocity;  // of the tick that is played
    logic signed [63:0] moved;  // 2^-40 period, since the piece began

    wire signed [72:0] gap = 73'($signed({position, 24'd0})) - 73'(begin_position);
    wire too_far = gap >= FARTHEST || gap <= -FARTHEST;
    wire signed [48:0] change = 49'(velocity) - 49'(begin_velocity);

    // numerators of acceleration and jerk
    wire signed [63:0] of_acceleration = more + (more <<< 1) - changes + (64'(change) <<< 1);
    wire signed [63:0] of_jerk = changes - 64'(change) - (more <<< 1);
    wire signed [63:0] dividend = division == 3'd0 ? of_acceleration <<< 1
        : (of_jerk <<< 2) + (of_jerk <<< 1);

    // division: ticks, ticks + 1, and for the jerk ticks - 1
    wire        [ 8:0] divisor = division == 3'd4 ? {1'b0, ticks} - 9'd1
        : {1'b0, ticks} + 9'(division == 3'd1 || division == 3'd3);
    wire [9:0] shifted = {remainder, digits[63]};
    wire [10:0] less = {1'b0, shifted} - {2'b00, divisor};
    wire fits = !less[10];
    wire [63:0] next_digits = {digits[62:0], fits};
    wire signed [63:0] quotient = next_digits ^ {64{negative}};
    wire fits_48 = quotient[63:47] == {17{quotient[63]}};
    wire fits_32 = quotient[63:31] == {33{quotient[63]}};

    // a tick of the piece
    wire signed [49:0] next_velocity = played_velocity + played_acceleration;
    wire signed [49:0] fastest = $signed({3'd0, velocity_limit});
    wire signed [49:0] steepest = $signed({3'd0, acceleration_limit});
    wire               beyond = next_velocity > fastest || next_velocity < -fastest
        || played_acceleration > steepest || played_acceleration < -steepest;

    // the only tick of a piece
    wire signed [64:0] single = 65'(begin_velocity) + 65'(more);
    wire signed [64:0] fast = 65'(fastest);
    wire signed [63:0] steep = 64'(steepest);
    wire single_beyond = single > fast || single < -fast || more > steep || more < -steep;

    assign busy = state != REST;

    always_ff @(posedge clk) begin
        valid <= 1'b0;
        case (state)
            REST: begin
                left    <= ticks;
                more    <= 64'(gap) - 64'(velocity >>> 1);
                changes <= '0;
                refused <= too_far;
                if (begin_piece && too_far) valid <= 1'b1;
                if (begin_piece && !too_far) state <= COAST;
            end
            COAST: begin
                left     <= left - 1'b1;
                more     <= more - 64'(begin_velocity);
                changes  <= changes + 64'(change);
                division <= 3'd0;
                if (left == 8'd1) state <= ticks == 8'd1 ? SINGLE : PREPARE;
            end
            SINGLE: begin
                acceleration    <= '0;
                jerk            <= '0;
                moved           <= single[63:0];
                played_velocity <= single[49:0];
                valid           <= 1'b1;
                refused         <= single_beyond;
                state           <= REST;
            end
            PREPARE: begin
                negative  <= dividend[63];
                digits    <= dividend ^ {64{dividend[63]}};
                remainder <= '0;
                bits_left <= '1;
                state     <= DIVIDE;
            end
            DIVIDE: begin
                digits    <= next_digits;
                remainder <= fits ? less[8:0] : shifted[8:0];
                bits_left <= bits_left - 1'b1;
                if (bits_left == '0) begin
                    remainder <= '0;
                    division  <= division + 1'b1;
                    if (division == 3'd1) begin
                        acceleration <= quotient[47:0];
                        state        <= PREPARE;
                    end
                    if (division == 3'd4) begin
                        jerk  <= quotient[31:0];
                        state <= PLAY;
                    end
                    if ((division == 3'd1 && !fits_48) || (division == 3'd4 && !fits_32)) begin
                        {valid, refused} <= 2'b11;
                        state <= REST;
                    end
                end
                left                <= ticks;
                moved               <= '0;
                played_velocity     <= 50'(begin_velocity);
                played_acceleration <= 50'(acceleration);
            end
            PLAY: begin
                left                <= left - 1'b1;
                moved               <= moved + 64'(played_velocity);
                played_velocity     <= next_velocity;
                played_acceleration <= played_acceleration + 50'(jerk);
                if (beyond || left == 8'd1) begin
                    valid   <= 1'b1;
                    refused <= beyond;
                    state   <= REST;
                end
            end
            default: state <= REST;
        endcase
        if (rst) begin
            state <= REST;
            {valid, refused} <= '0;
        end
    end

    assign end_position = begin_position + 72'(moved);
    assign end_velocity = played_velocity[47:0];

    wire unused = &{1'b0, less[9], shifted[9], played_velocity[49:48]};
endmodule

`default_nettype wire
