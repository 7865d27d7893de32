// SPDX-License-Identifier: Apache-2.0
// index_latch -- find the index (reference mark) of a grating, latch or clear the count exactly
// there, check the counts between; latch it at a probe as well.
//
// latency  1 clk to a_later, b_later, from which the decoder counts: so clear meets the edge that
//          it belongs to. found and index_count 2 clk after a, b, z, together with the count of the
//          state in which the index first stands, which is zero then if it clears; revolution_wrong
//          4 clk after a, b, z. probe 1 clk: the count that stands then
// rate     one index per 2 clk
// source   S3: a rising edge on R latches the position and sets a flag. An index counts once,
//          however wide it is; gated by a and b it is one quarter period wide and lies at the same
//          count in both directions
// model    tb/decode/index_latch.py, equal in every bit of every cycle
// proved   found only after an edge of a, b or z into the gated index, in a wanted direction, armed
//          or each, and never again before z has fallen; settings alone never make one; count is
//          cleared only with found; index_count changes only with found or by probe
// proof    W = 4
`default_nettype none

module index_latch #(
    parameter int W     = 32,  // bits of count
    parameter int CHECK = 1    // 0: without the check of counts_per_revolution
) (
    input wire clk,
    input wire rst,
    input wire active_low,  // polarity: the index is 0: z high, 1: z low
    input wire [1:0] gate_mask,  // {b, a}: 1 the index needs this level to be as in gate
    input wire [1:0] gate,  // {b, a}
    input wire take_up,  // take an index that is met going up
    input wire take_down,  // and going down
    input wire each,  // 1: every index, 0: one for each arm
    input wire clears,  // 1: an index that is found clears the count
    input  wire        [W-1:0]   counts_per_revolution, // in counts of the decoder's mode; 0, or each = 0: not checked
    input wire arm,  // strobe: take the next index
    input wire probe,  // strobe: latch the count
    input  wire                  ready,   // from the decoder behind a_later, b_later, as are direction, stepping, count
    input wire direction,
    input wire stepping,
    input wire signed [W-1:0] count,
    input wire a,  // levels, synchronous to clk and already filtered
    input wire b,
    input wire z,
    output logic a_later,  // a, b and clear: to the decoder
    output logic b_later,
    output logic clear,
    output logic armed,
    output logic found,  // strobe
    output logic signed [W-1:0]  index_count, // count of the last index found, before it cleared, or of a probe since then
    output logic                 revolution_wrong // strobe: neither 0 nor counts_per_revolution since the index before
);
    logic z_later;
    // a_later, b_later, z_later have just come into the index; it is taken if that was going up,
    // down
    logic from_below, from_above;
    logic wanted;  // every index, or armed
    logic used;  // this index has been met already

    wire  at_index = (z ^ active_low) && ((gate ^ {b, a}) & gate_mask) == 0;
    // settings of now: they make no edge
    wire  at_index_q = (z_later ^ active_low) && ((gate ^ {b_later, a_later}) & gate_mask) == 0;
    wire  entering = ready && at_index && !at_index_q && !used;
    wire  met = direction ? from_below : from_above;
    wire  take = met && wanted;
    wire  stepped = ready && stepping;

    assign clear = take && clears;

    always_ff @(posedge clk) begin
        a_later    <= a;
        b_later    <= b;
        z_later    <= z;
        from_below <= entering && take_up;
        from_above <= entering && take_down;
        wanted     <= each || armed;
        used       <= (used || met) && (z ^ active_low);
        armed      <= arm || (armed && !take);
        found      <= take;
        // less the reverse of the step: an adder of its own costs nothing here, that of the decoder
        // shared costs W cells
        if (take || probe) index_count <= count - {{W - 1{stepped && direction}}, stepped};
        if (rst) begin
            from_below  <= 1'b0;
            from_above  <= 1'b0;
            used        <= 1'b0;
            armed       <= 1'b0;
            found       <= 1'b0;
            index_count <= '0;
        end
    end

    if (CHECK != 0) begin : g_check
        // there was an index before; the last one cleared the count
        logic known, zeroed;
        logic judge, judge_q;  // index_count, then turn, is to be judged
        logic [W-1:0] reference, turn;  // count of the index before; counts from there

        wire on = each && counts_per_revolution != '0;

        always_ff @(posedge clk) begin
            if (take) zeroed <= clears;
            if (found) reference <= zeroed ? '0 : index_count;
            judge            <= take && known && on;
            turn             <= index_count - reference;
            judge_q          <= judge;
            revolution_wrong <= judge_q && turn != '0 && turn != counts_per_revolution && turn != -counts_per_revolution;
            known            <= on && (known || take);
            if (rst) begin
                known            <= 1'b0;
                judge            <= 1'b0;
                judge_q          <= 1'b0;
                revolution_wrong <= 1'b0;
            end
        end
    end else begin : g_no_check
        wire unused = &{1'b0, counts_per_revolution};
        assign revolution_wrong = 1'b0;
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic free;  // z has not been the index since one was met
    always @(posedge clk) begin
        past <= 1'b1;
        free <= rst || !(z ^ active_low) || (free && !met);
        if (!past) assume (rst);
        if (past) begin
            assert (used == !free);
            assert (!clear || (take && clears));
            if (take) begin
                assert ({a_later, b_later, z_later} != {$past(
                    a_later
                ), $past(
                    b_later
                ), $past(
                    z_later
                )});
                assert ((z_later ^ $past(active_low)) && $past(ready) && $past(free));
                assert ($past(each || armed) && (direction ? $past(take_up) : $past(take_down)));
            end
        end
        if (past && !$past(rst)) begin
            assert (found == $past(take));
            if (found || $past(probe))
                assert (index_count == W'($past(
                    count
                ) + ($past(
                    stepped
                ) ? $past(
                    direction
                ) ? 1 : -1 : 0)));
                else assert (index_count == $past(index_count));
            assert (!armed || !found || $past(arm));
            cover (found && gate_mask == 3 && !each);
            cover (found && $past(found, 2));
            cover (revolution_wrong && counts_per_revolution == 5);
        end
    end
`endif
endmodule

`default_nettype wire
