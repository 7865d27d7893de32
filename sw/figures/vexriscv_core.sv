// SPDX-License-Identifier: Apache-2.0
// vexriscv_core -- VexRiscv in place of soft_core, for the comparison of soft cores: its memory
// answers each access at once, better than a block memory could.
`default_nettype none

module vexriscv_core #(
    parameter int MEMORY_BYTES = 32768,  // bytes
    parameter     FIRMWARE     = ""      // name of a file of 32-bit words for $readmemh
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         ready,    // level: the registers take an access
    output logic        select,   // strobe: one access to the registers
    output logic        write,    // level: with select, wdata is to be written
    output logic [15:0] address,  // byte address of a register
    output logic [31:0] wdata,    // word to be written
    input  wire  [31:0] rdata,    // word read, 1 cycle after select
    output logic        trap      // level: an access to no valid address
);
    localparam int A = $clog2(MEMORY_BYTES);

    logic [31:0] memory[0:(1<<(A-2))-1];
    initial $readmemh(FIRMWARE, memory);

    wire fetch, fetch_strobe, access, access_strobe, store;
    // verilator lint_off UNUSEDSIGNAL
    wire  [29:0] fetch_word;  // of an instruction outside the memory, any word is read
    // verilator lint_on UNUSEDSIGNAL
    wire  [29:0] access_word;
    wire  [31:0] access_wdata;
    wire  [ 3:0] access_bytes;
    logic        answered;

    wire         in_registers = access_word[29:14] == 16'h8000;

    assign select  = access && access_strobe && in_registers && ready && !answered;
    assign write   = store;
    assign address = {access_word[13:0], 2'b00};
    assign wdata   = access_wdata;

    always_ff @(posedge clk) begin
        answered <= select && !rst;
        if (access && access_strobe && !in_registers && access_word >= 30'(MEMORY_BYTES / 4)) begin
            trap <= 1'b1;
        end
        for (int n = 0; n < 4; n++) begin
            if (access && access_strobe && store && !in_registers && access_bytes[n]) begin
                memory[access_word[A-3:0]][8*n+:8] <= access_wdata[8*n+:8];
            end
        end
        if (rst) trap <= 1'b0;
    end

    // what the simple memory does not need:
    // verilator lint_off PINCONNECTEMPTY
    VexRiscv u_core (
        .clk,
        .reset                 (rst),
        .externalResetVector   (32'd0),
        .timerInterrupt        (1'b0),
        .softwareInterrupt     (1'b0),
        .externalInterruptArray(32'd0),
        .iBusWishbone_CYC      (fetch),
        .iBusWishbone_STB      (fetch_strobe),
        .iBusWishbone_ACK      (fetch && fetch_strobe),
        .iBusWishbone_WE       (),
        .iBusWishbone_ADR      (fetch_word),
        .iBusWishbone_DAT_MISO (memory[fetch_word[A-3:0]]),
        .iBusWishbone_DAT_MOSI (),
        .iBusWishbone_SEL      (),
        .iBusWishbone_ERR      (1'b0),
        .iBusWishbone_CTI      (),
        .iBusWishbone_BTE      (),
        .dBusWishbone_CYC      (access),
        .dBusWishbone_STB      (access_strobe),
        .dBusWishbone_ACK      (access && access_strobe && (!in_registers || answered)),
        .dBusWishbone_WE       (store),
        .dBusWishbone_ADR      (access_word),
        .dBusWishbone_DAT_MISO (in_registers ? rdata : memory[access_word[A-3:0]]),
        .dBusWishbone_DAT_MOSI (access_wdata),
        .dBusWishbone_SEL      (access_bytes),
        .dBusWishbone_ERR      (1'b0),
        .dBusWishbone_CTI      (),
        .dBusWishbone_BTE      ()
    );
    // verilator lint_on PINCONNECTEMPTY
endmodule

`default_nettype wire
