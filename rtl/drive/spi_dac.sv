// SPDX-License-Identifier: Apache-2.0
// spi_dac -- commands to a 16-bit bipolar converter on three wires, and 0 V to it while the drive
// is off.
//
// latency  33 * half_period + 2 clk from valid, while no frame is being sent, to the rising edge of
//          cs_n, at which the converter takes the command; a frame that is being sent is ended
//          first, 36 * half_period clk at most
// rate     a frame per 36 * half_period + 1 clk; of commands that come faster the last one is sent
// refresh  after `refresh` clk without a frame the same code is sent again: a disturbed converter
//          does not stay wrong
// off      when enable falls 0 V is sent at once, and at each refresh. A command that comes while
//          it is low is forgotten: when it rises 0 V stands until the next command
// code     offset binary, 32768 + command + trim, held inside 16 bits; 0 V is command 0, so the
//          trim belongs to it too
// source   AD5542A, Analog Devices, in bipolar mode (+-VREF): 16 bits, most significant first,
//          taken at rising edges of sclk while cs_n is low; with its LDAC low the output changes at
//          the rising edge of cs_n. sclk up to 50 MHz
// model    tb/drive/spi_dac.py, equal in every bit of every cycle
// proof    depth 40
// proved   a frame that begins while the drive is off is one of 0 V, and one begins for each change
//          of enable
`default_nettype none

module spi_dac (
    input wire clk,
    input wire rst,
    input  wire        [7:0]     half_period,                  // clk that sclk is high, and low; 0 counts as 1; taken with a frame
    input wire [15:0] refresh,  // clk
    input wire signed [15:0] trim,  // full scale 2^15: code at which the output is 0 V, less 32768
    input wire enable,  // level: 0: 0 V
    input wire valid,  // strobe: command is new
    input wire signed [15:0] command,  // full scale 2^15
    output logic cs_n,  // pin
    output logic sclk,  // pin
    output logic sdi,  // pin
    output logic sent  // strobe: the converter has taken a frame
);
    logic due, enable_q;
    logic [15:0] idle;
    logic signed [15:0] wanted;

    wire signed [16:0] trimmed = {wanted[15], wanted} + {trim[15], trim};
    wire signed [15:0] fitting = trimmed[16] == trimmed[15] ? trimmed[15:0] : {trimmed[16], {15{~trimmed[16]}}};
    wire ready;
    wire present = due || idle >= refresh;

    spi_word_sender u_frames (
        .clk,
        .rst,
        .half_period,
        .valid(present),
        .ready,
        .word ({!fitting[15], fitting[14:0]}),
        .cs_n,
        .sclk,
        .sdi,
        .sent
    );

    always_ff @(posedge clk) begin
        enable_q <= enable;
        if (valid) wanted <= command;
        if (!enable) wanted <= '0;
        due  <= (valid && enable) || enable != enable_q || (due && !ready);
        idle <= ready ? idle + 1'b1 : '0;
        if (rst) begin
            due      <= 1'b1;
            enable_q <= 1'b0;
            wanted   <= '0;
            idle     <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert (enable_q || wanted == '0);
            if (!$past(rst) && enable_q != $past(enable_q)) assert (due);
            cover (sent && !enable_q);
        end
    end
`endif
endmodule

`default_nettype wire
