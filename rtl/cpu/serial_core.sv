// SPDX-License-Identifier: Apache-2.0
// serial_core -- bit-serial RISC-V processor (rv32i) with its memory, the smallest master of the
// register bus.
//
// latency   1 wait cycle for an access to the memory, 3 wait cycles for an access to a register,
//           and as many more as ready is low.
// rate      An instruction takes 36 to 38 cycles, one with an access to memory, a jump, a branch, a
//           comparison or a shift 70 to 104.
// behaviour The memory is at 0000_0000 (start address 0, stack from its end), the registers are at
//           8000_0000 (64 KiB, whole words only), with HAS_UPDATE the port of the flash at
//           8001_0000, whole words as well. Any other access stops the core: trap is high until the
//           next start. After rst flash_loader copies PROGRAM_BYTES from a serial flash into the
//           memory, then the core starts at address 0. The memory has one port for reading and
//           writing and no contents at power-up, so it may be a single-port RAM (SB_SPRAM256KA).
//           An illegal instruction is not detected, and a misaligned access never ends.
//           The port of the flash has two words.
//           At 8001_0000, a write sends bits 7..0, and bit 8 ends the command; a read returns the
//           byte of the flash in bits 7..0, and the image that was copied in bits 9..8.
//           At 8001_0004, a write with bit 2 copies image 0 to 3 (bits 1..0) and starts the core
//           again, and bit 3 puts it on trial; a write without bit 3 ends the trial. A read returns
//           FLASH_START. A trial that is not ended within 2^TRIAL_BITS cycles copies image 0 and
//           starts the core again.
// source    SERV, from the package pythondata_cpu_serv
// model     tb/cpu/serial_core.py, the results of the program tb/cpu/serial_test.c
`default_nettype none

module serial_core #(
    parameter int MEMORY_BYTES = 65536,  // bytes, a multiple of 1024
    parameter int PROGRAM_BYTES = 32768,  // bytes that are copied, a power of two
    parameter int FLASH_START = 131072,  // byte address of the program in the flash
    parameter int HAS_UPDATE = 0,  // 1: build the port of the flash, and the choice of an image
    parameter int TRIAL_BITS = 28  // a trial takes 2^TRIAL_BITS cycles at most
) (
    input  wire         clk,
    input  wire         rst,
    output logic        request,     // level: an access waits for ready
    input  wire         ready,       // level: the registers take an access in the next cycle
    output logic        select,      // strobe: one access to the registers
    output logic        write,       // level: with select, wdata is to be written
    output logic [15:0] address,     // byte address of a register, from 1 cycle before select on
    output logic [31:0] wdata,       // word to be written, from 1 cycle before select on
    input  wire  [31:0] rdata,       // word read, 2 cycles after select
    output logic        trap,        // level: the core has stopped
    // flash
    output logic        flash_cs_n,  // pin, low during a command
    output logic        flash_sclk,  // pin, idles low
    output logic        flash_mosi,  // pin, data to the flash
    input  wire         flash_miso   // pin, data of the flash, synchronous to flash_sclk
);
    localparam int A = $clog2(MEMORY_BYTES);
    localparam int P = $clog2(PROGRAM_BYTES);

    wire fetch, load_or_store, storing, loads, loaded;
    wire [31:0] fetch_address, data_address, memory_rdata, loaded_word;
    wire [  3:0] bytes;
    wire [P-3:0] loaded_at;
    // memory or port have answered; the registers will answer in the next cycle, have answered
    logic fetched, awaited, answered;
    logic restart, trial;
    logic [           1:0] slot;
    logic [TRIAL_BITS-1:0] trial_time;
    wire  [           7:0] answer;

    wire                   valid = fetch || load_or_store;
    wire  [          31:0] access = fetch ? fetch_address : data_address;
    wire                   in_memory = access < 32'(MEMORY_BYTES);
    wire                   whole = !fetch && (&bytes || !storing);  // a word, not a part of one
    wire                   in_registers = whole && data_address[31:16] == 16'h8000;
    wire                   in_port = HAS_UPDATE != 0 && whole && data_address[31:16] == 16'h8001;
    wire                   done = fetched || answered;
    wire                   puts = load_or_store && storing && in_memory && !fetched;
    wire                   orders = load_or_store && storing && in_port && !fetched;
    wire                   sends = orders && !data_address[2];
    wire                   controls = orders && data_address[2];
    wire                   overdue = &trial_time;
    wire                   reset = rst || HAS_UPDATE != 0 && restart;
    wire  [          31:0] port_rdata = data_address[2] ? 32'(FLASH_START) : {22'd0, slot, answer};
    wire  [         A-3:0] at = loaded ? access[A-1:2] : (A - 2)'(loaded_at);

    wire                   free = !(select || awaited || answered);

    assign request = valid && in_registers && free && !trap;
    assign write   = storing;
    assign address = data_address[15:0];

    always_ff @(posedge clk) begin
        fetched  <= valid && (in_memory || in_port) && !fetched && !trap;
        select   <= request && ready;
        awaited  <= select;
        answered <= awaited;
        if (valid && !in_memory && !in_registers && !in_port) trap <= 1'b1;
        if (reset) begin
            fetched  <= 1'b0;
            select   <= 1'b0;
            awaited  <= 1'b0;
            answered <= 1'b0;
            trap     <= 1'b0;
        end
    end

    // which image runs, and whether it is on trial
    always_ff @(posedge clk) begin
        restart    <= overdue || controls && wdata[2];
        trial_time <= trial ? trial_time + 1'b1 : '0;
        if (controls) trial <= wdata[3];
        if (controls && wdata[2]) slot <= wdata[1:0];
        if (overdue) {trial, slot, trial_time} <= '0;
        if (rst) begin
            restart    <= 1'b0;
            trial      <= 1'b0;
            slot       <= '0;
            trial_time <= '0;
        end
    end

    flash_loader #(
        .WORDS   (PROGRAM_BYTES / 4),
        .START   (FLASH_START),
        .HAS_PORT(HAS_UPDATE)
    ) u_loader (
        .clk,
        .rst    (reset),
        .slot   (HAS_UPDATE != 0 ? slot : 2'd0),
        // flash
        .cs_n   (flash_cs_n),
        .sclk   (flash_sclk),
        .mosi   (flash_mosi),
        .miso   (flash_miso),
        // memory
        .store  (loads),
        .address(loaded_at),
        .word   (loaded_word),
        .done   (loaded),
        // port
        .send   (sends),
        .data   (wdata[7:0]),
        .ends   (wdata[8]),
        .answer
    );
    node_memory #(
        .BYTES(MEMORY_BYTES)
    ) u_memory (
        .clk,
        .write        (loaded ? bytes & {4{puts}} : {4{loads}}),
        .write_address(at),
        .wdata        (loaded ? wdata : loaded_word),
        .read_address (at),
        .rdata        (memory_rdata)
    );
    serv_rf_top #(
        .RESET_PC      (32'd0),
        .RESET_STRATEGY("MINI"),
        .WITH_CSR      (0),
        .RF_WIDTH      (2)
    ) u_core (
        .clk,
        .i_rst       (reset || !loaded),
        .i_timer_irq (1'b0),
        .o_ibus_adr  (fetch_address),
        .o_ibus_cyc  (fetch),
        .i_ibus_rdt  (memory_rdata),
        .i_ibus_ack  (fetched && fetch),
        .o_dbus_adr  (data_address),
        .o_dbus_dat  (wdata),
        .o_dbus_sel  (bytes),
        .o_dbus_we   (storing),
        .o_dbus_cyc  (load_or_store),
        .i_dbus_rdt  (answered ? rdata : in_port ? port_rdata : memory_rdata),
        .i_dbus_ack  (done && load_or_store),
        // no extension:
        // verilator lint_off PINCONNECTEMPTY
        .o_ext_rs1   (),
        .o_ext_rs2   (),
        .o_ext_funct3(),
        .o_mdu_valid (),
        // verilator lint_on PINCONNECTEMPTY
        .i_ext_rd    (32'd0),
        .i_ext_ready (1'b0)
    );
endmodule

`default_nettype wire
