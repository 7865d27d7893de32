// SPDX-License-Identifier: Apache-2.0
// Behaviour of SP and SPX9: one port that reads or writes.

    gowin_ram #(
        .UNIT(`UNIT), .WIDTH_A(BIT_WIDTH), .WIDTH_B(BIT_WIDTH), .MODE_A(WRITE_MODE),
        .PIPELINED(READ_MODE), .RESET_MODE(RESET_MODE), .INIT(`INIT)
    ) u_ram (
        .clka(CLK), .clkb(1'b0), .cea(CE && BLKSEL == BLK_SEL), .ceb(1'b0), .wea(WRE), .web(1'b0),
        .reseta(RESET), .resetb(1'b0), .ada(AD), .adb(14'b0), .dia(DI), .dib(36'b0), .doa(DO),
        .dob()
    );
