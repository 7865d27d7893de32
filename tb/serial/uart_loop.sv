// SPDX-License-Identifier: Apache-2.0
// uart_loop -- bench top: a transmitter and a receiver of 8N1 characters, on one line or on two.
`default_nettype none

module uart_loop #(
    parameter int PARTS = 8  // ticks of a bit
) (
    input  wire         clk,
    input  wire         rst,
    input  wire  [19:0] bit_time,       // 1/16 cycle
    input  wire         valid,          // level: data is a character to be sent
    output logic        ready,          // level: with valid, the character is taken in this cycle
    input  wire  [ 7:0] data,           // character to be sent
    output logic        tx,             // level: line of the transmitter
    output logic        driver_enable,  // level: the line is driven
    input  wire         rx,             // level: line of the receiver
    output logic        received,       // strobe: character is new
    output logic [ 7:0] character,      // received character
    output logic        ninth,          // level: 0, as there is no 9th bit
    output logic        framing_error,  // strobe: there was no stop bit
    output logic        start_glitch,   // strobe: high again in the middle of the start bit
    output logic        busy            // level: a character is being received
);
    /* verilator lint_off PINCONNECTEMPTY */
    uart_tx #(
        .NINTH(0),
        .PARTS(PARTS)
    ) u_transmitter (
        .clk,
        .rst,
        .bit_time,
        .valid,
        .ready,
        .data,
        .ninth(1'b0),
        .tx,
        .driver_enable,
        .busy (),
        .tick ()
    );
    /* verilator lint_on PINCONNECTEMPTY */
    uart_rx #(
        .NINTH(0),
        .PARTS(PARTS)
    ) u_receiver (
        .clk,
        .rst,
        .bit_time,
        .rx,
        .valid(received),
        .data (character),
        .ninth,
        .framing_error,
        .start_glitch,
        .busy
    );
endmodule

`default_nettype wire
