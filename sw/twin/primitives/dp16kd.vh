// SPDX-License-Identifier: Apache-2.0
// Behaviour of the block RAM of the ECP5, for the ports and parameters of Yosys's black box DP16KD:
// Yosys has no model of it. 512 rows of 36 bits; a port of w bits sees a part of a row, whose first
// address bits are ADx13..5. Data sheet: Lattice FPGA-TN-02204, "ECP5 and ECP5-5G Memory Usage
// Guide". What Yosys never makes is refused.
// A bit that one port writes while the other one reads it is unknown: the data sheet forbids it. Both
// ports have the same clock.

    generate
        if (REGMODE_A != "NOREG" || REGMODE_B != "NOREG") DP16KD_OUTPUT_REGISTERS u_error ();
        if (CSDECODE_A != "0b000" || CSDECODE_B != "0b000") DP16KD_CHIP_SELECT u_error ();
    endgenerate

    reg  [35:0] rows                        [0:511];
    reg  [17:0] doa;
    reg  [17:0] dob;

    wire [13:0] ada = `ADA_BITS;
    wire [13:0] adb = `ADB_BITS;
    wire [35:0] dia = DATA_WIDTH_A == 36 ? {`DIB_BITS, `DIA_BITS} : {18'b0, `DIA_BITS};
    wire [35:0] dib = {18'b0, `DIB_BITS};
    wire        clka = CLKAMUX == "INV" ? ~CLKA : CLKA;
    wire        clkb = CLKBMUX == "INV" ? ~CLKB : CLKB;

    // the first bit of a row that a port of `width` bits sees at an address
    function [5:0] first_bit(input [13:0] address, input integer width);
        first_bit = (width <= 18 && address[4] ? 18 : 0) + (width <= 9 && address[3] ? 9 : 0)
            + (width == 4 ? 4 * address[2] : width == 2 ? 2 * address[2:1] : width == 1 ? address[2:0] : 0);
    endfunction

    // the bits of a row that it sees
    function [35:0] seen(input [13:0] address, input integer width);
        seen = (36'hFFFFFFFFF >> (36 - width)) << first_bit(address, width);
    endfunction

    // those that it writes: ports of 18 and 36 bits have a write enable for each 9 of them
    function [35:0] written(input [13:0] address, input integer width);
        case (width)
            36: written = {{9{address[3]}}, {9{address[2]}}, {9{address[1]}}, {9{address[0]}}};
            18: written = {18'b0, {9{address[1]}}, {9{address[0]}}} << (address[4] ? 18 : 0);
            default: written = seen(address, width);
        endcase
    endfunction

    wire        writes_a = CEA && WEA && !RSTA && !CSA0 && !CSA1 && !CSA2;
    wire        writes_b = CEB && WEB && !RSTB && !CSB0 && !CSB1 && !CSB2;
    wire [35:0] change_a = writes_a ? written(ada, DATA_WIDTH_A) : 36'b0;
    wire [35:0] change_b = writes_b ? written(adb, DATA_WIDTH_B) : 36'b0;
    wire [35:0] new_a = dia << first_bit(ada, DATA_WIDTH_A);
    wire [35:0] new_b = dib << first_bit(adb, DATA_WIDTH_B);
    wire        same_row = ada[13:5] == adb[13:5];

    // what a port reads; bits that the other one writes at the same clock edge are unknown
    function [35:0] read(
        input [35:0] row, input [35:0] change, input [13:0] address, input integer width
    );
        read = ((row ^ (change & 36'hxxxxxxxxx)) & seen(address, width)) >> first_bit(address, width);
    endfunction

    wire [35:0] clash_a = same_row && DATA_WIDTH_B != 36 ? change_b : 36'b0;
    wire [35:0] clash_b = same_row ? change_a : 36'b0;
    wire [35:0] old_a = read(rows[ada[13:5]], clash_a, ada, DATA_WIDTH_A);
    wire [35:0] old_b = read(rows[adb[13:5]], clash_b, adb, DATA_WIDTH_B);
    wire [35:0] now_a = WRITEMODE_A == "WRITETHROUGH" && writes_a
        ? ((rows[ada[13:5]] & ~change_a) | (new_a & change_a)) >> first_bit(ada, DATA_WIDTH_A) : old_a;
    wire [35:0] now_b = WRITEMODE_B == "WRITETHROUGH" && writes_b
        ? ((rows[adb[13:5]] & ~change_b) | (new_b & change_b)) >> first_bit(adb, DATA_WIDTH_B) : old_b;

    wire        arsta = RESETMODE == "ASYNC" && RSTA;
    wire        arstb = RESETMODE == "ASYNC" && RSTB;

    integer a, b, n;
    initial begin
        `ROWS
        doa = 18'b0;
        dob = 18'b0;
    end

    always @(posedge clka) begin
        for (a = 0; a < 36; a = a + 1) if (change_a[a]) rows[ada[13:5]][a] <= new_a[a];
    end
    always @(posedge clkb) begin
        for (b = 0; b < 36; b = b + 1) if (change_b[b]) rows[adb[13:5]][b] <= new_b[b];
    end

    // a port of 36 bits reads through both outputs
    generate
        if (DATA_WIDTH_B == 36) begin
            always @(posedge clkb, posedge arstb) begin
                if (RSTB) {dob, doa} <= 36'b0;
                else if (CEB) {dob, doa} <= old_b;
            end
        end else begin
            always @(posedge clka, posedge arsta) begin
                if (RSTA) doa <= 18'b0;
                else if (CEA && (!writes_a || WRITEMODE_A != "NORMAL")) doa <= now_a[17:0];
            end
            always @(posedge clkb, posedge arstb) begin
                if (RSTB) dob <= 18'b0;
                else if (CEB && (!writes_b || WRITEMODE_B != "NORMAL")) dob <= now_b[17:0];
            end
        end
    endgenerate

    assign `DOA_BITS = doa;
    assign `DOB_BITS = dob;
