// SPDX-License-Identifier: Apache-2.0
// Behaviour of DPB and DPX9B: two ports that read and write.

    gowin_ram #(
        .UNIT(`UNIT), .WIDTH_A(BIT_WIDTH_0), .WIDTH_B(BIT_WIDTH_1), .MODE_A(WRITE_MODE0),
        .MODE_B(WRITE_MODE1), .PIPELINED(READ_MODE0 | READ_MODE1), .RESET_MODE(RESET_MODE),
        .INIT(`INIT)
    ) u_ram (
        .clka(CLKA), .clkb(CLKB), .cea(CEA && BLKSELA == BLK_SEL_0),
        .ceb(CEB && BLKSELB == BLK_SEL_1), .wea(WREA), .web(WREB), .reseta(RESETA),
        .resetb(RESETB), .ada(ADA), .adb(ADB), .dia(DIA), .dib(DIB), .doa(DOA), .dob(DOB)
    );
