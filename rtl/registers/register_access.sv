// SPDX-License-Identifier: Apache-2.0
// register_access -- make the accesses to the register bus for a bus port, one after the other.
//
// latency   2 cycles from take to select, and as many more as ready is low; LATENCY cycles from
//           select to done
// rate      one access every LATENCY + 3 cycles
// behaviour A take while free is low has no effect. address, wdata and write stay as they are from
//           the cycle after take until the next one.
// source    the accesses of soft_core: address and wdata are there one cycle before select
// model     tb/registers/register_access.py, equal in every bit of every cycle
// proved    Each take gives exactly one select, one cycle after a cycle in which ready was high,
//           with the address and the word that came with take, which are there one cycle before.
//           Each select gives one done, LATENCY cycles later, and free is high again after it.
// proof     depth 8, ADDRESS_W = 4
`default_nettype none

module register_access #(
    parameter int ADDRESS_W = 16,  // bits of the byte address, 3 or more
    parameter int LATENCY   = 2    // cycles from select to rdata: 1 of a block, 2 of register_bus
) (
    input wire clk,
    input wire rst,
    // request
    input wire take,  // strobe: begin an access, if free is high
    input wire put,  // level: it writes, with take
    input wire [ADDRESS_W-1:0] at,  // byte address, with take
    input wire [31:0] value,  // word to be written, with take
    output logic free,  // level: no access is under way
    output logic waits,  // level: the access waits for ready
    output logic done,  // strobe: the access is done, the register bus has the word read
    // register bus
    input wire ready,  // level: the registers take an access in the next cycle
    output logic select,  // strobe: an access
    output logic write,  // level: with select, wdata is to be written
    output logic [ADDRESS_W-1:0] address,  // byte address, from 1 cycle before select on
    output logic [31:0] wdata  // word to be written, from 1 cycle before select on
);
    if (ADDRESS_W < 3 || ADDRESS_W > 32) begin : g_check_address
        ADDRESS_W_MUST_BE_FROM_3_TO_32 u_error ();
    end
    if (LATENCY < 1 || LATENCY > 2) begin : g_check_latency
        LATENCY_MUST_BE_1_OR_2 u_error ();
    end

    logic [LATENCY-1:0] passed;  // bit n: select was high n + 1 cycles ago

    assign done = passed[LATENCY-1];

    always_ff @(posedge clk) begin
        if (take && free) begin
            write   <= put;
            address <= at;
            wdata   <= value;
        end
        free   <= (free && !take) || done;
        waits  <= (take && free) || (waits && !ready);
        select <= waits && ready;
        passed <= LATENCY'({passed, select});
        if (rst) begin
            free   <= 1'b1;
            waits  <= 1'b0;
            select <= 1'b0;
            passed <= '0;
        end
    end

`ifdef FORMAL
    logic                 past = 1'b0;
    logic                 owed;  // a request was taken that is not done
    logic                 owed_write;
    logic [ADDRESS_W-1:0] owed_address;
    logic [         31:0] owed_value;
    wire                  last = LATENCY > 1 && done;  // and not passed[0]
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        owed <= !rst && ((take && free) || (owed && !done));
        if (take && free) {owed_write, owed_address, owed_value} <= {put, at, value};
        if (past) begin
            assert (free == !owed);
            assert ({31'd0, owed} == 32'(waits) + 32'(select) + 32'(passed[0]) + 32'(last));
            if (owed) assert ({write, address, wdata} == {owed_write, owed_address, owed_value});
            if (select) begin
                assert ($past(ready && waits) && $stable(write));
                assert ($stable(address) && $stable(wdata));
            end
            if (!$past(rst)) begin
                if ($past(select)) assert (passed[0]);
                if ($past(done)) assert (free);
                if ($past(waits && ready)) assert (select);
            end
            cover (done && write && owed_address == 3);
            cover (select && $past(!ready, 2) && !write);
        end
    end
`endif
endmodule

`default_nettype wire
