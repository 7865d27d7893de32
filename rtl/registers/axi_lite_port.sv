// SPDX-License-Identifier: Apache-2.0
// axi_lite_port -- let an AXI4-Lite master access the register bus.
//
// latency   LATENCY + 3 cycles from axi_arvalid to axi_rvalid, 5 behind register_bus, and from
//           axi_awvalid and axi_wvalid to axi_bvalid, and as many more as ready is low; 2 cycles
//           to axi_bvalid for a write that is refused
// rate      one access every LATENCY + 4 cycles, if the master takes the response at once
// behaviour One access at a time, in the order of arrival; of a read and a write that wait at once,
//           the kind that was not served last goes first. A write begins when its address and its
//           word are both there. A write must have all four bytes: any other one writes nothing and
//           is answered with SLVERR. A read may have an effect, as reading a queue has. The two low
//           bits of an address are not used. There are no ports for AWPROT and ARPROT.
// source    AMBA AXI and ACE protocol specification, part B: AXI4-Lite
// model     tb/registers/axi_lite_port.py, equal in every bit of every cycle
// proved    A response stays until the master takes it. There is never more than one access under
//           way, each that was taken gets exactly one response of its kind, and a read brings the
//           word that the register bus had for it. The register bus never sees a write without all
//           bytes.
// proof     depth 12, ADDRESS_W = 4
`default_nettype none

module axi_lite_port #(
    parameter int ADDRESS_W = 16,  // bits of the byte address, 3 or more
    parameter int LATENCY   = 2    // cycles from select to rdata: 1 of a block, 2 of register_bus
) (
    input wire clk,
    input wire rst,
    // AXI4-Lite: write address
    input wire axi_awvalid,  // level: an address is there
    output logic axi_awready,  // strobe: it is taken
    input wire [ADDRESS_W-1:0] axi_awaddr,  // byte address
    // AXI4-Lite: write data
    input wire axi_wvalid,  // level: a word is there
    output logic axi_wready,  // strobe: it is taken
    input wire [31:0] axi_wdata,  // word to be written
    input wire [3:0] axi_wstrb,  // bit n: byte n is written
    // AXI4-Lite: write response
    output logic axi_bvalid,  // level: a response is there
    input wire axi_bready,  // level: the master takes it
    output logic [1:0] axi_bresp,  // 0 OKAY, 2 SLVERR
    // AXI4-Lite: read address
    input wire axi_arvalid,  // level: an address is there
    output logic axi_arready,  // strobe: it is taken
    input wire [ADDRESS_W-1:0] axi_araddr,  // byte address
    // AXI4-Lite: read data
    output logic axi_rvalid,  // level: a word is there
    input wire axi_rready,  // level: the master takes it
    output logic [31:0] axi_rdata,  // word read
    output logic [1:0] axi_rresp,  // always 0, OKAY
    // register bus
    input wire ready,  // level: the registers take an access in the next cycle
    output logic select,  // strobe: an access
    output logic write,  // level: with select, wdata is to be written
    output logic [ADDRESS_W-1:0] address,  // byte address, from 1 cycle before select on
    output logic [31:0] wdata,  // word to be written, from 1 cycle before select on
    input wire [31:0] rdata  // word read, LATENCY cycles after select
);
    localparam logic [1:0] OKAY = 0, SLVERR = 2;

    logic has_read;  // the access served last was a read
    logic refused;  // the write that is taken in this cycle is refused
    wire free, waits, done;

    wire writes = axi_awvalid && axi_wvalid;
    wire reads = axi_arvalid && !(writes && has_read);
    wire begins = (writes || reads) && free && !axi_awready && !axi_bvalid && !axi_rvalid;
    wire whole = &axi_wstrb;

    assign axi_wready = axi_awready;
    assign axi_rresp  = OKAY;

    register_access #(
        .ADDRESS_W(ADDRESS_W),
        .LATENCY  (LATENCY)
    ) u_access (
        .clk,
        .rst,
        // request
        .take (begins && (reads || whole)),
        .put  (!reads),
        .at   ({reads ? axi_araddr[ADDRESS_W-1:2] : axi_awaddr[ADDRESS_W-1:2], 2'b00}),
        .value(axi_wdata),
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
        axi_arready <= begins && reads;
        axi_awready <= begins && !reads;
        refused     <= begins && !reads && !whole;
        if (begins) has_read <= reads;
        if (done) axi_rdata <= rdata;
        if (done || refused) axi_bresp <= refused ? SLVERR : OKAY;
        axi_bvalid <= refused || (done && write) || (axi_bvalid && !axi_bready);
        axi_rvalid <= (done && !write) || (axi_rvalid && !axi_rready);
        if (rst) begin
            axi_arready <= 1'b0;
            axi_awready <= 1'b0;
            refused     <= 1'b0;
            has_read    <= 1'b0;
            axi_bvalid  <= 1'b0;
            axi_rvalid  <= 1'b0;
        end
    end

    wire unused = &{1'b0, waits, axi_awaddr[1:0], axi_araddr[1:0]};

`ifdef FORMAL
    logic past = 1'b0;
    logic owes_read, owes_write;  // a response to an access that was taken
    wire  [         31:0] answers = LATENCY > 1 ? 32'(done) : 0;
    logic                 bad;  // the write did not have all bytes
    logic [         31:0] word;  // what the register bus had for the last access
    logic [ADDRESS_W-1:0] asked_at;
    logic [         31:0] asked_value;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        // a master holds its valid and what goes with it until it is taken
        if (past && !$past(rst)) begin
            if ($past(axi_awvalid && !axi_awready)) assume (axi_awvalid && $stable(axi_awaddr));
            if ($past(axi_wvalid && !axi_wready))
                assume (axi_wvalid && $stable(axi_wdata) && $stable(axi_wstrb));
            if ($past(axi_arvalid && !axi_arready)) assume (axi_arvalid && $stable(axi_araddr));
        end
        if (done) word <= rdata;
        owes_read  <= !rst && (axi_arready || (owes_read && !(axi_rvalid && axi_rready)));
        owes_write <= !rst && (axi_awready || (owes_write && !(axi_bvalid && axi_bready)));
        if (axi_awready) {bad, asked_at, asked_value} <= {!(&axi_wstrb), axi_awaddr, axi_wdata};
        if (axi_arready) asked_at <= axi_araddr;
        if (past) begin
            assert (32'(axi_arready) + 32'(axi_awready) + 32'(owes_read) + 32'(owes_write) <= 1);
            assert (!axi_rvalid || owes_read);
            assert (!axi_bvalid || owes_write);
            if (axi_arready) assert (axi_arvalid && !write && !free);
            if (axi_awready) assert (axi_awvalid && axi_wvalid && refused == !(&axi_wstrb));
            if (axi_awready) assert (refused == free && (refused || write));
            if (refused) assert (axi_awready);
            // an access waits, is made, or is being answered; and nothing of it is left
            assert (32'(!free) == 32'(waits) + 32'(select) + 32'($past(select && !rst)) + answers);
            // each response that is owed is there or comes from the access
            if (owes_read) assert (axi_rvalid == free && (free || !write));
            if (owes_write) assert (axi_bvalid == free && (free || (write && !bad)));
            if (!free) assert (axi_arready || axi_awready || owes_read || owes_write);
            if (owes_read || owes_write)
                assert (address[ADDRESS_W-1:2] == asked_at[ADDRESS_W-1:2] || (owes_write && bad));
            if (owes_write && !bad) assert (wdata == asked_value);
            if (axi_rvalid) assert (axi_rdata == word);
            if (axi_bvalid) assert (axi_bresp == (bad ? SLVERR : OKAY));
            if (select && write) assert (axi_awready ? &axi_wstrb : owes_write && !bad);
            if (!$past(rst)) begin
                if ($past(axi_rvalid && !axi_rready)) assert (axi_rvalid && $stable(axi_rdata));
                if ($past(axi_bvalid && !axi_bready)) assert (axi_bvalid && $stable(axi_bresp));
                if ($past(done)) assert ($past(write) ? axi_bvalid : axi_rvalid);
            end
            cover (axi_rvalid && axi_rdata == 1 && $past(axi_bvalid, 6));
            cover (axi_bvalid && axi_bresp == OKAY && $past(axi_rvalid, 6));
            cover (axi_bvalid && axi_bresp == SLVERR);
        end
    end
`endif
endmodule

`default_nettype wire
