// SPDX-License-Identifier: Apache-2.0
// crc32_serial -- compute the CRC-32 of a stream of bytes bit by bit, or compare bytes with it.
//
// latency   9 cycles from a byte to done, crc and wrong
// rate      one byte in 9 cycles; data and check must stay as they are until done
// behaviour A start or a byte during the cycles of the byte before gives a wrong CRC-32. Bytes with
//           check are compared with the CRC-32 of the bytes before, low byte first; no other byte
//           may follow them until start.
// source    CRC-32/ISO-HDLC (Ethernet, zlib): polynomial 04C11DB7 reflected, starts with all ones,
//           inverted at the end
// model     tb/serial/crc32_serial.py, which uses zlib.crc32; equal in every bit of every cycle
// proved    Four bytes with check leave wrong low only if all 32 bits are those of crc before them.
// proof     depth 10
`default_nettype none

module crc32_serial (
    input  wire         clk,
    input  wire         rst,
    input  wire         start,  // strobe: start again; a byte of the same cycle is the first
    input  wire         valid,  // strobe: data is the next byte
    input  wire  [ 7:0] data,   // byte
    input  wire         check,  // level: data is a byte of the CRC-32
    output logic        busy,   // level: the byte is being taken in
    output logic        done,   // strobe: the byte is taken in
    output logic        wrong,  // level: a byte with check has differed since start
    output logic [31:0] crc     // CRC-32 of the bytes since start, while there was none with check
);
    localparam logic [31:0] POLYNOMIAL = 32'hEDB88320;

    logic [31:0] remainder;
    logic [ 3:0] number;  // of the bit; 8: none

    wire         differs = remainder[0] ^ data[number[2:0]];
    wire         divides = differs && !check;

    assign busy = !number[3];
    assign crc  = ~remainder;

    always_ff @(posedge clk) begin
        if (start) remainder <= '1;
        else if (busy) remainder <= {1'b0, remainder[31:1]} ^ (divides ? POLYNOMIAL : 32'd0);
        if (start) wrong <= 1'b0;
        else if (busy && check && !differs) wrong <= 1'b1;  // the CRC-32 is inverted
        if (valid) number <= '0;
        else if (busy) number <= number + 4'd1;
        done <= number == 4'd7;
        if (rst) begin
            remainder <= '1;
            wrong     <= 1'b0;
            number    <= 4'd8;
            done      <= 1'b0;
        end
    end

`ifdef FORMAL
    logic        past = 1'b0;
    logic [31:0] expected;  // crc before the first byte with check
    logic [31:0] compared;  // the bits compared since then
    logic [ 5:0] bits;  // their number
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) assume (!rst);
        if (busy) assume (!start && !valid && check == $past(check) && data == $past(data));
        if (valid && check) assume (bits != 6'd32 && bits[2:0] == 3'd0 && !start);
        if (valid && !check) assume (bits == '0 || start);
        if (busy && check) begin
            if (bits == '0) expected <= crc;
            compared[bits[4:0]] <= data[number[2:0]];
            bits                <= bits + 6'd1;
        end
        if (start || rst) bits <= '0;
        if (past) begin
            assert (bits[2:0] == (busy && check ? number[2:0] : 3'd0) && bits <= 6'd32);
            if (busy && !check || bits == '0) assert (bits == '0 && !wrong);
            if (bits != '0) assert (remainder == ~expected >> bits);
            if (bits != '0) assert (wrong == (((compared ^ expected) << (6'd32 - bits)) != '0));
            cover (wrong);
        end
        cover (busy && remainder[31:24] == 8'hED);
    end
`endif
endmodule

`default_nettype wire
