// SPDX-License-Identifier: Apache-2.0
// Behaviour of SDPB and SDPX9B: port A writes, port B reads.

    gowin_ram #(
        .UNIT(`UNIT), .WIDTH_A(BIT_WIDTH_0), .WIDTH_B(BIT_WIDTH_1), .PIPELINED(READ_MODE),
        .RESET_MODE(RESET_MODE), .INIT(`INIT)
    ) u_ram (
        .clka(CLKA), .clkb(CLKB), .cea(CEA && BLKSELA == BLK_SEL_0),
        .ceb(CEB && BLKSELB == BLK_SEL_1), .wea(1'b1), .web(1'b0), .reseta(RESETA),
        .resetb(RESETB), .ada(ADA), .adb(ADB), .dia(DI), .dib(36'b0), .doa(), .dob(DO)
    );
