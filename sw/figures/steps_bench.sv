// SPDX-License-Identifier: Apache-2.0
// steps_bench -- one axis of step_lines with its step generator, as in node.sv; the top of
// sw/figures/steps_run.cpp. The line to a target begins with the tick after the one of the target.
`default_nettype none

module steps_bench (
    input  wire         clk,
    input  wire         rst,
    input  wire  [17:0] period,         // cycles per tick
    input  wire  [13:0] high_cycles,    // cycles
    input  wire  [13:0] low_cycles,     // cycles
    input  wire  [13:0] setup_cycles,   // cycles
    input  wire  [13:0] hold_cycles,    // cycles
    input  wire         step_low,       // level: step is active low
    input  wire         direction_low,  // level: direction is active low
    input  wire         enable,         // level: follow the lines
    input  wire         tick,           // strobe: target is new, and the next line begins
    input  wire  [47:0] target,         // 2^-16 step
    output logic        step,           // pin
    output logic        direction,      // pin
    output logic [31:0] steps,          // steps made
    output logic        overrun         // level: stopped
);
    wire line_start, line_idle, rate_valid, rate_restart, rate_steep, stopped;
    wire signed [36:0] rate;
    wire pulse, upward;
    wire unused = &{1'b0, pulse, upward};

    step_lines u_lines (
        .clk,
        .rst,
        .period,
        .tick,
        .valid     (tick),
        .axis      (3'd0),
        .target,
        .restart_in(1'b0),
        .stopped,
        .line_start,
        .line_idle,
        .rate_valid,
        .rate,
        .rate_restart,
        .rate_steep
    );
    step_generator u_steps (
        .clk,
        .rst,
        .high_cycles,
        .low_cycles,
        .setup_cycles,
        .hold_cycles,
        .mode(2'd0),
        .step_low,
        .direction_low,
        .enable,
        .line_start,
        .line_idle,
        .rate_valid,
        .rate,
        .rate_restart,
        .rate_steep,
        .stopped,
        .step,
        .direction,
        .pulse,
        .upward,
        .steps,
        .overrun
    );
endmodule

`default_nettype wire
