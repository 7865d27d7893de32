// SPDX-License-Identifier: Apache-2.0
// spi_dac -- commands to a 16-bit bipolar converter on three wires, and 0 V to it while the drive is off.
//
// latency  33 * half_clk + 2 clk from valid, while no frame is being sent, to the rising edge of cs_n, at which the converter
//          takes the command; a frame that is being sent is ended first, 36 * half_clk clk at most
// rate     a frame per 36 * half_clk + 1 clk; of commands that come faster the last one is sent
// refresh  after `refresh` clk without a frame the same code is sent again: a disturbed converter does not stay wrong
// off      when enable falls 0 V is sent at once, and at each refresh. A command that comes while it is low is forgotten: when
//          it rises 0 V stands until the next command
// code     offset binary, 32768 + command + trim, held inside 16 bits; 0 V is command 0, so the trim belongs to it too
// source   AD5542A, Analog Devices, in bipolar mode (+-VREF): 16 bits, most significant first, taken at rising edges of sclk
//          while cs_n is low; with its LDAC low the output changes at the rising edge of cs_n. sclk up to 50 MHz
// model    tb/drive/spi_dac.py, equal in every bit of every cycle
// proof    depth 40
// proved   sclk is low while cs_n is high or changes; a frame has 16 rising edges of sclk; sdi stands from one clk before each
//          of them to the falling edge
`default_nettype none

module spi_dac (
    input  wire                  clk,
    input  wire                  rst,
    input  wire        [7:0]     half_clk,                  // clk that sclk is high, and low; 0 counts as 1; taken with a frame
    input  wire        [15:0]    refresh,                   // clk
    input  wire signed [15:0]    trim,                      // full scale 2^15: code at which the output is 0 V, less 32768
    input  wire                  enable,                    // level: 0: 0 V
    input  wire                  valid,                     // strobe: command is new
    input  wire signed [15:0]    command,                   // full scale 2^15
    output logic                 cs_n,                      // pin
    output logic                 sclk,                      // pin
    output logic                 sdi,                       // pin
    output logic                 sent                       // strobe: the converter has taken a frame
);
    localparam [5:0] RAISE = 6'd33, LAST = 6'd35;           // halves of sclk in a frame: 0 set-up, 16 bits, 32 hold, 3 with cs_n high

    logic               busy, due, enable_q;
    logic        [5:0]  half;
    logic        [7:0]  length, left;                       // clk of a half, less one; after this one
    logic        [15:0] idle, shift;
    logic signed [15:0] wanted;

    wire signed [16:0] trimmed = {wanted[15], wanted} + {trim[15], trim};
    wire signed [15:0] fitting = trimmed[16] == trimmed[15] ? trimmed[15:0] : {trimmed[16], {15{~trimmed[16]}}};
    wire        [15:0] code    = {!fitting[15], fitting[14:0]};
    wire        [7:0]  wanted_length = half_clk == 8'd0 ? 8'd0 : half_clk - 1'b1;
    wire               starts  = !busy && (due || idle >= refresh);
    wire        [5:0]  next    = half + 1'b1;

    always_ff @(posedge clk) begin
        sent     <= 1'b0;
        enable_q <= enable;
        if (valid) wanted <= command;
        if (!enable) wanted <= '0;
        due <= (valid && enable) || enable != enable_q || (due && !starts);

        left <= left - 1'b1;
        if (starts) begin
            busy   <= 1'b1;
            half   <= '0;
            length <= wanted_length;
            left   <= wanted_length;
            cs_n   <= 1'b0;
            sdi    <= code[15];
            shift  <= code << 1;
        end else if (busy && left == 8'd0) begin
            left <= length;
            half <= next;
            sclk <= next[0] && next < RAISE;
            if (!next[0] && next < RAISE - 1'b1) {sdi, shift} <= {shift, 1'b0};
            if (next == RAISE) begin
                cs_n <= 1'b1;
                sent <= 1'b1;
            end
            if (half == LAST) busy <= 1'b0;
        end
        idle <= busy ? '0 : idle + 1'b1;
        if (rst) begin
            busy     <= 1'b0;
            due      <= 1'b1;
            enable_q <= 1'b0;
            wanted   <= '0;
            idle     <= '0;
            cs_n     <= 1'b1;
            sclk     <= 1'b0;
            sdi      <= 1'b0;
            sent     <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [4:0] rises = '0;                                 // of sclk in this frame
    always @(posedge clk) begin
        past  <= 1'b1;
        rises <= rst || cs_n ? '0 : rises + {4'd0, sclk && !$past(sclk)};
        if (!past) assume (rst);
        if (past) begin
            assert (!(cs_n && sclk));
            assert (!busy || half <= LAST);
            assert (cs_n == (!busy || half >= RAISE));
            assert (!sclk || (half[0] && half < RAISE));
            if (!$past(rst)) begin
                if (cs_n != $past(cs_n)) assert (!sclk && !$past(sclk));
                if (sclk) assert (sdi == $past(sdi));
                if (cs_n && !$past(cs_n)) assert (rises == 5'd16);
                if (busy && !cs_n) assert (sclk == half[0]);
                if (busy && !cs_n) assert (rises + {4'd0, sclk && !$past(sclk)} == (half[5:1] + {4'd0, half[0]}));
            end
            cover (sent && length == 8'd0);
        end
    end
`endif
endmodule

`default_nettype wire
