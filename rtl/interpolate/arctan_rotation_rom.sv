// SPDX-License-Identifier: Apache-2.0
// arctan_rotation_rom -- the sum of a few of the angles that a vector was turned by; made by tables/arctan_rotation.py, not to be edited.
//
// latency  0 clk, a table               rate  any
// source   digit i turns by atan(2^-i) up to TURNS, by (1 - 2^-2(TURNS + 1)) 2^-i after it, all in 2^-48 turn
// model    entry() of tables/arctan_rotation.py
`default_nettype none

module arctan_rotation_rom #(
    parameter int TURNS = 6,                // digits with an angle of their own, up to 10
    parameter int FIRST = 1,                // the first digit; sums from 1 on are cut off and have half an LSB added, others are rounded
    parameter int COUNT = 4,                // digits in the sum
    parameter int GUARD = 9,                // bits below the LSB of a 16-bit phase
    localparam int B = 16 + GUARD - FIRST
) (
    input  wire         [COUNT-1:0] negative,   // digit FIRST is bit 0
    output logic signed [B-1:0]     sum         // 2^-GUARD LSB of phase
);
    if (TURNS < 1 || TURNS > 10) begin : g_check_turns TURNS_MUST_BE_FROM_1_TO_10 u_error (); end
    if (COUNT < 1 || COUNT > 5) begin : g_check_count COUNT_MUST_BE_FROM_1_TO_5 u_error (); end

    localparam int CUT = 32 - GUARD;

    function [63:0] angle(input int digit);
        if (digit > TURNS) angle = (64'd44798133900177 - (64'd44798133900177 >> (2 * TURNS + 2))) >> digit;
        else case (digit)
            1      : angle = 64'd20770547670515;
            2      : angle = 64'd10974586953444;
            3      : angle = 64'd5570871696862;
            4      : angle = 64'd2796246208089;
            5      : angle = 64'd1399486241028;
            6      : angle = 64'd699913886760;
            7      : angle = 64'd349978300884;
            8      : angle = 64'd174991820497;
            9      : angle = 64'd87496244017;
            10     : angle = 64'd43748163730;
            default: angle = 64'd0;
        endcase
    endfunction

    localparam [63:0] HALF = 64'd1 << (FIRST == 1 ? 31 : CUT - 1);
    localparam [63:0] A0 = angle(FIRST), A1 = angle(FIRST + 1), A2 = angle(FIRST + 2), A3 = angle(FIRST + 3),
                      A4 = angle(FIRST + 4);

    wire [B-1:0] row [0:(1<<COUNT)-1];
    for (genvar n = 0; n < 1 << COUNT; n++) begin : g_row
        assign row[n] = B'((HALF + (n % 2 > 0 ? -A0 : A0) + (COUNT < 2 ? 64'd0 : n / 2 % 2 > 0 ? -A1 : A1)
                            + (COUNT < 3 ? 64'd0 : n / 4 % 2 > 0 ? -A2 : A2)
                            + (COUNT < 4 ? 64'd0 : n / 8 % 2 > 0 ? -A3 : A3)
                            + (COUNT < 5 ? 64'd0 : n / 16 > 0 ? -A4 : A4)) >> CUT);
    end

    assign sum = $signed(row[negative]);
endmodule

`default_nettype wire
