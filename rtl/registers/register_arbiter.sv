// SPDX-License-Identifier: Apache-2.0
// register_arbiter -- share the register bus among several masters.
//
// latency   0 cycles for a single master, and for master 0 while no other one requests; 1 cycle
//           from the request of another master to its ready on an idle bus
// rate      one access every 4 cycles, as for a single master; one master passes unchanged
// behaviour Each master has the bus port of soft_core, and request while it waits for ready. The
//           masters that wait are served in turn, in the order of their numbers. The two words of a
//           register of 64 bits belong together: after an access to the low word the bus is
//           reserved for the same master, until it accesses an odd word or requests another one, or
//           has not requested for HOLD cycles. waits holds a single master back.
// limits    A master keeps address, write and wdata from request to 2 cycles after select. It
//           requests the high word within HOLD cycles after select of the low word, or another
//           master may access the same register between the two.
// model     tb/registers/register_arbiter.py, equal in every bit of every cycle
// proved    At most one master is given ready, only while the bus is ready. The bus shows each
//           access of a master once, with its address and its word, from one cycle before it to two
//           cycles after it. Accesses are 4 cycles apart or more. After an access to the low word
//           of a register of 64 bits no other master has one before the high word, if that is
//           requested within HOLD cycles. A master that waits sees 2 accesses of each other one at
//           most, one or the two words of a wide register.
// proof     depth 8, MASTERS = 3, HOLD = 3
`default_nettype none

module register_arbiter #(
    parameter int MASTERS = 2,  // masters of the bus, 1 to 4
    parameter int HOLD    = 63  // cycles, longest time from a low word to its high word
) (
    input  wire                   clk,
    input  wire                   rst,
    // masters, bit n or the bits from 16 n, 32 n on: master n
    input  wire  [   MASTERS-1:0] request,      // levels: the master waits for ready
    input  wire  [   MASTERS-1:0] waits,        // levels: the master gets no access
    output logic [   MASTERS-1:0] ready,        // levels: its access may be in the next cycle
    input  wire  [   MASTERS-1:0] select,       // strobes: an access, one cycle after both levels
    input  wire  [   MASTERS-1:0] write,        // levels: the access writes
    input  wire  [16*MASTERS-1:0] address,      // byte addresses
    input  wire  [32*MASTERS-1:0] wdata,        // words to be written
    // register bus
    input  wire                   bus_ready,    // level: the registers take an access
    output logic                  bus_select,   // strobe: an access
    output logic                  bus_write,    // level: it writes
    output logic [          15:0] bus_address,  // byte address, from 1 cycle before select on
    output logic [          31:0] bus_wdata     // word to be written, from 1 cycle before select on
);
    if (MASTERS < 1 || MASTERS > 4) begin : g_check
        MASTERS_MUST_BE_FROM_1_TO_4 u_error ();
    end

    if (MASTERS == 1) begin : g_one
        assign ready       = bus_ready && !waits;
        assign bus_select  = select;
        assign bus_write   = write;
        assign bus_address = address;
        assign bus_wdata   = wdata;

        wire unused = &{1'b0, clk, rst, request};
    end else begin : g_several
        localparam int H = $clog2(HOLD + 1);

        logic [        1:0] owner;  // the master whose access the bus shows
        logic [MASTERS-1:0] owns;  // the same, one bit for each
        logic accessed, answered;  // select was high one, two cycles ago
        logic         reserved;  // the last access was to a low word
        logic [H-1:0] left;  // cycles for which the bus stays reserved without a request
        wire          low;

        register_width u_wide (
            .address(bus_address[15:2]),
            .low
        );

        wire idle = !bus_select && !accessed && !answered;
        wire [MASTERS-1:0] asks = request & ~waits;
        wire asked = |(asks & owns);
        wire alone = reserved && !bus_address[2];  // what is requested is no high word
        wire take = asked && idle && bus_ready && !alone;
        wire ends = asked ? alone : left == '0;  // the reservation

        // masters that are served next, the lowest number first
        wire [MASTERS-1:0] above = asks & ~(owns | (owns - 1'b1));
        wire [MASTERS-1:0] next = above != '0 ? above : asks;

        assign ready      = idle && bus_ready && !alone ? owns & ~waits : '0;
        assign bus_select = |select;

        always_comb begin
            bus_write   = write[0];
            bus_address = address[15:0];
            bus_wdata   = wdata[31:0];
            for (int n = 1; n < MASTERS; n++) begin
                if (owner == 2'(n)) begin
                    bus_write   = write[n];
                    bus_address = address[16*n+:16];
                    bus_wdata   = wdata[32*n+:32];
                end
            end
        end

        always_comb begin
            owns = '0;
            for (int n = 0; n < MASTERS; n++) owns[n] = owner == 2'(n);
        end

        always_ff @(posedge clk) begin
            accessed <= bus_select;
            answered <= accessed;
            if (!bus_select && !accessed && (reserved ? ends : answered || !asked)) begin
                owner <= '0;
                for (int n = MASTERS - 1; n > 0; n--) if (next[n] && !next[0]) owner <= 2'(n);
            end
            left <= bus_select ? H'(HOLD) : left - H'(left != '0);
            if (accessed) reserved <= low;
            else if (take || ends) reserved <= 1'b0;
            if (rst) begin
                owner    <= '0;
                accessed <= 1'b0;
                answered <= 1'b0;
                reserved <= 1'b0;
            end
        end

`ifdef FORMAL
        logic past = 1'b0;
        always @(posedge clk) begin
            past <= 1'b1;
            if (!past) assume (rst);
            if (past) begin
                assert ((ready & (ready - 1'b1)) == '0 && (select & (select - 1'b1)) == '0);
                assert (ready == '0 || bus_ready);
                assert (32'(bus_select) + 32'(accessed) + 32'(answered) <= 1);
                if (bus_select) assert (select == owns && $past(bus_ready && idle));
                if (bus_select || accessed || answered)
                    assert ($stable(bus_write) && $stable(bus_address) && $stable(bus_wdata));
                assert (owner < 2'(MASTERS));
                cover (bus_select && $past(reserved) && owner == '0);
                cover (reserved && !asked && left == '0);
            end
        end
        for (genvar n = 0; n < MASTERS; n++) begin : g_master
            logic opened;  // its last access was to a low word
            logic dropped;  // it requested another word, or nothing for too long
            logic [H:0] age;  // cycles since that access
            logic [2:0] seen;  // accesses of the others while it waits
            // accesses of the others before its turn
            wire [1:0] turns = 2'(n < 32'(owner) ? n + MASTERS - 32'(owner) : n - 32'(owner));
            wire [1:0] of_owner = idle ? 2'd2 - 2'(reserved) :
                answered ? 2'(reserved) : 2'(bus_select) + 2'(!bus_address[2]);
            wire [3:0] to_come = owns[n] ? '0 : {1'b0, turns - 2'd1, 1'b0} + 4'(of_owner);
            wire own = select[n];
            wire mine = (accessed || answered || own) && owns[n];
            wire waiting = asks[n] && !own;
            wire other = bus_select && !own;
            always @(posedge clk) begin
                if (!past)
                    assume (!own);
                    else assume (own == $past(request[n] && ready[n] && !rst));
                if (past && (mine || $past(request[n])))
                    assume ($stable(
                        write[n]
                    ) && $stable(
                        address[16*n+:16]
                    ) && $stable(
                        wdata[32*n+:32]
                    ));
                if (accessed && owns[n]) opened <= low;
                else if (own) opened <= 1'b0;
                age <= own ? '0 : age + (H + 1)'(!age[H]);
                dropped <= !own && (dropped || (opened
                    && (asks[n] ? !address[16*n+2] : age >= (H + 1)'(HOLD - 1))));
                seen <= waiting ? seen + 3'(other) : '0;
                if (rst) begin
                    {opened, dropped} <= '0;
                    age <= '0;
                    seen <= '0;
                end
                if (past && !$past(rst)) begin
                    // the bus shows the access
                    if (own) begin
                        assert (bus_select && bus_write == write[n]);
                        assert (bus_address == address[16*n+:16] && bus_wdata == wdata[32*n+:32]);
                    end
                    // the two words of a register stay together
                    if (opened && !dropped && !own && !accessed) assert (reserved && owns[n]);
                    if (reserved && owns[n]) assert (opened);
                    if (other) assert (!opened || dropped);
                    // the turn comes nearer with each access
                    assert (!waiting || 32'(seen) + 32'(to_come) <= 2 * (MASTERS - 1));
                    assert (32'(seen) <= 2 * (MASTERS - 1));
                end
            end
        end
`endif
    end
endmodule

`default_nettype wire
