// SPDX-License-Identifier: Apache-2.0
// profile_player -- play queued segments of constant jerk, at full speed or slower, and stop within
// limits from any state.
//
// latency   2 cycles from tick to target, target_velocity and moving, 3 cycles to
//           target_acceleration. The step was prepared after the tick before; a shift delays it by
//           one cycle. The first tick after start only prepares.
// rate      one step per tick. A tick must come at least 160 cycles after the one before, 12 more
//           for each segment of 0 ticks in a row, and 390 cycles after the first tick of a
//           controlled stop. A tick that comes before its step is prepared is lost. The six words
//           of a segment must stay constant for 7 cycles from push; a push less than 7 cycles after
//           another is lost.
// accuracy  exact: in n ticks a segment moves the profile by v n + a n(n-1)/2 + j n(n-1)(n-2)/6, in
//           2^-40 period. All bits are kept from segment to segment; the last step of the profile
//           rounds to the LSB of target, a half up.
// method    One adder of 72 bits and 16 words of memory, controlled by profile_microcode. Both
//           ramps to zero, of the step and of the rate, follow one rule: the slope is a whole
//           number of increments, and area is what the slope still adds while it falls to zero from
//           here. The slope grows while what is left is enough for the larger area, falls when what
//           is left is less than the area, and otherwise stays. Less than an increment is left in
//           the end, and is the last step.
// behaviour Slower: target is the quadratic B-spline of the positions of the profile, read at a
//           time that advances by the rate. So at any rate from 0 to 100 % |velocity|,
//           |acceleration| and |jerk| stay below those of the segments times rate, rate^2 and
//           rate^2; at 100 % each step is the mean of two steps of the profile. Distances are those
//           of the profile. Where the velocity itself jumps between two segments, one step below
//           100 % may exceed it by half of the jump. Feed override: the rate follows
//           `feed_fraction`. It changes by `slope` per tick at most, its change changes by `curve`,
//           and it ends exactly at the setting, whatever the setting did meanwhile; a profile
//           begins at the setting. Controlled stop: it starts from the step and the acceleration
//           made last. The acceleration changes by stop_jerk per tick at most, by a part of
//           stop_jerk in the first and the last tick, is brought below stop_deceleration, and both
//           end at zero.
// source    forward differences of a cubic; Schoenberg, Quart. Appl. Math. 4 (1946) 45;
//           time-optimal control of two integrators, made discrete so that it ends at zero without
//           chatter
// model     tb/control/profile_player.py, equal in every bit of every cycle
// proved    target moves only by a step, a shift or set_target_to_position, and by the whole of it.
//           After a profile has ended, velocity and acceleration are zero. queue_free is never
//           above DEPTH. A controlled stop and an underrun leave the queue empty.
// proof     depth 8, DEPTH = 2
`default_nettype none

module profile_player #(
    parameter int DEPTH = 16  // segments in the queue, a power of two from 2 to 16
) (
    input  wire                clk,
    input  wire                rst,
    input  wire         [31:0] stop_deceleration,       // 2^-32 period/tick2; 0: stop in one step
    input  wire         [31:0] stop_jerk,               // 2^-40 period/tick3; 0: not limited
    input  wire         [31:0] slope,                   // 2^-32 per tick, of the rate; 0: no limit
    input  wire         [31:0] curve,                   // 2^-32 per tick2; 0: only slope limits
    input  wire         [16:0] feed_fraction,           // 2^-16; 65536 is 100 %, and the largest
    input  wire                pause,                   // level: the rate goes to 0
    input  wire                tick,                    // strobe: servo tick
    input  wire                push,                    // strobe: queue the segment
    input  wire signed  [63:0] segment_velocity,        // 2^-40 period/tick, at its start
    input  wire signed  [63:0] segment_acceleration,    // 2^-40 period/tick2, at its start
    input  wire signed  [31:0] segment_jerk,            // 2^-40 period/tick3
    input  wire         [23:0] segment_ticks,           // ticks; 0: the segment is skipped
    input  wire                segment_last,            // level: the profile ends with this segment
    input  wire                start,                   // strobe: play the queue
    input  wire                arm,                     // strobe: start when now reaches start_at
    input  wire         [31:0] start_at,                // cycles
    input  wire         [31:0] now,                     // cycles, wraps
    input  wire                controlled_stop,         // strobe: stop and empty the queue
    input  wire                set_target_to_position,  // strobe: target := position, standstill
    input  wire signed  [47:0] position,                // 2^-16 period, measured
    input  wire                shift,                   // strobe: the origin moves
    input  wire signed  [47:0] shift_by,                // 2^-16 period, added to target
    output logic signed [47:0] target,                  // 2^-16 period, rounded down in motion
    output logic signed [31:0] target_velocity,         // 2^-16 period/tick; saturates
    output logic signed [31:0] target_acceleration,     // 2^-16 period/tick2; saturates
    output logic               moving,                  // level: a profile is being played
    output logic               armed,                   // level: waits for start_at
    output logic        [ 4:0] queue_free,              // segments that still fit
    output logic               underrun                 // strobe: a segment was missing
);
    // A stop_jerk above stop_deceleration does not limit either. push is ignored while the queue is
    // full or a controlled stop runs; start is ignored in motion or with an empty queue. Both
    // controlled_stop and set_target_to_position disarm the start and empty the queue.
    // target_velocity is the last step, target_acceleration the last step less the one before.
    if (DEPTH < 2 || DEPTH > 16 || (DEPTH & (DEPTH - 1)) != 0) begin : g_check
        DEPTH_MUST_BE_2_4_8_OR_16 u_error ();
    end

    localparam int A = $clog2(DEPTH);

    // as in tables/profile_microcode.py
    localparam [4:0] GOTO = 5'd1, NEGATIVE = 5'd2, POSITIVE = 5'd3, QUOTIENT = 5'd4, LOOP = 5'd5;
    localparam [4:0] MULTIPLY = 5'd6, FACTOR = 5'd7, COUNT_31 = 5'd8, WORD = 5'd9, POP = 5'd10;
    localparam [4:0] LAST = 5'd11, STARVED = 5'd12, READY = 5'd13, CROSS = 5'd14, CROSSED = 5'd15;
    localparam [4:0] FIRST = 5'd16, LATER = 5'd17, STOPPING = 5'd18, WIDE = 5'd19, ARRIVED = 5'd20;
    localparam [4:0] SET_UPWARD = 5'd21, END = 5'd22, ARRIVE = 5'd23, PREPARED = 5'd24;
    localparam [4:0] WAIT = 5'd25, MAKE = 5'd26, DISPATCH = 5'd27;
    localparam [2:0] LIMIT = 3'd1, CURVE = 3'd2, SETTING = 3'd3, FULL = 3'd4, HALF = 3'd5;
    localparam [2:0] QUEUE_LOW = 3'd6, QUEUE_HIGH = 3'd7;
    localparam [4:0] LOW = 5'd9;

    // a step is prepared; the segment is the last; the prepared step is the last
    logic ready, last, final_step;
    // a controlled stop is requested; is being computed; is at its first step
    logic braking, stopping, first;
    logic upward, arrived, crossed, wide, negative;

    // the microcode
    logic [6:0] line;
    logic [4:0] count;
    logic       jump;
    wire  [6:0] target_line;
    wire [4:0] job, operand, word;
    wire halved, with_acc;
    wire [1:0] sign;

    wire       full = queue_free == 5'd0;
    wire       empty = queue_free == 5'(DEPTH);
    wire       clear = set_target_to_position || rst;
    wire       ticked = job == WAIT && tick && moving;
    wire       make = job == MAKE && !shift;
    // a controlled stop may have emptied the queue meanwhile
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
        .code({target_line, job, halved, with_acc, sign, operand, word})
    );

    // the queue: seven words per segment, written and read one per cycle
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
    logic [71:0] memory                                                                   [0:15];
    logic [71:0] acc;
    logic [31:0] factor;
    logic [39:0] outside;

    wire         from_memory = !operand[4] || !operand[3];
    wire         gate = from_memory && job != MAKE && (job != MULTIPLY || factor[0]);
    wire  [ 3:0] read_from = operand[4] ? {1'b0, !stopping, operand[1:0]} : operand[3:0];
    wire  [ 3:0] write_to = word[4] ? {1'b0, !stopping, word[1:0]} : word[3:0];
    wire  [71:0] stored = memory[read_from];
    wire         queue_high = !from_memory && operand[2:0] == QUEUE_HIGH;
    wire  [32:0] fraction = {1'b0, feed_fraction[15:0], 16'd0};
    wire  [32:0] setting = pause ? 33'd0 : feed_fraction[16] ? 33'h1_0000_0000 : fraction;

    always_comb begin
        case (operand[2:0])
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

    wire        [71:0] from_word = stored & {{48{gate && operand != LOW}}, {24{gate}}};
    wire        [39:0] queue_top = {{8{queue_word[31]}}, queue_word[31:0]};
    wire        [39:0] outside_top = queue_high ? queue_top : {32'd0, outside[39:32]};
    wire        [71:0] term = from_word | {outside_top, outside[31:0]};
    wire               minus = sign[1] ? sign[0] == upward : sign[0];
    wire        [71:0] sum = (with_acc ? acc : '0) + (term ^ {72{minus}}) + 72'(minus);

    // target is moved by a step or by a shift, or is set to position
    wire signed [47:0] from = set_target_to_position ? position : target;
    wire signed [47:0] by = shift ? shift_by : make && !set_target_to_position ? acc[71:24] : '0;

    wire               fits = stored[71:55] == {17{stored[71]}};
    wire signed [31:0] held = fits ? stored[55:24] : {stored[71], {31{~stored[71]}}};

    always_ff @(posedge clk) begin
        line <= next;
        acc  <= halved ? {sum[71], sum[71:1]} : sum;
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
    wire  still = target_velocity == '0 && target_acceleration == '0;
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
                assert (!moving && !armed && !ready && still && line == '0);
            if ($past(moving) && !moving) assert (still);
            if ($past(controlled_stop) && !$past(rst)) assert (queue_free == 5'(DEPTH) && !armed);
        end
        cover (past && !rst && moving && armed && queue_free != 5'(DEPTH));
        cover (past && !rst && braking && !ready);
    end
`endif
endmodule

`default_nettype wire
