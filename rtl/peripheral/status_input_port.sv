// SPDX-License-Identifier: Apache-2.0
// status_input_port -- read two slow status inputs of another machine; if it is not built, it
// reports nothing.
//
// latency  see status_inputs
// rate     see status_inputs
// source   S4: the EDM machine reports by contacts whether it cuts and whether it has a fault
// model    the models of its blocks; tested together by tb/peripheral/test_peripherals.py
`default_nettype none

module status_input_port #(
    parameter int CLK_HZ = 50_000_000,  // Hz, clk frequency
    parameter int BUILT  = 1            // 0: no logic, all outputs are 0
) (
    input  wire         clk,
    input  wire         rst,
    input  wire  [15:0] time_ms,  // ms that an input must be stable
    input  wire  [ 1:0] pins,     // asynchronous
    output logic [ 1:0] level,    // levels of the inputs, filtered
    output logic [ 1:0] rose,     // strobes: an input went high
    output logic [ 1:0] fell      // strobes: an input went low
);
    if (BUILT == 0) begin : g_idle
        assign {level, rose, fell} = '0;
        wire unused = &{1'b0, clk, rst, time_ms, pins};
    end else begin : g_built
        status_inputs #(
            .CLK_HZ(CLK_HZ),
            .W     (2)
        ) u_inputs (
            .clk,
            .rst,
            .time_ms,
            .inputs(pins),
            .level,
            .rose,
            .fell
        );
    end
endmodule

`default_nettype wire
