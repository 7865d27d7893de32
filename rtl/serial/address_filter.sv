// SPDX-License-Identifier: Apache-2.0
// address_filter -- pass only what is meant for this node of a multi-drop line.
//
// latency  1 clk
// rate     one word per clk
// source   S0: multiprocessor mode of the 8031 (SM2). A word with the 9th bit set is looked at by
//          all nodes: `00 D5D4 address` with D5D4 01 or 10 and the own address passes and opens the
//          gate for the words that follow; `00 10 0000` is for all nodes; any other closes it
// model    tb/serial/address_filter.py, equal in every bit of every cycle
// proved   nothing passes but own commands, and data words after one with no other command between
`default_nettype none

module address_filter (
    input  wire        clk,
    input  wire        rst,       // closes the gate
    input  wire  [3:0] address,   // of this node
    input  wire        valid_in,  // strobe
    input  wire  [7:0] data_in,
    input  wire        ninth,     // 1: a command byte, for whomever
    output logic       valid,     // strobe: a word for this node
    output logic [7:0] data,
    output logic       command    // with valid: a command byte of this node
);
    logic open;

    wire own = (data_in[7:6] == 2'b00 && (data_in[5] ^ data_in[4]) && data_in[3:0] == address) || data_in == 8'h20;

    always_ff @(posedge clk) begin
        valid   <= valid_in && (ninth ? own : open);
        data    <= data_in;
        command <= ninth;
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
                assert ($past(valid_in) && data == $past(data_in) && command == $past(ninth));
                if (command) assert (data[7:4] == 4'h1 || data[7:4] == 4'h2);
                if (command)
                    assert (data[3:0] == $past(address) || data == 8'h20);
                    else assert ($past(called));
            end
            cover (valid && command);
            cover (valid && !command && data == 8'h55);
            cover (!open && $past(open));
        end
    end
`endif
endmodule

`default_nettype wire
