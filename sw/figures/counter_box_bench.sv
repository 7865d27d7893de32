// SPDX-License-Identifier: Apache-2.0
// counter_box_bench -- the pins of a box that counts four A/B/Z scales: a node without drives,
// whose unused pins are tied off, so that it fits the pads of a small part.
`default_nettype none

module counter_box_bench #(
    parameter int CLK_HZ = 20_000_000  // Hz, clk frequency
) (
    input  wire        clk,
    input  wire        rst,
    input  wire  [3:0] address,              // static
    input  wire        rs485_rx,
    output logic       rs485_tx,
    output logic       rs485_driver_enable,
    input  wire  [3:0] encoder_a,
    input  wire  [3:0] encoder_b,
    input  wire  [3:0] encoder_z,
    input  wire  [7:0] probe,
    output logic       flash_cs_n,
    output logic       flash_sclk,
    output logic       flash_mosi,
    input  wire        flash_miso            // synchronous to flash_sclk
);
    wire [3:0] adc_cs_n, adc_sclk, compare_pulse, bridge_a, bridge_b, step, direction;
    wire [3:0] dac_cs_n, dac_sclk, dac_sdi, drive_enable;
    wire i2c_scl_low, i2c_sda_low, keyboard_clock_low, keyboard_data_low, edm_clock_low;
    wire link_tx, link_driver_enable, link_miso, udp_rx_ready, udp_tx_valid, udp_tx_last;
    wire [ 7:0] udp_tx_data;
    wire [47:0] udp_tx_receiver;
    wire [15:0] udp_tx_length;
    wire edm_data_low, peer_tx, display_cs_n, display_sclk, display_data;

    node #(
        .CLK_HZ           (CLK_HZ),
        .AXES             (4),
        .FILTERS          (0),
        .HAS_SINE         (0),
        .HAS_COMPARE      (0),
        .HAS_ENCODER_CHECK(0),
        .HAS_VELOCITY     (0),
        .HAS_DRIVE        (0),
        .HAS_SERIAL_CORE  (1),
        .MEMORY_BYTES     (65536),
        .REGISTER_STYLE   ("huge"),
        .QUEUE_STYLE      ("auto")
    ) u_node (
        .clk,
        .rst,
        .address,
        .rs485_rx,
        .rs485_tx,
        .rs485_driver_enable,
        .link_rx        (1'b1),
        .link_tx,
        .link_driver_enable,
        .link_cs_n      (1'b1),
        .link_sclk      (1'b0),
        .link_mosi      (1'b0),
        .link_miso,
        .udp_rx_valid   (1'b0),
        .udp_rx_data    (8'd0),
        .udp_rx_last    (1'b0),
        .udp_rx_error   (1'b0),
        .udp_rx_sender  (48'd0),
        .udp_rx_ready,
        .udp_tx_valid,
        .udp_tx_data,
        .udp_tx_last,
        .udp_tx_receiver,
        .udp_tx_length,
        .udp_tx_ready   (1'b0),
        .flash_cs_n,
        .flash_sclk,
        .flash_mosi,
        .flash_miso,
        .estop_open     (1'b0),
        .encoder_a,
        .encoder_b,
        .encoder_z,
        .probe,
        .adc_sin        (4'd0),
        .adc_cos        (4'd0),
        .adc_cs_n,
        .adc_sclk,
        .compare_pulse,
        .limit_low_open (4'd0),
        .limit_high_open(4'd0),
        .drive_fault_n  (4'hF),
        .bridge_a,
        .bridge_b,
        .step,
        .direction,
        .dac_cs_n,
        .dac_sclk,
        .dac_sdi,
        .drive_enable,
        .i2c_scl        (1'b1),
        .i2c_sda        (1'b1),
        .i2c_scl_low,
        .i2c_sda_low,
        .keyboard_clock (1'b1),
        .keyboard_data  (1'b1),
        .keyboard_clock_low,
        .keyboard_data_low,
        .edm_clock      (1'b1),
        .edm_data       (1'b1),
        .edm_clock_low,
        .edm_data_low,
        .peer_rx        (1'b1),
        .peer_tx,
        .sensor_rx      (1'b1),
        .display_cs_n,
        .display_sclk,
        .display_data,
        .edm_status     (2'b00)
    );

    wire unused = &{
        1'b0, adc_cs_n, adc_sclk, compare_pulse, bridge_a, bridge_b, step, direction, dac_cs_n,
        dac_sclk, dac_sdi, drive_enable, i2c_scl_low, i2c_sda_low, keyboard_clock_low,
        keyboard_data_low, edm_clock_low, edm_data_low, peer_tx, display_cs_n, display_sclk,
        display_data, link_tx, link_driver_enable, link_miso, udp_rx_ready, udp_tx_valid,
        udp_tx_data, udp_tx_last, udp_tx_receiver, udp_tx_length
    };
endmodule

`default_nettype wire
