// SPDX-License-Identifier: Apache-2.0
// display_port -- send words from a queue to the driver of a numeric display by SPI; if it is not
// built, its pins are idle.
//
// latency  see spi_word_sender
// rate     one word at a time, 16 in the queue; sclk is at most 1 MHz
// source   S0: numeric display
// model    the models of its blocks; tested together by tb/peripheral/test_peripherals.py
`default_nettype none

module display_port #(
    parameter int CLK_HZ = 50_000_000,  // Hz, clk frequency
    parameter int BUILT  = 1            // 0: no logic, all outputs are idle
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         push,     // strobe: queue word
    input  wire  [15:0] word,     // register in the high byte, value in the low one
    output logic [ 4:0] free,     // words that can be queued, 16 at most
    output logic        sending,  // level: a word is being sent or waits
    output logic        cs_n,     // pin, low during a word
    output logic        sclk,     // pin, idles low
    output logic        sdi       // pin, data of the display
);
    if (BUILT == 0) begin : g_idle
        assign {free, sending} = '0;
        assign {cs_n, sclk, sdi} = 3'b100;
        wire unused = &{1'b0, clk, rst, push, word};
    end else begin : g_built
        localparam int SCLK_HZ = 1_000_000;
        localparam [7:0] HALF_PERIOD = 8'((CLK_HZ + 2 * SCLK_HZ - 1) / (2 * SCLK_HZ));  // cycles

        wire present, ready, sent, overrun;
        wire [15:0] to_send;

        sync_fifo #(
            .W    (16),
            .DEPTH(16)
        ) u_words (
            .clk,
            .rst,
            .push,
            .in (word),
            .pop(ready),
            .present,
            .out(to_send),
            .free,
            .overrun
        );
        spi_word_sender u_sender (
            .clk,
            .rst,
            .half_period(HALF_PERIOD),
            .valid      (present),
            .ready,
            .word       (to_send),
            .cs_n,
            .sclk,
            .sdi,
            .sent
        );

        assign sending = push || !free[4] || !ready;

        wire unused = &{1'b0, sent, overrun};
    end
endmodule

`default_nettype wire
