// SPDX-License-Identifier: Apache-2.0
// index_latch -- find the index (reference mark) of a scale, latch or clear the count exactly at
// it, check the counts between two of them, and latch the count at a probe.
//
// latency  1 cycle from a, b to a_later, b_later; 2 cycles from a, b, z to found and index_count;
//          4 cycles from a, b, z to revolution_wrong; 1 cycle from probe to index_count
// rate     one index per 2 cycles
// behaviour The decoder counts the delayed a_later and b_later, so clear arrives together with the
//          edge it belongs to. index_count is the count of the first state in which the index is
//          present, and the count is 0 there if the index clears it. A probe latches the count of
//          its own cycle.
// source   S3: a rising edge on R latches the position and sets a flag. An index counts once,
//          however wide it is. Gated by a and b it is one quarter period wide and lies at the same
//          count in both directions.
// model    tb/decode/index_latch.py, equal in every bit of every cycle
// proved   found follows only an edge of a, b or z into the gated index, in an enabled direction,
//          armed or with `each`, and never again before z has become inactive; a change of
//          settings alone never causes it; count is cleared only together with found; index_count
//          changes only with found or probe
// proof    W = 4
`default_nettype none

module index_latch #(
    parameter int W     = 32,  // bits of count
    parameter int CHECK = 1    // 1: counts_per_revolution is checked; 0: not
) (
    input  wire                 clk,
    input  wire                 rst,                    // level: disarms, index_count becomes 0
    input  wire                 active_low,             // level: the index is present at z = 0
    input  wire         [  1:0] gate_mask,              // {b, a}: 1: this level is required
    input  wire         [  1:0] gate,                   // {b, a}: the levels required
    input  wire                 take_up,                // level: take an index that is met going up
    input  wire                 take_down,              // level: take an index met going down
    input  wire                 each,                   // level: take each index; 0: one per arm
    input  wire                 clears,                 // level: an index clears the count
    input  wire         [W-1:0] counts_per_revolution,  // counts; 0, or each = 0: not checked
    input  wire                 arm,                    // strobe: take the next index
    input  wire                 probe,                  // strobe: latch the count
    input  wire                 ready,                  // level: ready of the decoder
    input  wire                 direction,              // level: direction of the decoder
    input  wire                 stepping,               // level: stepping of the decoder
    input  wire signed  [W-1:0] count,                  // counts: count of the decoder
    input  wire                 a,                      // level: filtered channel A, synchronous
    input  wire                 b,                      // level: filtered channel B, synchronous
    input  wire                 z,                      // level: filtered index, synchronous to clk
    output logic                a_later,                // level: a for the decoder
    output logic                b_later,                // level: b for the decoder
    output logic                clear,                  // strobe: clear for the decoder
    output logic                armed,                  // level: the next index will be taken
    output logic                found,                  // strobe: an index was taken
    output logic signed [W-1:0] index_count,            // counts at the last index or probe
    output logic                revolution_wrong        // strobe: turned neither 0 nor one turn
);
    logic z_later;
    // the delayed levels have just entered the index; taken if that was going up, going down
    logic from_below, from_above;
    logic wants;  // an index would be taken: each or armed
    logic used;  // this index was met already

    wire  at_index = (z ^ active_low) && ((gate ^ {b, a}) & gate_mask) == 0;
    // with the present settings, so that a new setting makes no edge
    wire  at_index_q = (z_later ^ active_low) && ((gate ^ {b_later, a_later}) & gate_mask) == 0;
    wire  entering = ready && at_index && !at_index_q && !used;
    wire  met = direction ? from_below : from_above;
    wire  take = met && wants;
    wire  stepped = ready && stepping;

    assign clear = take && clears;

    always_ff @(posedge clk) begin
        a_later    <= a;
        b_later    <= b;
        z_later    <= z;
        from_below <= entering && take_up;
        from_above <= entering && take_down;
        wants     <= each || armed;
        used       <= (used || met) && (z ^ active_low);
        armed      <= arm || (armed && !take);
        found      <= take;
        // The count before the step, by a subtraction of its own: it costs no extra cells here,
        // while sharing the adder of the decoder would cost W cells.
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
        // known: there was an index before; zeroed: it cleared the count
        logic known, zeroed;
        logic judge, judge_q;  // index_count is ready to be judged, then turn
        logic [W-1:0] reference, turn;  // count at the preceding index; counts since then

        wire on = each && counts_per_revolution != '0;
        // x + y is 0 if each of its bits takes the carry of the bit below, which is x | y there
        wire [W-1:0] carry = {turn[W-2:0] | counts_per_revolution[W-2:0], 1'b0};
        wire up = turn == counts_per_revolution;
        wire down = (turn ^ counts_per_revolution) == carry;

        always_ff @(posedge clk) begin
            if (take) zeroed <= clears;
            if (found) reference <= zeroed ? '0 : index_count;
            judge            <= take && known && on;
            turn             <= index_count - reference;
            judge_q          <= judge;
            revolution_wrong <= judge_q && turn != '0 && !up && !down;
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
    logic         past = 1'b0;
    wire  [  2:0] levels = {a_later, b_later, z_later};
    wire  [W-1:0] count_now = !stepped ? count : direction ? count + 1'b1 : count - 1'b1;
    logic         free;  // z has been inactive since an index was met
    always @(posedge clk) begin
        past <= 1'b1;
        free <= rst || !(z ^ active_low) || (free && !met);
        if (!past) assume (rst);
        if (past) begin
            assert (used == !free);
            assert (!clear || (take && clears));
            if (take) begin
                assert (levels != $past(levels));
                assert ((z_later ^ $past(active_low)) && $past(ready) && $past(free));
                assert ($past(each || armed) && (direction ? $past(take_up) : $past(take_down)));
            end
        end
        if (past && !$past(rst)) begin
            assert (found == $past(take));
            if (found || $past(probe)) begin
                assert (index_count == $past(count_now));
            end else begin
                assert (index_count == $past(index_count));
            end
            assert (!armed || !found || $past(arm));
            cover (found && gate_mask == 3 && !each);
            cover (found && $past(found, 2));
            cover (revolution_wrong && counts_per_revolution == 5);
        end
    end
`endif
endmodule

`default_nettype wire
