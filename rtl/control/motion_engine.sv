// SPDX-License-Identifier: Apache-2.0
// motion_engine -- compute velocity, profile, servo and motor steps of all axes of a node in one
// datapath, one axis after the other at each servo tick.
//
// latency   `cycles` at most from tick to the last result: 70 and 365 for each axis without
//           filters, 480 with two filters, 584 with four. The results of an axis come before the
//           next step of its profile is prepared, which is the last third of its time.
// rate      a tick when the one before has been served, else overrun is reported and what the axes
//           show is not certain; between two ticks one request of an axis per 20 to 70 cycles
// accuracy  Profile: exact, in n ticks a segment moves by v n + a n(n-1)/2 + j n(n-1)(n-2)/6 in
//           2^-40 period; the last step rounds to the LSB of target, a half up. Velocity: distance
//           by time between the last two steps, in 2^-24 period/tick, within one quantum of the
//           distance of the tick, and bounded by one quantum over the time without a step from the
//           first tick without one on. Motor steps: floor((target + trim + take_up) * step_ratio
//           / 2^32) modulo 2^48.
// method    One adder of 72 bits, one multiplier of 35 bits and one memory, controlled by the
//           microcode of tables/engine_microcode.py. A line is fetched, its operand is read in the
//           next cycle and added in the one after. The words of an axis, its queue, its settings
//           and its filters are in the memory; the flags are loaded with each axis. What comes from
//           outside and what comes from memory are combined by OR: the one that is not meant is 0.
// behaviour All axes are sampled in the cycle of the tick, and starts that were requested before it
//           begin at it. A start makes the profile move at once; the first tick only prepares.
//           Requests are served between two ticks, in the order shift, set_target_to_position,
//           push, start, arm, controlled_stop; at the tick only shifts, and starts of axes that
//           wait for nothing else. A shift is done in the cycle in which the position moves: it is
//           seen with the position, so the error is never disturbed. push takes the segment from
//           the settings; it is ignored while the queue is full or a stop runs, and a segment of 0
//           ticks that is not the last is left out. Without a segment the acceleration stays for
//           one tick, underrun is reported, and a controlled stop begins. Profile, feed override,
//           servo and filters are those of the models. Results: 0 state (the flags from bit 1 on,
//           bit 16 the head of the queue, bit 20 its length), 1 target in 2^-16 period, 2 its
//           velocity and 3 the measured velocity in 2^-16 period/tick, 4 following error in 2^-16
//           period (flag: above following_limit), 5 command (flag: at its limit), 6 target in 2^-16
//           motor step (flag: restart there), 7 underrun. The integral of the servo comes before
//           each command, with a strobe of its own, in 2^-16 command.
//           A setting is written within 100 cycles between two ticks, and before the next axis is
//           served during a tick. While there is nothing to do, the program stays at one line.
// limits    The build stops if the axes need more than TICK_CYCLES. Settings keep these units:
//           gains 2^-16 command/LSB (ki and ka 2^-24), output_limit 2^-16 command, integral_limit
//           2^-24 command, coefficients 2^-32, stop_deceleration 2^-40 period/tick2, trim_scale
//           2^-16 period/command, segment_ticks bit 24: the last segment. A segment, and shift_by
//           from the cycle after shift on, stay as they are while `waits` is high.
// source    forward differences of a cubic; Schoenberg, Quart. Appl. Math. 4 (1946) 45; Ohmae et
//           al., IEEE Trans. IE-29 (1982) 207, count times
// model     tb/control/motion_engine.py, equal in every result of every tick and request
`default_nettype none

module motion_engine #(
    parameter  int AXES        = 1,                    // axes, 1 to 8
    parameter  int FILTERS     = 0,                    // filters of each servo, 0 to 4
    parameter  int TICK_CYCLES = 0,                    // cycles between two ticks; 0: not checked
    localparam int WORD_W      = FILTERS == 0 ? 7 : 8  // bits of the address of a word of an axis
) (
    input  wire                       clk,
    input  wire                       rst,
    input  wire                       tick,                    // strobe: servo tick
    input  wire         [       31:0] now,                     // cycles, time stamp, wraps
    // settings
    input  wire                       setting_write,           // strobe: write a setting
    input  wire         [        2:0] setting_axis,            // number of its axis
    input  wire         [        6:0] setting_word,            // number of its word
    input  wire         [        1:0] setting_filter,          // number of its filter
    input  wire signed  [       63:0] setting,                 // value
    output logic                      setting_waits,           // level: it must stay as it is
    // the axes
    input  wire         [48*AXES-1:0] position,                // 2^-16 period, of each axis
    input  wire         [   AXES-1:0] stepped,                 // strobes: position made a step
    input  wire         [   AXES-1:0] downward,                // level: that step went down
    input  wire         [   AXES-1:0] block_up,                // level: no positive command passes
    input  wire         [   AXES-1:0] block_down,              // level: no negative command passes
    input  wire         [   AXES-1:0] closed_loop,             // level: 0: command is open_command
    input  wire         [24*AXES-1:0] take_up,                 // 2^-16 period, motor before table
    // requests
    input  wire         [   AXES-1:0] start,                   // strobes: play the queue
    input  wire         [   AXES-1:0] arm,                     // strobes: start at start_at
    input  wire         [   AXES-1:0] controlled_stop,         // strobes: stop and empty the queue
    input  wire         [   AXES-1:0] set_target_to_position,  // strobes: target := position
    input  wire         [   AXES-1:0] push,                    // strobes: queue the segment
    input  wire         [   AXES-1:0] gains_changed,           // strobes: a gain is new
    input  wire         [   AXES-1:0] shift,                   // strobes: the origin moves
    input  wire signed  [       47:0] shift_by,                // 2^-16 period, of these axes
    output logic        [   AXES-1:0] waits,                   // level: a request is not done yet
    // results
    output logic                      result_valid,            // strobe: result is new
    output logic                      integral_valid,          // strobe: result is the integral
    output logic        [        2:0] result_axis,             // number of its axis
    output logic        [        2:0] result_kind,             // number of what it is
    output logic signed [       47:0] result,                  // value
    output logic                      result_flag,             // level: its flag
    // schedule
    output logic                      ready,                   // level: settings may be written
    output logic                      busy,                    // level: a tick is being served
    output logic                      overrun,                 // strobe: a tick came too soon
    output logic        [       15:0] cycles                   // cycles that a tick needs at most
);
    if (AXES < 1 || AXES > 8) begin : g_check_axes
        AXES_MUST_BE_FROM_1_TO_8 u_error ();
    end
    if (FILTERS < 0 || FILTERS > 4) begin : g_check_filters
        FILTERS_MUST_BE_FROM_0_TO_4 u_error ();
    end

    localparam int A = $clog2(AXES) + WORD_W;

    // as in tables/engine_microcode.py
    localparam [3:0] TEST = 4'd1, BELOW = 4'd2, ABOVE = 4'd3, SHIFT_8 = 4'd4, X = 4'd5;
    localparam [3:0] X_LOW = 4'd6, X_HIGH = 4'd7, Y = 4'd8, Y_LOW = 4'd9, DIVIDE = 4'd10;
    localparam [3:0] UPWARD = 4'd11, ALONG = 4'd12;
    localparam int PRODUCT = 1, PRODUCT_HIGH = 2, PRODUCT_LOW = 3, HALVE = 4, POSITION = 5;
    localparam int ELAPSED = 6, PERIOD = 7, NOW = 8, FLAGS = 9, SHIFT_BY = 10, SETTING = 11;
    localparam int TAKE_UP = 12;
    localparam [7:0] LOAD_CONTEXT = 8'h20, SAMPLE = 8'h23;
    localparam [7:0] STAND = 8'h24, POP = 8'h26, PUSH = 8'h27, EMPTY = 8'h28;
    localparam [7:0] BOOTED = 8'h29, FIRST_FILTER = 8'h2A, NEXT_FILTER = 8'h2B;
    localparam [1:0] SET_OR_CLEAR = 2'd1;
    localparam [2:0] GIVE = 3'd4, DONE = 3'd6;
    localparam [2:0] COMMAND = 3'd5, STEPS = 3'd6;
    localparam int HALTING = 19, LIMITED_UP = 10, LIMITED_DOWN = 11, REBASED = 13;
    localparam int UPWARDS = 14;
    localparam [15:0] MOTION = 16'b0000_0000_1111_1110;  // the flags that STAND clears
    localparam [5:0] OF_SETTING = 6'h37, NOWHERE = 6'h3F;

    // the axis that is served, and its flags; 16 and above are cleared with each axis
    wire  [ 2:0] axis;
    logic [20:0] flags;
    logic [ 3:0] head;  // slot of the next segment
    logic [ 4:0] queued;  // segments in the queue
    logic [ 2:0] filter;
    logic        negative;
    logic        quiet;  // no tick is served, no setting waits, no axis has a request
    // what is seen of this axis
    logic [47:0] axis_position;
    logic [23:0] axis_elapsed, axis_take_up;
    logic [6:0] requested, level;
    logic axis_asked, axis_gains;
    // time
    logic [31:0] seen_now;
    logic [23:0] elapsed;  // cycles since the last tick
    logic [23:0] period;

    // what the axes show
    localparam int SEEN = 88;  // bits that an axis shows
    wire  [SEEN*AXES-1:0] seen;
    wire  [   SEEN*8-1:0] of_eight = (SEEN * 8)'(seen);
    wire  [   SEEN*4-1:0] of_four = axis[2] ? of_eight[SEEN*4+:SEEN*4] : of_eight[0+:SEEN*4];
    wire  [   SEEN*2-1:0] of_two = axis[1] ? of_four[SEEN*2+:SEEN*2] : of_four[0+:SEEN*2];
    wire  [     24*8-1:0] all_take_up = (24 * 8)'(take_up);
    wire  [     SEEN-1:0] of_axis = axis[0] ? of_two[SEEN+:SEEN] : of_two[0+:SEEN];

    // the lines in work: fetched, and its operand is being read; then the operand is there; then it
    // is added
    wire  [         35:0] code;
    wire  [          7:0] action_e;
    logic [         15:0] source;  // of the operand: the bit of its number; none: memory
    logic [5:0] word, word_e;
    logic with_acc, sign, sign_e;
    logic [3:0] effect, effect_e;
    logic [71:0] term, acc;
    logic signed [34:0] x, y;
    wire signed [69:0] product;
    wire        [71:0] stored;

    wire        [ 6:0] operand = code[12:6];
    wire        [72:0] wide = {acc, 1'b1} + {term, sign_e};
    wire        [71:0] sum = wide[72:1];
    wire               off = level[2] && level[3];

    engine_sequencer #(
        .AXES       (AXES),
        .FILTERS    (FILTERS),
        .TICK_CYCLES(TICK_CYCLES)
    ) u_sequencer (
        .clk,
        .rst,
        .tick,
        .conditions({
            14'd0,
            1'(FILTERS == 0),
            requested[3] && requested[2:1] == 2'd0 && !requested[5],
            off,
            !level[4] || off,
            level,
            axis_gains,
            requested[5:0],
            filter != 3'(FILTERS),
            queued[4],
            queued == 5'd0,
            1'b0,
            axis_asked,
            2'd0,
            negative,
            2'd0,
            quiet,
            flags
        }),
        .code,
        .action(action_e),
        .axis,
        .busy,
        .overrun,
        .cycles
    );

    // addresses of words; where nothing is read from memory, a word that is 0
    logic [7:0] read_word, write_word;
    wire [3:0] tail = head + queued[3:0];

    always_comb begin
        casez (operand)
            7'b0??_????: read_word = {2'd0, operand[5:0]};
            7'b100_????: read_word = {2'b01, operand[3:0], 2'b11};
            7'b101_????: read_word = {2'b10, filter[1:0], operand[3:0]};
            7'b110_0???: read_word = {2'b01, head, operand[1:0]};
            7'b110_1???: read_word = {3'd0, flags[HALTING], 2'b00, operand[1:0]};
            default:     read_word = 8'h7F;
        endcase
        casez (word_e)
            6'b11_00??: write_word = {3'd0, flags[HALTING], 2'b00, word_e[1:0]};
            6'b11_01??: write_word = {2'b01, tail, word_e[1:0]};
            6'b11_1???: write_word = {2'b10, filter[1:0], word_e[3:0]};
            default:    write_word = {2'd0, word_e};
        endcase
    end

    wire        writes_setting = word_e == OF_SETTING;
    wire        write = word_e != NOWHERE && (!writes_setting || setting_waits);
    wire [ 1:0] setting_bank = setting_word[6] ? setting_filter : setting_word[5:4];
    wire [ 7:0] setting_at = {setting_word[6], 1'b0, setting_bank, setting_word[3:0]};
    wire [10:0] write_at = writes_setting ? {setting_axis, setting_at} : {axis, write_word};

    engine_memory #(
        .AXES  (AXES),
        .WORD_W(WORD_W)
    ) u_memory (
        .clk,
        .read_at (A'({axis, read_word[WORD_W-1:0]})),
        .stored,
        .write,
        .write_at(A'({write_at[10:8], write_at[WORD_W-1:0]})),
        .word    (sum)
    );

    // the operand
    engine_multiplier u_multiplier (
        .clk,
        .x,
        .y,
        .product
    );

    wire minus = sign ^ (effect == ALONG && !flags[UPWARDS]);
    wire  [71:0] multiplied = ({72{source[PRODUCT]}} & {{2{product[69]}}, product})
        | ({72{source[PRODUCT_HIGH]}} & {product[39:0], 32'd0})
        | ({72{source[PRODUCT_LOW]}} & {{34{product[69]}}, product[69:32]});
    wire  [47:0] outside = ({48{source[POSITION]}} & axis_position)
        | ({48{source[ELAPSED]}} & {24'd0, axis_elapsed}) | ({48{source[PERIOD]}} & {24'd0, period})
        | ({48{source[NOW]}} & {16'd0, seen_now})
        | ({48{source[FLAGS]}} & {23'd0, queued, head, flags[15:0]})
        | ({48{source[SHIFT_BY]}} & shift_by) | ({48{source[TAKE_UP]}} & {24'd0, axis_take_up});
    wire  [71:0] from = stored | multiplied | {{24{outside[47]}}, outside}
        | ({72{source[SETTING]}} & {{8{setting[63]}}, setting});

    // flags and requests
    wire sets = action_e[7:6] == SET_OR_CLEAR;
    wire [20:0] named = 21'd1 << action_e[4:0];
    wire [6:0] done = action_e[7:5] == DONE ? 7'd1 << action_e[2:0] : '0;

    for (genvar n = 0; n < AXES; n++) begin : g_axis
        engine_inputs u_inputs (
            .clk,
            .rst,
            .tick,
            .sample(action_e == SAMPLE && axis == 3'(n) && !busy),
            .elapsed,
            .position(position[48*n+:48]),
            .stepped(stepped[n]),
            .downward(downward[n]),
            .block_up(block_up[n]),
            .block_down(block_down[n]),
            .closed_loop(closed_loop[n]),
            .request({
                gains_changed[n],
                controlled_stop[n],
                arm[n],
                start[n],
                push[n],
                set_target_to_position[n],
                shift[n]
            }),
            .done(axis == 3'(n) ? done : '0),
            .seen_position(seen[SEEN*n+:48]),
            .seen_elapsed(seen[SEEN*n+48+:24]),
            .seen(seen[SEEN*n+72+:7]),
            .levels(seen[SEEN*n+79+:7]),
            .asked(seen[SEEN*n+86]),
            .gains(seen[SEEN*n+87])
        );
        assign waits[n] = seen[SEEN*n+86];
    end


    wire unused = &{1'b0, code, wide[0], requested[6], read_word, write_at};

    always_ff @(posedge clk) begin
        // the operand is read
        word     <= code[18:13];
        with_acc <= code[5];
        sign     <= code[4];
        effect   <= code[3:0];
        source   <= operand[6:4] == 3'd7 ? 16'd1 << operand[3:0] : '0;

        // the operand is there
        word_e   <= word;
        sign_e   <= source[HALVE] ? sign : minus;
        effect_e <= effect;
        term     <= source[HALVE] ? {term[71], term[71:1]} : from ^ {72{minus}};

        // it is added
        if (effect_e == TEST) negative <= sum[71];
        if (effect_e == UPWARD) flags[UPWARDS] <= sum[71];
        if (!with_acc || (effect_e == BELOW && !sum[71]) || (effect_e == ABOVE && sum[71]))
            acc <= '0;
        else if (effect_e != DIVIDE || !sum[71])
            acc <= effect_e == SHIFT_8 ? {{8{sum[71]}}, sum[71:8]} : sum;
        case (effect_e)
            X:       x <= sum[34:0];
            X_LOW:   x <= {3'd0, sum[31:0]};
            X_HIGH:  x <= sum[66:32];
            Y:       y <= sum[34:0];
            Y_LOW:   y <= {3'd0, sum[31:0]};
            DIVIDE:  y <= {y[33:0], !sum[71]};
            default: ;
        endcase

        // and acts
        case (action_e)
            LOAD_CONTEXT: begin
                {queued, head, flags[15:0]} <= sum[24:0];
                flags[20:17] <= '0;
            end
            STAND:        flags[15:0] <= flags[15:0] & ~MOTION;
            POP:          {queued, head} <= {queued - 1'b1, head + 1'b1};
            PUSH:         queued <= queued + 1'b1;
            EMPTY:        queued <= '0;
            BOOTED:       ready <= 1'b1;
            FIRST_FILTER: filter <= '0;
            NEXT_FILTER:  filter <= filter + 1'b1;
            default:      ;
        endcase
        for (int n = 0; n <= 20; n++) if (sets && named[n]) flags[n] <= !action_e[5];
        result_valid <= action_e[7:5] == GIVE && !action_e[3];
        integral_valid <= action_e[7:5] == GIVE && action_e[3];
        if (action_e[7:5] == GIVE) begin
            result      <= sum[47:0];
            result_axis <= axis;
            result_kind <= action_e[2:0];
            case (action_e[2:0])
                COMMAND: result_flag <= flags[LIMITED_UP] || flags[LIMITED_DOWN];
                STEPS:   result_flag <= flags[REBASED] || level[6];
                default: result_flag <= negative;
            endcase
        end

        // the axis
        {axis_gains, axis_asked, level, requested, axis_elapsed, axis_position} <= of_axis;
        axis_take_up <= all_take_up[24*axis+:24];

        // time
        if (tick) begin
            elapsed  <= 24'd1;
            period   <= elapsed;
            seen_now <= now;
        end else if (elapsed != '1) elapsed <= elapsed + 1'b1;

        quiet <= !busy && !setting_waits && waits == '0;

        // the setting that waits
        setting_waits <= setting_write || (setting_waits && !writes_setting);

        if (rst) begin
            source <= '0;
            {word, word_e} <= '1;
            {effect, effect_e} <= '0;
            {filter, flags, period, quiet, ready, setting_waits} <= '0;
            {result_valid, integral_valid} <= '0;
            elapsed <= 24'd1;
        end
    end
endmodule

`default_nettype wire
