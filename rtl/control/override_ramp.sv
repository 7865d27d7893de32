// SPDX-License-Identifier: Apache-2.0
// override_ramp -- how fast a profile is played: 0 to 100 %, brought to its setting with limited slope and limited curvature.
//
// latency  2 clk from tick to rate
// rate     one step per tick, a tick at most every 2 clk
// exact    ends at the setting, whatever the setting did on the way; while nothing moves it is there at once
// source   law of approach_law on the distance to the setting
// model    tb/control/override_ramp.py, equal in every bit of every cycle
// proved   never above 100 %, never below 0
// proof    depth 12
`default_nettype none

module override_ramp (
    input  wire                  clk,
    input  wire                  rst,
    input  wire        [31:0]    slope,                         // 2^-32 per tick; 0: no limit
    input  wire        [31:0]    curve,                         // 2^-32 per tick2; 0: no limit but slope
    input  wire        [16:0]    percent,                       // 2^-16: 65536 is 100 %, more is taken for it
    input  wire                  pause,                         // the setting is 0
    input  wire                  moving,                        // a profile is being played
    input  wire                  tick,                          // strobe: servo tick
    output logic       [32:0]    rate                           // 2^-32 tick of the profile per tick
);
    localparam int W = 36;

    logic [W-1:0] pace, area, step;                             // slope now, what it still adds, and its change
    logic         upward, decided, last, grow, fall, arrived;
    wire          turn, upward_now, last_now, grow_now, fall_now;

    wire        [32:0]  setting  = pause ? 33'd0 : percent[16] ? 33'h1_0000_0000 : {1'b0, percent[15:0], 16'd0};
    wire signed [W-1:0] distance = $signed({3'b0, rate}) - $signed({3'b0, setting});
    wire        [W-1:0] limit    = W'(slope);
    wire        [W-1:0] change   = curve == 32'd0 || curve > slope ? W'(slope) : W'(curve);
    wire                at_once  = !moving || slope == 32'd0;

    approach_law #(.W(W)) u_law (.change(pace == '0 ? change : step), .limit, .value(distance), .slope(pace), .upward, .area, .turn, .upward_now,
                                 .last(last_now), .grow(grow_now), .fall(fall_now));

    wire [W-1:0] pace_now = grow ? pace + step : fall ? pace - step : pace;
    wire [W-1:0] moved    = upward ? W'(rate) + pace_now : W'(rate) - pace_now;

    always_ff @(posedge clk) begin
        decided <= tick && moving;
        if (tick) begin
            if (turn) step <= change;                           // one change for a whole ramp, even if the setting moves
            upward <= upward_now;
            last   <= last_now && !arrived;                     // a rest of one tick before the next ramp
            grow   <= grow_now && !arrived;
            fall   <= fall_now;
        end
        if (decided) begin
            pace    <= pace_now;
            arrived <= last && rate != setting;
            area    <= grow ? area + pace_now : fall ? area - pace : area;
            rate    <= last ? setting : moved[W-1] ? 33'd0 : moved > W'(33'h1_0000_0000) ? 33'h1_0000_0000 : moved[32:0];
        end
        if (at_once) begin
            rate    <= setting;
            pace    <= '0;
            area    <= '0;
            decided <= 1'b0;
            arrived <= 1'b0;
        end
        if (rst) begin
            rate    <= 33'h1_0000_0000;
            pace    <= '0;
            area    <= '0;
            decided <= 1'b0;
            arrived <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    initial rate = 33'h1_0000_0000;
    always_ff @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) assert (rate <= 33'h1_0000_0000);
        cover (past && !rst && rate == 33'd0 && moving && slope != 32'd0);
    end
`endif
endmodule

`default_nettype wire
