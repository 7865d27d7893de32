// SPDX-License-Identifier: Apache-2.0
// pid_servo -- PID with feed-forward of velocity and acceleration, once a tick, one shift-and-add multiplier for all terms.
//
//   2^16 command = kp e + integral + kd (target_velocity - velocity) + kv target_velocity + ka target_acceleration
//   with e = target - position, integral += ki e, the units of axis_registers, and the result rounded down.
//
// latency  135 clk from tick to valid; the inputs are taken 8 clk after tick, when target and velocity of this tick stand
// rate     one command per tick, a tick at most every 135 clk (an earlier one is ignored)
// windup   the integral stays inside integral_limit; it does not grow in a direction in which the last command stood at
//          its limit or the guard blocks; it rests while |e| <= dead_band and the profile stands; it is zero in open loop
//          and while the guard blocks both directions (drive off). The first command after that is zero unless its inputs
//          were taken since, so that the drive comes on without a jump
// model    tb/control/pid_servo.py, equal in every bit of every cycle
`default_nettype none

module pid_servo (
    input  wire                  clk,
    input  wire                  rst,
    input  wire                  closed_loop,               // 0: command is open_command; error is still measured
    input  wire        [23:0]    kp,                        // 2^-16 command/LSB of position
    input  wire        [23:0]    ki,                        // 2^-24 command/LSB of position, each tick
    input  wire        [23:0]    kd,                        // 2^-16 command/(LSB/tick)
    input  wire        [23:0]    kv,                        // 2^-16 command/(LSB/tick)
    input  wire        [23:0]    ka,                        // 2^-8 command/(LSB/tick2)
    input  wire        [14:0]    output_limit,              // largest |command|
    input  wire        [14:0]    integral_limit,            // largest |integral|, of command
    input  wire        [15:0]    dead_band,                 // 2^-16 period
    input  wire                  tick,                      // strobe: servo tick
    input  wire signed [47:0]    target,                    // 2^-16 period
    input  wire signed [31:0]    target_velocity,           // 2^-16 period/tick
    input  wire signed [31:0]    target_acceleration,       // 2^-16 period/tick2
    input  wire                  moving,                    // a profile is being played
    input  wire signed [47:0]    position,                  // 2^-16 period
    input  wire signed [31:0]    velocity,                  // 2^-16 period/tick
    input  wire signed [15:0]    open_command,              // full scale 2^15; passed on as it is in open loop
    input  wire                  block_up,                  // level: the guard passes no positive command
    input  wire                  block_down,                // level: the guard passes no negative command
    output logic                 valid,                     // strobe: command is new, error belongs to it
    output logic signed [15:0]   command,                   // full scale 2^15
    output logic signed [31:0]   error,                     // 2^-16 period, target - position, held inside 32 bits
    output logic                 saturated                  // command stands at output_limit
);
    localparam [2:0] INTEGRAL = 3'd0, PROPORTIONAL = 3'd1, DERIVATIVE = 3'd2, VELOCITY = 3'd3, ACCELERATION = 3'd4;

    enum logic [2:0] {WAIT, SETTLE, TAKE, LOAD, MULTIPLY, LIMIT} state;

    logic [4:0]         step;                               // clk within a state
    logic [2:0]         term;
    logic signed [32:0] velocity_error;
    logic signed [31:0] velocity_taken, acceleration_taken;
    logic               standing;                           // no profile was being played
    logic               stale;                              // power was missing at some clk since the inputs were taken
    logic signed [63:0] operand;                            // shifted left
    logic [23:0]        gain;                               // shifted right
    logic signed [65:0] total;                              // 2^-16 command; of the integral: 2^-24 command
    logic signed [39:0] integral;                           // 2^-24 command
    logic               limited_up, limited_down;           // the last command stood at its limit

    wire signed [48:0] distance      = {target[47], target} - {position[47], position};
    wire               distance_fits = distance[48:31] == {18{distance[48]}};
    wire        [31:0] magnitude     = error[31] ? -error : error;
    wire               powerless     = !closed_loop || (block_up && block_down);
    wire               into_limit    = error[31] ? block_down || limited_down : block_up || limited_up;

    wire signed [65:0] integral_high = {27'd0, integral_limit, 24'd0};
    wire signed [65:0] new_integral  = total > integral_high ? integral_high : total < -integral_high ? -integral_high : total;

    wire signed [49:0] asked    = stale || powerless ? '0 : total[65:16];   // 2^0 command
    wire signed [49:0] high     = {35'd0, output_limit};
    wire               too_high = asked > high;
    wire               too_low  = asked < -high;

    always_ff @(posedge clk) begin
        valid <= 1'b0;
        step  <= step + 1'b1;
        case (state)
            SETTLE: if (step == 5'd6) state <= TAKE;
            TAKE: begin
                error              <= distance_fits ? distance[31:0] : {distance[48], {31{~distance[48]}}};
                velocity_error     <= {target_velocity[31], target_velocity} - {velocity[31], velocity};
                velocity_taken     <= target_velocity;
                acceleration_taken <= target_acceleration;
                standing           <= !moving;
                term               <= INTEGRAL;
                state              <= LOAD;
            end
            LOAD: begin
                case (term)
                    INTEGRAL: begin
                        total   <= powerless ? '0 : {{26{integral[39]}}, integral};
                        operand <= {{32{error[31]}}, error};
                        gain    <= into_limit || (standing && magnitude <= {16'd0, dead_band}) ? '0 : ki;
                    end
                    PROPORTIONAL: begin
                        integral <= new_integral[39:0];
                        total    <= {{8{new_integral[65]}}, new_integral[65:8]};
                        operand  <= {{32{error[31]}}, error};
                        gain     <= kp;
                    end
                    DERIVATIVE: begin
                        operand <= {{31{velocity_error[32]}}, velocity_error};
                        gain    <= kd;
                    end
                    VELOCITY: begin
                        operand <= {{32{velocity_taken[31]}}, velocity_taken};
                        gain    <= kv;
                    end
                    default: begin
                        operand <= {{24{acceleration_taken[31]}}, acceleration_taken, 8'd0};
                        gain    <= ka;
                    end
                endcase
                step  <= '0;
                state <= MULTIPLY;
            end
            MULTIPLY: begin
                if (gain[0]) total <= total + {{2{operand[63]}}, operand};
                operand <= operand <<< 1;
                gain    <= gain >> 1;
                if (step == 5'd23) begin
                    term  <= term + 1'b1;
                    state <= term == ACCELERATION ? LIMIT : LOAD;
                end
            end
            LIMIT: begin
                valid        <= 1'b1;
                command      <= !closed_loop ? open_command :
                                too_high     ? {1'b0, output_limit} :
                                too_low      ? -{1'b0, output_limit} : asked[15:0];
                saturated    <= closed_loop && (too_high || too_low);
                limited_up   <= closed_loop && too_high;
                limited_down <= closed_loop && too_low;
                state        <= WAIT;
            end
            default: begin
                step <= '0;
                if (tick) state <= SETTLE;
            end
        endcase
        stale <= powerless || (stale && state != TAKE);
        if (powerless) integral <= '0;
        if (rst) begin
            state        <= WAIT;
            valid        <= 1'b0;
            command      <= '0;
            error        <= '0;
            saturated    <= 1'b0;
            limited_up   <= 1'b0;
            limited_down <= 1'b0;
            stale        <= 1'b1;
            integral     <= '0;
        end
    end
endmodule

`default_nettype wire
