// SPDX-License-Identifier: Apache-2.0
// top -- a node with one axis on the ULX3S: clock, reset, pins. The RS-485 bus is on the USB serial
// converter and on an RS-485 transceiver at the same time; both idle high. Pins: pins.lpf.
`default_nettype none

module top (
    input  wire        clk_25mhz,            // pin, 25 MHz
    // bus
    input  wire        usb_rx,               // pin, idles high
    output logic       usb_tx,               // pin, idles high
    input  wire        rs485_rx,             // pin, idles high
    output logic       rs485_tx,             // pin, idles high
    output logic       rs485_driver_enable,  // pin, 1: drive the bus
    input  wire  [3:0] address,              // switches, address of the node, static
    output logic [7:0] led,                  // see the assignment
    input  wire        estop_open,           // pin, 1: pressed or wire cut
    // scale
    input  wire        encoder_a,            // pin
    input  wire        encoder_b,            // pin
    input  wire        encoder_z,            // pin, index
    input  wire  [1:0] probe,                // pins of the touch probes
    input  wire        adc_sin,              // pin, serial data, synchronous to adc_sclk
    input  wire        adc_cos,              // pin, serial data, synchronous to adc_sclk
    output logic       adc_cs_n,             // pin, low during a conversion
    output logic       adc_sclk,             // pin, idles high
    // machine
    input  wire        limit_low_open,       // pin, 1: pressed or wire cut
    input  wire        limit_high_open,      // pin, 1: pressed or wire cut
    input  wire        drive_fault_n,        // pin, 0: the drive reports a fault
    // drive
    output logic       drive_enable,         // pin, 1: the drive may be on
    output logic       bridge_a,             // pin, alone high for a positive command
    output logic       bridge_b,             // pin, alone high for a negative command
    output logic       step,                 // pin
    output logic       direction,            // pin
    output logic       dac_cs_n,             // pin, low during a word
    output logic       dac_sclk,             // pin, idles low
    output logic       dac_sdi,              // pin, data of the DAC
    output logic       compare_pulse         // pin, high during a compare pulse
);
    localparam int CLK_HZ = 50_000_000;

    wire clk, locked;
    logic [7:0] wait_q = 8'd0;  // cycles since the PLL has locked
    logic       rst = 1'b1;

    (* FREQUENCY_PIN_CLKI = "25", FREQUENCY_PIN_CLKOP = "50" *)
    EHXPLLL #(
        .CLKI_DIV     (1),
        .CLKFB_DIV    (2),
        .CLKOP_DIV    (12),
        .CLKOP_CPHASE (6),
        .CLKOP_ENABLE ("ENABLED"),
        .FEEDBK_PATH  ("CLKOP"),
        .PLLRST_ENA   ("DISABLED"),
        .STDBY_ENABLE ("DISABLED"),
        .DPHASE_SOURCE("DISABLED"),
        .INTFB_WAKE   ("DISABLED")
    ) u_clock (
        .CLKI        (clk_25mhz),
        .CLKFB       (clk),
        .CLKOP       (clk),
        .LOCK        (locked),
        .RST         (1'b0),
        .STDBY       (1'b0),
        .PHASESEL0   (1'b0),
        .PHASESEL1   (1'b0),
        .PHASEDIR    (1'b1),
        .PHASESTEP   (1'b1),
        .PHASELOADREG(1'b1),
        .PLLWAKESYNC (1'b0),
        .ENCLKOP     (1'b0)
    );

    always_ff @(posedge clk or negedge locked) begin
        if (!locked) {rst, wait_q} <= {1'b1, 8'd0};
        else {rst, wait_q} <= {wait_q != '1, wait_q + 8'(wait_q != '1)};
    end

    node #(
        .CLK_HZ  (CLK_HZ),
        .SEGMENTS(255),
        .FIRMWARE("build/firmware/firmware.hex")
    ) u_node (
        .clk,
        .rst,
        .address,
        .estop_open,
        .rs485_rx           (usb_rx & rs485_rx),
        .rs485_tx           (usb_tx),
        .rs485_driver_enable(rs485_driver_enable),
        .encoder_a,
        .encoder_b,
        .encoder_z,
        .probe,
        .adc_sin,
        .adc_cos,
        .adc_cs_n,
        .adc_sclk,
        .limit_low_open,
        .limit_high_open,
        .drive_fault_n,
        .drive_enable,
        .bridge_a,
        .bridge_b,
        .step,
        .direction,
        .dac_cs_n,
        .dac_sclk,
        .dac_sdi,
        .compare_pulse,
        .i2c_scl            (1'b1),
        .i2c_sda            (1'b1),
        .keyboard_clock     (1'b1),
        .keyboard_data      (1'b1),
        .edm_clock          (1'b1),
        .edm_data           (1'b1),
        .peer_rx            (1'b1),
        .sensor_rx          (1'b1),
        .edm_status         (2'b00),
        .flash_miso         (1'b0)
    );

    assign rs485_tx = usb_tx;
    assign led = {
        locked && !rst, rs485_driver_enable, estop_open, limit_high_open, limit_low_open,
        !drive_fault_n, step, drive_enable
    };
endmodule

`default_nettype wire
