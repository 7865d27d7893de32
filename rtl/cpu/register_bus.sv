// SPDX-License-Identifier: Apache-2.0
// register_bus -- send each access of the soft core to the register block that holds the address.
//
// latency  select and write reach a block in the same clk; its answer passes in the next
// rate     one access per clk
// source   the addresses of tables/registers.rdl: node at 0x000, line at 0x100, links at 0x200,
//          axis n at 0x400 + n * 0x100, its grating at 0xC00 + n * 0x100, its actuator at 0x1400 +
//          n * 0x100
// model    tb/cpu/register_bus.py, equal in every bit of every cycle
// proved   an access reaches at most one block, the one that holds its address, and none without
//          select; rdata is the answer of the block that was selected one clk before, and 0 if
//          there was none
// proof    depth 4, AXES = 2
`default_nettype none

module register_bus #(
    parameter int AXES = 1  // axis blocks on the bus
) (
    input wire clk,
    input wire select,  // strobe: an access
    input wire [15:0] address,  // byte address inside the register map
    input wire [31:0] node_rdata,  // answer of each block, the clk after its select
    input wire [31:0] bus_rdata,
    input wire [31:0] peripherals_rdata,
    input wire [32*AXES-1:0] axis_rdata,  // axis n in bits 32 n + 31 .. 32 n
    input wire [32*AXES-1:0] feedback_rdata,
    input wire [32*AXES-1:0] actuator_rdata,
    output logic node_select,  // strobe: the access is for this block
    output logic bus_select,
    output logic peripherals_select,
    output logic [AXES-1:0] axis_select,
    output logic [AXES-1:0] feedback_select,
    output logic [AXES-1:0] actuator_select,
    output logic [31:0] rdata  // answer of the block selected last; 0 where there is none
);
    if (AXES < 1 || AXES > 8) begin : g_check
        AXES_MUST_BE_FROM_1_TO_8 u_error ();
    end

    logic node_q, bus_q, peripherals_q;
    logic [AXES-1:0] axis_q, feedback_q, actuator_q;

    wire [7:0] block = address[15:8];

    always_comb begin
        node_select = select && block == 8'd0;
        bus_select = select && block == 8'd1;
        peripherals_select = select && block == 8'd2;
        for (int n = 0; n < AXES; n++) begin
            axis_select[n]    = select && block == 8'(4 + n);
            feedback_select[n] = select && block == 8'(12 + n);
            actuator_select[n] = select && block == 8'(20 + n);
        end
    end

    always_comb begin
        rdata = ({32{node_q}} & node_rdata) | ({32{bus_q}} & bus_rdata) | ({32{peripherals_q}} & peripherals_rdata);
        for (int n = 0; n < AXES; n++)
        rdata = rdata | ({32{axis_q[n]}} & axis_rdata[32*n +: 32]) | ({32{feedback_q[n]}} & feedback_rdata[32*n +: 32])
                          | ({32{actuator_q[n]}} & actuator_rdata[32*n +: 32]);
    end

    always_ff @(posedge clk) begin
        node_q    <= node_select;
        bus_q    <= bus_select;
        peripherals_q   <= peripherals_select;
        axis_q    <= axis_select;
        feedback_q <= feedback_select;
        actuator_q <= actuator_select;
    end

    wire unused = &{1'b0, address[7:0]};

`ifdef FORMAL
    localparam int BLOCKS = 3 + 3 * AXES;
    logic past = 1'b0;
    wire [BLOCKS-1:0] chosen = {
        actuator_select, feedback_select, axis_select, peripherals_select, bus_select, node_select
    };
    wire [32*BLOCKS-1:0] answers = {
        actuator_rdata, feedback_rdata, axis_rdata, peripherals_rdata, bus_rdata, node_rdata
    };
    logic [BLOCKS-1:0] chosen_q;
    always @(posedge clk) begin
        past     <= 1'b1;
        chosen_q <= chosen;
        assert ((chosen & (chosen - 1'b1)) == '0);
        assert (select || chosen == '0);
        assert (node_select == (select && block == 0) && bus_select == (select && block == 1));
        for (int n = 0; n < BLOCKS; n++)
        if (past && chosen_q[n]) assert (rdata == answers[32*n+:32]);
        if (past && chosen_q == '0) assert (rdata == 0);
        cover (past && chosen_q[BLOCKS-1] && chosen[0] && rdata == 3);
    end
`endif
endmodule

`default_nettype wire
