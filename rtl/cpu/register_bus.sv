// SPDX-License-Identifier: Apache-2.0
// register_bus -- send each access of the soft core to the register block that holds the address.
//
// latency   1 cycle from address and 0 cycles from select to the select of its block, 1 cycle from
//           the answers of the blocks and of register_memory to rdata
// rate      one access every 2 cycles
// source    the addresses of tables/registers.rdl: node at 0x000, RS-485 bus at 0x100, peripherals
//           at 0x200, link at 0x300, axis n at 0x400 + n * 0x100, its feedback channel at 0xC00 + n
//           * 0x100, its actuator at 0x1400 + n * 0x100
// model     tb/cpu/register_bus.py, equal in every bit of every cycle
// proved    An access reaches at most one block, the one that holds its address, and none without
//           select. rdata has the bits of all answers to the last access.
// proof     depth 4, AXES = 2
`default_nettype none

module register_bus #(
    parameter int AXES = 1  // number of axis blocks on the bus
) (
    input wire clk,
    input wire select,  // strobe: an access
    input wire [15:0] address,  // byte in the register map, the same one cycle before select
    input wire [31:0] memory_rdata,  // settings in the word of the last access
    input wire [31:0] node_rdata,  // live bits, 1 cycle after node_select
    input wire [31:0] bus_rdata,  // live bits, 1 cycle after bus_select
    input wire [31:0] peripherals_rdata,  // live bits, 1 cycle after peripherals_select
    input wire [31:0] link_rdata,  // live bits, 1 cycle after link_select
    input wire [32*AXES-1:0] axis_rdata,  // live bits, axis n: bits 32 n + 31 .. 32 n
    input wire [32*AXES-1:0] feedback_rdata,  // live bits, axis n: bits 32 n + 31 .. 32 n
    input wire [32*AXES-1:0] actuator_rdata,  // live bits, axis n: bits 32 n + 31 .. 32 n
    output logic node_select,  // strobe: access to the node's block
    output logic bus_select,  // strobe: access to the RS-485 bus block
    output logic peripherals_select,  // strobe: access to the peripherals' block
    output logic link_select,  // strobe: access to the block of the real-time link
    output logic [AXES-1:0] axis_select,  // strobe: access to axis n
    output logic [AXES-1:0] feedback_select,  // strobe: access to feedback channel n
    output logic [AXES-1:0] actuator_select,  // strobe: access to actuator n
    output logic [31:0] rdata  // word of the last access, from 2 cycles after it on
);
    if (AXES < 1 || AXES > 8) begin : g_check
        AXES_MUST_BE_FROM_1_TO_8 u_error ();
    end

    wire [7:0] block = address[15:8];
    // the blocks of the address of the cycle before
    logic node, bus, peripherals, link;
    logic [AXES-1:0] axis, feedback, actuator;

    always_ff @(posedge clk) begin
        node        <= block == 8'd0;
        bus         <= block == 8'd1;
        peripherals <= block == 8'd2;
        link        <= block == 8'd3;
        for (int n = 0; n < AXES; n++) begin
            axis[n]     <= block == 8'(4 + n);
            feedback[n] <= block == 8'(12 + n);
            actuator[n] <= block == 8'(20 + n);
        end
    end

    assign node_select        = select && node;
    assign bus_select         = select && bus;
    assign peripherals_select = select && peripherals;
    assign link_select        = select && link;
    assign axis_select        = select ? axis : '0;
    assign feedback_select    = select ? feedback : '0;
    assign actuator_select    = select ? actuator : '0;

    // a block that was not read answers 0
    logic [31:0] answer;
    always_comb begin
        answer = node_rdata | bus_rdata | peripherals_rdata | link_rdata | memory_rdata;
        for (int n = 0; n < AXES; n++) begin
            answer = answer | axis_rdata[32*n+:32];
            answer = answer | feedback_rdata[32*n+:32];
            answer = answer | actuator_rdata[32*n+:32];
        end
    end

    logic accessed;  // the blocks answer in this cycle

    always_ff @(posedge clk) begin
        accessed <= select;
        if (accessed) rdata <= answer;
    end

    wire unused = &{1'b0, address[7:0]};

`ifdef FORMAL
    localparam int BLOCKS = 4 + 3 * AXES;
    logic past = 1'b0;
    wire [BLOCKS-1:0] chosen = {
        actuator_select,
        feedback_select,
        axis_select,
        link_select,
        peripherals_select,
        bus_select,
        node_select
    };
    wire [32*BLOCKS-1:0] answers = {
        actuator_rdata,
        feedback_rdata,
        axis_rdata,
        link_rdata,
        peripherals_rdata,
        bus_rdata,
        node_rdata
    };
    logic [31:0] together;
    always_comb begin
        together = memory_rdata;
        for (int n = 0; n < BLOCKS; n++) together = together | answers[32*n+:32];
    end
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (!select);
        if (past && select) assume (address == $past(address));
        assert ((chosen & (chosen - 1'b1)) == '0);
        assert (select || chosen == '0);
        assert (node_select == (select && block == 0) && bus_select == (select && block == 1));
        if (past && $past(accessed)) assert (rdata == $past(together));
        if (past && !$past(accessed)) assert (rdata == $past(rdata));
        if (past) assert (accessed == $past(select));
        cover (past && chosen[BLOCKS-1] && $past(chosen[0], 2) && rdata == 3);
    end
`endif
endmodule

`default_nettype wire
