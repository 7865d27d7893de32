// SPDX-License-Identifier: Apache-2.0
// peer_port -- UART of 8 bits to another node, with a queue each way; if it is not built, its pin
// is idle.
//
// latency  see uart_rx and uart_tx
// rate     one byte each way at a time, 64 in each queue
// source   S4: the main controller speaks to the sub-controller
// model    the models of its blocks; tested together by tb/peripheral/test_peripherals.py
`default_nettype none

module peer_port #(
    parameter int BUILT = 1  // 0: no logic, all outputs are idle
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         rx_pin,           // pin, idles high
    output logic        tx_pin,           // pin, idles high
    input  wire  [19:0] bit_time,         // 1/16 cycle, duration of a bit
    input  wire         receive_pop,      // strobe: take the oldest received byte
    output logic        receive_present,  // level: a received byte waits
    output logic [ 7:0] receive_data,     // byte, the oldest received
    input  wire         transmit_push,    // strobe: queue transmit_data
    input  wire  [ 7:0] transmit_data,    // byte to send
    output logic [ 6:0] transmit_free,    // bytes that can be queued, 64 at most
    output logic        sending,          // level: a byte is being sent
    output logic        framing_error,    // strobe: a byte had no stop bit
    output logic        overrun           // strobe: a byte was lost, the queue was full
);
    if (BUILT == 0) begin : g_idle
        assign tx_pin = 1'b1;
        assign {receive_present, receive_data, transmit_free} = '0;
        assign {sending, framing_error, overrun} = '0;
        wire unused = &{
            1'b0, clk, rst, rx_pin, bit_time, receive_pop, transmit_push, transmit_data
        };
    end else begin : g_built
        wire rx, received, ninth, start_glitch, receiving;
        wire to_send, send_ready, driver_enable, transmit_overrun, transmit_tick;
        wire [7:0] received_data, send_data;
        wire [6:0] receive_free;

        synchroniser #(
            .RESET(1)
        ) u_pin (
            .clk,
            .rst,
            .d(rx_pin),
            .q(rx)
        );
        uart_rx #(
            .NINTH(0)
        ) u_receiver (
            .clk,
            .rst,
            .bit_time,
            .rx,
            .valid(received),
            .data (received_data),
            .ninth,
            .framing_error,
            .start_glitch,
            .busy (receiving)
        );
        sync_fifo #(
            .W    (8),
            .DEPTH(64)
        ) u_received (
            .clk,
            .rst,
            .push   (received),
            .in     (received_data),
            .pop    (receive_pop),
            .present(receive_present),
            .out    (receive_data),
            .free   (receive_free),
            .overrun
        );
        sync_fifo #(
            .W    (8),
            .DEPTH(64)
        ) u_to_send (
            .clk,
            .rst,
            .push   (transmit_push),
            .in     (transmit_data),
            .pop    (send_ready),
            .present(to_send),
            .out    (send_data),
            .free   (transmit_free),
            .overrun(transmit_overrun)
        );
        uart_tx #(
            .NINTH(0)
        ) u_transmitter (
            .clk,
            .rst,
            .bit_time,
            .valid(to_send),
            .ready(send_ready),
            .data (send_data),
            .ninth(1'b0),
            .tx   (tx_pin),
            .driver_enable,
            .busy (sending),
            .tick (transmit_tick)
        );
        wire unused = &{
            1'b0, ninth, start_glitch, receiving, receive_free, transmit_overrun, driver_enable,
            transmit_tick
        };
    end
endmodule

`default_nettype wire
