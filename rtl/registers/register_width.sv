// SPDX-License-Identifier: Apache-2.0
// register_width -- report whether a word of the register map is the low word of a register of 64
// bits.
//
// latency  0 cycles: combinational
// rate     one word per cycle
// source   tables/registers.rdl
// model    tb/registers/register_width.py, equal for every word
// made     by tables/registers.py, not to be edited
`default_nettype none

module register_width (
    input  wire  [13:0] address,  // word of the register map
    output logic        low       // level: the word has a high word after it
);
    wire  [7:0] block = address[13:6];
    wire  [5:0] word = address[5:0];
    logic [2:0] kind;
    wire  [8:0] entry = {kind, word};

    always_comb begin
        kind = 3'd7;
        if (block == 8'h00) kind = 3'd0;  // node
        if (block == 8'h01) kind = 3'd1;  // bus
        if (block == 8'h02) kind = 3'd2;  // peripherals
        // axis, of up to 8 axes
        if (block >= 8'h04 && block < 8'h0C) kind = 3'd3;
        // feedback, of up to 8 axes
        if (block >= 8'h0C && block < 8'h14) kind = 3'd4;
        // actuator, of up to 8 axes
        if (block >= 8'h14 && block < 8'h1C) kind = 3'd5;
        case (entry)
            9'h004, 9'h092, 9'h0C6, 9'h0CA, 9'h0CC, 9'h0EC, 9'h0EE, 9'h0F8, 9'h0FA, 9'h0FC, 9'h11C,
                9'h11E, 9'h120, 9'h12E, 9'h130, 9'h146: low = 1'b1;
            default: low = 1'b0;
        endcase
    end
endmodule

`default_nettype wire
