// SPDX-License-Identifier: Apache-2.0
// incremental_encoder -- the full input of an A/B/Z encoder, from synchronised pins to the count:
// filter, decoder, index, flags and the time of the last edge.
//
// latency  N samples of the filter and 2 cycles from a, b, z to count and index_found; 3 cycles
//          from own_a, own_b to count
// rate     one edge per cycle if the filter is bypassed, else one edge of each level per N samples
// behaviour own_a and own_b are levels made by this design. They carry no disturbances and may be
//          shorter than the filter passes, so they bypass the filter: with own = 1 the decoder
//          counts own_a and own_b instead of the filtered a and b, and the index gate uses them.
//          The filter of a, b, z keeps running. edge_time is undefined before the first step.
// source   the functions of HostMot2's encoder counter, with an N-of-M filter, more modes, and
//          checks of direction and of counts per revolution
// model    tb/decode/incremental_encoder.py, equal in every bit of every cycle
// proved   with own = 1 the decoder gets own_a and own_b of 2 cycles ago, whatever the filter
//          settings are; an illegal edge becomes a fault only while illegal_enable is 1; edge_time
//          changes with a step of count and at no other time
// proof    W = 4, TIME_W = 4, FILTER_W = 2, TOLERATED_W = 1, SKIP_W = 1
//
// The settings have the meaning of the same settings of the blocks: filter_… of event_filter,
// `mode` of quadrature_decoder, index_… and counts_per_revolution of index_latch (gate_mask and
// gate as {b, a}). An event in the cycle of clear_flags sets its flag again. edge_time is `now` of
// the cycle before the step.
`default_nettype none

module incremental_encoder #(
    parameter int W           = 32,  // bits of count
    parameter int TIME_W      = 32,  // bits of the time stamp
    parameter int FILTER_W    = 8,   // bits of filter_required
    parameter int TOLERATED_W = 4,   // bits of filter_tolerated
    parameter int SKIP_W      = 16,  // bits of filter_skip
    parameter int CHECK       = 1    // 1: counts_per_revolution is checked; 0: not
) (
    input  wire                           clk,
    input  wire                           rst,                    // level: count and flags become 0
    input  wire         [     SKIP_W-1:0] filter_skip,            // cycles left out between samples
    input  wire         [   FILTER_W-1:0] filter_required,        // samples N; 0 and 1 pass each
    input  wire         [TOLERATED_W-1:0] filter_tolerated,       // samples M - N
    input  wire         [            1:0] mode,                   // 0 x4, 1 x2, 2 x1, 3 pulses
    input  wire                           index_low,              // level: the index is active low
    input  wire         [            1:0] index_gate_mask,        // {b, a}: 1: level is required
    input  wire         [            1:0] index_gate,             // {b, a}: the levels required
    input  wire                           index_up,               // level: take an index going up
    input  wire                           index_down,             // level: take one going down
    input  wire                           index_each,             // level: all; 0: one per arm
    input  wire                           index_clears,           // level: an index clears count
    input  wire         [          W-1:0] counts_per_revolution,  // counts; 0: not checked
    input  wire                           illegal_enable,         // level: illegal edge is a fault
    input  wire                           arm_index,              // strobe: take the next index
    input  wire                           clear_flags,            // strobe: clear the level flags
    input  wire         [     TIME_W-1:0] now,                    // cycles, the time stamp
    input  wire                           a,                      // level: channel A, synchronous
    input  wire                           b,                      // level: channel B, synchronous
    input  wire                           z,                      // level: index, synchronous
    input  wire                           own,                    // level: count own_a and own_b
    input  wire                           own_a,                  // level made in clk, not filtered
    input  wire                           own_b,                  // level made in clk, not filtered
    output logic signed [          W-1:0] count,                  // counts, wraps
    output logic signed [            1:0] step,                   // counts in this cycle: -1, 0, +1
    output logic                          direction,              // level: 1 up, 0 down
    output logic        [     TIME_W-1:0] edge_time,              // cycles, time of the last step
    output logic                          index_found,            // strobe: an index was taken
    output logic                          index_armed,            // level: the next index is taken
    output logic signed [          W-1:0] index_count,            // counts: where the index was
    output logic        [            2:0] filtered,               // {z, b, a}: filtered levels
    output logic        [            2:0] rejected,               // {z, b, a}: disturbance strobes
    output logic                          illegal,                // strobe: a and b changed at once
    output logic                          illegal_seen,           // level: one since clear_flags
    output logic                          illegal_fault,          // level: one while enabled
    output logic                          revolution_wrong,       // strobe: wrong number of counts
    output logic                          revolution_fault        // level: one since clear_flags
);
    wire a_later, b_later, ready, stepping, clear;
    logic [1:0] own_q;  // {b, a}
    wire  [1:0] counted = own ? own_q : filtered[1:0];

    event_filter #(
        .LEVELS     (3),
        .W          (FILTER_W),
        .TOLERATED_W(TOLERATED_W),
        .SKIP_W     (SKIP_W)
    ) u_filter (
        .clk,
        .rst,
        .skip     (filter_skip),
        .required (filter_required),
        .tolerated(filter_tolerated),
        .level    ({z, b, a}),
        .filtered,
        .rejected
    );
    quadrature_decoder #(
        .W(W)
    ) u_decoder (
        .clk,
        .rst,
        .mode,
        .clear,
        .a(a_later),
        .b(b_later),
        .ready,
        .stepping,
        .count,
        .step,
        .direction,
        .illegal
    );
    index_latch #(
        .W    (W),
        .CHECK(CHECK)
    ) u_index (
        .clk,
        .rst,
        .active_low(index_low),
        .gate_mask (index_gate_mask),
        .gate      (index_gate),
        .take_up   (index_up),
        .take_down (index_down),
        .each      (index_each),
        .clears    (index_clears),
        .counts_per_revolution,
        .arm       (arm_index),
        .probe     (1'b0),
        .ready,
        .direction,
        .stepping,
        .count,
        .a         (counted[0]),
        .b         (counted[1]),
        .z         (filtered[2]),
        .a_later,
        .b_later,
        .clear,
        .armed     (index_armed),
        .found     (index_found),
        .index_count,
        .revolution_wrong
    );

    always_ff @(posedge clk) begin
        own_q <= {own_b, own_a};
        if (stepping) edge_time <= now;
        illegal_seen     <= illegal || (illegal_seen && !clear_flags);
        illegal_fault    <= illegal_enable && (illegal || (illegal_fault && !clear_flags));
        revolution_fault <= revolution_wrong || (revolution_fault && !clear_flags);
        if (rst) begin
            illegal_seen     <= 1'b0;
            illegal_fault    <= 1'b0;
            revolution_fault <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [2:0] own_before;  // {own_q, own} of the preceding cycle
    logic       seen_enabled;  // an illegal edge since illegal_enable rose
    always @(posedge clk) begin
        past         <= 1'b1;
        seen_enabled <= !rst && illegal_enable && (illegal || seen_enabled);
        if (!past) assume (rst);
        if (past) begin
            assert (!illegal_fault || seen_enabled);
            assert (!illegal_fault || illegal_seen);
        end
        if (past && !$past(rst)) begin
            if (ready && $past(ready) && edge_time != $past(edge_time))
                assert (step != 0 && edge_time == $past(now));
            if (step != 0) assert (edge_time == $past(now));
            if ($past(illegal)) assert (illegal_seen);
            cover (index_found && step == -1);
            cover (own && $past(own) && step == 1 && filter_required == 3);
        end
        own_before <= {own_q, own};
        // the decoder counts these delayed levels
        if (past && own_before[0]) assert ({b_later, a_later} == own_before[2:1]);
        cover (illegal_fault);
    end
`endif
endmodule

`default_nettype wire
