// SPDX-License-Identifier: Apache-2.0
// fine_stage -- control the fine stage: a PID loop with the same target as the main servo, which
// drives the DAC.
//
// latency  134 cycles from tick to command, 125 in a tick in which the integral is retaken
// rate     one command per tick, a tick at least 134 cycles after the one before
// behaviour  While the fine stage does not hold the position, its command returns to the middle by
//          RETURN in each tick. That is slow enough for the main servo to follow. When the fine
//          stage takes over, its loop continues from the command that it has at that moment.
// source   S0: piezo on top of a motor stage
// model    tb/drive/fine_stage.py, equal in every bit of every cycle
`default_nettype none

module fine_stage #(
    parameter signed [15:0] RETURN = 16'sd16  // command counts per tick, towards the middle
) (
    input  wire                clk,
    input  wire                rst,
    input  wire                enable,         // level: the interlock allows the drive
    input  wire                hold,           // level: the fine stage holds the position
    input  wire         [23:0] kp,             // 2^-16 command/LSB of position
    input  wire         [23:0] ki,             // 2^-24 command/LSB of position, each tick
    input  wire         [23:0] kd,             // 2^-16 command/LSB of position per tick
    input  wire         [14:0] limit,          // largest |command|, full scale 2^15
    input  wire                gains_changed,  // strobe: kp is new
    input  wire                tick,           // strobe: target of this servo tick is known
    input  wire signed  [47:0] target,         // 2^-16 period
    input  wire signed  [47:0] position,       // 2^-16 period
    output logic               valid,          // strobe: command is new
    output logic signed [15:0] command,        // full scale 2^15
    output logic               saturated       // level: it holds, and its command is at its limit
);
    wire signed [15:0] moved = command + (command[15] ? RETURN : -RETURN);
    wire signed [15:0] closer = moved[15] == command[15] ? moved : 16'sd0;
    wire               at_limit;

    pid_loop u_loop (
        .clk,
        .rst,
        .power       (enable),
        .closed_loop (hold && enable),
        .kp,
        .ki,
        .kd,
        .limit,
        .gains_changed,
        .tick,
        .target,
        .position,
        .open_command(enable ? closer : 16'sd0),
        .valid,
        .command,
        .at_limit
    );

    assign saturated = hold && at_limit;
endmodule

`default_nettype wire
