// SPDX-License-Identifier: Apache-2.0
// link_port -- the node's port to the real-time link: process_link behind a register block, with a
// serial line of 8N1 bytes and packets in COBS frames, with UDP datagrams, or with SPI transfers.
//
// latency   see the blocks
// rate      see the blocks
// behaviour The receiver of the line does not hear what the node sends. The line driver stays on
//           from the first bit of a reply to the last one. The outputs of the carrier that is not
//           built are idle. If the link is not built, its outputs are idle, all registers read 0,
//           and it never accesses the register bus.
// source    docs/link.md
// model     the models of its blocks; tested together by tb/link/test_link_port.py
`default_nettype none

module link_port #(
    parameter int CLK_HZ  = 60_000_000,  // Hz, clk frequency; a multiple of 1000
    parameter int BUILT   = 1,           // 0: no logic, all outputs are idle
    parameter int CARRIER = 0,           // 0: serial line, 1: UDP datagrams, 2: SPI
    parameter int PLL     = 0            // 1: build the PLL of the arrivals
) (
    input  wire         clk,
    input  wire         rst,
    // register bus, as one of its blocks
    input  wire         select,              // strobe: an access to this block
    input  wire         write,               // level: the access writes
    input  wire  [ 5:0] word,                // 32-bit word of the block
    input  wire  [31:0] wdata,               // value to write
    output logic [31:0] rdata,               // value read, in the next cycle; else 0
    // register bus, as one of its masters
    output logic        request,             // level: an access waits for ready
    input  wire         ready,               // level: the registers take it in the next cycle
    output logic        link_select,         // strobe: an access
    output logic        link_write,          // level: it writes
    output logic [15:0] link_address,        // byte address, from 1 cycle before link_select on
    output logic [31:0] link_wdata,          // word to be written
    input  wire  [31:0] link_rdata,          // word read, 2 cycles after link_select
    // node
    input  wire  [31:0] now,                 // cycles, time of the node
    input  wire         drive_on,            // level: a drive is on, the host stays
    output logic        watchdog_expired,    // level: no good request for too long
    // pins of the serial line
    input  wire         link_rx,             // pin, idles high
    output logic        link_tx,             // pin, idles high
    output logic        link_driver_enable,  // pin, 1: drive the line
    // pins of the SPI
    input  wire         link_cs_n,           // pin, low during a transfer
    input  wire         link_sclk,           // pin, idles low
    input  wire         link_mosi,           // pin, data of the host
    output logic        link_miso,           // pin, data to the host
    // UDP datagrams
    input  wire         udp_rx_valid,        // level: a byte of a datagram
    input  wire  [ 7:0] udp_rx_data,         // byte
    input  wire         udp_rx_last,         // level: with udp_rx_valid, the last byte
    input  wire         udp_rx_error,        // level: with udp_rx_valid, the datagram is damaged
    input  wire  [47:0] udp_rx_sender,       // IP address, UDP port in bits 15:0
    output logic        udp_rx_ready,        // level: with udp_rx_valid, the byte is taken
    output logic        udp_tx_valid,        // level: a byte of a datagram
    output logic [ 7:0] udp_tx_data,         // byte
    output logic        udp_tx_last,         // level: with udp_tx_valid, the last byte
    output logic [47:0] udp_tx_receiver,     // IP address, UDP port in bits 15:0
    output logic [15:0] udp_tx_length,       // bytes of the datagram
    input  wire         udp_tx_ready         // level: with udp_tx_valid, the byte is taken
);
    if (CARRIER < 0 || CARRIER > 2) begin : g_check
        CARRIER_MUST_BE_0_1_OR_2 u_error ();
    end
    if (BUILT == 0 || CARRIER != 1) begin : g_no_udp
        assign {udp_rx_ready, udp_tx_valid, udp_tx_data, udp_tx_last} = '0;
        assign {udp_tx_receiver, udp_tx_length} = '0;

        wire unused = &{
            1'b0, drive_on, udp_rx_valid, udp_rx_data, udp_rx_last, udp_rx_error, udp_rx_sender,
            udp_tx_ready
        };
    end
    if (BUILT == 0 || CARRIER != 2) begin : g_no_spi
        assign link_miso = 1'b0;

        wire unused = &{1'b0, link_cs_n, link_sclk, link_mosi};
    end
    if (BUILT == 0 || CARRIER != 0) begin : g_no_line
        assign {link_tx, link_driver_enable} = 2'b10;

        wire unused = &{1'b0, link_rx};
    end
    if (BUILT == 0) begin : g_none
        assign {rdata, request, link_select, link_write, link_address, link_wdata} = '0;
        assign watchdog_expired = 1'b0;

        wire unused = &{1'b0, clk, rst, select, write, word, wdata, ready, link_rdata, now};
    end else begin : g_link
        // settings
        wire [23:0] session, time_window;
        wire [6:0] lists_writes, lists_reads, entry_number;
        wire [15:0] entry_write, entry_read, watchdog_time;
        wire [19:0] bit_time;
        wire [19:0] pll_period;
        wire [18:0] capture_lead;
        wire entry_written, enable;
        // state
        wire [47:0] refused;
        wire [20:0] phase_error;
        wire [31:0] read_at;
        wire busy, locked, capturing, framing_errors;
        // packets
        wire rx_valid, rx_ends, rx_broken, rx_foreign, accepted, tx_valid, tx_last, tx_taken;
        wire [7:0] rx_data, tx_data;

        process_link #(
            .CLK_HZ(CLK_HZ),
            .PLL   (PLL)
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
            .pll_period,
            .capture_lead,
            .list_put   (entry_written),
            .list_at    (entry_number),
            .list_entry ({entry_read, entry_write}),
            // state
            .busy,
            .refused,
            .expired    (watchdog_expired),
            .locked,
            .phase_error,
            .capturing,
            .read_at,
            // packets
            .rx_valid,
            .rx_data,
            .rx_ends,
            .rx_broken,
            .rx_foreign,
            .accepted,
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
        if (CARRIER == 0) begin : g_line
            wire rx_level, rx, tx_level, sends, sending, transmitting, tick;
            wire received, ninth, start_glitch, receiving;
            wire [7:0] received_byte, byte_to_send;
            wire to_send, send_ready;

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

            assign rx_foreign = 1'b0;

            wire unused = &{1'b0, ninth, start_glitch, receiving, transmitting, tick, accepted};
        end
        if (CARRIER == 1) begin : g_udp
            link_datagram u_datagram (
                .clk,
                .rst,
                // settings
                .enable,
                .reads   (lists_reads),
                .locked  (drive_on),
                // datagrams
                .rx_valid(udp_rx_valid),
                .rx_last (udp_rx_last),
                .rx_error(udp_rx_error),
                .sender  (udp_rx_sender),
                .rx_ready(udp_rx_ready),
                .receiver(udp_tx_receiver),
                .length  (udp_tx_length),
                // requests
                .valid   (rx_valid),
                .ends    (rx_ends),
                .broken  (rx_broken),
                .foreign (rx_foreign),
                .accepted
            );

            assign rx_data = udp_rx_data;
            assign {udp_tx_valid, udp_tx_data, udp_tx_last} = {tx_valid, tx_data, tx_last};
            assign tx_taken = udp_tx_ready;
            assign framing_errors = 1'b0;

            wire unused = &{1'b0, bit_time};
        end
        if (CARRIER == 2) begin : g_spi
            wire cs_n, sclk, mosi;

            synchroniser #(
                .W    (3),
                .RESET(4)
            ) u_pins (
                .clk,
                .rst,
                .d({link_cs_n, link_sclk, link_mosi}),
                .q({cs_n, sclk, mosi})
            );
            link_spi u_spi (
                .clk,
                .rst,
                .writes     (lists_writes),
                // pins, synchronised
                .cs_n,
                .sclk,
                .mosi,
                .miso       (link_miso),
                // requests
                .valid      (rx_valid),
                .data       (rx_data),
                .ends       (rx_ends),
                .broken     (rx_broken),
                .accepted,
                .cut        (framing_errors),
                // replies
                .reply_valid(tx_valid),
                .reply_data (tx_data),
                .reply_last (tx_last),
                .reply_taken(tx_taken)
            );

            assign rx_foreign = 1'b0;

            wire unused = &{1'b0, bit_time};
        end

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
            .pll_period,
            .capture_lead,
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
            .framing_errors,
            .pll_state_built        (1'(PLL != 0)),
            .pll_state_locked       (locked),
            .pll_state_captured     (capturing),
            .pll_state_phase_error  ({{3{phase_error[20]}}, phase_error}),
            .read_time              (read_at)
        );
    end
endmodule

`default_nettype wire
