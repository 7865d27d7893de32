// SPDX-License-Identifier: Apache-2.0
// event_counters -- counts events of several kinds in one memory, instead of an adder and a
// register for each kind.
//
// latency   at most 4 * COUNTERS + 1 cycles from an event to its count, and 2 more for each read
//           and 3 more for each clear meanwhile
// rate      one read per cycle, one clear in 2 cycles; events of one counter must be
//           2 * COUNTERS + 1 cycles apart, and 2 more for each read and 3 more for each clear
//           meanwhile, or may be lost
// behaviour Counter 0 is not there: its place in the memory is 0 at power-up and never written, and
//           a count is cleared with it. The places are served in turn, two cycles each: a count is
//           read, then raised if there was an event before the turn of place 0, which lasts until
//           there is one. A count stops at its largest value. A clear drops what was counted; an
//           event that waits counts from 0 on. In the cycle after a clear there must be no read of
//           the same counter. After rst the counts are cleared in 2 * COUNTERS cycles, in which
//           there must be no access.
// model     tb/registers/event_counters.py, equal in every bit of every cycle
// proved    Whatever is read and cleared: count and waiting events together are the number of
//           events since the last clear and those that waited then, if no event comes while
//           the one before it waits for the turn of place 0.
// proof     depth 18, COUNTERS = 4, W = 3
`default_nettype none

module event_counters #(
    parameter int COUNTERS = 16,  // number of places, a power of two from 4 up
    parameter int W        = 32   // bits of a count
) (
    input  wire                         clk,
    input  wire                         rst,     // level: all counts become 0
    input  wire  [        COUNTERS-1:1] events,  // strobes: bit n raises counter n
    input  wire                         read,    // strobe: count of counter `number`
    input  wire                         clear,   // strobe: counter `number` becomes 0
    input  wire  [$clog2(COUNTERS)-1:0] number,  // counter that is read or cleared
    output logic [               W-1:0] count    // in the cycle after read
);
    localparam int A = $clog2(COUNTERS);

    if (COUNTERS < 4 || COUNTERS != 1 << A) begin : g_check
        COUNTERS_MUST_BE_A_POWER_OF_TWO_FROM_4_UP u_error ();
    end

    // what is read where it is written is not used
    (* no_rw_check *) logic [W-1:0] memory[0:COUNTERS-1];
    initial memory[0] = '0;

    logic [COUNTERS-1:1] waiting;  // events since the last turn of place 0
    logic [COUNTERS-1:1] in_turn;  // events before that, the one of this place lowest
    logic [A-1:0] place;  // whose turn it is
    logic raising;  // the second cycle of its turn: count is that of the place
    logic fresh;  // the counts are cleared after rst
    logic clearing;  // the count of `cleared` becomes 0
    logic [A-1:0] cleared;

    wire idle = place == '0 && waiting == '0 && !fresh;
    wire access = read || clear || clearing;
    wire next = raising && !access && !idle;
    wire [W:0] raised = {1'b0, count} + (W + 1)'(!clearing && !fresh);
    wire [A-1:0] stored_at = clearing ? cleared : place;
    wire store = (clearing || (next && (fresh || in_turn[1]))) && !raised[W] && stored_at != '0;

    always_ff @(posedge clk) begin
        if (store) memory[stored_at] <= raised[W-1:0];
        count <= memory[read?number : clear||fresh?A'(0) : place];
    end

    always_ff @(posedge clk) begin
        raising  <= !access && (!raising || idle);
        clearing <= clear;
        cleared  <= number;
        if (next) begin
            place   <= place + 1'b1;
            in_turn <= place == '0 ? waiting : in_turn >> 1;
        end
        waiting <= events | (next && place == '0 ? '0 : waiting);
        if (next && &place) fresh <= 1'b0;
        if (rst) begin
            waiting  <= '0;
            in_turn  <= '0;
            place    <= '0;
            raising  <= 1'b0;
            fresh    <= 1'b1;
            clearing <= 1'b0;
        end
    end

`ifdef FORMAL
    (* anyconst *)logic [A-1:0] observed;  // a counter
    logic         past = 1'b0;
    logic [W-1:0] events_so_far;  // since its last clear, at most the largest count
    logic         asked;  // its count was read in the cycle before
    logic [W-1:0] answer;  // count in that cycle
    wire          listed = place != '0 && place <= observed && in_turn[observed-place+1'b1];
    wire  [  W:0] waits = (W + 1)'(waiting[observed]) + (W + 1)'(listed);
    wire  [W-1:0] held = clearing && cleared == observed ? '0 : memory[observed];
    wire  [  W:0] known = {1'b0, held} + waits;
    wire  [W-1:0] reached = known[W] ? '1 : known[W-1:0];
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (observed != '0 && number != '0);
        if (fresh) assume (!clear && !read && events == '0);
        assume (!(clearing && (read || clear)));
        assume (!(read && clear));
        if (events[observed]) assume (!waiting[observed]);
        if (rst) events_so_far <= '0;
        else if (clear && number == observed) events_so_far <= waits[W-1:0] + W'(events[observed]);
        else if (!(&events_so_far)) events_so_far <= events_so_far + W'(events[observed]);
        asked  <= !rst && read && number == observed;
        answer <= held;
        if (past) begin
            assert (memory[0] == '0);
            if (!fresh) assert (reached == events_so_far);
            if (fresh) assert (events_so_far == '0 && waiting == '0 && in_turn == '0 && !clearing);
            if (fresh && place > observed) assert (memory[observed] == '0);
            if (raising && !fresh) assert (count == memory[place]);
            if ((raising && fresh) || clearing) assert (count == '0);
            if (raising) assert (!clearing);
            if (asked) assert (count == answer);
        end
        cover (past && !rst && !fresh && store && next);
        cover (past && !rst && !fresh && raising && in_turn[1] && read);
    end
`endif
endmodule

`default_nettype wire
