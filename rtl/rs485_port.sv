// SPDX-License-Identifier: Apache-2.0
// rs485_port -- the node's port to the RS-485 bus: receiver, address filter, frame check, queues
// and transmitter, behind a register block.
//
// latency  see the blocks
// rate     one character each way at a time, 128 in each queue
// source   S0: one master, many slaves on one pair of wires, the 9th bit marks command bytes
// model    the models of its blocks; tested together by tb/serial/test_rs485_port.py
`default_nettype none

module rs485_port #(
    parameter int CLK_HZ      = 4_000_000,  // Hz, clk frequency
    parameter     QUEUE_STYLE = "auto"      // ram_style of the queues
) (
    input  wire         clk,
    input  wire         rst,
    // register bus
    input  wire         select,              // strobe: an access to this block
    input  wire         write,               // level: the access writes
    input  wire  [ 5:0] word,                // 32-bit word of the block
    input  wire  [31:0] wdata,               // value to write
    output logic [31:0] rdata,               // value read, in the next cycle; else 0
    // node
    input  wire  [ 3:0] address,             // address of the node on the bus
    input  wire         armed,               // level: a drive is on
    output logic        watchdog_expired,    // level: the master has been silent too long
    output logic        word_received,       // level: a received word has not been read
    output logic        crc_waits,           // level: the CRC-32 takes in a byte: no access
    output logic        sync,                // strobe: sync pulse of the bus
    output logic [ 7:0] sync_axes,           // bit n: axis n starts with sync
    // pins
    input  wire         rs485_rx,            // pin, idles high
    output logic        rs485_tx,            // pin, idles high
    output logic        rs485_driver_enable  // pin, 1: drive the bus
);
    // settings
    wire [19:0] bit_time;
    wire [15:0] watchdog_time;
    // receive
    wire rx_level, rx, received, ninth, framing_error, start_glitch, receiving, line_break;
    wire filtered, checked, good, frame_good, frame_bad;
    wire receive_present, receive_read, receive_good, receive_command, receive_overrun;
    wire [7:0] received_data, receive_data, receive_free;
    // transmit
    wire to_send, send_ready, send_command, sending, driver_requested, tx_level, transmit_tick;
    wire transmit_written, transmit_command, transmit_expired, transmit_overrun;
    wire [7:0] send_data, transmit_data, transmit_free;
    // CRC
    wire crc_start, crc_byte_written;
    wire [ 7:0] crc_byte;
    wire [31:0] crc;

    half_duplex u_half_duplex (
        .driver_enable(rs485_driver_enable),
        .tx_level,
        .rx_pin       (rs485_rx),
        .tx_pin       (rs485_tx),
        .rx_level
    );

    // receive
    synchroniser #(
        .RESET(1)
    ) u_pin (
        .clk,
        .rst,
        .d(rx_level),
        .q(rx)
    );
    uart_rx u_receiver (
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
    break_detector #(
        .CLK_HZ(CLK_HZ)
    ) u_break (
        .clk,
        .rst,
        .rx,
        .found(line_break)
    );
    address_filter u_filter (
        .clk,
        .rst,
        .address,
        .valid_in(received),
        .data_in (received_data),
        .ninth,
        .valid   (filtered)
    );
    frame_check u_check (
        .clk,
        .rst,
        .valid_in(filtered),
        .data    (received_data),
        .command (ninth),
        .framing_error,
        .valid   (checked),
        .good,
        .frame_good,
        .frame_bad,
        .sync
    );
    sync_fifo #(
        .W    (10),
        .DEPTH(128),
        .STYLE(QUEUE_STYLE)
    ) u_received (
        .clk,
        .rst,
        .push   (checked),
        .in     ({good, ninth, received_data}),
        .pop    (receive_read),
        .present(receive_present),
        .out    ({receive_good, receive_command, receive_data}),
        .free   (receive_free),
        .overrun(receive_overrun)
    );
    heartbeat_watchdog #(
        .CLK_HZ(CLK_HZ)
    ) u_watchdog (
        .clk,
        .rst,
        .time_ms(watchdog_time),
        .kick   (frame_good),
        .armed,
        .expired(watchdog_expired)
    );

    // transmit
    sync_fifo #(
        .W    (9),
        .DEPTH(128),
        .STYLE(QUEUE_STYLE)
    ) u_to_send (
        .clk,
        .rst,
        .push   (transmit_written),
        .in     ({transmit_command, transmit_data}),
        .pop    (send_ready),
        .present(to_send),
        .out    ({send_command, send_data}),
        .free   (transmit_free),
        .overrun(transmit_overrun)
    );
    uart_tx u_transmitter (
        .clk,
        .rst,
        .bit_time,
        .valid        (to_send),
        .ready        (send_ready),
        .data         (send_data),
        .ninth        (send_command),
        .tx           (tx_level),
        .driver_enable(driver_requested),
        .busy         (sending),
        .tick         (transmit_tick)
    );
    transmit_timeout u_timeout (
        .clk,
        .rst,
        .tick         (transmit_tick),
        .requested    (driver_requested),
        .driver_enable(rs485_driver_enable),
        .expired      (transmit_expired)
    );
    // the register keeps the byte; the next access of the soft core waits while crc_waits
    /* verilator lint_off PINCONNECTEMPTY */
    crc32_serial u_crc (
        .clk,
        .rst,
        .start(crc_start),
        .valid(crc_byte_written),
        .data (crc_byte),
        .check(1'b0),
        .busy (crc_waits),
        .done (),
        .wrong(),
        .crc
    );
    /* verilator lint_on PINCONNECTEMPTY */

    bus_registers u_registers (
        .clk,
        .rst,
        // register bus
        .select,
        .write,
        .word,
        .wdata,
        .rdata,
        // settings
        .bit_time,
        .watchdog_time,
        .sync_axes,
        // receive
        .receive_data,
        .receive_command,
        .receive_good,
        .receive_present,
        .receive_read,
        // transmit
        .transmit_data,
        .transmit_written,
        .transmit_command,
        .state_transmit_free(transmit_free),
        .state_sending      (sending),
        // CRC
        .crc_byte_data      (crc_byte),
        .crc_byte_written,
        .crc_start_start    (crc_start),
        .crc,
        // counted events
        .frames_good        (frame_good),
        .frames_bad         (frame_bad),
        .framing_errors     (framing_error),
        .start_glitches     (start_glitch),
        .overruns           (receive_overrun),
        .breaks             (line_break),
        .transmit_timeouts  (transmit_expired),
        .syncs              (sync)
    );

    assign word_received = receive_present;

    wire unused = &{1'b0, receiving, receive_free, transmit_overrun};
endmodule

`default_nettype wire
