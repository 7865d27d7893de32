// SPDX-License-Identifier: Apache-2.0
// crc32_stream -- compute the CRC-32 of a stream of bytes, one byte after the other.
//
// latency   1 cycle from a byte to crc with 8 BITS, else 8 / BITS + 1
// rate      one byte per cycle with 8 BITS, else one in 8 / BITS + 1 cycles
// behaviour A start or a byte during the cycles of the byte before gives a wrong CRC-32.
// source    CRC-32/ISO-HDLC (Ethernet, zlib): polynomial 04C11DB7 reflected, starts with all ones,
//           inverted at the end
// model     tb/serial/crc32_stream.py, which uses zlib.crc32; equal in every bit of every cycle
`default_nettype none

module crc32_stream #(
    parameter int BITS = 8  // bits of a byte in a cycle: 1, 2, 4 or 8; fewer take less logic
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         start,  // strobe: start again; a byte of the same cycle is the first
    input  wire         valid,  // strobe: data is the next byte
    input  wire  [ 7:0] data,   // byte
    output logic [31:0] crc     // CRC-32 of the bytes since start
);
    localparam logic [31:0] POLYNOMIAL = 32'hEDB88320;

    if (BITS != 1 && BITS != 2 && BITS != 4 && BITS != 8) begin : g_check
        BITS_MUST_BE_1_2_4_OR_8 u_error ();
    end

    logic [31:0] remainder;

    function automatic [31:0] divided(input [31:0] dividend);
        divided = dividend;
        for (int n = 0; n < BITS; n++)
        divided = {1'b0, divided[31:1]} ^ (divided[0] ? POLYNOMIAL : 32'd0);
    endfunction

    assign crc = ~remainder;

    if (BITS == 8) begin : g_byte
        wire [31:0] from = start ? '1 : remainder;

        always_ff @(posedge clk) begin
            if (valid) remainder <= divided(from ^ {24'd0, data});
            else if (start) remainder <= '1;
            if (rst) remainder <= '1;
        end
    end else begin : g_bits
        localparam int STEPS = 8 / BITS;
        logic [STEPS-1:0] left;  // one bit for each step that is still to be made

        // the first byte of a frame: added to the remainder that the start gives
        wire  [     31:0] from = start ? '1 : remainder;

        always_ff @(posedge clk) begin
            if (valid) remainder <= from ^ {24'd0, data};
            else if (start) remainder <= '1;
            else if (left[0]) remainder <= divided(remainder);
            left <= valid ? '1 : left >> 1;
            if (rst) begin
                remainder <= '1;
                left      <= '0;
            end
        end
    end
endmodule

`default_nettype wire
