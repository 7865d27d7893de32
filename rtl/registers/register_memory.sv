// SPDX-License-Identifier: Apache-2.0
// register_memory -- hold the settings of all register blocks for reading back, and the low word
// of a setting of 64 bits until its high word is written.
//
// latency   1 cycle from select to rdata and to wdata_low; 2048 cycles without hold from the end of
//           rst to ready
// rate      one access every 2 cycles
// behaviour address and wdata are there one cycle before select already: register_layout has that
//           cycle to find what is stored and where. After rst each setting gets its first value,
//           one word in each cycle without hold; until ready is high there must be no access.
//           stores shows every setting that is written, its first value too; of a value of 64 bits
//           with its high word. A write of a low word changes wdata_low only; the write of the high
//           word stores both. There is one wdata_low for all blocks.
// source    register_layout: the layout of the memory, the bits of each setting, the first values
// model     tb/registers/register_memory.py, equal in every bit of every cycle
// proved    A read of any word gives what the last write of the word stored, else its first value;
//           no access to another word changes it. The low word of a setting of 64 bits reads what
//           was written before the last write of its high word.
// limits    The settings that need what an axis has not read 0: the HAS_... parameters and FILTERS
//           are masks, bit n for axis n.
// proof     depth 4, AXES = 2
`default_nettype none

module register_memory #(
    parameter int AXES              = 1,      // axes of the node, 1 to 8
    parameter int FILTERS           = 255,    // bit n: axes with biquads of the servo
    parameter int HAS_BRIDGE        = 255,    // axes with a bridge
    parameter int HAS_COMPARE       = 255,    // axes with compare
    parameter int HAS_DAC           = 255,    // axes with a DAC
    parameter int HAS_DRIVE         = 255,    // axes with a drive
    parameter int HAS_ENCODER_CHECK = 255,    // axes with the check of the encoder
    parameter int HAS_FINE_STAGE    = 255,    // axes with a fine stage
    parameter int HAS_HARMONICS     = 255,    // axes with harmonic correction
    parameter int HAS_MONITOR       = 255,    // axes with a signal monitor
    parameter int HAS_RECORDER      = 255,    // axes with a recorder
    parameter int HAS_BACKLASH      = 255,    // axes with compensation of backlash
    parameter int HAS_SET_POINTS    = 255,    // axes that can follow set-points
    parameter int HAS_SINE          = 255,    // axes with sine and cosine
    parameter int HAS_STEPPER       = 255,    // axes with a step generator
    parameter int HAS_VELOCITY      = 255,    // axes with a measured velocity
    // an attribute uses it:
    // verilator lint_off UNUSEDPARAM
    parameter     STYLE             = "auto"  // ram_style of the memory: "huge" takes SB_SPRAM256KA
    // verilator lint_on UNUSEDPARAM
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         hold,         // level: no first value is stored
    input  wire         select,       // strobe: an access to any block
    input  wire         write,        // level: it writes wdata
    input  wire  [13:0] address,      // word of the register map, the same one cycle before select
    input  wire  [31:0] wdata,        // value to write, the same one cycle before select
    output logic        ready,        // level: the settings have their first values
    output logic [31:0] rdata,        // settings in the word read last; its other bits are 0
    output logic [31:0] wdata_low,    // low word that waits for its high word
    output logic        stores,       // strobe: a word is stored
    output logic [13:0] stored_at,    // word of the register map
    output logic [31:0] stored_value  // bits of its settings
);
    localparam int W = $clog2(3 + 3 * AXES) + 6;  // bits of a place in the memory

    logic [ 11:0] next;  // number of the next word that gets its first value
    logic         commit;  // the low word is stored in this cycle
    logic [W-1:0] low_place;
    // the word at stored_at, which is accessed or gets its first value
    logic [W-1:0] place;  // where it is in the memory
    logic low, high;

    wire        fill = !ready && !hold;
    wire        begins = ready && !rst;  // an access may follow
    wire [13:0] coming = rst ? '0 : ready ? address : {3'd0, next[10:0]};
    wire coming_low, coming_high;
    wire [W-1:0] coming_place;
    wire [31:0] stored_bits, first;
    wire put = select && write;

    register_layout #(
        .AXES             (AXES),
        .FILTERS          (FILTERS),
        .HAS_BRIDGE       (HAS_BRIDGE),
        .HAS_COMPARE      (HAS_COMPARE),
        .HAS_DAC          (HAS_DAC),
        .HAS_DRIVE        (HAS_DRIVE),
        .HAS_ENCODER_CHECK(HAS_ENCODER_CHECK),
        .HAS_FINE_STAGE   (HAS_FINE_STAGE),
        .HAS_HARMONICS    (HAS_HARMONICS),
        .HAS_MONITOR      (HAS_MONITOR),
        .HAS_RECORDER     (HAS_RECORDER),
        .HAS_BACKLASH     (HAS_BACKLASH),
        .HAS_SET_POINTS   (HAS_SET_POINTS),
        .HAS_SINE         (HAS_SINE),
        .HAS_STEPPER      (HAS_STEPPER),
        .HAS_VELOCITY     (HAS_VELOCITY)
    ) u_layout (
        .address(coming),
        .wdata,
        .place  (coming_place),
        .stored_bits,
        .first,
        .low    (coming_low),
        .high   (coming_high)
    );

    assign stores = ready ? put && !low : fill;

    wire          store = !ready || commit || (put && !low);
    // of a write and of a read: one port, since a low word is not stored while another is read
    wire  [W-1:0] used_place = commit ? low_place : place;
    wire  [ 31:0] stored = commit ? wdata_low : stored_value;

    (* ram_style = STYLE *)logic [ 31:0] memory                                     [0:2**W-1];
    always_ff @(posedge clk) begin
        if (store) memory[used_place] <= stored;
        else if (select && !write) rdata <= memory[used_place];
    end

    always_ff @(posedge clk) begin
        if (rst || ready || fill) begin
            place        <= coming_place;
            low          <= coming_low;
            high         <= coming_high;
            stored_at    <= coming;
            stored_value <= begins ? stored_bits : first;
        end
        if (fill) begin
            next  <= next + 1'b1;
            ready <= next[11];
        end
        if (put && low) wdata_low <= wdata;
        commit    <= put && high;
        low_place <= {place[W-1:1], 1'b0};
        if (rst) begin
            next   <= 12'd1;
            ready  <= 1'b0;
            commit <= 1'b0;
            wdata_low <= '0;
        end
    end

`ifdef FORMAL
    (* anyconst *)logic [13:0] observed;  // a word of the map
    logic        past = 1'b0;
    logic        pending;  // its high word was written in the cycle before
    logic        fetched;  // rdata is its value
    logic [31:0] value, fetched_value;  // what it reads, what it was when it was read
    // of the observed word, and of the one at stored_at
    wire [ 13:0] looked_at   [0:1];
    wire [W-1:0] looked_place[0:1];
    wire [31:0] looked_bits[0:1], looked_first[0:1];
    wire [1:0] looked_low, looked_high;
    assign looked_at[0] = observed;
    assign looked_at[1] = stored_at;
    for (genvar n = 0; n < 2; n++) begin : g_look
        register_layout #(
            .AXES             (AXES),
            .FILTERS          (FILTERS),
            .HAS_BRIDGE       (HAS_BRIDGE),
            .HAS_COMPARE      (HAS_COMPARE),
            .HAS_DAC          (HAS_DAC),
            .HAS_DRIVE        (HAS_DRIVE),
            .HAS_ENCODER_CHECK(HAS_ENCODER_CHECK),
            .HAS_FINE_STAGE   (HAS_FINE_STAGE),
            .HAS_HARMONICS    (HAS_HARMONICS),
            .HAS_MONITOR      (HAS_MONITOR),
            .HAS_RECORDER     (HAS_RECORDER),
            .HAS_BACKLASH     (HAS_BACKLASH),
            .HAS_SET_POINTS   (HAS_SET_POINTS),
            .HAS_SINE         (HAS_SINE),
            .HAS_STEPPER      (HAS_STEPPER),
            .HAS_VELOCITY     (HAS_VELOCITY)
        ) u_layout (
            .address    (looked_at[n]),
            .wdata,
            .place      (looked_place[n]),
            .stored_bits(looked_bits[n]),
            .first      (looked_first[n]),
            .low        (looked_low[n]),
            .high       (looked_high[n])
        );
    end
    wire [W-1:0] observed_place = looked_place[0];
    wire         observed_low = looked_low[0];
    wire         filled = ready || stored_at > observed;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (observed < 14'd2048);
        assume (!select || (ready && !commit));
        if (past && select) assume ($past(ready) && $stable(address) && $stable(wdata));
        if (!ready && stored_at == observed) value <= looked_first[0];
        if (put && address == observed && !observed_low) value <= looked_bits[0];
        if (pending) value <= wdata_low;
        pending <= !rst && observed_low && high && put && address == {observed[13:1], 1'b1};
        if (select && !write) begin
            fetched       <= address == observed;
            fetched_value <= value;
        end
        if (rst || !past) fetched <= 1'b0;
        if (past) begin
            if (!ready && !$past(rst)) assert (next == stored_at[11:0] + 1'b1);
            if (!ready) assert (next != '0 && next <= 12'd2048 && stored_at < 14'd2048);
            if (!ready) assert (place == looked_place[1] && stored_value == looked_first[1]);
            if (filled && !rst) assert (memory[observed_place] == value);
            assert (pending == (commit && observed_low && low_place == observed_place));
            if (commit) assert (ready && (observed_low || low_place != observed_place));
            if (filled && &observed_place[W-1:6]) assert (value == 0);
            if (fetched) assert (rdata == fetched_value);
            cover (next == 12'd2 && filled);
        end
    end
    wire unused = &{1'b0, looked_low[1], looked_high, looked_bits[1]};
`endif
endmodule

`default_nettype wire
