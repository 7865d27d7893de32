// SPDX-License-Identifier: Apache-2.0
// half_duplex -- join a transmitter and a receiver to one pair of wires: the receiver does not hear
// what the node sends.
//
// latency  0 cycles, combinational
// rate     one level per cycle
// model    tb/serial/half_duplex.py, equal for all inputs
// proved   The receiver sees an idle bus while the driver is on, and the pin is idle while it is
//          off.
`default_nettype none

module half_duplex (
    input  wire  driver_enable,  // level: the bus driver is on
    input  wire  tx_level,       // level of the transmitter, idles high
    input  wire  rx_pin,         // pin, idles high
    output logic tx_pin,         // pin, idles high
    output logic rx_level        // level for the receiver, asynchronous, idles high
);
    assign tx_pin   = tx_level || !driver_enable;
    assign rx_level = rx_pin || driver_enable;

`ifdef FORMAL
    always_comb begin
        if (driver_enable) assert (rx_level && tx_pin == tx_level);
        if (!driver_enable) assert (tx_pin && rx_level == rx_pin);
        cover (!tx_pin);
        cover (!rx_level);
    end
`endif
endmodule

`default_nettype wire
