// SPDX-License-Identifier: Apache-2.0
// address_filter -- pass only the words of an RS-485 bus that are meant for this node.
//
// latency   1 cycle from valid_in to valid
// rate      one word per cycle
// behaviour All nodes examine a word with the 9th bit set. `00 D5D4 address` with D5D4 01 or 10 and
//           the node's own address passes, and opens the gate for the words that follow. `00 10
//           0000` is meant for all nodes. Any other word with the 9th bit set closes the gate.
//           The word itself stays at its source (uart_rx), for all that read it.
// source    S0: multiprocessor mode of the 8031 (SM2)
// model     tb/serial/address_filter.py, equal in every bit of every cycle
// proved    Nothing passes but commands for this node, and data words after one with no other
//           command between.
`default_nettype none

module address_filter (
    input  wire        clk,
    input  wire        rst,
    input  wire  [3:0] address,   // number of this node, 1 to 15
    input  wire        valid_in,  // strobe: data_in and ninth are a word
    input  wire  [7:0] data_in,   // 8 data bits of the word
    input  wire        ninth,     // level: the word is a command byte, for any node
    output logic       valid      // strobe: the word is for this node
);
    logic open;  // data words pass

    wire  is_command = data_in[7:6] == 2'b00 && (data_in[5] ^ data_in[4]);
    wire  own = (is_command && data_in[3:0] == address) || data_in == 8'h20;

    always_ff @(posedge clk) begin
        valid <= valid_in && (ninth ? own : open);
        if (valid_in && ninth) open <= own;
        if (rst) begin
            valid <= 1'b0;
            open  <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic called;  // the latest command byte was for this node
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (rst) called <= 1'b0;
        else if (valid_in && ninth)
            called <= data_in == {4'h1, address} || data_in == {4'h2, address} || data_in == 8'h20;
        if (past && !$past(rst)) begin
            assert (open == called);
            if (valid) begin
                assert ($past(valid_in));
                if ($past(ninth))
                    assert ($past(data_in[7:4]) == 4'h1 || $past(data_in[7:4]) == 4'h2);
                if ($past(ninth))
                    assert ($past(data_in[3:0]) == $past(address) || $past(data_in) == 8'h20);
                if (!$past(ninth)) assert ($past(called));
            end
            cover (valid && $past(ninth));
            cover (valid && !$past(ninth) && $past(data_in) == 8'h55);
            cover (!open && $past(open));
        end
    end
`endif
endmodule

`default_nettype wire
