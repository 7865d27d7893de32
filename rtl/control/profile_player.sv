// SPDX-License-Identifier: Apache-2.0
// profile_player -- play queued segments of constant jerk, at full speed or slower, and stop within limits from anywhere.
//
// latency  2 clk from tick to target, which makes the step prepared after the tick before; a shift delays it by one clk.
//          The first tick after start only prepares
// rate     one step per tick; a tick at least 80 clk after the one before, and one more for each segment of 0 ticks in a
//          row; 220 clk after the first of a brake
// exact    a segment moves the profile by v n + a n(n-1)/2 + j n(n-1)(n-2)/6 in n ticks, in 2^-40 period. All bits are
//          kept from segment to segment and rounded to the LSB of target (half up) when the profile ends
// slower   target is the quadratic B-spline of the profile's positions, read at a time that advances by `rate`. So at any
//          rate from 0 to 100 % |velocity|, |acceleration| and |jerk| stay below those of the segments times rate,
//          rate^2, rate^2; at 100 % each step is the mean of two of the profile. The lengths are those of the profile
//          Where the velocity itself steps between two segments, one step below 100 % may exceed it by half of that
// brake    from the step and the acceleration made last: the acceleration changes by brake_jerk a tick at most, a part of
//          brake_jerk in the first and the last, is brought below brake_rate, and both end at zero (approach_law)
// source   forward differences of a cubic; Schoenberg, Quart. Appl. Math. 4 (1946) 45
// model    tb/control/profile_player.py, equal in every bit of every cycle
`default_nettype none

module profile_player #(
    parameter int DEPTH = 16                                    // segments in the queue, a power of two from 2 to 16
) (
    input  wire                  clk,
    input  wire                  rst,                           // target becomes zero, the queue empty
    input  wire        [31:0]    brake_rate,                    // 2^-32 period/tick2; 0: velocity is zero after one step
    input  wire        [31:0]    brake_jerk,                    // 2^-40 period/tick3; 0, or more than brake_rate: not limited
    input  wire        [32:0]    rate,                          // 2^-32 tick of the profile per tick, 2^32 at most: override_ramp
    input  wire                  tick,                          // strobe: servo tick
    input  wire                  push,                          // strobe: queue the segment; lost when full or braking
    input  wire signed [63:0]    segment_velocity,              // 2^-40 period/tick, at the start of the segment
    input  wire signed [63:0]    segment_acceleration,          // 2^-40 period/tick2, at the start of the segment
    input  wire signed [31:0]    segment_jerk,                  // 2^-40 period/tick3
    input  wire        [23:0]    segment_ticks,                 // duration; 0: the segment is skipped
    input  wire                  segment_last,                  // the profile ends with this segment
    input  wire                  start,                         // strobe: play the queue; ignored while moving or when it is empty
    input  wire                  arm,                           // strobe: start when `now` reaches start_at; a brake or hold_here disarms
    input  wire        [31:0]    start_at,                      // clk
    input  wire        [31:0]    now,                           // clk, wraps
    input  wire                  brake,                         // strobe: controlled stop, queue emptied
    input  wire                  hold_here,                     // strobe: target := position, queue emptied, standing
    input  wire signed [47:0]    position,                      // 2^-16 period, measured
    input  wire                  shift,                         // strobe: the origin moves
    input  wire signed [31:0]    shift_periods,                 // period, added to target
    output logic signed [47:0]   target,                        // 2^-16 period, rounded down while moving
    output logic signed [31:0]   target_velocity,               // 2^-16 period/tick: the step just made; held inside 32 bits
    output logic signed [31:0]   target_acceleration,           // 2^-16 period/tick2: less the step before; held inside 32 bits
    output logic                 moving,                        // a profile is being played
    output logic                 armed,                         // waits for start_at
    output logic [4:0]           queue_free,                    // segments that may still be queued
    output logic                 underrun                       // strobe: a segment should have followed and did not
);
    if (DEPTH < 2 || DEPTH > 16 || (DEPTH & (DEPTH - 1)) != 0) begin : g_check DEPTH_MUST_BE_2_4_8_OR_16 u_error (); end

    localparam int A = $clog2(DEPTH);
    localparam [71:0] HALF = 72'd1 << 23;

    enum logic [3:0] {WAIT, MAKE, ROUND, ADVANCE, CROSS, LOAD, SCALE, SLOPE, BEND, PREPARED, DIVIDE, SUM, DECIDE, BRAKE} state;

    logic [184:0]       queue [0:DEPTH-1];
    logic [A-1:0]       write_at, read_at;
    logic [71:0]        exact;                                  // 2^-40 period
    logic signed [63:0] step, change;                           // to be made next, and less the one before
    logic               ready, final_step;                      // `step` is prepared; the profile ends with it

    // the profile: this interval of a tick, and the place in it
    logic signed [63:0] velocity, acceleration;                 // while braking: area and slope of approach_law
    logic signed [31:0] jerk;
    logic        [23:0] left;                                   // intervals of this segment
    logic        [31:0] fraction;                               // of the interval gone
    logic signed [63:0] offset;                                 // target less the position at the start of the interval
    logic               last, ended, crossed;

    // brake
    logic               braking, divided, abrupt, upward, stop_last, grow;
    logic        [39:0] pace;                                   // change of acceleration per tick
    logic        [39:0] remainder;

    // serial multiplier, and dividend of the division
    logic signed [63:0] product;
    logic        [31:0] multiplier;
    logic        [5:0]  count;

    wire [184:0] head   = queue[read_at];
    wire         full   = queue_free == 5'd0;
    wire         empty  = queue_free == 5'(DEPTH);
    wire         put    = push && !full && !braking;
    wire         fetch  = state == LOAD && !braking && !last && !empty;
    wire         starve = state == LOAD && !braking && !last && empty;
    wire         move   = state == MAKE && !shift;
    wire         finish = state == ROUND && !shift;
    wire         reached = armed && $signed(now - start_at) >= 0;
    wire         begins  = (start || reached) && !empty && !moving && !brake;

    // one adder for every cause of a new target
    wire [71:0] base   = hold_here ? {position, 24'd0} : exact;
    wire [71:0] growth = shift     ? {shift_periods, 40'd0} :
                         hold_here ? 72'd0 :
                         move      ? {{8{step[63]}}, step} : HALF;

    // product = multiplicand x fraction, one bit of the fraction a clk
    wire signed [63:0] multiplicand = state == SLOPE ? acceleration : offset;
    wire        [64:0] addend = multiplier[0] ? {multiplicand[63], multiplicand} : 65'd0;
    wire        [64:0] sum = {product[63], product} + addend;           // its lowest bit is below the LSB
    wire signed [63:0] product_now = $signed(sum[64:1]);
    wire        [32:0] time_sum = {1'b0, fraction} + rate;
    logic signed [63:0] step_base;
    wire signed [63:0] next_step = step_base + offset;

    // brake: quotient of |change| by pace, and the area below it, a bit at a time
    wire        [39:0] rate_limit = {brake_rate, 8'd0};
    wire               no_pace    = brake_jerk == 32'd0 || {8'd0, brake_jerk} > rate_limit;
    wire        [40:0] trial      = {remainder, product[63]};
    wire               bit_now    = trial >= {1'b0, pace};
    wire               turn, upward_now, last_now, grow_now, fall_now;
    wire               may_grow   = divided || !turn || remainder == 40'd0;      // from its other side it would be more than pace
    wire signed [63:0] braking_step = upward ? acceleration : -acceleration;

    approach_law #(.W(64)) u_law (.change({24'd0, pace}), .limit({24'd0, rate_limit}), .value(step), .slope(acceleration), .upward,
                                  .area(velocity), .turn, .upward_now, .last(last_now), .grow(grow_now), .fall(fall_now));

    wire step_fits   = step[63:55]   == {9{step[63]}};
    wire change_fits = change[63:55] == {9{change[63]}};

    wire unused = &{1'b0, sum[0]};

    assign target = exact[71:24];

    always_ff @(posedge clk) begin
        if (put) queue[write_at] <= {segment_last, segment_ticks, segment_jerk, segment_acceleration, segment_velocity};
        if (put) write_at <= write_at + 1'b1;
        if (fetch) read_at <= read_at + 1'b1;
        if (put != fetch) queue_free <= put ? queue_free - 1'b1 : queue_free + 1'b1;

        if (shift || hold_here || move || finish) exact <= base + growth;
        underrun <= starve;
        if (arm || reached) armed <= arm;
        if (begins) moving <= 1'b1;
        if ((brake && moving) || starve) braking <= 1'b1;
        case (state)
            MAKE: if (move) begin
                target_velocity     <= step_fits ? step[55:24] : {step[63], {31{~step[63]}}};
                target_acceleration <= change_fits ? change[55:24] : {change[63], {31{~change[63]}}};
                state               <= final_step ? ROUND : braking ? divided ? DECIDE : DIVIDE : ADVANCE;
            end
            ROUND: if (finish) begin
                exact[23:0]         <= '0;
                target_velocity     <= '0;
                target_acceleration <= '0;
                {moving, braking, divided, last, ended, ready, final_step} <= '0;
                {left, fraction, offset, step, change} <= '0;
                state               <= WAIT;
            end
            ADVANCE: begin                                      // the time
                {crossed, fraction} <= time_sum;
                step_base           <= -offset;
                state               <= left == 24'd0 ? LOAD : time_sum[32] ? CROSS : SCALE;
            end
            CROSS: begin                                        // into the next interval
                step_base    <= step_base + velocity;
                velocity     <= velocity + acceleration;
                acceleration <= acceleration + {{32{jerk[31]}}, jerk};
                left         <= left - 1'b1;
                crossed      <= 1'b0;
                state        <= left == 24'd1 ? LOAD : SCALE;
            end
            LOAD: begin
                if (fetch) {last, left, jerk, acceleration, velocity} <= head;
                if (last) begin
                    velocity     <= '0;
                    acceleration <= '0;
                    ended        <= 1'b1;
                end
                state <= braking || starve ? DIVIDE : last ? SCALE : head[183:160] == 24'd0 ? LOAD : crossed ? CROSS : SCALE;
            end
            SCALE: begin                                        // offset = v/2 + fraction (v + fraction a/2)
                product    <= '0;
                multiplier <= fraction;
                count      <= '0;
                offset     <= velocity >>> 1;
                state      <= fraction == 32'd0 || ended ? PREPARED : SLOPE;
            end
            SLOPE, BEND: begin
                product    <= product_now;
                multiplier <= {multiplier[0], multiplier[31:1]};
                count      <= count + 1'b1;
                if (count == 6'd31) begin
                    count   <= '0;
                    product <= '0;
                    offset  <= state == SLOPE ? velocity + (product_now >>> 1) : (velocity >>> 1) + product_now;
                    state   <= state == SLOPE ? BEND : PREPARED;
                end
            end
            PREPARED: begin
                step       <= next_step;
                change     <= next_step - step;
                ready      <= 1'b1;
                final_step <= ended;
                state      <= WAIT;
            end
            DIVIDE: begin                                       // the first step of a brake: how many changes the acceleration is high
                product      <= change[63] ? -change : change;
                upward       <= !change[63];
                pace         <= no_pace ? rate_limit : {8'd0, brake_jerk};
                abrupt       <= brake_rate == 32'd0;
                remainder    <= '0;
                velocity     <= '0;
                acceleration <= '0;
                count        <= '0;
                multiplier   <= '0;
                state        <= SUM;
            end
            SUM: begin                                          // two clk for each bit, by the lowest bit of multiplier
                multiplier[0] <= !multiplier[0];
                if (multiplier[0]) begin
                    velocity     <= velocity + (crossed ? {24'd0, pace} : 64'd0);
                    acceleration <= {acceleration[62:0], 1'b0} + (crossed ? {24'd0, pace} : 64'd0);
                    count        <= count + 1'b1;
                    if (count == 6'd63) state <= DECIDE;
                end else begin
                    crossed   <= bit_now;
                    remainder <= 40'(bit_now ? trial - {1'b0, pace} : trial);
                    product   <= {product[62:0], 1'b0};
                    velocity  <= {velocity[61:0], 2'b0} + (bit_now ? acceleration : -acceleration);
                    if (velocity[63:60] != 4'd0) abrupt <= 1'b1;
                end
            end
            DECIDE: begin
                upward    <= upward_now;
                grow      <= grow_now && may_grow;
                stop_last <= abrupt || (last_now && divided);
                state     <= BRAKE;
                if (grow_now && may_grow) acceleration <= acceleration + {24'd0, pace};
                if (fall_now && divided) begin
                    velocity     <= velocity - acceleration;
                    acceleration <= acceleration - {24'd0, pace};
                end
            end
            BRAKE: begin
                if (grow) velocity <= velocity + acceleration;
                change     <= stop_last ? -step : braking_step;
                step       <= stop_last ? '0 : step + braking_step;
                divided    <= 1'b1;
                ready      <= 1'b1;
                final_step <= stop_last;
                state      <= WAIT;
            end
            default: if (tick && moving) state <= ready ? MAKE : braking ? DIVIDE : ADVANCE;
        endcase
        if (brake || starve || hold_here || rst) begin
            queue_free <= 5'(DEPTH);
            write_at   <= '0;
            read_at    <= '0;
        end
        if (brake || hold_here || rst) armed <= 1'b0;
        if (hold_here || rst) begin
            state               <= WAIT;
            underrun            <= 1'b0;
            target_velocity     <= '0;
            target_acceleration <= '0;
            {moving, braking, divided, last, ended, ready, final_step} <= '0;
            {left, fraction, offset, step, change} <= '0;
        end
        if (rst) exact <= '0;
    end
endmodule

`default_nettype wire
