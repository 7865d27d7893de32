// SPDX-License-Identifier: Apache-2.0
// zero_crossing -- report when the position passes its zero, and in which direction.
//
// latency  1 cycle from valid to up, down
// rate     one position per cycle
// behaviour The position in the cycle after a shift is only taken as the new reference: moving the
//          origin is no crossing.
// source   S0: the borrow of the last decade interrupts the 8031 at every pass of the absolute
//          zero
// model    tb/position/zero_crossing.py, equal in every bit of every cycle
// proved   up and down are never reported at once; without a shift they alternate; neither a shift
//          nor the wrap of the position causes one
`default_nettype none

module zero_crossing (
    input  wire               clk,
    input  wire               rst,       // level: the next position is only taken as reference
    input  wire               valid,     // strobe: position is new
    /* verilator lint_off UNUSEDSIGNAL */  // only the two top bits matter
    input  wire signed [47:0] position,  // Q32.16 periods
    /* verilator lint_on UNUSEDSIGNAL */
    input  wire               shift,     // strobe: the origin moves in the next cycle
    output logic              up,        // strobe: position went from below 0 to 0 or above
    output logic              down       // strobe: position went from 0 or above to below 0
);
    // known: below is the sign of a position; shifted: the cycle after a shift
    logic known, below, shifted;

    wire near_above = position[47:46] == 2'b00;  // not where the position wraps
    wire near_below = position[47:46] == 2'b11;

    always_ff @(posedge clk) begin
        shifted <= shift;
        up      <= valid && known && !shifted && below && near_above;
        down    <= valid && known && !shifted && !below && near_below;
        if (valid || (shifted && known)) below <= position[47];
        if (valid) known <= 1'b1;
        if (rst) begin
            known   <= 1'b0;
            shifted <= 1'b0;
            up      <= 1'b0;
            down    <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    // the last strobe since reset, shift or wrap: 1 up, 2 down, 0 none
    logic [1:0] turn;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (up || down) turn <= up ? 2'd1 : 2'd2;
        if (rst || shift || shifted || position[47] != position[46]) turn <= '0;
        if (past) begin
            assert (!(up && down));
            if (up) assert (turn != 1);
            if (down) assert (turn != 2);
            if (turn == 1 && !up && !down) assert (known && !below);
            if (turn == 2 && !up && !down) assert (known && below);
            if (up) assert (known && !below);
            if (down) assert (known && below);
        end
        if (past && !$past(rst)) begin
            if ($past(shifted) || !$past(valid)) assert (!up && !down);
            if (up) assert (!$past(position[47]));
            if (down) assert ($past(position[47]));
            cover (up);
            cover (down && turn == 1);
        end
    end
`endif
endmodule

`default_nettype wire
