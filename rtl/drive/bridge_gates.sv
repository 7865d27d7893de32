// SPDX-License-Identifier: Apache-2.0
// bridge_gates -- the four gates of an H-bridge from the two levels of bridge_pwm, with dead time: never both of a leg.
//
//   bridge_a, bridge_b   10: a high, b low    01: a low, b high    11: both low, or all off with fast_decay    00: all off
//   brake                both low, whatever they say: the motor is shorted
//
// latency  1 clk from a level to a gate that goes off, dead_time clk more to one that comes on
// rate     any
// dead     a gate comes on when both of its leg have been off for dead_time clk, 0 counts as 1, and a command that is taken
//          back within them makes no pulse
// pulse    a gate that came on stays on for minimum_pulse clk, so that no switch is left half on; all off (00) does not wait
// decay    the brake between pulses goes over the low side, where it recharges the bootstrap capacitors of the high side.
//          fast_decay: the current goes back into the supply instead, and a small command holds less
// model    tb/drive/bridge_gates.py, equal in every bit of every cycle
// proved   whatever the inputs and settings do: never both gates of a leg, nor one within a clk after the other; each comes on
//          after dead_time clk of both off; with all off wanted, all off one clk later
`default_nettype none

module bridge_gates (
    input  wire                  clk,
    input  wire                  rst,
    input  wire        [7:0]     dead_time,                 // clk
    input  wire        [7:0]     minimum_pulse,             // clk
    input  wire                  fast_decay,                // level: 1: between pulses all gates are off
    input  wire                  brake,                     // level: 1: shorts the motor, also while the drive is off
    input  wire                  bridge_a,                  // level, from bridge_pwm
    input  wire                  bridge_b,
    output logic                 gate_a_high,               // pins, 1: the switch conducts
    output logic                 gate_a_low,
    output logic                 gate_b_high,
    output logic                 gate_b_low
);
    wire       shorts    = brake || (bridge_a && bridge_b && !fast_decay);
    wire [1:0] wants_high = {bridge_b && !bridge_a, bridge_a && !bridge_b} & {2{!brake}};       // legs {b, a}
    wire [1:0] wants_low  = {bridge_a && !bridge_b, bridge_b && !bridge_a} | {2{shorts}};
    wire       all_off    = !brake && !bridge_a && !bridge_b;

    logic [1:0] high, low;
    logic [7:0] since [0:1];                                // clk since a gate of the leg changed, less one, at most 255

    always_comb {gate_b_high, gate_a_high, gate_b_low, gate_a_low} = {high, low};

    for (genvar leg = 0; leg < 2; leg++) begin : g_leg
        wire on       = high[leg] || low[leg];
        wire unwanted = (high[leg] && !wants_high[leg]) || (low[leg] && !wants_low[leg]);
        wire elapsed  = {1'b0, since[leg]} + 9'd1 >= {1'b0, on ? minimum_pulse : dead_time};
        wire off      = unwanted && (elapsed || all_off);
        wire comes_on = !on && elapsed && (wants_high[leg] || wants_low[leg]);

        always_ff @(posedge clk) begin
            since[leg] <= off || comes_on ? 8'd0 : since[leg] == '1 ? '1 : since[leg] + 1'b1;
            if (off) {high[leg], low[leg]} <= 2'b00;
            if (comes_on) {high[leg], low[leg]} <= {wants_high[leg], wants_low[leg]};
            if (rst) begin
                since[leg] <= '0;
                high[leg]  <= 1'b0;
                low[leg]   <= 1'b0;
            end
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [7:0] both_off [0:1];                             // clk
    always @(posedge clk) begin
        past <= 1'b1;
        for (int leg = 0; leg < 2; leg++)
            both_off[leg] <= rst || high[leg] || low[leg] ? '0 : both_off[leg] == '1 ? '1 : both_off[leg] + 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert ((high & low) == 2'b00);
            assert (($past(high) & low) == 2'b00 && ($past(low) & high) == 2'b00);
            if ($past(all_off)) assert ({high, low} == 4'b0000);
            for (int leg = 0; leg < 2; leg++) if (!$past(rst)) begin
                if (!high[leg] && !low[leg]) assert (both_off[leg] == since[leg]);
                if ((high[leg] && !$past(high[leg])) || (low[leg] && !$past(low[leg])))
                    assert ({1'b0, $past(both_off[leg])} + 9'd1 >= {1'b0, $past(dead_time)});
            end
            cover (gate_a_high && gate_b_low);
            cover (gate_a_low && gate_b_low);
        end
    end
`endif
endmodule

`default_nettype wire
