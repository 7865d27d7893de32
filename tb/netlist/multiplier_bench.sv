// SPDX-License-Identifier: Apache-2.0
// multiplier_bench -- products of signed and of unsigned numbers, as the blocks write them.
`default_nettype none

module multiplier_bench (
    input  wire signed [17:0] a,
    input  wire signed [17:0] b,
    output wire signed [35:0] signed_product,
    output wire        [35:0] product          // of the same bits, unsigned
);
    assign signed_product = a * b;
    assign product = 36'($unsigned(a)) * 36'($unsigned(b));
endmodule

`default_nettype wire
