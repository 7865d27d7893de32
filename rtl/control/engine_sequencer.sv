// SPDX-License-Identifier: Apache-2.0
// engine_sequencer -- fetch the lines of the microcode of motion_engine, decide the jumps, and
// serve one axis after the other at each tick.
//
// latency   1 cycle from tick to busy; a jump costs no cycle. The condition of a line is tested one
//           cycle after the line is fetched, its action is executed two cycles after.
// rate      one line per cycle; a tick when the one before has been served. overrun reports a tick
//           that comes sooner.
// method    The line that follows and the line that a jump leads to are both read. The condition is
//           tested while they arrive, so the test begins at flip-flops and not at the block RAM.
// model     tb/control/engine_sequencer.py, equal in every bit of every cycle
// proved    Whatever the conditions are: a tick ends only after every axis was served, once and in
//           order; an axis is served for a tick only while the tick is busy, and every tick that
//           finds another one busy is reported.
// proof     depth 10, AXES = 3
`default_nettype none

module engine_sequencer #(
    parameter int AXES        = 1,  // axes of the engine, 1 to 8
    parameter int FILTERS     = 0,  // filters of each axis, 0 to 4
    parameter int TICK_CYCLES = 0   // cycles between two ticks; 0: not checked
) (
    input  wire         clk,
    input  wire         rst,
    input  wire         tick,        // strobe: servo tick
    input  wire  [63:0] conditions,  // levels, numbered as in tables/engine_microcode.py
    output logic [35:0] code,        // line that is fetched
    output logic [ 7:0] action,      // action of the line that is executed; 0: none
    output logic [ 2:0] axis,        // number of the axis that is served
    output logic        busy,        // level: a tick is being served
    output logic        overrun,     // strobe: a tick came before the last one was served
    output logic [15:0] cycles       // cycles that a tick needs at most
);
    localparam [5:0] NEVER = 6'd0, TICKING = 6'd16, LOOP = 6'd25, DUE = 6'd26, WRAPPED = 6'd28;
    localparam [7:0] FIRST_AXIS = 8'h21, NEXT_AXIS = 8'h22, FINISHED = 8'h25;
    localparam [7:0] SET_TICKING = 8'h50;
    localparam [2:0] COUNT = 3'd5;

    wire [35:0] next_code, target_code;
    logic [9:0] next_line, target_line;
    logic        unless;  // the line before jumps unless its condition holds
    logic [ 5:0] condition;  // of the line before
    logic        ticking;  // the axes are served because of a tick
    logic [ 4:0] count;  // how often a line is still repeated
    logic [ 7:0] read_action;  // action or target of the line whose operand is there
    logic [63:0] all;

    always_comb begin
        all = conditions;
        all[NEVER] = 1'b0;
        all[TICKING] = ticking;
        all[LOOP] = count != 5'd1;
        all[DUE] = busy;
        all[WRAPPED] = axis == 3'd0;
    end

    wire       jump = all[condition] ^ unless;
    wire [9:0] line = jump ? target_line : next_line;
    wire [9:0] next = rst ? '0 : line + 1'b1;
    wire       acts = condition == NEVER && !unless;
    wire       finishes = action == FINISHED;

    assign code = jump ? target_code : next_code;

    engine_microcode #(
        .AXES       (AXES),
        .FILTERS    (FILTERS),
        .TICK_CYCLES(TICK_CYCLES)
    ) u_microcode (
        .clk,
        .next,
        .target(code[35:26]),
        .next_code,
        .target_code,
        .cycles
    );

    always_ff @(posedge clk) begin
        next_line   <= next;
        target_line <= code[35:26];
        unless      <= code[25];
        condition   <= code[24:19];
        read_action <= code[33:26];
        action      <= acts ? read_action : '0;
        if (condition == LOOP) count <= count - 1'b1;
        if (action[7:5] == COUNT) count <= action[4:0];
        if (action == FIRST_AXIS) axis <= '0;
        if (action == NEXT_AXIS) axis <= axis == 3'(AXES - 1) ? '0 : axis + 1'b1;
        ticking <= action == SET_TICKING || (ticking && !finishes);
        busy    <= tick || (busy && !finishes);
        overrun <= tick && busy && !finishes;
        if (rst) {unless, condition, read_action, action, axis, ticking, busy, overrun} <= '0;
    end

`ifdef FORMAL
    localparam [2:0] IDLE = 3'd0, SERVE = 3'd2, LEAVE = 3'd3, ENTER = 3'd4;
    logic       past = 1'b0;
    logic [3:0] fill = '0;  // cycles since reset, until the pipeline is full
    logic [9:0] read_line, done_line;  // numbers of the lines in the pipeline
    logic [3:0] served = '0;  // axes that this tick has served
    wire  [2:0] region;  // of the line that is executed
    wire  [2:0] after = served == 4'(AXES) ? 3'd0 : served[2:0];

    engine_regions u_regions (
        .line(done_line),
        .region
    );

    always @(posedge clk) begin
        fill <= rst ? '0 : fill == 4'd4 ? fill : fill + 1'b1;
        {read_line, done_line} <= {line, read_line};
        past <= 1'b1;
        if (!past) assume (rst);
        if (rst || action == FIRST_AXIS) served <= '0;
        else if (action == NEXT_AXIS && ticking) served <= served + 1'b1;
        assert (fill <= 4'd4);
        if (past && fill < 4'd4)
            assert (line == 10'(fill) && !ticking && action == '0 && read_action == '0);
        if (fill == 4'd4 && !rst) begin
            assert (axis < 3'(AXES) && served <= 4'(AXES));
            assert (!ticking || busy);
            if (region == IDLE) assert (!ticking);
            if (region == ENTER) assert (ticking);
            if (region == SERVE) assert (ticking);
            if (region != IDLE && region != LEAVE && region != ENTER && ticking)
                assert (served == {1'b0, axis});
            if (region == LEAVE) assert (ticking && served != '0 && axis == after);
            if (finishes) assert (busy && ticking && served == 4'(AXES));
            if (action == NEXT_AXIS && ticking) assert (served == {1'b0, axis});
            assert (overrun == $past(tick && busy && !finishes));
            cover (overrun && line == 10'd6);
        end
    end
`endif
endmodule

`default_nettype wire
