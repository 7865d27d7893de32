// SPDX-License-Identifier: Apache-2.0
// link_port -- the node's port to the real-time link: a serial line of 8N1 bytes, packets in COBS
// frames, and process_link, behind a register block.
//
// latency   see the blocks
// rate      see the blocks
// behaviour The receiver does not hear what the node sends. The line driver stays on from the first
//           bit of a reply to the last one. If it is not built, its pins are idle, all registers
//           read 0, and it never accesses the register bus.
// source    docs/link.md
// model     the models of its blocks; tested together by tb/link/test_link_port.py
`default_nettype none

module link_port #(
    parameter int CLK_HZ = 60_000_000,  // Hz, clk frequency; a multiple of 1000
    parameter int BUILT  = 1            // 0: no logic, all outputs are idle
) (
    input  wire         clk,
    input  wire         rst,
    // register bus, as one of its blocks
    input  wire         select,             // strobe: an access to this block
    input  wire         write,              // level: the access writes
    input  wire  [ 5:0] word,               // 32-bit word of the block
    input  wire  [31:0] wdata,              // value to write
    output logic [31:0] rdata,              // value read, in the next cycle; else 0
    // register bus, as one of its masters
    output logic        request,            // level: an access waits for ready
    input  wire         ready,              // level: the registers take it in the next cycle
    output logic        link_select,        // strobe: an access
    output logic        link_write,         // level: it writes
    output logic [15:0] link_address,       // byte address, from 1 cycle before link_select on
    output logic [31:0] link_wdata,         // word to be written
    input  wire  [31:0] link_rdata,         // word read, 2 cycles after link_select
    // node
    input  wire  [31:0] now,                // cycles, time of the node
    output logic        watchdog_expired,   // level: no good request for too long
    // pins
    input  wire         link_rx,            // pin, idles high
    output logic        link_tx,            // pin, idles high
    output logic        link_driver_enable  // pin, 1: drive the line
);
    if (BUILT == 0) begin : g_none
        assign {rdata, request, link_select, link_write, link_address, link_wdata} = '0;
        assign {watchdog_expired, link_tx, link_driver_enable} = 3'b010;

        wire unused = &{
            1'b0, clk, rst, select, write, word, wdata, ready, link_rdata, now, link_rx
        };
    end else begin : g_link
        // settings
        wire [23:0] session, time_window;
        wire [6:0] lists_writes, lists_reads, entry_number;
        wire [15:0] entry_write, entry_read, watchdog_time;
        wire [19:0] bit_time;
        wire entry_written, enable;
        // state
        wire [47:0] refused;
        wire busy, framing_errors;
        // line
        wire rx_level, rx, tx_level, sends, sending, transmitting, tick;
        wire received, ninth, start_glitch, receiving;
        wire [7:0] received_byte, byte_to_send;
        wire to_send, send_ready;
        // packets
        wire rx_valid, rx_ends, rx_broken, tx_valid, tx_last, tx_taken;
        wire [7:0] rx_data, tx_data;

        assign link_driver_enable = sends || sending;

        half_duplex u_duplex (
            .driver_enable(link_driver_enable),
            .tx_level,
            .rx_pin       (link_rx),
            .tx_pin       (link_tx),
            .rx_level
        );
        synchroniser #(
            .RESET(1)
        ) u_pin (
            .clk,
            .rst,
            .d(rx_level),
            .q(rx)
        );
        uart_rx #(
            .NINTH(0),
            .PARTS(4)
        ) u_receiver (
            .clk,
            .rst,
            .bit_time,
            .rx,
            .valid        (received),
            .data         (received_byte),
            .ninth,
            .framing_error(framing_errors),
            .start_glitch,
            .busy         (receiving)
        );
        cobs_decoder u_decoder (
            .clk,
            .rst,
            .valid    (received),
            .data     (received_byte),
            .lost     (framing_errors),
            .valid_out(rx_valid),
            .data_out (rx_data),
            .ends     (rx_ends),
            .broken   (rx_broken)
        );
        process_link #(
            .CLK_HZ(CLK_HZ)
        ) u_link (
            .clk,
            .rst,
            .now,
            // settings
            .enable,
            .session,
            .writes     (lists_writes),
            .reads      (lists_reads),
            .time_window,
            .watchdog_ms(watchdog_time),
            .list_put   (entry_written),
            .list_at    (entry_number),
            .list_entry ({entry_read, entry_write}),
            // state
            .busy,
            .refused,
            .expired    (watchdog_expired),
            // packets
            .rx_valid,
            .rx_data,
            .rx_ends,
            .rx_broken,
            .tx_valid,
            .tx_data,
            .tx_last,
            .tx_taken,
            // register bus
            .request,
            .ready,
            .select     (link_select),
            .write      (link_write),
            .address    (link_address),
            .wdata      (link_wdata),
            .rdata      (link_rdata)
        );
        cobs_encoder u_encoder (
            .clk,
            .rst,
            .valid   (tx_valid),
            .data    (tx_data),
            .last    (tx_last),
            .taken   (tx_taken),
            .sends   (to_send),
            .data_out(byte_to_send),
            .ready   (send_ready),
            .busy    (sends)
        );
        uart_tx #(
            .NINTH(0),
            .PARTS(4)
        ) u_transmitter (
            .clk,
            .rst,
            .bit_time,
            .valid        (to_send),
            .ready        (send_ready),
            .data         (byte_to_send),
            .ninth        (1'b0),
            .tx           (tx_level),
            .driver_enable(sending),
            .busy         (transmitting),
            .tick
        );

        link_registers u_registers (
            .clk,
            .rst,
            // register bus
            .select,
            .write,
            .word,
            .wdata,
            .rdata,
            // settings
            .session,
            .lists_writes,
            .lists_reads,
            .entry_number,
            .entry_write,
            .entry_read,
            .entry_written,
            .time_window,
            .watchdog_time,
            .bit_time,
            .enable,
            // state
            .state_built            (1'b1),
            .state_on               (enable),
            .state_busy             (busy),
            .state_expired          (watchdog_expired),
            .state_session          (session),
            .refused_damaged        (refused[7:0]),
            .refused_foreign        (refused[15:8]),
            .refused_wrong_length   (refused[23:16]),
            .refused_replayed       (refused[31:24]),
            .refused_now_out_of_time(refused[39:32]),
            .refused_now_busy       (refused[47:40]),
            .framing_errors
        );

        wire unused = &{1'b0, ninth, start_glitch, receiving, transmitting, tick};
    end
endmodule

`default_nettype wire
