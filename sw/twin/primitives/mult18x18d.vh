// SPDX-License-Identifier: Apache-2.0
// Behaviour of the multiplier of the ECP5, for the ports and parameters of Yosys's black box
// MULT18X18D: Yosys has no model of it. 18 x 18 bits, each signed or not, without registers, which
// is all that Yosys makes; the rest is refused.

    generate
        if (REG_INPUTA_CLK != "NONE" || REG_INPUTB_CLK != "NONE") MULT18X18D_INPUT_REGISTERS u_error ();
        if (REG_PIPELINE_CLK != "NONE") MULT18X18D_PIPELINE_REGISTER u_error ();
        if (REG_OUTPUT_CLK != "NONE") MULT18X18D_OUTPUT_REGISTER u_error ();
        if (MULT_BYPASS != "DISABLED") MULT18X18D_BYPASS u_error ();
    endgenerate

    wire signed [18:0] a = {SIGNEDA && A17, `A_BITS};
    wire signed [18:0] b = {SIGNEDB && B17, `B_BITS};
    wire signed [37:0] product = a * b;

    assign `P_BITS = product[35:0];
