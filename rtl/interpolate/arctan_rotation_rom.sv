// SPDX-License-Identifier: Apache-2.0
// arctan_rotation_rom -- the sum of the angles of a few digits of a rotation; made by
// tables/arctan_rotation.py, not to be edited.
//
// latency  0 cycles from negative to sum: a table without a register
// rate     one sum per cycle
// source   digit i rotates by atan(2^-i) up to TURNS, by (1 - 2^-2(TURNS + 1)) 2^-i after it
// model    entry() of tables/arctan_rotation.py
//
// The angles are in 2^-48 turn. A sum from digit 1 on is truncated and includes half an LSB for
// rounding the phase; the others are rounded.
`default_nettype none

module arctan_rotation_rom #(
    parameter  int TURNS = 6,                  // digits that rotate by an arctangent, up to 10
    parameter  int FIRST = 1,                  // the first digit of the sum
    parameter  int COUNT = 4,                  // digits in the sum, 1 to 5
    parameter  int GUARD = 9,                  // bits below the LSB of a 16-bit phase
    localparam int B     = 16 + GUARD - FIRST  // bits of the sum
) (
    input  wire         [COUNT-1:0] negative,  // one bit per digit, digit FIRST is bit 0
    output logic signed [    B-1:0] sum        // 2^-GUARD LSB of phase
);
    if (TURNS < 1 || TURNS > 10) begin : g_check_turns
        TURNS_MUST_BE_FROM_1_TO_10 u_error ();
    end
    if (COUNT < 1 || COUNT > 5) begin : g_check_count
        COUNT_MUST_BE_FROM_1_TO_5 u_error ();
    end

    localparam int CUT = 32 - GUARD;
    localparam [63:0] RADIAN = 64'd44798133900177;

    function [63:0] angle(input int digit);
        if (digit > TURNS) angle = (RADIAN - (RADIAN >> (2 * TURNS + 2))) >> digit;
        else
            case (digit)
                1:       angle = 64'd20770547670515;
                2:       angle = 64'd10974586953444;
                3:       angle = 64'd5570871696862;
                4:       angle = 64'd2796246208089;
                5:       angle = 64'd1399486241028;
                6:       angle = 64'd699913886760;
                7:       angle = 64'd349978300884;
                8:       angle = 64'd174991820497;
                9:       angle = 64'd87496244017;
                10:      angle = 64'd43748163730;
                default: angle = 64'd0;
            endcase
    endfunction

    localparam [63:0] HALF = 64'd1 << (FIRST == 1 ? 31 : CUT - 1);
    localparam [63:0] A0 = angle(FIRST);
    localparam [63:0] A1 = COUNT > 1 ? angle(FIRST + 1) : 64'd0;
    localparam [63:0] A2 = COUNT > 2 ? angle(FIRST + 2) : 64'd0;
    localparam [63:0] A3 = COUNT > 3 ? angle(FIRST + 3) : 64'd0;
    localparam [63:0] A4 = COUNT > 4 ? angle(FIRST + 4) : 64'd0;

    wire [B-1:0] row[0:(1<<COUNT)-1];
    for (genvar n = 0; n < 1 << COUNT; n++) begin : g_row
        localparam [63:0] S0 = n % 2 > 0 ? HALF - A0 : HALF + A0;
        localparam [63:0] S1 = n / 2 % 2 > 0 ? S0 - A1 : S0 + A1;
        localparam [63:0] S2 = n / 4 % 2 > 0 ? S1 - A2 : S1 + A2;
        localparam [63:0] S3 = n / 8 % 2 > 0 ? S2 - A3 : S2 + A3;
        localparam [63:0] S4 = n / 16 > 0 ? S3 - A4 : S3 + A4;
        assign row[n] = B'(S4 >> CUT);
    end

    assign sum = $signed(row[negative]);
endmodule

`default_nettype wire
