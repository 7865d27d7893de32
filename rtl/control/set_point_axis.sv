// SPDX-License-Identifier: Apache-2.0
// set_point_axis -- the state of one axis that follows streamed set-points: when its stream begins,
// how far its pieces reach, why it has ended, and what was counted.
//
// latency   1 cycle from every strobe to the levels and to the counts
// rate      one strobe of each kind per cycle
// behaviour A stream begins when the axis is allowed to, at rest. After an end it begins again when
//           `allowed` has fallen in between. `ahead` counts the ticks that the queued pieces still
//           take, 17 * 255 at most: from the tick in which the engine takes the first piece on. A
//           stream ends at once when the drive is off, when the registers stop the axis, and when
//           the engine stops by itself because a piece is missing. stop_due then asks for a
//           controlled stop, so that nothing of the stream stays in the queue of the engine.
// source    docs/stream.md
// model     tb/control/set_point_axis.py, equal in every bit of every cycle
// proved    Without a level of begins or active, nothing of the axis may be queued. Every end but a
//           release asks for a stop. A set-point is counted once.
// proof     depth 8
`default_nettype none

module set_point_axis #(
    parameter int HOLD   = 6,  // ticks of the first piece of a stream
    parameter int MARGIN = 3   // ticks before the end of the last piece when it is continued
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         tick,         // strobe: servo tick
    input  wire         allowed,      // level: the axis is to follow set-points
    input  wire         enabled,      // level: the drive is on
    input  wire         stops,        // strobe: the registers stop the axis or set its target
    // motion engine
    input  wire         state_valid,  // strobe: a new state of this axis
    input  wire         moving,       // level: with state_valid, a profile is being played
    input  wire         braking,      // level: with state_valid, a controlled stop runs
    input  wire  [ 4:0] queued,       // segments in the queue, with state_valid
    // player
    input  wire  [ 1:0] waiting,      // commits that wait
    input  wire         looked,       // strobe: the player has dealt with what was due
    input  wire         began,        // strobe: the first piece of a stream follows
    input  wire         pushed,       // strobe: a piece was given to the engine
    input  wire  [ 7:0] ticks,        // its duration
    input  wire         accepted,     // strobe: it leads to a set-point
    input  wire         extended,     // strobe: it continues a stream whose set-point is late
    input  wire         released,     // strobe: it is the last one
    input  wire         quits,        // strobe: the stream ends
    input  wire  [ 2:0] reason,       // number of its reason, with quits
    input  wire         stopped,      // strobe: the controlled stop was requested
    input  wire         refused,      // strobe: a set-point is refused
    input  wire  [ 2:0] cause,        // number of its cause, with refused
    input  wire         dropped,      // strobe: a set-point found no room
    // state
    output logic        begins,       // level: a stream is to begin
    output logic        active,       // level: the axis follows set-points
    output logic        anchored,     // level: `ahead` is right
    output logic        started,      // level: a set-point was accepted
    output logic        ending,       // level: the pieces end soon
    output logic        due,          // level: the player must look at the axis
    output logic        stop_due,     // level: a controlled stop is to be requested
    output logic        full,         // level: the queue of the engine has no room
    output logic        streamed,     // level: the segments of the axis are pieces
    output logic [12:0] ahead,        // ticks from the last tick to the end of the last piece
    // for the registers
    output logic [31:0] state,        // stream_state
    output logic [31:0] counts        // stream_counts
);
    // as in tables/registers.rdl
    localparam [2:0] OFF = 3'd0, PREPARED = 3'd1, STREAMING = 3'd2, EXTRAPOLATING = 3'd3;
    localparam [2:0] ENDED = 3'd4;
    localparam [2:0] NOT_ENDED = 3'd0, RELEASED = 3'd1, STOPPED = 3'd2, FAULT = 3'd4;
    localparam [2:0] NONE = 3'd0, LATE = 3'd1, QUEUE_FULL = 3'd4;
    localparam [4:0] DEPTH = 5'd16;  // segments that the engine queues

    logic [2:0] mode, ended, refusal;
    logic       starting;  // the first piece was not taken yet
    logic       resting;  // the engine is at rest, and its queue is empty
    logic [4:0] in_queue;
    logic [15:0] accepted_count, extrapolated;
    logic [7:0] late_count, refused_count;

    wire       fails = !enabled || stops || (state_valid && (braking || (!moving && !starting)));
    wire       takes = starting && state_valid && moving && queued == '0;
    wire       late = refused && cause == LATE;
    wire [5:0] room = 6'(DEPTH) - 6'(in_queue) - 6'(waiting);

    assign anchored = mode == PREPARED || mode == STREAMING || mode == EXTRAPOLATING;
    assign active   = starting || anchored;
    assign started  = mode == STREAMING || mode == EXTRAPOLATING;
    assign begins   = allowed && mode == OFF && !starting && !stop_due && resting;
    assign ending    = ahead <= 13'(MARGIN);
    assign full     = in_queue == DEPTH;
    assign streamed = active || stop_due;
    assign state    = {extrapolated, 2'd0, room[5] ? 5'd0 : room[4:0], refusal, ended, mode};
    assign counts   = {refused_count, late_count, accepted_count};

    always_ff @(posedge clk) begin
        if (state_valid) begin
            in_queue <= queued;
            resting  <= !moving && queued == '0;
        end
        ahead          <= ahead + (pushed ? 13'(ticks) : 13'd0) - 13'(tick && ahead != '0);
        accepted_count <= accepted_count + 16'(accepted);
        late_count     <= late_count + 8'(late);
        refused_count  <= refused_count + 8'(refused && !late) + 8'(dropped);
        if (extended) extrapolated <= extrapolated + 16'(ticks);
        if (refused) refusal <= cause;
        if (dropped) refusal <= QUEUE_FULL;

        if (looked) due <= 1'b0;
        if (tick && (allowed || active || mode == ENDED)) due <= 1'b1;
        if (stopped) stop_due <= 1'b0;

        if (mode == ENDED && !allowed) mode <= OFF;
        if (accepted) mode <= STREAMING;
        if (extended) mode <= EXTRAPOLATING;
        if (released) begin
            mode  <= OFF;
            ended <= RELEASED;
        end
        if (takes) begin
            starting <= 1'b0;
            mode     <= PREPARED;
            ahead    <= 13'(HOLD);
        end
        if (began) begin
            starting <= 1'b1;
            ended    <= NOT_ENDED;
            refusal  <= NONE;
            {accepted_count, late_count, refused_count, extrapolated} <= '0;
        end
        if (quits || (active && fails)) begin
            mode     <= ENDED;
            ended    <= quits && enabled ? reason : enabled && stops ? STOPPED : FAULT;
            starting <= 1'b0;
            {stop_due, due} <= '1;
        end
        if (rst) begin
            {mode, ended, refusal, starting, resting, in_queue, ahead, due, stop_due} <= '0;
            {accepted_count, late_count, refused_count, extrapolated} <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    wire  strobes = looked || began || accepted || extended || released || quits || refused;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        // the player gives one of them at a time, as the levels allow
        assume (
            3'(began) + 3'(accepted) + 3'(extended) + 3'(released) + 3'(quits) + 3'(refused) <= 3'd1
        );
        assume (!began || (begins && enabled));
        assume (!(accepted || extended || released) || (anchored && pushed));
        assume (!quits || ((active || begins) && reason != NOT_ENDED));
        if (past && !$past(rst)) begin
            if (streamed && !$past(streamed)) assert ($past(began || quits));
            if ($past(active) && !active) assert ($past(released) || (stop_due && mode == ENDED));
            if (accepted_count != $past(accepted_count)) assert ($past(accepted || began));
            if (stop_due && !$past(stop_due)) assert (due && mode == ENDED && ended != NOT_ENDED);
            if (mode == PREPARED && $past(mode) == OFF) assert (ahead == 13'(HOLD));
            if (mode == OFF && $past(mode) == ENDED) assert ($past(!allowed));
            assert (!(starting && mode != OFF));
        end
        cover (past && mode == EXTRAPOLATING && $past(mode) == STREAMING);
        cover (past && mode == ENDED && stop_due && $past(started));
        cover (past && !strobes && ended == RELEASED);
    end
`endif
endmodule

`default_nettype wire
