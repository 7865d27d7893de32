// SPDX-License-Identifier: Apache-2.0
// gowin_ram -- behaviour of the block RAMs of Gowin parts, of which Yosys has black boxes only: 2048
// groups of UNIT bits (8, or 9 with parity) in rows of four. A port of w bits sees a part of a row,
// whose number is address[13:5]. Ports of 2 UNIT and 4 UNIT bits have a write enable for each group in
// their last address bits. Guide: Gowin UG285, "BSRAM & SSRAM User Guide". What Yosys never makes, as
// registers behind the outputs, is refused. A port that reads what the other one writes at the same
// edge reads the old bits.

module gowin_ram #(
    parameter integer                UNIT       = 8,
    parameter integer                WIDTH_A    = 8,
    parameter integer                WIDTH_B    = 8,
    parameter integer                MODE_A     = 0,       // of a write: 0: the output stays, 1: it is the new word, 2: the old one
    parameter integer                MODE_B     = 0,
    parameter integer                PIPELINED  = 0,
    parameter                        RESET_MODE = "SYNC",
    parameter         [UNIT*2048-1:0] INIT      = 0
) (
    input             clka,
    input             clkb,
    input             cea,
    input             ceb,
    input             wea,
    input             web,
    input             reseta,
    input             resetb,
    input      [13:0] ada,
    input      [13:0] adb,
    input      [35:0] dia,
    input      [35:0] dib,
    output reg [35:0] doa,
    output reg [35:0] dob
);
    localparam integer ROW = 4 * UNIT;

    generate
        if (PIPELINED != 0) GOWIN_RAM_OUTPUT_REGISTERS u_error ();
    endgenerate

    reg [ROW-1:0] rows[0:511];

    // the first bit of a row that a port of `width` bits sees at an address
    function [5:0] first_bit(input [13:0] address, input integer width);
        first_bit = (width <= 2 * UNIT && address[4] ? 2 * UNIT : 0)
            + (width <= UNIT && address[3] ? UNIT : 0)
            + (width == 4 ? 4 * address[2] : width == 2 ? 2 * address[2:1] : width == 1 ? address[2:0] : 0);
    endfunction

    // the bits of a row that it writes
    function [35:0] written(input [13:0] address, input integer width);
        integer n;
        begin
            written = 36'b0;
            for (n = 0; n < 36; n = n + 1)
                if (n < width && (width < 2 * UNIT || address[n/UNIT])) written[n] = 1'b1;
            written = written << first_bit(address, width);
        end
    endfunction

    // what it reads of a row
    function [35:0] read(input [35:0] row, input [13:0] address, input integer width);
        read = (row >> first_bit(address, width)) & (36'hFFFFFFFFF >> (36 - width));
    endfunction

    wire [35:0] change_a = cea && wea ? written(ada, WIDTH_A) : 36'b0;
    wire [35:0] change_b = ceb && web ? written(adb, WIDTH_B) : 36'b0;
    wire [35:0] new_a = dia << first_bit(ada, WIDTH_A);
    wire [35:0] new_b = dib << first_bit(adb, WIDTH_B);
    wire [35:0] row_a = {{36 - ROW{1'b0}}, rows[ada[13:5]]};
    wire [35:0] row_b = {{36 - ROW{1'b0}}, rows[adb[13:5]]};
    wire [35:0] now_a = MODE_A == 1 ? (row_a & ~change_a) | (new_a & change_a) : row_a;
    wire [35:0] now_b = MODE_B == 1 ? (row_b & ~change_b) | (new_b & change_b) : row_b;
    wire        areseta = RESET_MODE == "ASYNC" && reseta;
    wire        aresetb = RESET_MODE == "ASYNC" && resetb;

    integer a, b, n;
    initial begin
        for (n = 0; n < 512; n = n + 1) rows[n] = INIT[ROW*n+:ROW];
        doa = 36'b0;
        dob = 36'b0;
    end

    always @(posedge clka) begin
        for (a = 0; a < ROW; a = a + 1) if (change_a[a]) rows[ada[13:5]][a] <= new_a[a];
    end
    always @(posedge clkb) begin
        for (b = 0; b < ROW; b = b + 1) if (change_b[b]) rows[adb[13:5]][b] <= new_b[b];
    end
    always @(posedge clka, posedge areseta) begin
        if (reseta) doa <= 36'b0;
        else if (cea && (!wea || MODE_A != 0)) doa <= read(now_a, ada, WIDTH_A);
    end
    always @(posedge clkb, posedge aresetb) begin
        if (resetb) dob <= 36'b0;
        else if (ceb && (!web || MODE_B != 0)) dob <= read(now_b, adb, WIDTH_B);
    end
endmodule
