// SPDX-License-Identifier: Apache-2.0
// spi_dac -- send commands to a 16-bit bipolar DAC on three wires, and 0 V while the drive is off.
//
// latency   33 * half_period + 2 cycles from valid, while no frame is being sent, to the rising
//           edge of cs_n, at which the DAC takes the command. A frame that is being sent is
//           finished first, which takes 36 * half_period cycles at most.
// rate      one frame per 36 * half_period + 1 cycles; of commands that come faster the last one is
//           sent.
// behaviour After `refresh` cycles without a frame the same code is sent again, so that a disturbed
//           DAC does not stay wrong. When enable falls, 0 V is sent at once, and again at each
//           refresh. A command that comes while enable is low is forgotten: when enable rises, the
//           output stays at 0 V until the next command. The code is offset binary, 32768 + command
//           + trim, limited to 16 bits. 0 V is command 0, so the trim applies to it too.
// source    AD5542A, Analog Devices, in bipolar mode (+-VREF): 16 bits, most significant first,
//           taken at rising edges of sclk while cs_n is low. With its LDAC low the output changes
//           at the rising edge of cs_n. sclk may run at up to 50 MHz.
// model     tb/drive/spi_dac.py, equal in every bit of every cycle
// proved    A frame that begins while the drive is off carries 0 V. A frame begins for each change
//           of enable.
// proof     depth 40
`default_nettype none

module spi_dac (
    input  wire               clk,
    input  wire               rst,
    input  wire        [ 7:0] half_period,  // cycles of half an sclk; 0 counts as 1
    input  wire        [15:0] refresh,      // cycles without a frame until the code is sent again
    input  wire signed [15:0] trim,         // full scale 2^15: code of 0 V, less 32768
    input  wire               enable,       // level: the drive is on; 0: the output is 0 V
    input  wire               valid,        // strobe: command is new
    input  wire signed [15:0] command,      // full scale 2^15
    output logic              cs_n,         // level: pin, low during a frame
    output logic              sclk,         // level: pin, serial clock
    output logic              sdi,          // level: pin, serial data
    output logic              sent          // strobe: the DAC has taken a frame
);
    logic due, enable_q;
    logic        [15:0] idle;
    logic signed [15:0] required;

    wire signed  [16:0] trimmed = {required[15], required} + {trim[15], trim};
    wire                fits = trimmed[16] == trimmed[15];
    wire signed  [15:0] nearest = {trimmed[16], {15{~trimmed[16]}}};
    wire signed  [15:0] fitting = fits ? trimmed[15:0] : nearest;
    wire                ready;
    wire                send = due || idle >= refresh;

    spi_word_sender u_frames (
        .clk,
        .rst,
        .half_period,
        .valid(send),
        .ready,
        .word ({!fitting[15], fitting[14:0]}),
        .cs_n,
        .sclk,
        .sdi,
        .sent
    );

    always_ff @(posedge clk) begin
        enable_q <= enable;
        if (valid) required <= command;
        if (!enable) required <= '0;
        due  <= (valid && enable) || enable != enable_q || (due && !ready);
        idle <= ready ? idle + 1'b1 : '0;
        if (rst) begin
            due      <= 1'b1;
            enable_q <= 1'b0;
            required <= '0;
            idle     <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert (enable_q || required == '0);
            if (!$past(rst) && enable_q != $past(enable_q)) assert (due);
            cover (sent && !enable_q);
        end
    end
`endif
endmodule

`default_nettype wire
