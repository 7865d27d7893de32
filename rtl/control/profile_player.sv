// SPDX-License-Identifier: Apache-2.0
// profile_player -- play queued segments of constant jerk, at full speed or slower, and stop within
// limits from anywhere.
//
// latency  2 clk from tick to target, target_velocity and moving, 3 to target_acceleration: the
//          step was prepared after the tick before; a shift delays it by one clk. The first tick
//          after start only prepares
// rate     one step per tick; a tick at least 160 clk after the one before, and 12 more for each
//          segment of 0 ticks in a row; 390 clk after the first of a brake. A tick that comes
//          before its step is prepared is lost. The six words of a segment stand for 7 clk from
//          push; a push less than 7 clk after another is lost
// exact    a segment moves the profile by v n + a n(n-1)/2 + j n(n-1)(n-2)/6 in n ticks, in 2^-40
//          period. All bits are kept from segment to segment and rounded to the LSB of target (half
//          up) with the last step of the profile
// slower   target is the quadratic B-spline of the profile's positions, read at a time that
//          advances by the rate. So at any rate from 0 to 100 % |velocity|, |acceleration| and
//          |jerk| stay below those of the segments times rate, rate^2, rate^2; at 100 % each step
//          is the mean of two of the profile. The lengths are those of the profile. Where the
//          velocity itself steps between two segments, one step below 100 % may exceed it by half
//          of that
// override the rate goes to `feed_fraction`: it changes by `slope` a tick at most, its change by
//          `curve`, and it ends at the setting exactly,
//          whatever the setting did on the way; a profile begins at the setting
// brake    from the step and the acceleration made last: the acceleration changes by stop_jerk a
//          tick at most, a part of stop_jerk in the first and the last, is brought below
//          stop_deceleration, and both end at zero
// law      of both ways to zero: the slope is a whole number of paces; area is what it still adds
//          while it falls to zero from here. It grows while what is left is enough for the larger
//          area, falls when that is less than the area, else it stays. Less than a pace is left in
//          the end, and is the last step
// source   forward differences of a cubic; Schoenberg, Quart. Appl. Math. 4 (1946) 45; time-optimal
//          control of two integrators, made discrete so that it ends at zero without chatter
// built    one adder of 72 bits and 16 words of memory, moved by profile_microcode
//          (tables/profile_microcode.py)
// proved   target moves by a step, shift or set_target_to_position only, by the whole of it; what
//          stops moving has no velocity nor acceleration; queue_free is never above DEPTH; brake
//          and underrun leave the queue empty
// proof    depth 8, DEPTH = 2
// model    tb/control/profile_player.py, equal in every bit of every cycle
`default_nettype none

module profile_player #(
    parameter int DEPTH = 16  // segments in the queue, a power of two from 2 to 16
) (
    input wire clk,
    input wire rst,  // target becomes zero, the queue empty
    input wire [31:0] stop_deceleration,  // 2^-32 period/tick2; 0: velocity is zero after one step
    input  wire        [31:0]    stop_jerk,                    // 2^-40 period/tick3; 0, or more than stop_deceleration: not limited
    input wire [31:0] slope,  // of the rate, 2^-32 per tick; 0: no limit
    input wire [31:0] curve,  // of the rate, 2^-32 per tick2; 0: no limit but slope
    input wire [16:0] feed_fraction,  // rate wanted, 2^-16: 65536 is 100 %, more is taken for it
    input wire pause,  // the rate wanted is 0
    input wire tick,  // strobe: servo tick
    input wire push,  // strobe: queue the segment; lost when full or braking
    input wire signed [63:0] segment_velocity,  // 2^-40 period/tick, at the start of the segment
    input  wire signed [63:0]    segment_acceleration,          // 2^-40 period/tick2, at the start of the segment
    input wire signed [31:0] segment_jerk,  // 2^-40 period/tick3
    input wire [23:0] segment_ticks,  // duration; 0: the segment is skipped
    input wire segment_last,  // the profile ends with this segment
    input wire start,  // strobe: play the queue; ignored while moving or when it is empty
    input  wire                  arm,                           // strobe: start when `now` reaches start_at; a brake or set_target_to_position disarms
    input wire [31:0] start_at,  // clk
    input wire [31:0] now,  // clk, wraps
    input wire controlled_stop,  // strobe: controlled stop, queue emptied
    input wire set_target_to_position,  // strobe: target := position, queue emptied, standing
    input wire signed [47:0] position,  // 2^-16 period, measured
    input wire shift,  // strobe: the origin moves
    input wire signed [47:0] shift_by,  // 2^-16 period, added to target
    output logic signed [47:0] target,  // 2^-16 period, rounded down while moving
    output logic signed [31:0]   target_velocity,               // 2^-16 period/tick: the step just made; held inside 32 bits
    output logic signed [31:0]   target_acceleration,           // 2^-16 period/tick2: less the step before; held inside 32 bits
    output logic moving,  // a profile is being played
    output logic armed,  // waits for start_at
    output logic [4:0] queue_free,  // segments that may still be queued
    output logic underrun  // strobe: a segment should have followed and did not
);
    if (DEPTH < 2 || DEPTH > 16 || (DEPTH & (DEPTH - 1)) != 0) begin : g_check
        DEPTH_MUST_BE_2_4_8_OR_16 u_error ();
    end

    localparam int A = $clog2(DEPTH);

    // as in tables/profile_microcode.py
    localparam [4:0] GOTO = 5'd1, NEGATIVE = 5'd2, POSITIVE = 5'd3, QUOTIENT = 5'd4, LOOP = 5'd5, MULTIPLY = 5'd6, FACTOR = 5'd7,
                     COUNT_31 = 5'd8, WORD = 5'd9, POP = 5'd10, LAST = 5'd11, STARVED = 5'd12, READY = 5'd13, CROSS = 5'd14,
                     CROSSED = 5'd15, FIRST = 5'd16, LATER = 5'd17, STOPPING = 5'd18, WIDE = 5'd19, ARRIVED = 5'd20,
                     SET_UPWARD = 5'd21, END = 5'd22, ARRIVE = 5'd23, PREPARED = 5'd24, WAIT = 5'd25, MAKE = 5'd26, DISPATCH = 5'd27;
    localparam [2:0] LIMIT = 3'd1, CURVE = 3'd2, SETTING = 3'd3, FULL = 3'd4, HALF = 3'd5, QUEUE_LOW = 3'd6, QUEUE_HIGH = 3'd7;
    localparam [4:0] LOW = 5'd9;

    // a step is prepared; of the segment; of the prepared step
    logic ready, last, final_step;
    // a brake is wanted; is what the program is at; its first step
    logic braking, stopping, first;
    logic upward, arrived, crossed, wide, negative;

    // the program
    logic [6:0] line;
    logic [4:0] count;
    logic       jump;
    wire  [6:0] target_line;
    wire [4:0] job, place, word;
    wire halved, with_acc;
    wire [1:0] sign;

    wire       full = queue_free == 5'd0;
    wire       empty = queue_free == 5'(DEPTH);
    wire       clear = set_target_to_position || rst;
    wire       ticked = job == WAIT && tick && moving;
    wire       make = job == MAKE && !shift;
    // a brake may have emptied it on the way
    wire       pop = job == POP && !empty && !controlled_stop;
    wire       starve = job == STARVED && !braking && empty;
    wire       reached = armed && $signed(now - start_at) >= 0;
    wire       begins = (start || reached) && !empty && !moving && !controlled_stop;

    always_comb begin
        case (job)
            GOTO, PREPARED, END, ARRIVE: jump = 1'b1;
            NEGATIVE, QUOTIENT: jump = negative;
            POSITIVE:           jump = !negative;
            LOOP, MULTIPLY:     jump = count != 5'd31;
            LAST:               jump = last && !braking;
            STARVED:            jump = braking || empty;
            READY:              jump = ready;
            CROSSED:            jump = crossed;
            FIRST:              jump = stopping && first;
            LATER:              jump = !first;
            STOPPING:           jump = stopping;
            MAKE:               jump = final_step;
            WIDE:               jump = wide;
            ARRIVED:            jump = arrived;
            WAIT:               jump = !ready;
            DISPATCH:           jump = braking;
            default:            jump = 1'b0;
        endcase
    end

    wire       stay = (job == WAIT && !ticked) || (job == MAKE && shift);
    wire [6:0] next = clear ? 7'd0 : stay ? line : jump ? target_line : line + 7'd1;

    profile_microcode u_microcode (
        .clk,
        .next,
        .code({target_line, job, halved, with_acc, sign, place, word})
    );

    // the queue: seven words a segment, written and read one a clk
    logic [32:0] queue[0:DEPTH*8-1];
    logic [32:0] queue_in, queue_out, queue_word;
    logic [A-1:0] write_at, read_at;
    logic [2:0] write_word, read_word;

    wire put = push && !full && !braking && write_word == 3'd0;
    wire write = put || write_word != 3'd0;

    always_comb begin
        case (write_word)
            3'd0:    queue_in = {1'b0, segment_velocity[31:0]};
            3'd1:    queue_in = {1'b0, segment_velocity[63:32]};
            3'd2:    queue_in = {1'b0, segment_acceleration[31:0]};
            3'd3:    queue_in = {1'b0, segment_acceleration[63:32]};
            3'd4:    queue_in = {1'b0, segment_jerk};
            3'd5:    queue_in = {33{segment_jerk[31]}};
            default: queue_in = {segment_last, 8'd0, segment_ticks};
        endcase
    end

    always_ff @(posedge clk) begin
        if (write) queue[{write_at, write_word}] <= queue_in;
        queue_out  <= queue[{read_at, read_word}];
        queue_word <= queue_out;
    end

    // the adder and its memory
    logic [71:0] memory[0:15];
    logic [71:0] acc;
    logic [31:0] factor;
    logic [39:0] outside;

    wire from_memory = !place[4] || !place[3];
    wire gate = from_memory && job != MAKE && (job != MULTIPLY || factor[0]);
    wire [3:0] read_from = place[4] ? {1'b0, !stopping, place[1:0]} : place[3:0];
    wire [3:0] write_to = word[4] ? {1'b0, !stopping, word[1:0]} : word[3:0];
    wire [71:0] stored = memory[read_from];
    wire queue_high = !from_memory && place[2:0] == QUEUE_HIGH;
    wire         [32:0] setting   = pause ? 33'd0 : feed_fraction[16] ? 33'h1_0000_0000 : {1'b0, feed_fraction[15:0], 16'd0};

    always_comb begin
        case (place[2:0])
            LIMIT:     outside = stopping ? {stop_deceleration, 8'd0} : {8'd0, slope};
            CURVE:     outside = {8'd0, stopping ? stop_jerk : curve};
            SETTING:   outside = {7'd0, setting};
            FULL:      outside = 40'h1_0000_0000;
            HALF:      outside = {16'd0, final_step, 23'd0};
            QUEUE_LOW: outside = {8'd0, queue_word[31:0]};
            default:   outside = '0;
        endcase
        if (from_memory) outside = '0;
    end

    wire         [71:0] term = (stored & {{48{gate && place != LOW}}, {24{gate}}})
                               | {queue_high ? {{8{queue_word[31]}}, queue_word[31:0]} : {32'd0, outside[39:32]}, outside[31:0]};
    wire minus = sign[1] ? sign[0] == upward : sign[0];
    wire [71:0] sum = (with_acc ? acc : '0) + (term ^ {72{minus}}) + 72'(minus);

    // target: moved by a step or a shift, or set
    wire signed [47:0] from = set_target_to_position ? position : target;
    wire signed [47:0] by = shift ? shift_by : make && !set_target_to_position ? acc[71:24] : '0;

    wire fits = stored[71:55] == {17{stored[71]}};
    wire signed [31:0] held = fits ? stored[55:24] : {stored[71], {31{~stored[71]}}};

    always_ff @(posedge clk) begin
        line     <= next;
        acc      <= halved ? {sum[71], sum[71:1]} : sum;
        if (job == FACTOR) acc <= '0;
        negative <= sum[71];
        if (!word[4] || !word[3]) memory[write_to] <= sum;
        if (job == FACTOR) factor <= sum[31:0];
        else if (job == QUOTIENT || job == MULTIPLY) factor <= {!negative, factor[31:1]};
        if (job == COUNT_31) count <= 5'd1;
        else if (job == LOOP || job == MULTIPLY) count <= count + 1'b1;
        if (job == COUNT_31) wide <= 1'b0;
        else if (job == MULTIPLY && acc[71:68] != 4'd0) wide <= 1'b1;
        if (job == SET_UPWARD) upward <= sum[71];
        if (job == ARRIVED) arrived <= 1'b0;
        else if (job == ARRIVE) arrived <= sum[71];
        if (ticked || job == DISPATCH) stopping <= braking;
        else if (job == STARVED && jump) stopping <= 1'b1;
        if (job == END) final_step <= 1'b1;
        if (job == PREPARED) begin
            ready <= 1'b1;
            first <= !stopping;
        end

        if (put || write_word != 3'd0) write_word <= write_word == 3'd6 ? 3'd0 : write_word + 1'b1;
        if (write_word == 3'd6) write_at <= write_at + 1'b1;
        if (job == WAIT) {crossed, read_word} <= '0;
        if (job == CROSS) crossed <= 1'b1;
        if (job == WORD || job == STARVED) read_word <= read_word + 1'b1;
        if (job == POP) {last, read_word} <= {queue_word[32], 3'd0};
        if (pop) read_at <= read_at + 1'b1;
        if (put != pop) queue_free <= put ? queue_free - 1'b1 : queue_free + 1'b1;

        target   <= from + by;
        underrun <= starve;
        if (arm || reached) armed <= arm;
        if (begins) moving <= 1'b1;
        if ((controlled_stop && moving) || starve) braking <= 1'b1;
        if (make) target_velocity <= final_step ? '0 : held;
        if (make && final_step) target_acceleration <= '0;
        else if (job == DISPATCH) target_acceleration <= held;

        if (controlled_stop || starve || clear) begin
            queue_free <= 5'(DEPTH);
            write_at   <= read_at;
            write_word <= '0;
        end
        if (clear || (make && final_step))
            {moving, braking, ready, last, final_step, arrived} <= '0;
        if (clear || (make && final_step)) {first, count} <= 6'b1_00000;
        if (controlled_stop || clear) armed <= 1'b0;
        if (clear) begin
            underrun            <= 1'b0;
            target_velocity     <= '0;
            target_acceleration <= '0;
        end
        if (rst) {target, write_at, read_at} <= '0;
    end

`ifdef FORMAL
    logic past = 1'b0;
    always_ff @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert (queue_free <= 5'(DEPTH));
            assert (write_word != 3'd7);
            assert (!underrun || (queue_free == 5'(DEPTH) && braking));
            if (!$past(rst || set_target_to_position || shift || make))
                assert (target == $past(target));
            if ($past(shift && !set_target_to_position && !rst))
                assert (target == $past(target) + $past(shift_by));
            if ($past(set_target_to_position && !shift && !rst)) assert (target == $past(position));
            if ($past(rst || set_target_to_position))
                assert (!moving && !armed && !ready && target_velocity == '0 && target_acceleration == '0 && line == '0);
            if ($past(moving) && !moving)
                assert (target_velocity == '0 && target_acceleration == '0);
            if ($past(controlled_stop) && !$past(rst)) assert (queue_free == 5'(DEPTH) && !armed);
        end
        cover (past && !rst && moving && armed && queue_free != 5'(DEPTH));
        cover (past && !rst && braking && !ready);
    end
`endif
endmodule

`default_nettype wire
