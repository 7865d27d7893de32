// SPDX-License-Identifier: Apache-2.0
// peripherals -- what a node speaks to besides its line: I2C, a PS/2 keyboard and its machine, a
// peer, an angle sensor, a numeric display, status inputs; all behind one register block.
//
// latency  see the rooms link and sense
// rate     see there
// source   S4: the main controller is a keyboard of the EDM machine, reads its lamps, has a panel
//          and an EEPROM on I2C and a sub-controller at the peer port; the sub-controller reads a
//          time-grating sensor. S0: numeric display
// model    the models of its blocks; proved in motion by tb/peripheral/test_peripherals.py
// built    PERIPHERALS chooses; a link that is absent has no logic but its settings, its pins are
//          idle; with none there is not even a register
`default_nettype none

module peripherals #(
    parameter int CLK_HZ = 50_000_000,
    parameter int PERIPHERALS  = 63                   // bit 0 I2C, 1 PS/2, 2 peer port, 3 angle sensor, 4 numeric display, 5 status inputs
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         select,              // register bus
    input  wire         write,
    input  wire  [ 5:0] word,                // 32-bit word of the block
    input  wire  [31:0] wdata,
    output logic [31:0] rdata,
    input  wire         i2c_scl,             // pins from here on: levels of the lines
    input  wire         i2c_sda,
    output logic        i2c_scl_low,         // pull the lines low
    output logic        i2c_sda_low,
    input  wire         keyboard_clock,      // PS/2, the keyboard's side
    input  wire         keyboard_data,
    output logic        keyboard_clock_low,
    output logic        keyboard_data_low,
    input  wire         edm_clock,           // PS/2, the machine's side
    input  wire         edm_data,
    output logic        edm_clock_low,
    output logic        edm_data_low,
    input  wire         peer_rx,             // idles high
    output logic        peer_tx,
    input  wire         sensor_rx,
    output logic        display_cs_n,
    output logic        display_sclk,
    output logic        display_data,
    input  wire  [ 1:0] edm_status
);
    if (PERIPHERALS < 0 || PERIPHERALS > 63) begin : g_check
        PERIPHERALS_MUST_BE_FROM_0_TO_63 u_error ();
    end

    if (PERIPHERALS == 0) begin : g_none
        assign rdata = '0;
        assign {i2c_scl_low, i2c_sda_low, keyboard_clock_low, keyboard_data_low, edm_clock_low, edm_data_low} = '0;
        assign {peer_tx, display_cs_n, display_sclk, display_data} = 4'b1100;
        wire unused = &{1'b0, clk, rst, select, write, word, wdata, i2c_scl, i2c_sda, keyboard_clock, keyboard_data, edm_clock,
                        edm_data, peer_rx, sensor_rx, edm_status};
    end else begin : g_peripherals
        wire [7:0]  i2c_data, i2c_answer_data, i2c_state_free, ps2_inject_data, peer_receive_data, peer_transmit;
        wire [2:0] i2c_command;
        wire [1:0] i2c_answer_result;
        wire        i2c_acknowledge, i2c_written, i2c_answer_present, i2c_answer_read, i2c_busy, i2c_owned, scl, sda;
        wire [15:0] ps2_idle, display, edm_filter;
        wire        ps2_inject_last, ps2_inject_written, ps2_drop, ps2_injecting, ps2_busy, ps2_typed, ps2_glitch;
        wire keyboard_damaged, command_damaged, command_unsent, aborted;
        wire [5:0] ps2_free;
        wire [19:0] peer_bit_time, sensor_bit_time;
        wire        peer_receive_present, peer_receive_read, peer_written, peer_sending, peer_framing_error, peer_overrun;
        wire [ 6:0] peer_free;
        wire [23:0] sensor_gap;
        wire [31:0] sensor_stale_after, angle, age;
        wire [7:0] sequence_number, crc_errors, broken, missed;
        wire stale, sensor_clear, sensor_frame, display_written, display_sending;
        wire [4:0] display_free;
        wire [1:0] status, rose, fell;

        peripherals_registers u_registers (
            .clk,
            .rst,
            .select,
            .write,
            .word,
            .wdata,
            .rdata,
            .built_i2c                   (PERIPHERALS[0]),
            .built_ps2                   (PERIPHERALS[1]),
            .built_peer                  (PERIPHERALS[2]),
            .built_sensor                (PERIPHERALS[3]),
            .built_display               (PERIPHERALS[4]),
            .built_edm                   (PERIPHERALS[5]),
            .i2c_data,
            .i2c_command,
            .i2c_acknowledge,
            .i2c_written,
            .i2c_answer_data,
            .i2c_answer_result,
            .i2c_answer_present,
            .i2c_answer_read,
            .i2c_state_free,
            .i2c_state_busy              (i2c_busy),
            .i2c_state_owned             (i2c_owned),
            .i2c_state_scl               (scl),
            .i2c_state_sda               (sda),
            .ps2_idle,
            .ps2_inject_data,
            .ps2_inject_last,
            .ps2_inject_written,
            .ps2_state_free              (ps2_free),
            .ps2_state_injecting         (ps2_injecting),
            .ps2_state_busy              (ps2_busy),
            .ps2_state_drop              (ps2_drop),
            .ps2_typed,
            .ps2_errors_keyboard_damaged (keyboard_damaged),
            .ps2_errors_command_damaged  (command_damaged),
            .ps2_errors_unsent           (command_unsent),
            .ps2_errors_aborted          (aborted),
            .ps2_glitches                (ps2_glitch),
            .peer_bit_time,
            .peer_receive_data,
            .peer_receive_present,
            .peer_receive_read,
            .peer_transmit,
            .peer_transmit_written       (peer_written),
            .peer_state_transmit_free    (peer_free),
            .peer_state_sending          (peer_sending),
            .peer_errors_framing         (peer_framing_error),
            .peer_errors_overruns        (peer_overrun),
            .sensor_bit_time,
            .sensor_gap,
            .sensor_stale_after,
            .sensor_reading              ({age, angle}),
            .sensor_state_sequence_number(sequence_number),
            .sensor_state_stale          (stale),
            .sensor_errors_crc           (crc_errors),
            .sensor_errors_broken        (broken),
            .sensor_errors_missed        (missed),
            .sensor_errors_clear         (sensor_clear),
            .sensor_frames               (sensor_frame),
            .display,
            .display_written,
            .display_state_free          (display_free),
            .display_state_sending       (display_sending),
            .edm_filter,
            .edm_status_inputs           (status),
            .edm_status_rose_0           (rose[0]),
            .edm_status_rose_1           (rose[1]),
            .edm_status_fell_0           (fell[0]),
            .edm_status_fell_1           (fell[1])
        );

        if (PERIPHERALS[0]) begin : g_i2c
            localparam int SPIKE = CLK_HZ / 20_000_000;  // clk: 50 ns

            wire present, command_ready, done, answer_overrun, overrun, scl_level, sda_level;
            wire [2:0] command, unused_rejected;
            wire [7:0] data, read_data;
            wire       acknowledge;
            wire [1:0] result;
            wire [7:0] answer_free;

            synchroniser #(
                .W    (2),
                .RESET(3)
            ) u_lines (
                .clk,
                .rst,
                .d({i2c_scl, i2c_sda}),
                .q({scl_level, sda_level})
            );
            deglitcher #(
                .W(4)
            ) u_scl (
                .clk,
                .rst,
                .stable_cycles(4'(SPIKE)),
                .level        (scl_level),
                .filtered     (scl),
                .rejected     (unused_rejected[0])
            );
            deglitcher #(
                .W(4)
            ) u_sda (
                .clk,
                .rst,
                .stable_cycles(4'(SPIKE)),
                .level        (sda_level),
                .filtered     (sda),
                .rejected     (unused_rejected[1])
            );
            sync_fifo #(
                .W    (12),
                .DEPTH(128)
            ) u_commands (
                .clk,
                .rst,
                .push(i2c_written),
                .in  ({i2c_acknowledge, i2c_command, i2c_data}),
                .pop (command_ready),
                .present,
                .out ({acknowledge, command, data}),
                .free(i2c_state_free),
                .overrun
            );
            i2c_master #(
                .CLK_HZ(CLK_HZ)
            ) u_master (
                .clk,
                .rst,
                .scl,
                .sda,
                .command_valid(present),
                .command_ready,
                .command,
                .write_data   (data),
                .acknowledge,
                .done,
                .result,
                .read_data,
                .owned        (i2c_owned),
                .scl_low      (i2c_scl_low),
                .sda_low      (i2c_sda_low)
            );
            sync_fifo #(
                .W    (10),
                .DEPTH(128)
            ) u_answers (
                .clk,
                .rst,
                .push   (done),
                .in     ({result, read_data}),
                .pop    (i2c_answer_read),
                .present(i2c_answer_present),
                .out    ({i2c_answer_result, i2c_answer_data}),
                .free   (answer_free),
                .overrun(answer_overrun)
            );
            assign i2c_busy = i2c_written || !i2c_state_free[7] || !command_ready || done;
            assign unused_rejected[2] = &{1'b0, overrun, answer_overrun, answer_free, unused_rejected[1:0]};
        end else begin : g_no_i2c
            assign {i2c_answer_data, i2c_answer_result, i2c_answer_present, i2c_state_free, i2c_busy, i2c_owned, scl, sda} = '0;
            assign {i2c_scl_low, i2c_sda_low} = '0;
            wire unused = &{1'b0, i2c_data, i2c_command, i2c_acknowledge, i2c_written, i2c_answer_read, i2c_scl, i2c_sda};
        end

        if (PERIPHERALS[1]) begin : g_ps2
            wire inject_valid, inject_ready, inject_last;
            wire [7:0] inject;

            ps2_inject_queue #(
                .DEPTH(32)
            ) u_inject (
                .clk,
                .rst,
                .push     (ps2_inject_written),
                .in       (ps2_inject_data),
                .in_last  (ps2_inject_last),
                .drop     (ps2_drop),
                .valid    (inject_valid),
                .ready    (inject_ready),
                .out      (inject),
                .last     (inject_last),
                .injecting(ps2_injecting),
                .free     (ps2_free)
            );
            ps2_pass #(
                .CLK_HZ(CLK_HZ)
            ) u_pass (
                .clk,
                .rst,
                .idle_ms       (ps2_idle),
                .keyboard_clock,
                .keyboard_data,
                .keyboard_clock_low,
                .keyboard_data_low,
                .host_clock    (edm_clock),
                .host_data     (edm_data),
                .host_clock_low(edm_clock_low),
                .host_data_low (edm_data_low),
                .inject_valid,
                .inject_ready,
                .inject,
                .inject_last,
                .injecting     (ps2_injecting),
                .typed         (ps2_typed),
                .keyboard_damaged,
                .command_damaged,
                .command_unsent,
                .aborted,
                .glitch        (ps2_glitch),
                .busy          (ps2_busy)
            );
        end else begin : g_no_ps2
            assign {ps2_free, ps2_injecting, ps2_busy, ps2_typed, ps2_glitch, keyboard_damaged, command_damaged, command_unsent, aborted} = '0;
            assign {keyboard_clock_low, keyboard_data_low, edm_clock_low, edm_data_low} = '0;
            wire unused = &{1'b0, ps2_idle, ps2_inject_data, ps2_inject_last, ps2_inject_written, ps2_drop, keyboard_clock,
                            keyboard_data, edm_clock, edm_data};
        end

        if (PERIPHERALS[2]) begin : g_peer
            wire       rx, received, ninth, start_glitch, receiving, present, ready, driver_enable, transmit_overrun;
            wire [7:0] data, to_send;
            wire [6:0] receive_free;

            synchroniser #(
                .RESET(1)
            ) u_rs485 (
                .clk,
                .rst,
                .d(peer_rx),
                .q(rx)
            );
            uart_rx #(
                .NINTH(0)
            ) u_receiver (
                .clk,
                .rst,
                .bit_time     (peer_bit_time),
                .rx,
                .valid        (received),
                .data,
                .ninth,
                .framing_error(peer_framing_error),
                .start_glitch,
                .busy         (receiving)
            );
            sync_fifo #(
                .W    (8),
                .DEPTH(64)
            ) u_received (
                .clk,
                .rst,
                .push   (received),
                .in     (data),
                .pop    (peer_receive_read),
                .present(peer_receive_present),
                .out    (peer_receive_data),
                .free   (receive_free),
                .overrun(peer_overrun)
            );
            sync_fifo #(
                .W    (8),
                .DEPTH(64)
            ) u_to_send (
                .clk,
                .rst,
                .push   (peer_written),
                .in     (peer_transmit),
                .pop    (ready),
                .present,
                .out    (to_send),
                .free   (peer_free),
                .overrun(transmit_overrun)
            );
            uart_tx #(
                .NINTH(0)
            ) u_transmitter (
                .clk,
                .rst,
                .bit_time(peer_bit_time),
                .valid   (present),
                .ready,
                .data    (to_send),
                .ninth   (1'b0),
                .tx      (peer_tx),
                .driver_enable,
                .busy    (peer_sending)
            );
            wire unused = &{1'b0, ninth, start_glitch, receiving, receive_free, transmit_overrun, driver_enable};
        end else begin : g_no_peer
            assign {peer_receive_data, peer_receive_present, peer_free, peer_sending, peer_framing_error, peer_overrun} = '0;
            assign peer_tx = 1'b1;
            wire unused = &{1'b0, peer_bit_time, peer_transmit, peer_receive_read, peer_written, peer_rx};
        end

        if (PERIPHERALS[3]) begin : g_sensor
            wire rx, received, ninth, framing_error, start_glitch, receiving;
            wire [7:0] data;

            synchroniser #(
                .RESET(1)
            ) u_rs485 (
                .clk,
                .rst,
                .d(sensor_rx),
                .q(rx)
            );
            uart_rx #(
                .NINTH(0)
            ) u_receiver (
                .clk,
                .rst,
                .bit_time(sensor_bit_time),
                .rx,
                .valid   (received),
                .data,
                .ninth,
                .framing_error,
                .start_glitch,
                .busy    (receiving)
            );
            angle_frame #(
                .W(8)
            ) u_frame (
                .clk,
                .rst,
                .gap        (sensor_gap),
                .stale_after(sensor_stale_after),
                .byte_valid (received),
                .byte_data  (data),
                .framing_error,
                .clear      (sensor_clear),
                .valid      (sensor_frame),
                .angle,
                .sequence_number,
                .age,
                .stale,
                .crc_errors,
                .broken,
                .missed
            );
            wire unused = &{1'b0, ninth, start_glitch, receiving};
        end else begin : g_no_sensor
            assign {angle, age, sequence_number, stale, crc_errors, broken, missed, sensor_frame} = '0;
            wire unused = &{1'b0, sensor_bit_time, sensor_gap, sensor_stale_after, sensor_clear, sensor_rx};
        end

        if (PERIPHERALS[4]) begin : g_display
            localparam int SCLK_HZ = 1_000_000;  // at most
            localparam [7:0] HALF_PERIOD = 8'((CLK_HZ + 2 * SCLK_HZ - 1) / (2 * SCLK_HZ));
            wire present, ready, sent, overrun;
            wire [15:0] to_send;

            sync_fifo #(
                .W    (16),
                .DEPTH(16)
            ) u_words (
                .clk,
                .rst,
                .push(display_written),
                .in  (display),
                .pop (ready),
                .present,
                .out (to_send),
                .free(display_free),
                .overrun
            );
            spi_word_sender u_sender (
                .clk,
                .rst,
                .half_period(HALF_PERIOD),
                .valid      (present),
                .ready,
                .word       (to_send),
                .cs_n       (display_cs_n),
                .sclk       (display_sclk),
                .sdi        (display_data),
                .sent
            );
            assign display_sending = display_written || !display_free[4] || !ready;
            wire unused = &{1'b0, sent, overrun};
        end else begin : g_no_display
            assign {display_free, display_sending} = '0;
            assign {display_cs_n, display_sclk, display_data} = 3'b100;
            wire unused = &{1'b0, display, display_written};
        end

        if (PERIPHERALS[5]) begin : g_edm
            status_inputs #(
                .CLK_HZ(CLK_HZ),
                .W     (2)
            ) u_inputs (
                .clk,
                .rst,
                .time_ms(edm_filter),
                .inputs (edm_status),
                .level  (status),
                .rose,
                .fell
            );
        end else begin : g_no_edm
            assign {status, rose, fell} = '0;
            wire unused = &{1'b0, edm_filter, edm_status};
        end
    end
endmodule

`default_nettype wire
