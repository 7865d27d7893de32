// SPDX-License-Identifier: Apache-2.0
// crc32_stream -- CRC-32 of a stream of bytes, as they come.
//
// latency   1 cycle from a byte to crc
// rate      one byte per cycle
// source    CRC-32/ISO-HDLC (Ethernet, zlib): polynomial 04C11DB7 reflected, starts with all ones,
//           inverted at the end
// model     tb/serial/crc32_stream.py, which uses zlib.crc32; equal in every bit of every cycle
`default_nettype none

module crc32_stream (
    input  wire         clk,
    input  wire         rst,
    input  wire         start,  // strobe: start again; a byte of the same cycle is left out
    input  wire         valid,  // strobe: data is the next byte
    input  wire  [ 7:0] data,   // byte
    output logic [31:0] crc     // CRC-32 of the bytes since start
);
    localparam logic [31:0] POLYNOMIAL = 32'hEDB88320;

    logic [31:0] remainder;

    function automatic [31:0] divided(input [31:0] dividend);
        divided = dividend;
        for (int n = 0; n < 8; n++)
        divided = {1'b0, divided[31:1]} ^ (divided[0] ? POLYNOMIAL : 32'd0);
    endfunction

    assign crc = ~remainder;

    always_ff @(posedge clk) begin
        if (valid) remainder <= divided(remainder ^ {24'd0, data});
        if (start || rst) remainder <= '1;
    end
endmodule

`default_nettype wire
