// SPDX-License-Identifier: Apache-2.0
// position_capture -- latch position and time at events, and queue them until they are read.
//
// latency  2 cycles from event to present, if the queue is empty
// rate     one entry per cycle
// behaviour The sources are bit 0 index, bit 1 tick, bit 2 software, then one bit per probe for its
//          rising edge, then one bit per probe for its falling edge. Events of the same cycle make
//          one entry with all their bits set. An entry holds the position at the port in the cycle
//          of the event, the time of that cycle, and the age of the position: the number of cycles
//          since it arrived. At velocity v the scale has moved on by v * (age + latency of the
//          measuring path). The position refers to the origin at the event: read or clear the
//          queue before the origin is moved. The head does not change until pop, so it may be read
//          word by word. An event that meets a full queue is dropped and reported by overrun; an
//          event together with clear is dropped without a report. The first level of a probe after
//          reset is no edge.
// source   S3: an edge of the reference mark latches the position counter and sets a flag
// model    tb/position/position_capture.py, equal in every bit of every cycle
// proved   position, time, age and sources of an entry always belong to the same cycle; the head
//          changes only by pop or clear; without overrun no event is lost, duplicated, invented or
//          reordered
// proof    depth 12, PROBES = 1, TIME_W = 4, DEPTH = 4
`default_nettype none

module position_capture #(
    parameter int PROBES = 2,   // number of probe inputs
    parameter int TIME_W = 32,  // bits of the time
    parameter int DEPTH  = 16,  // entries, a power of two from 4 up
    parameter int ZEROS  = 0    // lowest bits of position that are always 0, 0 to 47
) (
    input  wire                           clk,
    input  wire                           rst,                // level: the queue is emptied
    input  wire         [   2*PROBES+2:0] enabled,            // one bit per source: makes entries
    input  wire                           index,              // strobe: an index was found
    input  wire                           tick,               // strobe: a servo tick
    input  wire                           software,           // strobe: a capture by software
    input  wire         [     PROBES-1:0] probe,              // levels, synchronous to clk
    input  wire         [     TIME_W-1:0] now,                // cycles, the time stamp
    input  wire                           valid,              // strobe: position is new
    /* verilator lint_off UNUSEDSIGNAL */  // its ZEROS lowest bits are not used
    input  wire signed  [           47:0] position,           // Q32.16 periods
    /* verilator lint_on UNUSEDSIGNAL */
    input  wire                           pop,                // strobe: remove the head, if any
    input  wire                           clear,              // strobe: empty the queue
    output logic                          present,            // level: the outputs show the head
    output logic        [   2*PROBES+2:0] captured_sources,   // one bit per source
    output logic        [           15:0] captured_age,       // cycles; 65535: more, or no position
    output logic        [     TIME_W-1:0] captured_time,      // cycles
    output logic signed [           47:0] captured_position,  // Q32.16 periods
    output logic        [$clog2(DEPTH):0] free,               // entries that still fit
    output logic                          overrun             // strobe: an event was dropped
);
    localparam int A = $clog2(DEPTH), S = 2 * PROBES + 3, W = S + 16 + TIME_W + 48 - ZEROS;

    if (PROBES < 1) begin : g_check_probes
        PROBES_MUST_BE_AT_LEAST_1 u_error ();
    end
    if (DEPTH < 4 || DEPTH != 1 << A) begin : g_check_depth
        DEPTH_MUST_BE_A_POWER_OF_TWO_FROM_4_UP u_error ();
    end

    // a row that is read while it is written is not shown
    (* no_rw_check *)logic [W-1:0] memory[0:DEPTH-1];
    logic [W-1:0] head;
    // entries so far; the bit above an address distinguishes full from empty
    logic [A:0] written, read;
    logic known;  // probe_q is a level taken since reset
    logic [PROBES-1:0] probe_q;
    // age of the position in a cycle without a new one
    logic [15:0] since;

    wire [PROBES-1:0] changed = known ? probe ^ probe_q : '0;
    wire [S-1:0] events = {changed & ~probe, changed & probe, software, tick, index} & enabled;
    wire [15:0] age = valid ? 16'd0 : since;
    wire [W-1:0] entry = {events, age, now, position[47:ZEROS]};
    wire full = free == '0;
    wire take = events != '0 && !full && !clear;
    wire drop = pop && present;
    wire [A:0] read_next = read + (A + 1)'(drop);

    assign {captured_sources, captured_age, captured_time} = head[W-1:48-ZEROS];
    assign captured_position = 48'(head[47-ZEROS:0]) << ZEROS;

    always_ff @(posedge clk) begin
        if (take) memory[written[A-1:0]] <= entry;
        head <= memory[read_next[A-1:0]];
    end

    always_ff @(posedge clk) begin
        known   <= 1'b1;
        probe_q <= probe;
        since   <= age == '1 ? age : age + 1'b1;
        present <= written != read_next;
        overrun <= events != '0 && full && !clear;
        read    <= read_next;
        written <= written + (A + 1)'(take);
        free    <= free + (A + 1)'(drop) - (A + 1)'(take);
        if (rst || clear) begin
            present <= 1'b0;
            overrun <= 1'b0;
            read    <= '0;
            written <= '0;
            free    <= (A + 1)'(DEPTH);
        end
        if (rst) begin
            known <= 1'b0;
            since <= '1;
        end
    end

`ifdef FORMAL
    // Any one entry since the queue was emptied, the `chosen`-th, is followed from its event until
    // it is popped.
    (* anyconst *)logic        [       A:0] chosen;
    logic                     past = 1'b0;
    logic                     waiting;  // the chosen entry is in the queue
    // the inputs in the cycle of its event
    logic        [     S-1:0] then_events;
    logic        [      15:0] then_age;
    logic        [TIME_W-1:0] then_time;
    logic signed [      47:0] then_position;
    wire         [       A:0] stored = written - read;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (rst || clear) waiting <= 1'b0;
        else begin
            if (take && written == chosen) begin
                waiting       <= 1'b1;
                then_events   <= events;
                then_age      <= age;
                then_time     <= now;
                then_position <= position;
            end
            if (drop && read == chosen) waiting <= 1'b0;
        end
        assume ((position & ~(48'hFFFF_FFFF_FFFF << ZEROS)) == '0);
        if (past && !$past(rst)) begin
            if (known && $past(known)) assert (probe_q == $past(probe));
            assert (stored <= (A + 1)'(DEPTH) && free == (A + 1)'(DEPTH) - stored);
            if (present) assert (stored != 0);
            if (stored != 0 && !present) assert (stored == 1 && $past(take));
            assert (waiting == ((A + 1)'(chosen - read) < stored));
            if (waiting)
                assert (memory[chosen[A-1:0]] == {then_events, then_age, then_time, then_position});
            if (waiting && present && read == chosen) begin
                assert (head == {then_events, then_age, then_time, then_position});
                assert (captured_sources != 0);
            end
            if (waiting) assert (then_events != 0);
            if ($past(present) && !$past(pop) && !$past(clear))
                assert (present && read == $past(read));
            if ($past(events) != 0 && !$past(clear))
                assert (overrun || written == $past(written) + 1'b1);
            if (overrun) assert ($past(events) != 0 && $past(stored) == (A + 1)'(DEPTH));
            if ($past(events) == 0 && !$past(clear)) assert (written == $past(written) && !overrun);
            cover (drop && take && read == chosen);
            cover (overrun && $past(captured_sources) == 5'b10001);
        end
    end
`endif
endmodule

`default_nettype wire
