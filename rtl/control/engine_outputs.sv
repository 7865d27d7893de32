// SPDX-License-Identifier: Apache-2.0
// engine_outputs -- hold what motion_engine reported last of one axis: state, target and velocity;
// give strobes for the results that an axis uses at once.
//
// latency   1 cycle from a result to the levels, 0 cycles to the strobes
// rate      one result per cycle
// behaviour pending is high from the cycle in which waits is high until the state after the last
//           request is shown.
// model     tb/control/engine_outputs.py, equal in every bit of every cycle
// proved    pending falls only with a state that was given while no request waited.
`default_nettype none

module engine_outputs (
    input  wire                clk,
    input  wire                rst,
    // motion_engine
    input  wire                valid,          // strobe: result is new, and of this axis
    input  wire         [ 2:0] kind,           // number of what it is
    input  wire signed  [47:0] result,         // value
    input  wire                flag,           // level: its flag
    input  wire                waits,          // level: a request of this axis is not done yet
    input  wire                line_start,     // strobe: the lines of motor steps begin
    // the profile
    output logic               moving,         // level: a profile is being played
    output logic               armed,          // level: it waits for start_at
    output logic        [ 4:0] queue_free,     // segments that can be queued
    output logic               pending,        // level: a request is not done and shown
    output logic signed [47:0] target,         // 2^-16 period
    output logic               line_up,        // level: the target of the line moved up
    output logic               line_down,      // level: the target of the line moved down
    output logic               underrun,       // strobe: a segment is missing
    // the servo
    output logic signed [31:0] velocity,       // 2^-16 period/tick
    output logic signed [31:0] error,          // 2^-16 period, target - position
    output logic               saturated,      // level: the command is at its limit
    output logic               error_valid,    // strobe: error is new in the next cycle
    output logic               too_far,        // level: with error_valid, it is above its limit
    output logic               command_valid,  // strobe: command is new
    output logic signed [15:0] command         // full scale 2^15, with command_valid
);
    // as in tables/engine_microcode.py
    localparam [2:0] STATE = 3'd0, TARGET = 3'd1, TARGET_VELOCITY = 3'd2, VELOCITY = 3'd3;
    localparam [2:0] ERROR = 3'd4, COMMAND = 3'd5, UNDERRUN = 3'd7;
    localparam int MOVING = 1, ARMED = 8, QUEUED = 20;

    logic unshown;  // the state was given before the last request
    logic target_up, target_down;  // the target moves up, down

    assign pending       = waits || unshown;
    assign error_valid   = valid && kind == ERROR;
    assign too_far       = flag;
    assign command_valid = valid && kind == COMMAND;
    assign command       = result[15:0];
    assign underrun      = valid && kind == UNDERRUN;

    always_ff @(posedge clk) begin
        unshown <= waits || (unshown && !(valid && kind == STATE));
        if (line_start) {line_up, line_down} <= {target_up, target_down};
        if (valid)
            case (kind)
                STATE: begin
                    moving     <= result[MOVING];
                    armed      <= result[ARMED];
                    queue_free <= 5'd16 - result[QUEUED+:5];
                end
                TARGET:          target <= result;
                TARGET_VELOCITY: {target_down, target_up} <= {result[47], !result[47] && |result};
                VELOCITY:        velocity <= result[31:0];
                ERROR:           error <= result[31:0];
                COMMAND:         saturated <= flag;
                default:         ;
            endcase
        if (rst) begin
            {unshown, moving, armed, target, target_up, target_down} <= '0;
            {line_up, line_down} <= '0;
            {velocity, error, saturated} <= '0;
            queue_free <= 5'd16;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst) && $past(pending) && !pending)
            assert ($past(valid && kind == STATE && !waits));
        cover (past && $past(pending) && !pending && moving);
    end
`endif
endmodule

`default_nettype wire
