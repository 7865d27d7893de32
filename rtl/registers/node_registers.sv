// SPDX-License-Identifier: Apache-2.0
// node_registers -- the register block of node: identity, clock, health of the soft core.
//
// latency  1 clk from select to rdata, and from a write to the new value        rate  one access per clk
// source   tables/registers.rdl
// model    tb/registers/register_block.py, equal in every bit of every cycle; test tb/registers/test_registers.py
// made     by tables/registers.py, never by hand; map_crc is the CRC-32 of the source
`default_nettype none

module node_registers (
    input  wire         clk,
    input  wire         rst,                 // every setting takes its first value, what was counted or held is cleared
    input  wire         select,              // an access to this block
    input  wire         write,               // with select: wdata goes into the word
    input  wire  [5:0]  word,                // index of the 32-bit word; a word without a register reads 0
    input  wire  [31:0] wdata,
    output logic [31:0] rdata,               // what was read, for one clk; 0 in every other
    input  wire  [31:0] clk_hz,              // clk frequency [Hz]
    input  wire  [3:0]  build_axes,          // what was built: axes
    input  wire  [3:0]  build_address,       // what was built: address
    input  wire  [7:0]  build_memory,        // what was built: memory [1024 byte]
    input  wire  [63:0] time_stamp,          // clk since reset, wraps; the time stamp of everything [clk]
    output logic [23:0] tick_period,         // servo tick of all axes [clk]
    output logic [15:0] sample_period,       // sample rate of all converters [clk]
    output logic        heartbeat_kick,      // strobe: sign of life of the firmware; while a drive is on it is wanted within 1 200 000 clk and 20 ms: kick
    output logic [7:0]  start_axes,          // bit n: axis n
    output logic        start_axes_written   // strobe: start_axes has just been written, its new value stands
);
    logic [31:0] time_stamp_high;

    wire get = select && !write;
    wire put = select && write;
    wire unused = &{1'b0, wdata[31:24]};         // no register of this block has these bits

    always_ff @(posedge clk) begin
        rdata <= '0;
        if (get) case (word)
            6'h00: rdata <= 32'h45B847BA;
            6'h01: rdata <= clk_hz;
            6'h02: rdata <= {16'd0, build_memory, build_address, build_axes};
            6'h04: rdata <= time_stamp[31:0];
            6'h05: rdata <= time_stamp_high;
            6'h06: rdata <= {8'd0, tick_period};
            6'h07: rdata <= {16'd0, sample_period};
            default: rdata <= '0;
        endcase
        if (get && word == 6'h04) time_stamp_high <= time_stamp[63:32];

        if (put && word == 6'h06) tick_period <= wdata[23:0];
        if (put && word == 6'h07) sample_period <= wdata[15:0];
        heartbeat_kick <= put && word == 6'h08 && wdata[0];
        start_axes_written <= put && word == 6'h09;
        if (put && word == 6'h09) start_axes <= wdata[7:0];
        if (rst) begin
            rdata <= '0;
            time_stamp_high <= '0;
            tick_period <= 24'h000000;
            sample_period <= 16'h0000;
            heartbeat_kick <= 1'b0;
            start_axes_written <= 1'b0;
            start_axes <= 8'h00;
        end
    end
endmodule

`default_nettype wire
