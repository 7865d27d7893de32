// SPDX-License-Identifier: Apache-2.0
// position_counter -- one block in a design of your own: an incremental encoder counted to 32 bits.
//
// The pins are synchronised, then decoded. count is up to date 3 cycles after an edge at a pin: 2
// in the synchroniser and 1 in the decoder. Both edges of both channels count.
`default_nettype none

module position_counter (
    input  wire                clk,
    input  wire                rst,
    input  wire                encoder_a,  // pin
    input  wire                encoder_b,  // pin
    input  wire                clear,      // strobe: count becomes 0
    output logic signed [31:0] count,      // 1/4 period, wraps
    output logic               lost        // level: an illegal edge made count wrong; until clear
);
    wire a, b, ready, stepping, direction, illegal;
    wire signed [1:0] step;

    synchroniser #(
        .W(2)
    ) u_pins (
        .clk,
        .rst,
        .d({encoder_b, encoder_a}),
        .q({b, a})
    );
    quadrature_decoder u_decoder (
        .clk,
        .rst,
        .mode(2'd0),
        .clear,
        .a,
        .b,
        .ready,
        .stepping,
        .count,
        .step,
        .direction,
        .illegal
    );

    always_ff @(posedge clk) lost <= (lost || illegal) && !clear && !rst;

    wire unused = &{1'b0, ready, stepping, direction, step};
endmodule

`default_nettype wire
