// SPDX-License-Identifier: Apache-2.0
// wishbone_port -- let a Wishbone master access the register bus.
//
// latency   LATENCY + 3 cycles from wb_stb to wb_ack, 5 behind register_bus, and as many more as
//           ready is low; 1 cycle to wb_err
// rate      one access every LATENCY + 4 cycles
// behaviour The classic cycle of a port of 32 bits; wb_adr counts words. A write must have all four
//           bytes: any other one writes nothing and ends with wb_err. A read gives the whole word,
//           whatever wb_sel is, and may have an effect, as reading a queue has. An access that the
//           master gives up before its end is done all the same, without wb_ack; the next one
//           waits for it.
// source    Wishbone B4, chapter 3: the classic bus cycles
// model     tb/registers/wishbone_port.py, equal in every bit of every cycle
// proved    wb_ack and wb_err are strobes, never together, and end only an access that the master
//           has held since it began. wb_ack brings the word that the register bus had for this
//           access. Each access that is held while ready is high ends within LATENCY + 3 cycles of
//           its start. The register bus never sees a write without all bytes.
// proof     depth 12, ADDRESS_W = 4
`default_nettype none

module wishbone_port #(
    parameter int ADDRESS_W = 16,  // bits of the byte address, 3 or more
    parameter int LATENCY   = 2    // cycles from select to rdata: 1 of a block, 2 of register_bus
) (
    input  wire                  clk,
    input  wire                  rst,
    // Wishbone
    input  wire                  wb_cyc,    // level: a bus cycle
    input  wire                  wb_stb,    // level: an access to this port
    input  wire                  wb_we,     // level: it writes
    input  wire  [ADDRESS_W-3:0] wb_adr,    // word address
    input  wire  [          3:0] wb_sel,    // bit n: byte n is written
    input  wire  [         31:0] wb_dat_w,  // word to be written
    output logic [         31:0] wb_dat_r,  // word read, with wb_ack
    output logic                 wb_ack,    // strobe: the access is done
    output logic                 wb_err,    // strobe: the access is refused
    // register bus
    input  wire                  ready,     // level: the registers take an access in the next cycle
    output logic                 select,    // strobe: an access
    output logic                 write,     // level: with select, wdata is to be written
    output logic [ADDRESS_W-1:0] address,   // byte address, from 1 cycle before select on
    output logic [         31:0] wdata,     // word to be written, from 1 cycle before select on
    input  wire  [         31:0] rdata      // word read, LATENCY cycles after select
);
    logic held;  // the master has held the access since it began
    wire free, waits, done;

    wire active = wb_cyc && wb_stb;
    wire begins = active && free && !wb_ack && !wb_err;
    wire whole = !wb_we || &wb_sel;
    wire take = begins && whole;

    register_access #(
        .ADDRESS_W(ADDRESS_W),
        .LATENCY  (LATENCY)
    ) u_access (
        .clk,
        .rst,
        // request
        .take,
        .put  (wb_we),
        .at   ({wb_adr, 2'b00}),
        .value(wb_dat_w),
        .free,
        .waits,
        .done,
        // register bus
        .ready,
        .select,
        .write,
        .address,
        .wdata
    );

    always_ff @(posedge clk) begin
        held   <= take || (held && active);
        wb_ack <= done && held && active;
        wb_err <= begins && !whole;
        if (done) wb_dat_r <= rdata;
        if (rst) begin
            held   <= 1'b0;
            wb_ack <= 1'b0;
            wb_err <= 1'b0;
        end
    end

    wire unused = &{1'b0, waits};

`ifdef FORMAL
    logic        past = 1'b0;
    logic [ 2:0] since;  // cycles since the access began, but for those that it waited for ready
    logic        all_bytes;  // of the access that was taken last
    logic [31:0] word;  // what the register bus had for it
    wire         under_way = held && !free;
    wire  [31:0] answers = LATENCY > 1 ? 32'(done) : 0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        // the master changes nothing during an access that it holds
        if (past && $past(active && !wb_ack && !wb_err) && active) begin
            assume ($stable(wb_we) && $stable(wb_adr) && $stable(wb_sel) && $stable(wb_dat_w));
        end
        if (done) word <= rdata;
        if (take) all_bytes <= whole;
        if (take) since <= 3'd0;
        else if (!waits || ready) since <= since + 1'b1;
        if (past) begin
            assert (!(wb_ack && wb_err));
            if (!free && write) assert (all_bytes);
            // an access waits, is made, or is being answered; and nothing of it is left
            assert (32'(!free) == 32'(waits) + 32'(select) + 32'($past(select && !rst)) + answers);
            if (under_way) begin
                assert (since == (waits ? 3'd0 : select ? 3'd1 : done ? 3'(LATENCY + 1) : 3'd2));
                assert (write == $past(wb_we) && address == {$past(wb_adr), 2'b00});
                assert (wdata == $past(wb_dat_w));
            end
            if (wb_ack) assert (wb_dat_r == word && since == 3'(LATENCY + 2));
            if (wb_ack) assert ($past(under_way && active && done));
            if (wb_err) assert ($past(active && wb_we && wb_sel != '1));
            if ($past(wb_ack || wb_err)) assert (!wb_ack && !wb_err);
            if ($past(!rst && done && under_way && active)) assert (wb_ack);
            cover (wb_ack && write && wb_dat_r == 1);
            cover (wb_ack && $past(wb_ack, LATENCY + 4));
            cover (wb_err);
            cover (done && !held);
        end
    end
`endif
endmodule

`default_nettype wire
