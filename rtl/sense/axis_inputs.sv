// SPDX-License-Identifier: Apache-2.0
// axis_inputs -- bring the input pins of an axis into the clock domain, and filter its limit
// switches.
//
// latency  2 cycles from a pin to its level; as in switch_filter, with 8 periods of limit_tick,
//          from there to limit_low and limit_high
// rate     one change of each pin per cycle; a limit switch changes at most every 8 periods of
//          limit_tick
// behaviour  limit_low_open and limit_high_open are high when the switch is pressed or its wire is
//          cut.
// model    tb/sense/axis_inputs.py, equal in every bit of every cycle
`default_nettype none

module axis_inputs (
    input  wire        clk,
    input  wire        rst,
    input  wire        limit_tick,       // strobe: an eighth of the time of a limit switch
    input  wire        encoder_a,        // pin of the scale
    input  wire        encoder_b,        // pin of the scale
    input  wire        encoder_z,        // pin of the scale: index
    input  wire  [1:0] probe,            // pins of the touch probes
    input  wire        limit_low_open,   // pin, 1: pressed or wire cut
    input  wire        limit_high_open,  // pin, 1: pressed or wire cut
    input  wire        drive_fault_n,    // pin, 0: the drive reports a fault
    output logic       a,                // level of encoder_a
    output logic       b,                // level of encoder_b
    output logic       z,                // level of encoder_z
    output logic [1:0] probe_level,      // levels of probe
    output logic       limit_low,        // level: pressed, filtered
    output logic       limit_high,       // level: pressed, filtered
    output logic       drive_fault       // level: the drive reports a fault
);
    wire low_level, high_level, fault_level_n;

    synchroniser #(
        .W(8)
    ) u_pins (
        .clk,
        .rst,
        .d({
            probe, drive_fault_n, limit_high_open, limit_low_open, encoder_z, encoder_b, encoder_a
        }),
        .q({probe_level, fault_level_n, high_level, low_level, z, b, a})
    );
    switch_filter #(
        .W(2)
    ) u_limits (
        .clk,
        .rst,
        .sample  (limit_tick),
        .level   ({high_level, low_level}),
        .filtered({limit_high, limit_low})
    );

    assign drive_fault = !fault_level_n;
endmodule

`default_nettype wire
