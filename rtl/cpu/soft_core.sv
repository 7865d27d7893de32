// SPDX-License-Identifier: Apache-2.0
// soft_core -- RISC-V processor (rv32imc) with its memory, the master of the register bus.
//
// latency   0 wait cycles for a write to memory, 1 wait cycle for a word read from memory; 0 wait
//           cycles for an instruction that the memory has read ahead, 1 wait cycle for the second
//           half of one that it has not, 2 for any other one; 3 wait cycles for an access to a
//           register, and as many more as ready is low. In the flash: 2 wait cycles for a word of a
//           line that is kept, 580 for another one (code_cache).
// rate      An operation takes 3 cycles, a write to memory 5, a word read from memory or a product
//           6, a register access 8, a quotient 38.
// behaviour The memory is at 0000_0000 (start address 0, stack from its end), the registers are at
//           8000_0000 (64 KiB, whole words only). With CODE_BYTES, what is in the flash from
//           CODE_START on is at 2000_0000, to be executed and read. Any other access, a misaligned
//           access and an illegal instruction stop the core: trap is high until rst, which starts
//           the core at address 0 and leaves the memory as it is.
//           While an access is under way and does not use the memory, the memory reads the word
//           after the last instruction. Between two accesses it reads where the core's operand
//           points, which is the address of the next word of data if the core begins to read one.
//           So every address of the memory comes from a register: the look-ahead address of the
//           core would reach the block RAMs late.
// source    PicoRV32, from the package pythondata_cpu_picorv32; the address of a word of data is
//           its operand pcpi_rs1 one cycle early
// model     tb/cpu/soft_core.py, the results of the program tb/cpu/soft_test.c
// proved    Whatever the core does: an access to no valid address raises trap in the next cycle,
//           and trap stays high until rst. select is a strobe, only for an access to a whole word
//           of the registers, only one cycle after ready was high, never for an instruction, and
//           never in two cycles that follow each other; address and wdata are there one cycle
//           before it. Each word that the core takes from the memory was read at the address of the
//           access, after the last write to that address; each word from the flash is the one that
//           code_cache has found.
// proof     depth 12, MEMORY_BYTES = 1024, CODE_BYTES = 8192
`default_nettype none

module soft_core #(
    parameter int MEMORY_BYTES = 32768,  // bytes, a multiple of 1024
    parameter     FIRMWARE     = "",     // name of a file, see node_memory
    parameter int CODE_BYTES   = 0,      // bytes of program in the flash, see code_cache; 0: none
    parameter int CODE_START   = 131072  // byte address of the first of them in the flash
) (
    input  wire         clk,
    input  wire         rst,
    output logic        request,     // level: an access waits for ready
    input  wire         ready,       // level: the registers take an access in the next cycle
    output logic        select,      // strobe: one access to the registers
    output logic        write,       // level: with select, wdata is to be written
    // from 1 cycle before select on; 0 while the core accesses no register
    output logic [15:0] address,     // byte address of a register
    output logic [31:0] wdata,       // word to be written
    input  wire  [31:0] rdata,       // word read, 2 cycles after select
    output logic        trap,        // level: the core has stopped
    // flash
    output logic        flash_cs_n,  // pin, low during a command
    output logic        flash_sclk,  // pin, idles low
    output logic        flash_mosi,  // pin, data to the flash
    input  wire         flash_miso   // pin, data of the flash, synchronous to flash_sclk
);
    localparam int A = $clog2(MEMORY_BYTES);

    wire core_trap, mem_valid, mem_instr, mem_la_read, mem_la_write;
    wire [31:0] mem_addr, mem_wdata, memory_rdata;
    // verilator lint_off UNUSEDSIGNAL
    wire [31:0] mem_la_addr;  // of a word: bits 1:0 are zero
    // verilator lint_on UNUSEDSIGNAL
    wire [ 3:0] mem_wstrb;
    // products and divisions
    wire pcpi_valid, divides, divided, multiplied;
    wire [31:0] pcpi_insn, pcpi_rs1, pcpi_rs2, quotient, product;
    // the registers will answer in the next cycle, have answered; an access had no valid address
    logic awaited, answered, lost;
    // the first cycle of an access; it reads memory; the memory read `following` one cycle before;
    // no access was under way then; and the memory read mem_addr
    logic first, begun, coming, direct, sought;
    logic [31:0] word;  // what the memory had read, for the core or the word `next`
    logic fresh, held;  // the memory has just read the word `next`; `word` is that word
    logic has_core, has_ahead;  // `word` is for the core; and it was read ahead
    logic storing;  // the core writes to the memory
    logic [A-3:0] next;  // number of the word after the last instruction
    wire found;  // code_word is the one that the core asks for
    wire [31:0] code_word;

    wire in_memory = mem_addr < 32'(MEMORY_BYTES);
    wire in_registers = mem_addr[31:16] == 16'h8000 && !mem_instr && (&mem_wstrb || ~|mem_wstrb);
    wire in_code = CODE_BYTES != 0 && mem_addr[31:28] == 4'h2 && mem_addr[27:0] < 28'(CODE_BYTES) &&
        mem_wstrb == '0;
    wire la_in_memory = mem_la_addr < 32'(MEMORY_BYTES);

    // A word that is read passes through a register, since the block RAMs, the selection among them
    // and the expansion of a compressed instruction together take longer than a cycle.
    wire [A-3:0] following = mem_valid && mem_instr ? mem_addr[A-1:2] + (A - 2)'(1) : next;
    wire same = mem_la_addr[A-1:2] == following;
    wire passes = first && mem_instr;  // `following` is no longer `next`
    wire arrives = (begun && (coming || (direct && !mem_instr))) || sought;
    wire overwrites = arrives || found || (storing && mem_addr[A-1:2] == next);
    wire known = (fresh || held) && !passes && !overwrites;
    wire seek = begun && !arrives;
    wire [A-3:0] under_way = seek ? mem_addr[A-1:2] : following;
    wire [A-3:0] read_address = mem_valid ? under_way : pcpi_rs1[A-1:2];
    wire memory_ready = has_core || has_ahead || storing;
    wire mem_ready = answered || memory_ready;

    assign request = mem_valid && in_registers && !(select || awaited || answered);
    // the bus is quiet meanwhile, so that the twin need not evaluate the registers
    assign write   = mem_wstrb[0] && mem_addr[31];
    assign address = mem_addr[15:0] & {16{mem_addr[31]}};
    assign wdata   = mem_wdata & {32{mem_addr[31]}};
    assign trap    = core_trap || lost;

    always_ff @(posedge clk) begin
        select    <= request && ready;
        awaited   <= select;
        answered  <= awaited;
        next      <= following;
        first     <= mem_la_read;
        begun     <= mem_la_read && la_in_memory && !(same && known);
        coming    <= same && mem_valid && !seek && !storing;
        direct    <= !mem_valid;
        sought    <= seek && mem_valid && !mem_ready;
        fresh     <= mem_valid && !seek && !storing;
        held      <= known;
        storing   <= mem_la_write && la_in_memory && !core_trap;
        has_core  <= (arrives && mem_valid && !mem_ready) || found;
        has_ahead <= mem_la_read && la_in_memory && same && known;
        if (found) word <= code_word;
        else if (arrives || fresh) word <= memory_rdata;
        if (mem_valid && !in_memory && !in_registers && !in_code) lost <= 1'b1;
        if (rst) begin
            select    <= 1'b0;
            awaited   <= 1'b0;
            answered  <= 1'b0;
            lost      <= 1'b0;
            next      <= '0;
            first     <= 1'b0;
            begun     <= 1'b0;
            coming    <= 1'b0;
            sought    <= 1'b0;
            fresh     <= 1'b0;
            held      <= 1'b0;
            storing   <= 1'b0;
            has_core  <= 1'b0;
            has_ahead <= 1'b0;
        end
    end

    node_memory #(
        .BYTES   (MEMORY_BYTES),
        .FIRMWARE(FIRMWARE)
    ) u_memory (
        .clk,
        .write        (mem_wstrb & {4{storing}}),
        .write_address(mem_addr[A-1:2]),
        .wdata        (mem_wdata),
        .read_address,
        .rdata        (memory_rdata)
    );

    if (CODE_BYTES != 0) begin : g_code
        code_cache #(
            .BYTES(CODE_BYTES),
            .START(CODE_START)
        ) u_cache (
            .clk,
            .rst,
            .request(mem_valid && in_code && !has_core),
            .address(mem_addr[$clog2(CODE_BYTES)-1:2]),
            .ready  (found),
            .word   (code_word),
            // flash
            .cs_n   (flash_cs_n),
            .sclk   (flash_sclk),
            .mosi   (flash_mosi),
            .miso   (flash_miso)
        );
    end else begin : g_no_code
        assign {found, code_word} = '0;
        assign {flash_cs_n, flash_sclk, flash_mosi} = 3'b100;

        wire unused = &{1'b0, flash_miso};
    end

    core_multiplier u_multiplier (
        .clk,
        .rst,
        .valid      (pcpi_valid),
        .instruction(pcpi_insn),
        .a          (pcpi_rs1),
        .b          (pcpi_rs2),
        .ready      (multiplied),
        .result     (product)
    );
    core_divider u_divider (
        .clk,
        .rst,
        .valid      (pcpi_valid),
        .instruction(pcpi_insn),
        .a          (pcpi_rs1),
        .b          (pcpi_rs2),
        .working    (divides),
        .ready      (divided),
        .result     (quotient)
    );

    picorv32 #(
        .ENABLE_COUNTERS  (0),
        .ENABLE_COUNTERS64(0),
        .BARREL_SHIFTER   (1),
        .ENABLE_PCPI      (1),
        .COMPRESSED_ISA   (1),
        .CATCH_MISALIGN   (1),
        .CATCH_ILLINSN    (1),
        .STACKADDR        (32'(MEMORY_BYTES))
    ) u_core (
        .clk,
        .resetn      (!rst),
        .trap        (core_trap),
        .mem_valid,
        .mem_instr,
        .mem_ready   (answered || memory_ready),
        .mem_addr,
        .mem_wdata,
        .mem_wstrb,
        .mem_rdata   (answered ? rdata : word),
        .mem_la_read,
        .mem_la_write,
        .mem_la_addr,
        // writes do not look ahead:
        // verilator lint_off PINCONNECTEMPTY
        .mem_la_wdata(),
        .mem_la_wstrb(),
        // verilator lint_on PINCONNECTEMPTY
        .pcpi_valid,
        .pcpi_insn,
        .pcpi_rs1,
        .pcpi_rs2,
        .pcpi_wr     (multiplied || divided),
        .pcpi_rd     (multiplied ? product : quotient),
        .pcpi_wait   (divides),
        .pcpi_ready  (multiplied || divided),
        .irq         (32'd0),
        // no interrupts, no trace:
        // verilator lint_off PINCONNECTEMPTY
        .eoi         (),
        .trace_valid (),
        .trace_data  ()
    );
    // verilator lint_on PINCONNECTEMPTY

`ifdef FORMAL
    // of the word at the output of the memory, and of the one in word: its number, and whether it
    // was written after it was read
    logic [A-3:0] read_number, word_number;
    logic read_old, word_old;
    wire  overwritten = storing && mem_addr[A-1:2] == read_number;
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (arrives || fresh) begin
            word_number <= read_number;
            word_old    <= read_old || overwritten;
        end else if (storing && mem_addr[A-1:2] == word_number) word_old <= 1'b1;
        read_old <= storing && (read_old || overwritten);
        if (!storing) read_number <= read_address;
        if (!past) assume (rst);
        // the core begins no access before the last one is done
        if (mem_la_read || mem_la_write) assume (!mem_valid || mem_ready);
        // and keeps it until then
        if (past && !$past(rst) && $past(mem_valid && !mem_ready)) begin
            assume (mem_valid && $stable(mem_addr));
            assume ($stable(mem_instr) && $stable(mem_wstrb) && $stable(mem_wdata));
        end
        // the address of a word of data was in its operand
        if (past && first && mem_valid && !mem_instr && mem_wstrb == '0 && in_memory)
            assume (mem_addr[A-1:2] == $past(pcpi_rs1[A-1:2]));
        if (past && !$past(rst)) begin
            if ($past(mem_valid && !in_memory && !in_registers && !in_code)) assert (trap);
            if ($past(lost)) assert (trap);
            assert (32'(select) + 32'(awaited) + 32'(answered) <= 1);
            assert (select == $past(request && ready));
            if (select) assert (mem_valid && !in_memory && !mem_instr && $past(ready));
            if (select) assert (mem_wstrb == '0 || mem_wstrb == '1);
            if (select) assert ($stable(address) && $stable(wdata));
            if (write && select) assert (mem_wstrb == '1);
            if (storing) assert (mem_valid && in_memory);
            if (fresh) assert (read_number == next && !read_old);
            if (held) assert (word_number == next && !word_old);
            if (mem_valid && memory_ready && !storing && !core_trap) begin
                assert ((in_memory || in_code) && mem_wstrb == '0);
                if (in_memory)
                    assert (word_number == mem_addr[A-1:2] && !word_old);
                    else assert ($past(found) && word == $past(code_word));
            end
            cover (mem_valid && has_ahead && mem_instr);
            cover (mem_valid && in_memory && mem_instr);
        end
    end
`endif
endmodule

`default_nettype wire
