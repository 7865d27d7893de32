// SPDX-License-Identifier: Apache-2.0
// Behaviour of MULT18X18: 18 x 18 bits, each signed or not, without registers and chains, which is all
// that Yosys makes; registers are refused.

    generate
        if (AREG || BREG || OUT_REG || PIPE_REG || ASIGN_REG || BSIGN_REG) MULT18X18_REGISTERS u_error ();
    endgenerate

    wire signed [18:0] a = {ASIGN && A[17], A};
    wire signed [18:0] b = {BSIGN && B[17], B};
    wire signed [37:0] product = a * b;

    assign DOUT = product[35:0];
