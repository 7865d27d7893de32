// SPDX-License-Identifier: Apache-2.0
// event_counters -- counts events of several kinds in one memory, instead of an adder and a
// register for each kind.
//
// latency   2 cycles from an event to its count if nothing else happens; at most 2 * COUNTERS + 1
//           cycles, and 2 more for each read and each clear meanwhile
// rate      one read or one clear per cycle; events of one counter must be 2 * COUNTERS + 2 cycles
//           apart, and 2 more for each read and each clear meanwhile, or may be lost
// behaviour An event waits in a flag until its count is read, raised and stored, which takes two
//           cycles in which nothing is cleared, and nothing is read in the second one. A count
//           stops at its largest value. An event in the cycle of a clear counts from 0 on. After
//           rst the counts are cleared in COUNTERS cycles, in which there must be no clear.
// model     tb/registers/event_counters.py, equal in every bit of every cycle
// proved    Whatever is read and cleared: count and waiting event together are the number of events
//           since the last clear, if no event comes while the one before it waits.
// proof     depth 14, COUNTERS = 4, W = 3
`default_nettype none

module event_counters #(
    parameter int COUNTERS = 16,  // number of counters, a power of two from 2 up
    parameter int W        = 32   // bits of a count
) (
    input  wire                         clk,
    input  wire                         rst,     // level: all counts become 0
    input  wire  [        COUNTERS-1:0] events,  // strobes: bit n raises counter n
    input  wire                         read,    // strobe: count of counter `number`
    input  wire                         clear,   // strobe: counter `number` becomes 0
    input  wire  [$clog2(COUNTERS)-1:0] number,  // counter that is read or cleared
    output logic [               W-1:0] count    // in the cycle after read
);
    localparam int A = $clog2(COUNTERS);

    if (COUNTERS < 2 || COUNTERS != 1 << A) begin : g_check
        COUNTERS_MUST_BE_A_POWER_OF_TWO_FROM_2_UP u_error ();
    end

    (* no_rw_check *) logic [W-1:0] memory[0:COUNTERS-1];  // never read where it is written

    logic [COUNTERS-1:0] waiting;  // an event is not counted yet
    logic [A:0] cleared;  // counters that are 0 since rst; then COUNTERS
    logic raising;  // count is the one that is raised
    logic [A-1:0] raised;  // its counter

    logic [A-1:0] first;  // the lowest counter of which an event waits
    always_comb begin
        first = '0;
        for (int n = COUNTERS - 1; n >= 0; n--) if (waiting[n]) first = A'(n);
    end

    wire         ready = cleared[A];
    wire         start = ready && waiting != '0 && !raising && !read && !clear;
    wire         put_off = raising && (read || clear);
    wire         store = raising && !put_off && !(&count);
    wire         zero = clear || !ready;
    wire [A-1:0] place = !ready ? cleared[A-1:0] : clear ? number : raised;

    always_ff @(posedge clk) begin
        if (zero || store) memory[place] <= zero ? '0 : count + 1'b1;
        if (read || start) count <= memory[read?number : first];
    end

    always_ff @(posedge clk) begin
        if (!ready) cleared <= cleared + 1'b1;
        raising <= start;
        raised  <= first;
        for (int n = 0; n < COUNTERS; n++) begin
            if (clear && number == A'(n)) waiting[n] <= events[n];
            else if (events[n] || (put_off && raised == A'(n))) waiting[n] <= 1'b1;
            else if (start && first == A'(n)) waiting[n] <= 1'b0;
        end
        if (rst) begin
            waiting <= '0;
            cleared <= '0;
            raising <= 1'b0;
        end
    end

`ifdef FORMAL
    (* anyconst *)logic [A-1:0] observed;  // a counter
    logic         past = 1'b0;
    logic [W-1:0] events_so_far;  // since its last clear, at most the largest count
    logic         asked;  // its count was read in the cycle before
    logic [  W:0] answer;  // count and waiting event in that cycle
    wire          in_work = raising && raised == observed;
    wire  [  W:0] known = {1'b0, memory[observed]} + (W + 1)'(waiting[observed] || in_work);
    wire  [W-1:0] reached = known[W] ? '1 : known[W-1:0];
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (!ready) assume (!clear && !read);
        assume (!(read && clear));
        if (events[observed]) assume (!waiting[observed] && !in_work && ready);
        if (rst || (clear && number == observed)) events_so_far <= W'(events[observed] && !rst);
        else if (!(&events_so_far)) events_so_far <= events_so_far + W'(events[observed]);
        asked  <= !rst && read && number == observed;
        answer <= {1'b0, memory[observed]};
        if (past) begin
            assert (cleared <= (A + 1)'(COUNTERS));
            if (ready) assert (reached == events_so_far);
            if (!ready) assert (events_so_far == '0 && !waiting[observed] && !raising);
            if (!ready && cleared[A-1:0] > observed) assert (memory[observed] == '0);
            if (in_work) assert (count == memory[observed] && !waiting[observed]);
            if (asked) assert (count == answer[W-1:0]);
            assert (!(store && read));
        end
        cover (past && !rst && asked && count == W'(2));
        cover (past && !rst && put_off && in_work);
    end
`endif
endmodule

`default_nettype wire
