// SPDX-License-Identifier: Apache-2.0
// profile_player -- play queued segments of constant jerk: target += v; v += a; a += j, once a tick, in exact integers.
//
// latency  3 clk from tick to target, one more for each segment of 0 ticks that is skipped; the rounding at the end of a
//          profile one clk later; a shift in the clk of the step delays the step by one clk
// rate     one step per tick, a tick at most every 5 clk and one clk more for each segment of 0 ticks in a row
// exact    after n ticks of a segment target has moved by v n + a n(n-1)/2 + j n(n-1)(n-2)/6, in 2^-40 period; the 24 bits
//          below the LSB of target are kept from segment to segment and rounded (half up) when the profile ends
// brake    after the strobe, or when no segment follows: target += v; |v| falls by brake_rate; the end when v is zero
// source   forward differences of a cubic
// model    tb/control/profile_player.py, equal in every bit of every cycle
`default_nettype none

module profile_player #(
    parameter int DEPTH = 16                                    // segments in the queue, a power of two from 2 to 16
) (
    input  wire                  clk,
    input  wire                  rst,                           // target becomes zero, the queue empty
    input  wire        [31:0]    brake_rate,                    // 2^-32 period/tick2; 0: v is zero after one step
    input  wire                  tick,                          // strobe: servo tick
    input  wire                  push,                          // strobe: queue the segment; lost when full or braking
    input  wire signed [63:0]    segment_velocity,              // 2^-40 period/tick, at the start of the segment
    input  wire signed [63:0]    segment_acceleration,          // 2^-40 period/tick2, at the start of the segment
    input  wire signed [31:0]    segment_jerk,                  // 2^-40 period/tick3
    input  wire        [23:0]    segment_ticks,                 // duration; 0: the segment is skipped
    input  wire                  segment_last,                  // the profile ends with this segment
    input  wire                  start,                         // strobe: play the queue; ignored while moving or when it is empty
    input  wire                  brake,                         // strobe: controlled stop, queue emptied
    input  wire                  hold_here,                     // strobe: target := position, queue emptied, standing
    input  wire signed [47:0]    position,                      // 2^-16 period, measured
    input  wire                  shift,                         // strobe: the origin moves
    input  wire signed [31:0]    shift_periods,                 // period, added to target
    output logic signed [47:0]   target,                        // 2^-16 period, rounded down while moving
    output logic signed [31:0]   target_velocity,               // 2^-16 period/tick: the step just made; held inside 32 bits
    output logic signed [31:0]   target_acceleration,           // 2^-16 period/tick2: to the next step; held inside 32 bits
    output logic                 moving,                        // a profile is being played
    output logic [4:0]           queue_free,                    // segments that may still be queued
    output logic                 underrun                       // strobe: a segment should have followed and did not
);
    if (DEPTH < 2 || DEPTH > 16 || (DEPTH & (DEPTH - 1)) != 0) begin : g_check DEPTH_MUST_BE_2_4_8_OR_16 u_error (); end

    localparam int A = $clog2(DEPTH);
    localparam [71:0] HALF = 72'd1 << 23;

    enum logic [1:0] {WAIT, LOAD, STEP, ROUND} state;

    logic [184:0]       queue [0:DEPTH-1];
    logic [A-1:0]       write_at, read_at;
    logic [71:0]        exact;                                  // 2^-40 period
    logic signed [63:0] velocity, acceleration;                 // of the next step
    logic signed [31:0] jerk;
    logic [23:0]        left;                                   // steps of this segment
    logic               last, braking, stops;

    wire [184:0] head   = queue[read_at];
    wire         full   = queue_free == 5'd0;
    wire         empty  = queue_free == 5'(DEPTH);
    wire         put    = push && !full && !braking;
    wire         ended  = state == LOAD && !braking && left == 24'd0;
    wire         fetch  = ended && !last && !empty;
    wire         starve = ended && !last && empty;
    wire         move   = state == STEP && !shift;
    wire         finish = state == ROUND && !shift;

    // one adder for every cause of a new target
    wire [71:0] base   = hold_here ? {position, 24'd0} : exact;
    wire [71:0] growth = shift     ? {shift_periods, 40'd0} :
                         hold_here ? 72'd0 :
                         move      ? {{8{velocity[63]}}, velocity} : HALF;

    wire signed [63:0] speed     = velocity[63] ? -velocity : velocity;
    wire signed [63:0] rate      = {24'd0, brake_rate, 8'd0};
    wire               stops_now = brake_rate == 32'd0 || $unsigned(speed) <= $unsigned(rate);

    wire velocity_fits     = velocity[63:55]     == {9{velocity[63]}};
    wire acceleration_fits = acceleration[63:55] == {9{acceleration[63]}};

    assign target = exact[71:24];

    always_ff @(posedge clk) begin
        if (put) queue[write_at] <= {segment_last, segment_ticks, segment_jerk, segment_acceleration, segment_velocity};
        if (put) write_at <= write_at + 1'b1;
        if (fetch) read_at <= read_at + 1'b1;
        if (put != fetch) queue_free <= put ? queue_free - 1'b1 : queue_free + 1'b1;

        if (shift || hold_here || move || finish) exact <= base + growth;
        if ((brake && moving) || starve) braking <= 1'b1;
        underrun <= starve;
        case (state)
            LOAD: begin
                if (fetch) {last, left, jerk, acceleration, velocity} <= head;
                if (braking || starve) acceleration <= stops_now ? -velocity : velocity[63] ? rate : -rate;
                stops <= stops_now;
                state <= ended && last ? ROUND : fetch && head[183:160] == 24'd0 ? LOAD : STEP;
            end
            STEP: if (move) begin
                target_velocity     <= velocity_fits ? velocity[55:24] : {velocity[63], {31{~velocity[63]}}};
                target_acceleration <= acceleration_fits ? acceleration[55:24] : {acceleration[63], {31{~acceleration[63]}}};
                velocity            <= velocity + acceleration;
                acceleration        <= acceleration + {{32{jerk[31]}}, jerk};
                left                <= left - 1'b1;
                state               <= (braking ? stops : last && left == 24'd1) ? ROUND : WAIT;
            end
            ROUND: if (finish) begin
                exact[23:0]         <= '0;
                target_velocity     <= '0;
                target_acceleration <= '0;
                moving              <= 1'b0;
                braking             <= 1'b0;
                last                <= 1'b0;
                left                <= '0;
                state               <= WAIT;
            end
            default: begin
                if (start && !empty) moving <= 1'b1;
                if (tick && moving) state <= LOAD;
            end
        endcase
        if (brake || hold_here || rst) begin
            queue_free <= 5'(DEPTH);
            write_at   <= '0;
            read_at    <= '0;
        end
        if (hold_here || rst) begin
            state               <= WAIT;
            moving              <= 1'b0;
            braking             <= 1'b0;
            last                <= 1'b0;
            left                <= '0;
            underrun            <= 1'b0;
            target_velocity     <= '0;
            target_acceleration <= '0;
        end
        if (rst) exact <= '0;
    end
endmodule

`default_nettype wire
