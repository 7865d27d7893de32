// SPDX-License-Identifier: Apache-2.0
// uart_loop -- bench top: a transmitter of 8N1 characters and a receiver on the same wire, or
// on another.
`default_nettype none

module uart_loop (
    input  wire         clk,
    input  wire         rst,
    input  wire  [19:0] bit_time,
    input  wire         valid,
    output logic        ready,
    input  wire  [ 7:0] data,
    output logic        tx,
    output logic        driver_enable,
    input  wire         rx,
    output logic        received,
    output logic [ 7:0] character,
    output logic        ninth,
    output logic        framing_error,
    output logic        start_glitch,
    output logic        busy
);
    /* verilator lint_off PINCONNECTEMPTY */
    uart_tx #(
        .NINTH(0)
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
        .busy ()
    );
    /* verilator lint_on PINCONNECTEMPTY */
    uart_rx #(
        .NINTH(0)
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
