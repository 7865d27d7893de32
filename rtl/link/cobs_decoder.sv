// SPDX-License-Identifier: Apache-2.0
// cobs_decoder -- cut a stream of bytes into packets: a zero ends a packet, whose own zeros were
// replaced by consistent overhead byte stuffing (COBS).
//
// latency   0 cycles from valid to valid_out, ends and broken
// rate      one byte per cycle
// behaviour The zero behind a block comes with the code of the next block, so that the one behind
//           the last block never does. A packet without a byte only ends.
// source    Cheshire and Baker, Consistent Overhead Byte Stuffing, 1999
// model     tb/link/cobs_decoder.py, equal in every bit of every cycle
// proved    A packet ends with each zero and with nothing else. If its last block is not complete,
//           it is broken. No byte of a packet comes with the zero that ends it.
// proof     depth 8
`default_nettype none

module cobs_decoder (
    input  wire        clk,
    input  wire        rst,
    input  wire        valid,      // strobe: data is the next byte
    input  wire  [7:0] data,       // byte
    input  wire        lost,       // strobe: a byte was lost
    output logic       valid_out,  // strobe: data_out is the next byte of the packet
    output logic [7:0] data_out,   // byte
    output logic       ends,       // strobe: the packet has ended
    output logic       broken      // strobe: the packet is not whole
);
    logic [7:0] left;  // bytes of the block that are still to come
    logic       zero;  // a zero is behind the block
    logic       begun;  // a block has begun

    wire        code = valid && data != '0 && left == '0;

    assign ends      = valid && data == '0;
    assign broken    = lost || (ends && left != '0);
    assign valid_out = (valid && data != '0 && left != '0) || (code && begun && zero);
    assign data_out  = left != '0 ? data : '0;

    always_ff @(posedge clk) begin
        if (ends) begin
            left   <= '0;
            begun <= 1'b0;
        end else if (code) begin
            left   <= data - 8'd1;
            zero   <= data != '1;
            begun <= 1'b1;
        end else if (valid) left <= left - 8'd1;
        if (rst) begin
            left   <= '0;
            begun <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert (ends == (valid && data == '0));
            assert (!(ends && valid_out));
            if (ends && left != '0) assert (broken);
            if (!$past(rst) && $past(ends)) assert (left == '0 && !begun);
            if (valid_out && data_out == '0) assert (begun && left == '0);
            if (begun && left == '0 && !$past(rst)) assert ($past(!ends));
            cover (valid_out && data_out == '0);
            cover (ends && broken && begun);
        end
    end
`endif
endmodule

`default_nettype wire
