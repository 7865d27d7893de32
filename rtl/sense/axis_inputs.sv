// SPDX-License-Identifier: Apache-2.0
// axis_inputs -- brings the input pins of an axis into the clock domain, and filters its limit
// switches.
//
// latency  2 cycles from a pin to its level; LIMIT_CYCLES + 2 cycles from a limit switch to
//          limit_low and limit_high
// rate     one change of each pin per cycle; a limit switch changes at most every LIMIT_CYCLES
// behaviour  A limit switch must keep its level for 0.1 ms. limit_low_open and limit_high_open are
//          high when the switch is pressed or its wire is cut.
// model    tb/sense/axis_inputs.py, equal in every bit of every cycle
`default_nettype none

module axis_inputs #(
    parameter int CLK_HZ       = 4_000_000,       // Hz, clk frequency
    parameter int LIMIT_CYCLES = CLK_HZ / 10_000  // cycles that a limit switch must be stable
) (
    input  wire        clk,
    input  wire        rst,
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
    if (LIMIT_CYCLES < 1 || LIMIT_CYCLES > 65535) begin : g_check
        LIMIT_CYCLES_MUST_BE_FROM_1_TO_65535 u_error ();
    end

    wire low_level, high_level, fault_level_n, low_rejected, high_rejected;

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
    deglitcher u_low (
        .clk,
        .rst,
        .stable_cycles(16'(LIMIT_CYCLES)),
        .level        (low_level),
        .filtered     (limit_low),
        .rejected     (low_rejected)
    );
    deglitcher u_high (
        .clk,
        .rst,
        .stable_cycles(16'(LIMIT_CYCLES)),
        .level        (high_level),
        .filtered     (limit_high),
        .rejected     (high_rejected)
    );

    assign drive_fault = !fault_level_n;

    wire unused = &{1'b0, low_rejected, high_rejected};
endmodule

`default_nettype wire
