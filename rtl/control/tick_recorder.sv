// SPDX-License-Identifier: Apache-2.0
// tick_recorder -- record chosen signals of axes at each servo tick, evenly, into a block memory,
// from before a trigger on, so that a host can read them in its own time; or without end, while the
// host reads.
//
// latency  1 cycle from the last result of a sample to phase and available; 2 cycles from there to
//          the first word and from read to the next word, and one more for each word that is stored
//          meanwhile
// rate     one word per cycle while it records; one word per 2 cycles while it is read
// behaviour A sample begins at a tick and ends with the command of the last axis. It has one word
//          of each channel, in their order. Signals 1 to 6 are results, 6 is the integral; the
//          others, and 1 and 2 while there are none, are taken one after the other in the cycles
//          after the tick that have no result of a channel. Of two channels that are the same only
//          the first one has the results.
//          The trigger looks at one signal of each sample once there are `earlier` samples: mode 0
//          always, 1 it rises to level, 2 it falls below it, 3 its size reaches level, 4 it has a
//          bit of level. Without delay that sample follows the `earlier` ones; with delay it is the
//          first one so many ticks later at whose tick `ready` is high.
//          The recording ends after length samples, or when no sample fits any more. With length 0
//          only the latter ends it, and its words can be read while it records.
// model    tb/control/tick_recorder.py, equal in every bit of every cycle
// proved   Nothing is stored unless a recording is waiting or recording; words that are available
//          were stored, and are not stored over before they are read.
// proof    depth 12, WORDS = 16
`default_nettype none

module tick_recorder #(
    parameter int AXES  = 1,    // axes of the engine, 1 to 8
    parameter int WORDS = 4096  // words of the memory, a power of two, 16 to 65536
) (
    input  wire         clk,
    input  wire         rst,
    // settings
    input  wire         start,           // strobe: record from now on
    input  wire  [ 2:0] last,            // number of the last channel
    input  wire  [63:0] channels,        // a byte each: signal 4 bits, number of its axis 3 bits
    input  wire  [ 7:0] trigger,         // what triggers, in the same way
    input  wire  [ 2:0] trigger_mode,    // how it triggers
    input  wire  [31:0] level,           // of the trigger, signed
    input  wire  [15:0] length,          // samples; 0: no end
    input  wire  [15:0] every,           // one sample in so many ticks; 0 acts as 1
    input  wire  [15:0] earlier,         // samples from before the trigger, less than length
    input  wire  [15:0] delay,           // ticks from the trigger; 0 keeps its sample
    // what is recorded
    input  wire         tick,            // strobe: servo tick
    input  wire         ready,           // level: the sample after a delay may begin
    output logic [ 2:0] seen_axis,       // number of the axis of these levels
    input  wire  [31:0] sine_cosine,     // samples of the axis, cosine in the upper half
    input  wire  [31:0] target,          // the last result 1 of the axis
    input  wire  [31:0] position,        // 2^-16 period, low word
    input  wire  [31:0] interpolated,    // phase, 2^-16 period
    input  wire  [31:0] fine_command,    // full scale 2^15, signed
    input  wire  [31:0] faults,          // bits as in axis_registers.faults
    input  wire         valid,           // strobe: result is new
    input  wire         integral_valid,  // strobe: result is the integral
    input  wire  [ 2:0] result_axis,     // number of its axis
    input  wire  [ 2:0] kind,            // number of what it is
    input  wire  [31:0] result,          // its lower half
    // reading
    input  wire         read,            // strobe: go on to the next word
    output logic [31:0] word,            // word of the recording
    output logic [ 1:0] phase,           // 0 empty, 1 waiting for the trigger, 2 recording, 3 full
    output logic [16:0] available,       // words that can be read
    // command_excitation
    output logic        triggered        // level: from the trigger to the end of the recording
);
    if (WORDS < 16 || WORDS > 65536 || (WORDS & (WORDS - 1)) != 0) begin : g_check
        WORDS_MUST_BE_A_POWER_OF_TWO_FROM_16_TO_65536 u_error ();
    end

    localparam [2:0] COMMAND = 3'd5;  // kind of result, as in tables/engine_microcode.py
    // signals
    localparam [3:0] VELOCITY = 4'd2, INTEGRAL = 4'd6;
    // bits 3, 1 and 0 of the signals that are taken
    localparam [2:0] SINE_COSINE = 3'd0, TARGET = 3'd1, NO_VELOCITY = 3'd2, POSITION = 3'd3;
    localparam [2:0] PHASE = 3'd4, FINE_COMMAND = 3'd5;
    localparam int TRIGGER = 8, NONE = 9;  // entries after the channels
    localparam [1:0] EMPTY = 2'd0, WAITING = 2'd1, RECORDING = 2'd2, FULL = 2'd3;
    localparam [2:0] ALWAYS = 3'd0, RISES = 3'd1, FALLS = 3'd2, BEYOND = 3'd3, BITS = 3'd4;
    localparam int A = $clog2(WORDS);

    // the entry of which `take` has the bit
    function [6:0] picked(input [79:0] entries, input [9:0] take);
        picked = '0;
        for (int n = 0; n < 10; n++) picked = picked | (entries[8*n+:7] & {7{take[n]}});
    endfunction

    // the lowest bit of those that match, or else the one that is taken
    function [3:0] number_of(input [9:0] match, input [9:0] take);
        number_of = '0;
        for (int n = 0; n < 10; n++) if (take[n]) number_of = number_of | 4'(n);
        for (int n = 9; n >= 0; n--) if (match[n]) number_of = 4'(n);
    endfunction

    logic [31:0] memory[0:WORDS-1];
    logic [A-1:0] base, at;  // first word of the sample; word that is read
    logic [16:0] used;  // words of complete samples that are kept
    logic [15:0] kept, passed, left;  // samples; ticks since the last one, and of the delay
    logic [9:0] take;  // one bit: the entry that is taken next
    logic [9:0] got;  // entries of which results have come in this sample
    logic begun, sampling, delaying;  // there is a sample; it is not complete; the delay runs
    logic [31:0] watched;  // signal of the trigger
    logic known, was_above;  // it was seen in a sample; it was above the level

    // the words of a sample
    wire        active = phase == WAITING || phase == RECORDING;
    wire        over = delaying ? left <= 16'd1 && ready : !begun || passed + 1'b1 >= every;
    wire        due = active && tick && over;
    wire        counted = valid && kind != '0 && kind <= COMMAND;
    wire [ 3:0] number = integral_valid ? INTEGRAL : 4'(kind);
    wire [79:0] entries = {8'd0, trigger, channels};
    wire [ 6:0] entry = picked(entries, take);
    wire [ 9:0] match;  // entries that the result belongs to
    for (genvar n = 0; n < 10; n++) begin : g_match
        assign match[n] = sampling && (counted || integral_valid) &&
                          entries[8*n+:7] == {result_axis, number};
    end
    wire  [  3:0] index = number_of(match, take);  // entry whose value is new
    wire          given = |match;
    wire          taken = sampling && !given && !take[NONE];
    wire          is_level = entry[3:0] <= VELOCITY || entry[3:0] > INTEGRAL;
    wire          new_value = !due && (given || taken && is_level && (got & take) == '0);
    wire  [A-1:0] place = base + A'(index);
    wire          keep = new_value && index <= 4'(last);

    wire  [  2:0] level_of = {entry[3], entry[1:0]};
    logic [ 31:0] value;
    always_comb begin
        case (level_of)
            SINE_COSINE:  value = sine_cosine;
            TARGET:       value = target;
            NO_VELOCITY:  value = '0;  // of a target that does not move
            POSITION:     value = position;
            PHASE:        value = interpolated;
            FINE_COMMAND: value = fine_command;
            default:      value = faults;
        endcase
        if (given) value = result;
    end

    assign seen_axis = entry[6:4];

    // the trigger, at the end of a sample
    wire         ends = sampling && valid && kind == COMMAND && result_axis == 3'(AXES - 1) && !due;
    wire  [31:0] seen = match[TRIGGER] ? value : watched;
    wire         above = $signed(seen) >= $signed(level);
    wire         below = $signed(seen) <= -$signed(level);
    logic        hits;
    always_comb begin
        case (trigger_mode)
            RISES:   hits = known && above && !was_above;
            FALLS:   hits = known && !above && was_above;
            BEYOND:  hits = above || below;
            BITS:    hits = |(seen & level);
            default: hits = trigger_mode == ALWAYS;
        endcase
    end
    // the end of a sample
    wire [16:0] each = 17'(last) + 1'b1;
    wire        fits = used + each + each <= 17'(WORDS);  // this sample and one more
    wire        ripe = kept == earlier || !fits;
    wire        counts = phase == RECORDING || delaying || hits && ripe && delay == '0;
    wire        drops = ends && !counts && ripe;  // the oldest sample
    wire        complete = !fits || length != '0 && kept + 1'b1 >= length;
    wire        passes = read && available != '0;

    assign available = phase == FULL || phase == RECORDING && length == '0 ? used : '0;
    assign triggered = phase == RECORDING || delaying;

    always_ff @(posedge clk) begin
        // one port: what is stored comes first
        if (keep) memory[place] <= value;
        else word <= memory[at];
    end

    always_ff @(posedge clk) begin
        if (active && tick) begin
            passed <= due ? '0 : passed + 1'b1;
            if (left > 16'd1) left <= left - 1'b1;
        end
        if (taken) take <= take << 1;
        got <= got | match;
        if (new_value && (given ? match[TRIGGER] : take[TRIGGER])) watched <= value;
        if (ends) begin
            sampling <= 1'b0;
            {known, was_above} <= {1'b1, above};
            base <= base + each[A-1:0];
            if (!drops) kept <= kept + 1'b1;
            if (counts) phase <= complete ? FULL : RECORDING;
            delaying <= !counts && hits && ripe;
            if (hits && !delaying) left <= delay;
        end
        if (due) begin
            {begun, sampling} <= 2'b11;
            take <= 10'd1;
            got  <= '0;
        end
        used <= used + (ends && !drops ? each : '0) - 17'(passes);
        at   <= at + (drops ? each[A-1:0] : A'(passes));
        if (start) begin
            phase <= WAITING;
            {begun, sampling, delaying, known} <= '0;
            base   <= '0;
            at     <= '0;
            used   <= '0;
            kept   <= '0;
            passed <= '0;
            left   <= '0;
            watched <= '0;
        end
        if (rst) begin
            phase <= EMPTY;
            {begun, sampling, delaying, known} <= '0;
            used <= '0;
        end
    end

`ifdef FORMAL
    logic         past = 1'b0;
    wire  [A-1:0] distance = place - at;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            assume (start || last == $past(last));
            assert (!keep || active);
            assert (!active || base == A'(at + used[A-1:0]));
            assert (used <= 17'(WORDS) && available <= used);
            assert (start || !keep || 17'(distance) >= used);
            assert (!sampling || active);
            assert (!delaying || phase == WAITING);
            assert (start || !active || used + each <= 17'(WORDS));
        end
        cover (past && phase == FULL && word == 32'h1234_5678);
    end
`endif
endmodule

`default_nettype wire
