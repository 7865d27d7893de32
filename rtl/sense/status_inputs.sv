// SPDX-License-Identifier: Apache-2.0
// status_inputs -- slow levels of another machine, such as its lamps by opto-coupler: bounce taken
// out, changes told.
//
// latency  time_ms to time_ms + 1 ms, and 2 clk, from the last bounce to level, rose and fell
//          rate  a change per time_ms and 1 clk
// source   S4: the EDM machine tells by contacts whether it cuts and whether something is wrong
// model    tb/sense/status_inputs.py, equal in every bit of every cycle
// proof    depth 24, CLK_HZ = 3000, W = 1
// proved   rose and fell tell every change of level, one each, and no other; a level changes only
//          after it has stood without a break
// bounds   what stands at reset is no change
`default_nettype none

module status_inputs #(
    parameter int CLK_HZ = 50_000_000,
    parameter int W      = 2            // levels
) (
    input  wire          clk,
    input  wire          rst,      // level follows the inputs
    input  wire  [ 15:0] time_ms,  // a level must stand this long without a break
    input  wire  [W-1:0] inputs,   // asynchronous
    output logic [W-1:0] level,
    output logic [W-1:0] rose,     // strobe
    output logic [W-1:0] fell      // strobe
);
    if (CLK_HZ < 1000) begin : g_check
        CLK_HZ_MUST_BE_AT_LEAST_1000 u_error ();
    end

    localparam int SETTLE = 4;  // clk after reset in which level follows: the synchroniser fills
    localparam int MS = CLK_HZ / 1000;
    localparam int P = MS > 1 ? $clog2(MS) : 1;

    logic [W-1:0] now, level_q;
    logic [  2:0] settle;  // clk left of settling, one more for level_q
    logic [P-1:0] part;  // clk of this ms

    wire          settling = settle > 3'd1;
    wire          ms = part == P'(MS - 1);

    synchroniser #(
        .W(W)
    ) u_inputs (
        .clk,
        .rst,
        .d(inputs),
        .q(now)
    );

    assign rose = settle == '0 ? level & ~level_q : '0;
    assign fell = settle == '0 ? ~level & level_q : '0;

    always_ff @(posedge clk) begin
        level_q <= level;
        settle  <= settle - 3'(settle != '0);
        part    <= ms ? '0 : part + 1'b1;
        if (rst) begin
            settle <= 3'(SETTLE + 1);
            part   <= '0;
        end
    end

    for (genvar n = 0; n < W; n++) begin : g_input
        logic [15:0] stood;  // ends of ms since it has differed without a break

        wire         differs = now[n] != level[n];
        wire         ripe = ms && stood >= time_ms;

        always_ff @(posedge clk) begin
            stood <= !differs || ripe ? '0 : stood + 16'(ms);
            if (differs && ripe) level[n] <= now[n];
            if (rst || settling) begin
                stood    <= '0;
                level[n] <= now[n];
            end
        end
    end

`ifdef FORMAL
    logic        past = 1'b0;
    // clk that input 0 has differed from its level, up to the last one
    logic [15:0] unbroken;
    wire  [31:0] stood = 32'(g_input[0].stood);
    always @(posedge clk) begin
        past     <= 1'b1;
        unbroken <= rst || settling || now[0] == level[0] ? '0 : unbroken + 16'(!(&unbroken));
        if (!past) assume (rst);
        // unbroken does not reach its end
        if (past) assume (time_ms == $past(time_ms) && time_ms < 16'd1000);
        if (past) begin
            assert (settle <= 3'(SETTLE + 1) && part < P'(MS));
            assert (stood <= 32'(time_ms));
            if (stood != 0) assert (32'(unbroken) >= (stood - 1) * MS + 32'(part) + 1);
        end
        if (past && !$past(rst)) begin
            assert (rose[0] == (settle == '0 && level[0] && !$past(level[0])));
            assert (fell[0] == (settle == '0 && !level[0] && $past(level[0])));
            if (!$past(settling) && level[0] != $past(level[0]))
                assert (32'($past(unbroken)) >= 32'(time_ms) * MS);
            cover (rose[0] && time_ms == 16'd2);
            cover (fell[0] && time_ms == 16'd1);
        end
    end
`endif
endmodule

`default_nettype wire
