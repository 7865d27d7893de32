// SPDX-License-Identifier: Apache-2.0
// ethernet_bench -- a node with its real-time link over Ethernet: the node, the Ethernet core that
// LiteEth makes, and the MII pins of a PHY, whose clock is half of clk.
`default_nettype none

module ethernet_bench #(
    parameter int AXES         = 1,
    parameter int CLK_HZ       = 50_000_000,  // Hz, twice the clock of the PHY at 100 Mbit/s
    parameter int MEMORY_BYTES = 4096
) (
    input  wire             clk,
    input  wire             rst,
    input  wire  [    47:0] mac_address,
    input  wire  [    31:0] ip_address,
    input  wire  [AXES-1:0] drive_fault_n,  // pins, 0: the drive reports a fault
    output logic [AXES-1:0] drive_enable,   // pins, 1: the drive may be on
    // MII
    output logic            mii_clk,        // changes with clk
    input  wire             mii_rx_dv,      // level: a nibble
    input  wire  [     3:0] mii_rx_data,    // nibble
    output logic            mii_tx_en,      // level: a nibble
    output logic [     3:0] mii_tx_data     // nibble
);
    wire udp_rx_valid, udp_rx_last, udp_rx_error, udp_rx_ready, udp_tx_valid, udp_tx_last;
    wire udp_tx_ready;
    wire [7:0] udp_rx_data, udp_tx_data;
    wire [47:0] udp_rx_sender, udp_tx_receiver;
    wire [15:0] udp_tx_length;

    initial mii_clk = 1'b0;
    always_ff @(posedge clk) mii_clk <= !mii_clk;

    ethernet_core u_ethernet (
        .clk,
        .rst,
        .mac_address,
        .ip_address,
        // PHY
        .clocks_rx   (mii_clk),
        .clocks_tx   (mii_clk),
        .pads_rx_dv  (mii_rx_dv),
        .pads_rx_data(mii_rx_data),
        .pads_tx_en  (mii_tx_en),
        .pads_tx_data(mii_tx_data),
        // datagrams
        .udp_rx_valid,
        .udp_rx_data,
        .udp_rx_last,
        .udp_rx_error,
        .udp_rx_sender,
        .udp_rx_ready,
        .udp_tx_valid,
        .udp_tx_data,
        .udp_tx_last,
        .udp_tx_receiver,
        .udp_tx_length,
        .udp_tx_ready
    );
    // the pins of a node that have no part in this are idle or open
    // verilator lint_off PINMISSING
    node #(
        .CLK_HZ      (CLK_HZ),
        .TICK_HZ     (4000),
        .AXES        (AXES),
        .FILTERS     (0),
        .HAS_SINE    (0),
        .HAS_BRIDGE  (0),
        .HAS_DAC     (0),
        .HAS_LINK    (1),
        .LINK_CARRIER(1),
        .MEMORY_BYTES(MEMORY_BYTES)
    ) u_node (
        .clk,
        .rst,
        .address        (4'd1),
        .rs485_rx       (1'b1),
        .link_rx        (1'b1),
        .link_cs_n      (1'b1),
        .link_sclk      (1'b0),
        .link_mosi      (1'b0),
        .udp_rx_valid,
        .udp_rx_data,
        .udp_rx_last,
        .udp_rx_error,
        .udp_rx_sender,
        .udp_rx_ready,
        .udp_tx_valid,
        .udp_tx_data,
        .udp_tx_last,
        .udp_tx_receiver,
        .udp_tx_length,
        .udp_tx_ready,
        .flash_miso     (1'b0),
        .estop_open     (1'b0),
        .encoder_a      ('0),
        .encoder_b      ('0),
        .encoder_z      ('0),
        .probe          ('0),
        .adc_sin        ('0),
        .adc_cos        ('0),
        .limit_low_open ('0),
        .limit_high_open('0),
        .drive_fault_n,
        .drive_enable,
        .i2c_scl        (1'b1),
        .i2c_sda        (1'b1),
        .keyboard_clock (1'b1),
        .keyboard_data  (1'b1),
        .edm_clock      (1'b1),
        .edm_data       (1'b1),
        .peer_rx        (1'b1),
        .sensor_rx      (1'b1),
        .edm_status     (2'b00)
    );
    // verilator lint_on PINMISSING
endmodule

`default_nettype wire
