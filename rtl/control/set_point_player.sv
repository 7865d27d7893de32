// SPDX-License-Identifier: Apache-2.0
// set_point_player -- play streamed set-points of all axes of a node without the soft core: give
// the motion engine a piece of constant jerk for each set-point.
//
// latency   From a commit to the last word of the piece of its first axis: 336 cycles and two for
//           each tick of the piece, and 16 for a piece of one tick, if nothing else is due and the
//           engine takes each word at once; as much again for each further axis, and the time for
//           which the engine is busy.
// rate      one axis after the other
// behaviour A stream begins at rest: a piece without motion holds the target until the first
//           set-point. Each set-point makes one piece, from the end of the last one. If a piece has
//           MARGIN ticks left and no other one follows, the motion continues at its velocity, two
//           ticks at a time, for late_limit ticks at most; then the axis stops under control. A
//           set-point that is late, incomplete, outside the travel or beyond a limit is counted and
//           makes no piece: the next piece is longer. What is due in a tick comes before
//           set-points.
// limits    A set-point must be committed MARGIN ticks before the end of the piece before it, and
//           as much earlier as all axes take. The feed override must be full.
// source    docs/stream.md
// model     tb/control/set_point_player.py, equal in every bit of every cycle
// proved    A piece to a set-point is given only for a complete set-point of an axis of the oldest
//           commit, to this axis, and only once. A word is offered only for an axis that follows
//           set-points. Every set-point of a commit is counted once.
// proof     depth 8, AXES = 2
`default_nettype none

module set_point_player #(
    parameter int AXES   = 1,    // axes of the node, 1 to 8
    parameter int MASK   = 255,  // bit n: axis n can follow set-points
    parameter int MARGIN = 3     // ticks before the end of the last piece when it is continued
) (
    input  wire                       clk,
    input  wire                       rst,
    input  wire                       tick,          // strobe: servo tick
    // register memory
    input  wire                       stores,        // strobe: a word is stored
    input  wire         [       13:0] stored_at,     // word of the register map
    input  wire         [       31:0] stored_value,  // bits of its settings, sign-extended
    input  wire         [       31:0] wdata_low,     // low word of a value of 64 bits
    // the axes, bit n: axis n
    input  wire         [   AXES-1:0] enabled,       // levels: the drive is on
    input  wire         [   AXES-1:0] stops,         // strobes: the registers stop the axis
    // results of the motion engine, as there
    input  wire                       result_valid,  // strobe: result is new
    input  wire         [        2:0] result_axis,   // number of its axis
    input  wire         [        2:0] result_kind,   // number of what it is
    input  wire signed  [       47:0] result,        // value
    // to engine_bus
    output logic        [   AXES-1:0] streamed,      // levels: the segments are pieces
    output logic                      piece_valid,   // level: a word is offered
    output logic        [        2:0] piece_axis,    // number of its axis
    output logic        [        1:0] piece_part,    // 0 velocity, 1 acceleration, 2 jerk, 3 ticks
    output logic signed [       63:0] piece_word,    // value
    input  wire                       piece_taken,   // strobe: the word is taken in this cycle
    input  wire                       settled,       // level: every request is done and shown
    // requests to the motion engine
    output logic        [   AXES-1:0] start,         // strobes: play the queue
    output logic        [   AXES-1:0] stop,          // strobes: controlled stop
    // for the registers
    output logic        [       31:0] tick_count,    // servo ticks since reset
    output logic        [32*AXES-1:0] states,        // stream_state of each axis
    output logic        [32*AXES-1:0] counts         // stream_counts of each axis
);
    localparam int A = AXES == 1 ? 1 : $clog2(AXES);
    localparam [7:0] BUILT = 8'(MASK);
    localparam int HOLD = 6, EXTENSION = 2;  // ticks
    localparam int MOVING = 1, BRAKING = 2, QUEUED = 20;  // of a state of the engine
    localparam [2:0] STATE = 3'd0, TARGET = 3'd1;  // kinds of results
    // as in tables/registers.rdl
    localparam [2:0] STOPPED = 3'd2, ENDED_LATE = 3'd3, FAULT = 3'd4;  // reasons of an end
    localparam [2:0] LATE = 3'd1, LIMITS = 3'd2, OUT_OF_TRAVEL = 3'd3, QUEUE_FULL = 3'd4;
    localparam [2:0] INCOMPLETE = 3'd5, NOT_STREAMED = 3'd6, TOO_FAR_AHEAD = 3'd7;

    enum logic [2:0] {
        REST,
        LOOK,
        CHECK,
        FETCH,
        COMPUTE,
        OFFER,
        SETTLE
    } phase;
    enum logic [1:0] {
        BEGIN,
        EXTEND,
        RELEASE,
        REACH
    } piece;  // what it does
    logic [2:0] axis;  // that is served
    logic [2:0] scan;  // the next one that may be due
    logic [2:0] next_axis;  // of the oldest commit
    logic [1:0] part;
    logic [2:0] fetched;
    logic [7:0] ticks;
    logic starts;  // the first piece of a stream must be started
    logic [AXES-1:0] powered;  // the drive was on one cycle ago
    logic outside;
    logic signed [47:0] position;
    logic signed [31:0] velocity;
    logic [30:0] velocity_limit;
    logic [31:0] acceleration_limit;

    // the axes; what is not built, or not there, is 0
    wire [AXES-1:0] allowed, complete, named, dropped;
    wire [AXES-1:0] begins, active, anchored, started, ending, due, stop_due, full;
    logic [   AXES-1:0] here;  // the axis that is served
    wire  [       15:0] late_limit;
    wire  [        1:0] waiting;
    wire  [       31:0] commit_tick;
    wire  [       47:0] stored;
    wire  [13*AXES-1:0] ahead;
    logic [       12:0] ahead_here;
    always_comb begin
        ahead_here = '0;
        for (int n = 0; n < AXES; n++) begin
            here[n]    = axis == 3'(n);
            ahead_here = ahead_here | (ahead[13*n+:13] & {13{here[n]}});
        end
    end
    wire                due_scan = |(8'(due) & (8'd1 << scan));
    wire                is_active = |(active & here);
    wire                is_anchored = |(anchored & here);
    wire                is_started = |(started & here);
    wire                is_ending = |(ending & here);
    wire                is_allowed = |(allowed & here);
    wire                is_enabled = |(powered & here);
    wire                is_full = |(full & here);
    wire                begins_here = |(begins & here);
    wire                stops_here = |(stop_due & here);
    wire signed [ 31:0] distance = commit_tick - tick_count - 32'(ahead_here);

    // the end of the last piece of each axis, and the ticks extrapolated since the last set-point
    wire signed [ 47:0] target;
    wire        [ 15:0] late_ticks;
    wire signed [ 47:0] end_velocity;
    wire signed [ 71:0] end_position;
    logic       [135:0] new_end;
    wire                rests = end_velocity[47:16] == '0 || end_velocity[47:16] == '1;
    wire        [ 16:0] late_next = {1'b0, late_ticks} + 17'(EXTENSION);

    wire        [ 15:0] new_late = is_started ? late_next[15:0] : 16'd0;

    // the piece
    wire computing, computed, beyond;
    wire signed [47:0] acceleration, reached_velocity;
    wire signed [31:0] jerk;
    wire signed [71:0] reached;
    wire               given = piece_taken && part == 2'd3;

    assign piece_valid = phase == OFFER && is_active;
    assign piece_axis  = axis;
    assign piece_part  = part;
    // what the piece begins with; a piece of one tick has another velocity than the one before it
    wire reaches = piece == REACH;
    wire signed [47:0] first_velocity = reaches && ticks == 8'd1 ? reached_velocity
        : reaches || piece == EXTEND ? end_velocity : '0;
    wire signed [47:0] first_acceleration = reaches ? acceleration : '0;
    wire signed [31:0] first_jerk = reaches ? jerk : '0;
    wire [24:0] duration = {piece == RELEASE, 16'd0, ticks};  // bit 24: the last piece
    assign piece_word = part == 2'd0 ? 64'(first_velocity) : part == 2'd1 ? 64'(first_acceleration)
        : part == 2'd2 ? 64'(first_jerk) : {39'd0, duration};
    always_comb begin
        case (piece)
            REACH: new_end = {16'd0, reached_velocity, reached};
            EXTEND:
            new_end = {
                new_late,
                end_velocity,
                end_position + (72'(end_velocity) <<< 1)
            };
            default: new_end = {16'd0, 48'd0, 72'($signed({target, 24'd0}))};
        endcase
    end

    // what the player does in this cycle with the axis
    wire        looks = phase == LOOK;
    wire        commits = phase == CHECK;
    wire        of_commit = |(named & here);
    logic       check_refuses;
    logic [2:0] check_cause;
    always_comb begin
        check_refuses = 1'b1;
        check_cause   = NOT_STREAMED;
        if (!is_anchored) check_cause = NOT_STREAMED;
        else if (!(|(complete & here))) check_cause = INCOMPLETE;
        else if (distance < 32'sd1) check_cause = LATE;
        else if (distance > 32'sd255) check_cause = TOO_FAR_AHEAD;
        else if (is_full) check_cause = QUEUE_FULL;
        else check_refuses = 1'b0;
    end
    wire gives_up = looks && !stops_here && is_active && !is_allowed && !(is_anchored && rests);
    wire is_late = looks && !stops_here && is_allowed && is_anchored && is_ending && is_started
        && late_next > {1'b0, late_limit};
    wire no_drive = looks && !stops_here && begins_here && !is_enabled;
    wire begins_now = looks && !stops_here && begins_here && is_enabled;
    wire releases = looks && !stops_here && is_anchored && !is_allowed && rests && !is_full;
    wire continues = looks && !stops_here && is_anchored && is_allowed && is_ending && !is_late;
    wire fetch_ends = phase == FETCH && fetched == 3'd6;
    wire withdrawn = phase == OFFER && !is_active;
    wire refuses = (commits && of_commit && check_refuses) || (fetch_ends && outside)
        || (phase == COMPUTE && computed && beyond) || (withdrawn && piece == REACH);
    wire [2:0] cause = commits ? check_cause : phase == FETCH ? OUT_OF_TRAVEL
        : phase == COMPUTE ? LIMITS : NOT_STREAMED;
    wire commit_goes_on = (commits && !of_commit) || refuses || (given && piece == REACH);
    wire commit_done = commit_goes_on && next_axis == 3'(AXES - 1);
    wire begin_piece = fetch_ends && !outside;
    wire quits = gives_up || is_late || no_drive;
    wire [2:0] reason = is_late ? ENDED_LATE : no_drive ? FAULT : STOPPED;

    always_ff @(posedge clk) begin
        if (tick) tick_count <= tick_count + 1'b1;
        {start, stop} <= '0;
        powered <= enabled;
        if (commit_goes_on) next_axis <= commit_done ? 3'd0 : next_axis + 1'b1;
        case (phase)
            REST:
            if (due != '0) begin
                axis <= scan;
                scan <= scan == 3'(AXES - 1) ? 3'd0 : scan + 1'b1;
                if (due_scan) phase <= LOOK;
            end else if (waiting != '0) begin
                axis  <= next_axis;
                phase <= CHECK;
            end
            LOOK: begin
                part  <= 2'd0;
                phase <= REST;
                if (stops_here) begin
                    stop  <= here;
                    phase <= SETTLE;
                end
                if (begins_now) {piece, ticks} <= {BEGIN, 8'(HOLD)};
                if (continues) {piece, ticks} <= {EXTEND, 8'(EXTENSION)};
                if (releases) {piece, ticks} <= {RELEASE, 8'd1};
                if (begins_now || continues || releases) phase <= OFFER;
                starts <= begins_now;
            end
            CHECK: begin
                part    <= 2'd0;
                piece   <= REACH;
                ticks   <= distance[7:0];
                fetched <= 3'd0;
                starts  <= 1'b0;
                phase   <= of_commit && !check_refuses ? FETCH : REST;
            end
            FETCH: begin
                fetched <= fetched + 1'b1;
                case (fetched)
                    3'd1:    position <= stored;
                    3'd2:    velocity <= stored[31:0];
                    3'd3:    outside <= position < $signed(stored);
                    3'd4:    outside <= outside || position > $signed(stored);
                    3'd5:    velocity_limit <= stored[30:0];
                    3'd6:    acceleration_limit <= stored[31:0];
                    default: ;
                endcase
                if (fetch_ends) phase <= outside ? REST : COMPUTE;
            end
            COMPUTE: if (computed) phase <= beyond ? REST : OFFER;
            OFFER: begin
                if (piece_taken) part <= part + 1'b1;
                if (given) phase <= SETTLE;
                if (withdrawn) phase <= REST;
            end
            SETTLE:
            if (settled) begin
                starts <= 1'b0;
                if (starts) start <= here & active;
                else phase <= REST;
            end
            default: phase <= REST;
        endcase
        if (rst) begin
            {start, stop, powered, tick_count, axis, scan, next_axis} <= '0;
            phase <= REST;
        end
    end

    set_point_queue #(
        .AXES(AXES)
    ) u_queue (
        .clk,
        .rst,
        // register memory
        .stores,
        .stored_at,
        .stored_value,
        .wdata_low,
        // settings
        .late_limit,
        .allowed,
        // commits
        .waiting,
        .tick     (commit_tick),
        .axes     (named),
        .complete,
        .taken    (commit_done),
        .dropped,
        // words
        .read_axis(axis),
        .read_word(fetched < 3'd2 ? fetched : fetched + 3'd2),
        .stored
    );
    set_point_piece u_piece (
        .clk,
        .rst,
        .begin_piece,
        // limits
        .velocity_limit    ({velocity_limit, 16'd0}),
        .acceleration_limit({7'd0, acceleration_limit, 8'd0}),
        // set-point
        .ticks,
        .position,
        .velocity          ({velocity, 16'd0}),
        // where the piece begins
        .begin_position    (end_position),
        .begin_velocity    (end_velocity),
        // the piece
        .busy              (computing),
        .valid             (computed),
        .refused           (beyond),
        .acceleration,
        .jerk,
        .end_position      (reached),
        .end_velocity      (reached_velocity)
    );

    axis_memory #(
        .AXES (AXES),
        .WIDTH(48)
    ) u_targets (
        .clk,
        .write     (result_valid && result_kind == TARGET),
        .write_axis(result_axis[A-1:0]),
        .value     (result),
        .axis      (axis[A-1:0]),
        .stored    (target)
    );
    axis_memory #(
        .AXES (AXES),
        .WIDTH(136)
    ) u_ends (
        .clk,
        .write     (given),
        .write_axis(axis[A-1:0]),
        .value     (new_end),
        .axis      (axis[A-1:0]),
        .stored    ({late_ticks, end_velocity, end_position})
    );
    for (genvar n = 0; n < AXES; n++) begin : g_axis
        if (BUILT[n]) begin : g_built
            set_point_axis #(
                .HOLD  (HOLD),
                .MARGIN(MARGIN)
            ) u_axis (
                .clk,
                .rst,
                .tick,
                .allowed    (allowed[n]),
                .enabled    (powered[n]),
                .stops      (stops[n]),
                // motion engine
                .state_valid(result_valid && result_kind == STATE && result_axis == 3'(n)),
                .moving     (result[MOVING]),
                .braking    (result[BRAKING]),
                .queued     (result[QUEUED+:5]),
                // player
                .waiting,
                .looked     (looks && here[n]),
                .began      (begins_now && here[n]),
                .pushed     (given && here[n]),
                .ticks,
                .accepted   (given && here[n] && piece == REACH),
                .extended   (given && here[n] && piece == EXTEND && is_started),
                .released   (given && here[n] && piece == RELEASE),
                .quits      (quits && here[n]),
                .reason,
                .stopped    (looks && here[n] && stops_here),
                .refused    (refuses && here[n]),
                .cause,
                .dropped    (dropped[n]),
                // state
                .begins     (begins[n]),
                .active     (active[n]),
                .anchored   (anchored[n]),
                .started    (started[n]),
                .ending     (ending[n]),
                .due        (due[n]),
                .stop_due   (stop_due[n]),
                .full       (full[n]),
                .streamed   (streamed[n]),
                .ahead      (ahead[13*n+:13]),
                // for the registers
                .state      (states[32*n+:32]),
                .counts     (counts[32*n+:32])
            );
        end else begin : g_not_built
            assign {begins[n], active[n], anchored[n], started[n], ending[n]} = '0;
            assign {due[n], stop_due[n], full[n], streamed[n], ahead[13*n+:13]} = '0;
            assign {states[32*n+:32], counts[32*n+:32]} = '0;

            wire unused = &{1'b0, enabled[n], stops[n], dropped[n]};
        end
    end

    wire unused = &{1'b0, computing};

`ifdef FORMAL
    logic past = 1'b0;
    wire  reaching = piece == REACH && (phase == FETCH || phase == COMPUTE || phase == OFFER);
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (piece_taken) assume (piece_valid);
        if (past && !rst && !$past(rst)) begin
            assert (32'(axis) < AXES && 32'(scan) < AXES && 32'(next_axis) < AXES);
            if (phase == CHECK || reaching) assert (waiting != '0 && axis == next_axis);
            if (reaching) assert (of_commit && |(complete & here));
            if (computing) assert (phase == COMPUTE);
            if (phase == FETCH || phase == COMPUTE) assert (piece == REACH);
            if (piece_valid) assert (is_active && (streamed & here) != '0);
            if (given && piece == REACH) assert (of_commit && commit_goes_on && axis == next_axis);
            assert (2'(given && piece == REACH) + 2'(refuses) == 2'(commit_goes_on && of_commit));
            if ($past(piece_valid && !piece_taken) && piece_valid)
                assert ($stable(piece_axis) && $stable(piece_part) && $stable(piece_word));
            if (start != '0) assert ($past(starts) && (start & (start - 1'b1)) == '0);
        end
        cover (past && refuses && cause == NOT_STREAMED);
        cover (past && piece_valid);
    end
`endif
endmodule

`default_nettype wire
