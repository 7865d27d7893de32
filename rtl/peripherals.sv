// SPDX-License-Identifier: Apache-2.0
// peripherals -- the devices that a node serves besides its axes and its bus, all behind one
// register block.
//
// latency  see the blocks
// rate     see the blocks
// behaviour  A peripheral that is not built has no logic but its settings, and its pins are idle.
//          Without any peripheral there is no register block either, and rdata is 0.
// source   S4: the main controller is a keyboard of the EDM machine, reads its lamps, has a panel
//          and an EEPROM on I2C, and speaks to a sub-controller at the peer port; the
//          sub-controller reads a time-grating sensor. S0: numeric display
// model    the models of its blocks; tested together by tb/peripheral/test_peripherals.py
`default_nettype none

module peripherals #(
    parameter int CLK_HZ            = 50_000_000,  // Hz, clk frequency
    parameter int HAS_I2C           = 1,           // 1: build the I2C master
    parameter int HAS_PS2           = 1,           // 1: build the PS/2 pass-through
    parameter int HAS_PEER          = 1,           // 1: build the peer port
    parameter int HAS_ANGLE_SENSOR  = 1,           // 1: build the receiver of the angle sensor
    parameter int HAS_DISPLAY       = 1,           // 1: build the numeric display
    parameter int HAS_STATUS_INPUTS = 1            // 1: build the status inputs
) (
    input  wire         clk,
    input  wire         rst,
    // register bus
    input  wire         select,              // strobe: an access to this block
    input  wire         write,               // level: the access writes
    input  wire  [ 5:0] word,                // 32-bit word of the block
    input  wire  [31:0] wdata,               // value to write
    output logic [31:0] rdata,               // value read, in the next cycle; else 0
    // I2C
    input  wire         i2c_scl,             // level of the clock line
    input  wire         i2c_sda,             // level of the data line
    output logic        i2c_scl_low,         // 1: pull the clock line low
    output logic        i2c_sda_low,         // 1: pull the data line low
    // PS/2, the keyboard's side
    input  wire         keyboard_clock,      // level of the clock line
    input  wire         keyboard_data,       // level of the data line
    output logic        keyboard_clock_low,  // 1: pull the clock line low
    output logic        keyboard_data_low,   // 1: pull the data line low
    // PS/2, the side of the EDM machine
    input  wire         edm_clock,           // level of the clock line
    input  wire         edm_data,            // level of the data line
    output logic        edm_clock_low,       // 1: pull the clock line low
    output logic        edm_data_low,        // 1: pull the data line low
    // peer port
    input  wire         peer_rx,             // pin, idles high
    output logic        peer_tx,             // pin, idles high
    // angle sensor
    input  wire         sensor_rx,           // pin, idles high
    // numeric display
    output logic        display_cs_n,        // pin, low during a word
    output logic        display_sclk,        // pin, idles low
    output logic        display_data,        // pin
    // status inputs
    input  wire  [ 1:0] edm_status           // pins, asynchronous
);
    localparam int BUILT = HAS_I2C + HAS_PS2 + HAS_PEER + HAS_ANGLE_SENSOR + HAS_DISPLAY +
        HAS_STATUS_INPUTS;

    if (BUILT == 0) begin : g_none
        assign rdata = '0;
        assign {i2c_scl_low, i2c_sda_low} = '0;
        assign {keyboard_clock_low, keyboard_data_low, edm_clock_low, edm_data_low} = '0;
        assign {peer_tx, display_cs_n, display_sclk, display_data} = 4'b1100;

        wire unused_bus = &{1'b0, clk, rst, select, write, word, wdata};
        wire unused_pins = &{
            1'b0, i2c_scl, i2c_sda, keyboard_clock, keyboard_data, edm_clock, edm_data, peer_rx,
            sensor_rx, edm_status
        };
    end else begin : g_peripherals
        // I2C
        wire [7:0] i2c_data, i2c_answer_data, i2c_state_free;
        wire [2:0] i2c_command;
        wire [1:0] i2c_answer_result;
        wire i2c_acknowledge, i2c_written, i2c_answer_present, i2c_answer_read;
        wire i2c_state_busy, i2c_state_owned, i2c_state_scl, i2c_state_sda;
        // PS/2
        wire [15:0] ps2_idle;
        wire [ 7:0] ps2_inject_data;
        wire [ 5:0] ps2_state_free;
        wire ps2_inject_last, ps2_inject_written, ps2_state_drop;
        wire ps2_state_injecting, ps2_state_busy, ps2_typed, ps2_glitches;
        wire ps2_errors_keyboard_damaged, ps2_errors_command_damaged;
        wire ps2_errors_unsent, ps2_errors_aborted;
        // peer port
        wire [19:0] peer_bit_time;
        wire [7:0] peer_receive_data, peer_transmit;
        wire [6:0] peer_state_transmit_free;
        wire peer_receive_present, peer_receive_read, peer_transmit_written;
        wire peer_state_sending, peer_errors_framing, peer_errors_overruns;
        // angle sensor
        wire [19:0] sensor_bit_time;
        wire [23:0] sensor_gap;
        wire [31:0] sensor_stale_after, sensor_angle, sensor_age;
        wire [7:0] sensor_state_sequence_number;
        wire [7:0] sensor_errors_crc, sensor_errors_broken, sensor_errors_missed;
        wire sensor_state_stale, sensor_errors_clear, sensor_frames;
        // numeric display
        wire [15:0] display;
        wire [ 4:0] display_state_free;
        wire display_written, display_state_sending;
        // status inputs
        wire [15:0] edm_filter;
        wire [1:0] edm_status_inputs, edm_status_rose, edm_status_fell;

        i2c_port #(
            .CLK_HZ(CLK_HZ),
            .BUILT (HAS_I2C)
        ) u_i2c (
            .clk,
            .rst,
            // lines
            .scl_pin       (i2c_scl),
            .sda_pin       (i2c_sda),
            .scl_low       (i2c_scl_low),
            .sda_low       (i2c_sda_low),
            // commands
            .push          (i2c_written),
            .command       (i2c_command),
            .data          (i2c_data),
            .acknowledge   (i2c_acknowledge),
            // state
            .free          (i2c_state_free),
            .busy          (i2c_state_busy),
            .owned         (i2c_state_owned),
            .scl           (i2c_state_scl),
            .sda           (i2c_state_sda),
            // results
            .result_pop    (i2c_answer_read),
            .result_present(i2c_answer_present),
            .result        (i2c_answer_result),
            .result_data   (i2c_answer_data)
        );
        ps2_port #(
            .CLK_HZ(CLK_HZ),
            .BUILT (HAS_PS2)
        ) u_ps2 (
            .clk,
            .rst,
            // lines
            .keyboard_clock,
            .keyboard_data,
            .keyboard_clock_low,
            .keyboard_data_low,
            .host_clock      (edm_clock),
            .host_data       (edm_data),
            .host_clock_low  (edm_clock_low),
            .host_data_low   (edm_data_low),
            // injection
            .idle_ms         (ps2_idle),
            .push            (ps2_inject_written),
            .inject          (ps2_inject_data),
            .inject_last     (ps2_inject_last),
            .drop            (ps2_state_drop),
            // state
            .free            (ps2_state_free),
            .injecting       (ps2_state_injecting),
            .busy            (ps2_state_busy),
            // events
            .typed           (ps2_typed),
            .keyboard_damaged(ps2_errors_keyboard_damaged),
            .command_damaged (ps2_errors_command_damaged),
            .command_unsent  (ps2_errors_unsent),
            .aborted         (ps2_errors_aborted),
            .glitch          (ps2_glitches)
        );
        peer_port #(
            .BUILT(HAS_PEER)
        ) u_peer (
            .clk,
            .rst,
            // pins
            .rx_pin         (peer_rx),
            .tx_pin         (peer_tx),
            .bit_time       (peer_bit_time),
            // queues
            .receive_pop    (peer_receive_read),
            .receive_present(peer_receive_present),
            .receive_data   (peer_receive_data),
            .transmit_push  (peer_transmit_written),
            .transmit_data  (peer_transmit),
            .transmit_free  (peer_state_transmit_free),
            // state and events
            .sending        (peer_state_sending),
            .framing_error  (peer_errors_framing),
            .overrun        (peer_errors_overruns)
        );
        angle_sensor_port #(
            .BUILT(HAS_ANGLE_SENSOR)
        ) u_sensor (
            .clk,
            .rst,
            // pin and settings
            .rx_pin         (sensor_rx),
            .bit_time       (sensor_bit_time),
            .gap            (sensor_gap),
            .stale_after    (sensor_stale_after),
            .clear          (sensor_errors_clear),
            // frames
            .frame          (sensor_frames),
            .angle          (sensor_angle),
            .age            (sensor_age),
            .sequence_number(sensor_state_sequence_number),
            .stale          (sensor_state_stale),
            // errors
            .crc_errors     (sensor_errors_crc),
            .broken         (sensor_errors_broken),
            .missed         (sensor_errors_missed)
        );
        display_port #(
            .CLK_HZ(CLK_HZ),
            .BUILT (HAS_DISPLAY)
        ) u_display (
            .clk,
            .rst,
            // words
            .push   (display_written),
            .word   (display),
            .free   (display_state_free),
            .sending(display_state_sending),
            // pins
            .cs_n   (display_cs_n),
            .sclk   (display_sclk),
            .sdi    (display_data)
        );
        status_input_port #(
            .CLK_HZ(CLK_HZ),
            .BUILT (HAS_STATUS_INPUTS)
        ) u_status (
            .clk,
            .rst,
            .time_ms(edm_filter),
            .pins   (edm_status),
            .level  (edm_status_inputs),
            .rose   (edm_status_rose),
            .fell   (edm_status_fell)
        );

        peripherals_registers u_registers (
            .clk,
            .rst,
            // register bus
            .select,
            .write,
            .word,
            .wdata,
            .rdata,
            // what is built
            .built_i2c        (1'(HAS_I2C)),
            .built_ps2        (1'(HAS_PS2)),
            .built_peer       (1'(HAS_PEER)),
            .built_sensor     (1'(HAS_ANGLE_SENSOR)),
            .built_display    (1'(HAS_DISPLAY)),
            .built_edm        (1'(HAS_STATUS_INPUTS)),
            // I2C
            .i2c_data,
            .i2c_command,
            .i2c_acknowledge,
            .i2c_written,
            .i2c_answer_data,
            .i2c_answer_result,
            .i2c_answer_present,
            .i2c_answer_read,
            .i2c_state_free,
            .i2c_state_busy,
            .i2c_state_owned,
            .i2c_state_scl,
            .i2c_state_sda,
            // PS/2
            .ps2_idle,
            .ps2_inject_data,
            .ps2_inject_last,
            .ps2_inject_written,
            .ps2_state_free,
            .ps2_state_injecting,
            .ps2_state_busy,
            .ps2_state_drop,
            .ps2_typed,
            .ps2_errors_keyboard_damaged,
            .ps2_errors_command_damaged,
            .ps2_errors_unsent,
            .ps2_errors_aborted,
            .ps2_glitches,
            // peer port
            .peer_bit_time,
            .peer_receive_data,
            .peer_receive_present,
            .peer_receive_read,
            .peer_transmit,
            .peer_transmit_written,
            .peer_state_transmit_free,
            .peer_state_sending,
            .peer_errors_framing,
            .peer_errors_overruns,
            // angle sensor
            .sensor_bit_time,
            .sensor_gap,
            .sensor_stale_after,
            .sensor_reading   ({sensor_age, sensor_angle}),
            .sensor_state_sequence_number,
            .sensor_state_stale,
            .sensor_errors_crc,
            .sensor_errors_broken,
            .sensor_errors_missed,
            .sensor_errors_clear,
            .sensor_frames,
            // numeric display
            .display,
            .display_written,
            .display_state_free,
            .display_state_sending,
            // status inputs
            .edm_filter,
            .edm_status_inputs,
            .edm_status_rose_0(edm_status_rose[0]),
            .edm_status_rose_1(edm_status_rose[1]),
            .edm_status_fell_0(edm_status_fell[0]),
            .edm_status_fell_1(edm_status_fell[1])
        );
    end
endmodule

`default_nettype wire
