// SPDX-License-Identifier: Apache-2.0
// zero_crossing -- say when the position passes its absolute zero, and which way.
//
// latency  1 clk from valid to up, down
// rate     one position per clk
// source   S0: the borrow of the last decade interrupts the 8031 at every pass of the absolute zero
// shift    the position that stands in the clk after a shift is only learnt: moving the origin is
//          no crossing
// model    tb/position/zero_crossing.py, equal in every bit of every cycle
// proved   never up and down at once; without a shift they come by turns; none from a shift, nor
//          where the position wraps
`default_nettype none

module zero_crossing (
    input wire clk,
    input wire rst,  // the next position is only learnt
    input wire valid,  // strobe: position is new
    /* verilator lint_off UNUSEDSIGNAL */  // the sign and the bit below it tell all; the port is the whole stream
    input wire signed [47:0] position,  // Q32.16 periods
    /* verilator lint_on UNUSEDSIGNAL */
    input wire shift,  // strobe: the position will be of another origin in the next clk
    output logic up,  // strobe: from below 0 to 0 or above
    output logic down  // strobe: from 0 or above to below 0
);
    // known: below is that of a position; shifted: the clk after a shift
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
