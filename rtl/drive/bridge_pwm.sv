// SPDX-License-Identifier: Apache-2.0
// bridge_pwm -- make edge-aligned sign-magnitude PWM for an H-bridge driver with two inputs.
//
// latency   4 cycles from valid to the first period border that applies the command. Both pins are
//           low 1 cycle after enable falls.
// rate      one command per cycle; the last one before a border is applied. Any period is allowed.
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
    // the last command
    logic asked_reverse;
    logic [15:0] asked_period, amount;

    // the period that begins at the next border
    logic        next_reverse;
    logic [15:0] next_period;
    logic [31:0] next_on;  // 2^-15 cycle

    // the running period
    logic powered, reverse;  // powered: the period is not 0
    logic [15:0] length, elapsed, on;  // cycles: of the period, before this one, of its pulse
    logic [14:0] fraction;  // 2^-15 cycle that are still to be driven

    wire  [31:0] due = next_on + 32'(fraction);
    wire  [15:0] next_elapsed = elapsed + 1'b1;
    wire         border = !powered || next_elapsed == length;
    wire         drives = elapsed < on;
    wire         unused = &{1'b0, due[31]};

    always_ff @(posedge clk) begin
        if (valid) begin
            asked_reverse <= command[15];
            asked_period  <= period;
            amount        <= command[15] ? -command : command;
        end
        next_reverse <= asked_reverse;
        next_period  <= asked_period;
        next_on      <= amount * asked_period;

        elapsed      <= next_elapsed;
        if (border) begin
            elapsed  <= '0;
            length   <= next_period;
            powered  <= next_period != 16'd0;
            reverse  <= next_reverse;
            on       <= due[30:15];
            fraction <= due[14:0];
        end

        bridge_a <= powered && !(drives && reverse);
        bridge_b <= powered && !(drives && !reverse);
        if (rst || !enable) begin
            asked_period <= '0;
            amount       <= '0;
            next_period  <= '0;
            next_on      <= '0;
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
            if (!$past(border) && $past(enable) && !$past(rst)) assert (reverse == $past(reverse));
            if (bridge_a && !bridge_b) assert (!$past(reverse));
            if (bridge_b && !bridge_a) assert ($past(reverse));
            if (!$past(powered)) assert (!bridge_a && !bridge_b);
            cover (bridge_b && !bridge_a && !border);
            cover (bridge_a && bridge_b);
        end
    end
`endif
endmodule

`default_nettype wire
