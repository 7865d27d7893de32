// SPDX-License-Identifier: Apache-2.0
// bridge_pwm -- make edge-aligned sign-magnitude PWM for an H-bridge driver with two inputs.
//
// latency   10 cycles from valid to the first period border that applies the command. Both pins are
//           low 1 cycle after enable falls.
// rate      one command per 9 cycles; a command that comes sooner replaces the one before it. Any
//           period is allowed.
// accuracy  A period drives for |command| * period / 2^15 cycles. The fraction of a cycle is
//           carried into the next period (first-order noise shaping), so that over any number of
//           periods the driven time is right to 1 cycle in total.
// behaviour Between pulses both pins are high: the bridge shorts the motor (slow decay), so that
//           the mean voltage is linear in the command. If the motor coasted between pulses, the
//           current at a small duty cycle would follow the square of the duty cycle. While enable
//           is low both pins are low and the motor coasts.
// limits    The block inserts no dead time; the driver must do that itself.
// source    TI DRV8870 (SLVSCY8A table 1: IN1 IN2 = 10 forward, 01 reverse, 11 brake, 00 coast) and
//           its relatives. The driver sleeps after 1 ms of 00 and wakes in 50 us.
// model     tb/drive/bridge_pwm.py, equal in every bit of every cycle
// proved    Both pins are low one cycle after enable was low. A pulse has one direction, which
//           changes only at a period border.
`default_nettype none

module bridge_pwm (
    input  wire               clk,
    input  wire               rst,
    input  wire        [15:0] period,    // cycles; taken with a command; 0: off
    input  wire               enable,    // level: 0: both pins low, and any command is forgotten
    input  wire               valid,     // strobe: command is new
    input  wire signed [15:0] command,   // full scale 2^15
    output logic              bridge_a,  // level: pin; alone high while a positive command drives
    output logic              bridge_b   // level: pin; alone high while a negative command drives
);
    // the multiplier: |command| * period, in 2^-15 cycle
    logic busy, asked_reverse;
    logic [2:0] step;
    logic [15:0] asked_period, multiplier;
    logic [30:0] multiplicand, product;

    // the period that begins at the next border
    logic        next_reverse;
    logic [15:0] next_period;
    logic [30:0] next_on;  // 2^-15 cycle

    // the running period
    logic powered, reverse;  // powered: the period is not 0
    logic [15:0] left, on_left;  // cycles after this one: of the period, of its pulse
    logic [14:0] fraction;  // 2^-15 cycle that are still to be driven

    wire  [30:0] single = multiplier[0] ? multiplicand : '0;
    wire  [30:0] double = multiplier[1] ? multiplicand << 1 : '0;
    wire  [30:0] sum = product + single + double;
    wire  [15:0] shaped = {1'b0, next_on[14:0]} + {1'b0, fraction};
    wire  [15:0] on = next_on[30:15] + {15'd0, shaped[15]};

    wire         border = left == 16'd0;
    wire         drives = border ? on != 16'd0 : on_left != 16'd0;
    wire         direction = border ? next_reverse : reverse;
    wire         on_power = border ? next_period != 16'd0 : powered;

    always_ff @(posedge clk) begin
        if (valid) begin
            busy          <= 1'b1;
            step          <= '0;
            asked_reverse <= command[15];
            asked_period  <= period;
            multiplier    <= command[15] ? -command : command;
            multiplicand  <= {15'd0, period};
            product       <= '0;
        end else if (busy) begin
            step         <= step + 1'b1;
            multiplier   <= multiplier >> 2;
            multiplicand <= multiplicand << 2;
            product      <= sum;
            if (step == 3'd7) begin
                busy         <= 1'b0;
                next_reverse <= asked_reverse;
                next_period  <= asked_period;
                next_on      <= sum;
            end
        end

        left    <= !border ? left - 1'b1 : next_period == 16'd0 ? 16'd0 : next_period - 1'b1;
        on_left <= (border ? on : on_left) - {15'd0, drives};
        reverse <= direction;
        powered <= on_power;
        if (border) fraction <= shaped[14:0];

        bridge_a <= on_power && !(drives && direction);
        bridge_b <= on_power && !(drives && !direction);
        if (rst || !enable) begin
            busy         <= 1'b0;
            next_period  <= '0;
            next_on      <= '0;
            next_reverse <= 1'b0;
            left         <= '0;
            on_left      <= '0;
            reverse      <= 1'b0;
            powered      <= 1'b0;
            fraction     <= '0;
            bridge_a     <= 1'b0;
            bridge_b     <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            if (!$past(enable)) assert (!bridge_a && !bridge_b);
            if ($past(left) != 0 && $past(enable) && !$past(rst))
                assert (reverse == $past(reverse));
            if (bridge_a && !bridge_b) assert (!reverse);
            if (bridge_b && !bridge_a) assert (reverse);
            if (!powered) assert (!bridge_a && !bridge_b);
            cover (bridge_b && !bridge_a && left != 0);
            cover (bridge_a && bridge_b);
        end
    end
`endif
endmodule

`default_nettype wire
