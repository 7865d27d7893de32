// SPDX-License-Identifier: Apache-2.0
// status_inputs -- slow levels of another machine, such as its lamps by opto-coupler: bounce taken out, changes told.
//
// latency  time_ms less 0 to 1 ms, and 3 clk, from a clean edge to level, 1 clk more to rose and fell      rate  a sample per ms
// source   S4: the EDM machine tells by contacts whether it cuts and whether something is wrong
// model    tb/sense/status_inputs.py, equal in every bit of every cycle
// proved   rose and fell tell every change of level, one each; none of them until it has settled after reset
// proof    depth 16, CLK_HZ = 2000, W = 1
// bounds   pulses of time_ms pass, those of time_ms - 1 ms and shorter never do; what stands at reset is no change
`default_nettype none

module status_inputs #(
    parameter int CLK_HZ = 50_000_000,
    parameter int W      = 2                    // levels
) (
    input  wire                  clk,
    input  wire                  rst,           // level follows the inputs
    input  wire        [15:0]    time_ms,       // a level must stand this long; 0 counts as 1
    input  wire        [W-1:0]   inputs,        // asynchronous
    output logic       [W-1:0]   level,
    output logic       [W-1:0]   rose,          // strobe
    output logic       [W-1:0]   fell           // strobe
);
    if (CLK_HZ < 1000) begin : g_check CLK_HZ_MUST_BE_AT_LEAST_1000 u_error (); end

    localparam int SETTLE = 4;                  // clk: the synchroniser fills
    localparam int S      = $clog2(SETTLE + 3);

    logic [W-1:0] synchronous, rejected, level_q;
    logic [S-1:0] settle;

    synchroniser #(.W(W)) u_inputs (.clk, .rst, .d(inputs), .q(synchronous));
    event_filter #(.LEVELS(W), .W(16), .SPARE_W(1), .SKIP_W(20), .SETTLE(SETTLE)) u_filter (.clk, .rst, .skip(20'(CLK_HZ / 1000 - 1)),
        .needed(time_ms), .spare(1'b0), .level(synchronous), .filtered(level), .rejected);

    wire settled = settle == '0;

    always_ff @(posedge clk) begin
        level_q <= level;
        rose    <= settled ? level & ~level_q : '0;
        fell    <= settled ? ~level & level_q : '0;
        settle  <= settle - S'(!settled);
        if (rst) begin
            rose   <= '0;
            fell   <= '0;
            settle <= S'(SETTLE + 2);
        end
    end

    wire unused = &{1'b0, rejected};
endmodule

`default_nettype wire
