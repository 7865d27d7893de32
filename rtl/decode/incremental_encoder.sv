// SPDX-License-Identifier: Apache-2.0
// incremental_encoder -- everything between the synchronised pins of an A/B/Z encoder and its
// count: filter, decoder, index, flags, time of the last edge.
//
// latency  N samples of the filter and 2 clk from a, b, z to count and index_found; 3 clk from
//          own_a, own_b to count
// rate     one edge per clk with the filter in bypass, else one edge of each level per N samples
//          own      levels that are made in clk have no disturbances, and may be shorter than the filter
//          passes: with own = 1 own_a and own_b are counted in place of the filtered a and b. The
//          filter goes on for a, b and z
// source   the features of HostMot2's encoder counter, with N-of-M, more modes, direction and
//          revolution checks added
// model    tb/decode/incremental_encoder.py, equal in every bit of every cycle
// proved   with own, the decoder gets own_a and own_b as they were 2 clk before, whatever the
//          filter is set to; a fault only by an event after it was enabled; edge_time changes with
//          a step of count and at no other time
// proof    W = 4, TIME_W = 4, FILTER_W = 2, TOLERATED_W = 1, SKIP_W = 1
`default_nettype none

module incremental_encoder #(
    parameter int W           = 32,  // bits of count
    parameter int TIME_W      = 32,  // bits of the time stamp
    parameter int FILTER_W    = 8,   // bits of filter_required
    parameter int TOLERATED_W = 4,   // bits of filter_tolerated
    parameter int SKIP_W      = 16,  // bits of filter_skip
    parameter int CHECK       = 1    // 0: without the check of counts_per_revolution
) (
    input wire clk,
    input wire rst,
    input wire [SKIP_W-1:0] filter_skip,  // event_filter: clk left out between two samples
    input wire [FILTER_W-1:0] filter_required,  // event_filter: N; 0 and 1 pass every sample
    input wire [TOLERATED_W-1:0] filter_tolerated,  // event_filter: M - N
    input wire [1:0] mode,  // quadrature_decoder: x4, x2, x1, pulses and direction
    input wire index_low,  // index_latch: active_low
    input wire [1:0] index_gate_mask,
    input wire [1:0] index_gate,  // {b, a}
    input wire index_up,
    input wire index_down,
    input wire index_each,
    input wire index_clears,
    input wire [W-1:0] counts_per_revolution,
    input wire illegal_enable,  // an illegal edge from now on is a fault
    input wire arm_index,  // strobe
    input wire clear_flags,  // strobe; an event in the same clk is kept
    input wire [TIME_W-1:0] now,  // clk
    input wire a,  // levels, synchronous to clk
    input wire b,
    input wire z,
    input wire own,  // 1: own_a and own_b are counted, and gate the index; 0: a and b
    input wire own_a,  // levels made in clk, not filtered
    input wire own_b,
    output logic signed [W-1:0] count,
    output logic signed [1:0] step,
    output logic direction,  // as in quadrature_decoder
    output logic [TIME_W-1:0]    edge_time, // now in the clk before count took its last step, both change at once; nothing before the first step
    output logic index_found,  // strobe
    output logic index_armed,
    output logic signed [W-1:0] index_count,
    output logic [2:0] filtered,  // {z, b, a}, levels after the filter, whatever own is
    output logic [2:0] rejected,  // {z, b, a}, strobes of the filter
    output logic illegal,  // strobe
    output logic illegal_seen,  // flag: an illegal edge since clear_flags
    output logic illegal_fault,  // flag: one while illegal_enable was 1; falls with it
    output logic revolution_wrong,  // strobe
    output logic revolution_fault  // flag: a wrong revolution since clear_flags
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
    logic [2:0] own_before;  // {b, a} of own_q and own, one clk ago
    logic       seen_enabled;  // an illegal edge since the enable rose
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
        // from here on the decoder counts them
        if (past && own_before[0]) assert ({b_later, a_later} == own_before[2:1]);
        cover (illegal_fault);
    end
`endif
endmodule

`default_nettype wire
