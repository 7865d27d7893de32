// SPDX-License-Identifier: Apache-2.0
// pid_servo -- PID controller with feed-forward of velocity and acceleration and two filters,
// computed once per tick in serial arithmetic.
//
//   2^16 command = kp e + integral + kd (target_velocity - velocity)
//                  + kv target_velocity + ka target_acceleration
//
// Here e = target - position, and integral += ki e. The sum is limited to output_limit, filtered
// (biquad_cascade, 16 fraction bits), rounded down and limited to output_limit again.
//
// latency   11 + 25 * TERMS + 36 * BIQUADS cycles from tick to valid
// rate      one command per tick, at most one tick per 10 + 25 * TERMS + 177 * BIQUADS cycles: 489
//           with all terms and filters, 136 for five terms without filters. An earlier tick is
//           ignored.
// behaviour The inputs are sampled 8 cycles after tick, when target and velocity of this tick are
//           valid. With all terms and filters the command follows after 208 cycles. Anti-windup:
//           the integral is limited to integral_limit; it does not grow in a direction in which the
//           last command was at its limit or the interlock blocks; it stays constant while |e| <=
//           dead_band and no profile is played; it is zero in open loop and while the interlock
//           blocks both directions (drive off). Bumpless transfer: after the loop was closed, the
//           drive came on or a gain changed, the command is held for one tick (at 0 while the drive
//           was off), and the integral takes the value from which the next command continues, as
//           far as integral_limit allows; with ki = 0 no integral can do that, and the command
//           follows the gains at once. A tick whose inputs were taken without power does not count:
//           the command is held. Opening the loop gives open_command at once.
// limits    TERMS = 2: PI, 3: PID, 5: with feed-forward; BIQUADS = 0: no filters. Ports of what is
//           left out are not read. Filter coefficients are numbered 0: b0, 1: b1, 2: b2, 3: -a1, 4:
//           -a2.
// model     tb/control/pid_servo.py, equal in every bit of every cycle
// proved    A command of the closed loop is within output_limit, whatever gains, inputs and filters
//           do, and saturated is high whenever the command is held at a limit. An open-loop command
//           is passed on unchanged. command changes only with valid.
// proof     depth 12, TERMS = 2, BIQUADS = 0
`default_nettype none

module pid_servo #(
    parameter int TERMS   = 5,  // number of terms, 2 to 5
    parameter int BIQUADS = 2   // number of filters, 0 to 4
) (
    input  wire                clk,
    input  wire                rst,
    input  wire                closed_loop,          // level: 0: command is open_command
    input  wire         [23:0] kp,                   // 2^-16 command/LSB of position
    input  wire         [23:0] ki,                   // 2^-24 command/LSB of position, each tick
    input  wire         [23:0] kd,                   // 2^-16 command/(LSB/tick)
    input  wire         [23:0] kv,                   // 2^-16 command/(LSB/tick)
    input  wire         [23:0] ka,                   // 2^-8 command/(LSB/tick2)
    input  wire         [14:0] output_limit,         // full scale 2^15, largest |command|
    input  wire         [14:0] integral_limit,       // full scale 2^15, largest |integral|
    input  wire         [15:0] dead_band,            // 2^-16 period
    input  wire                gains_changed,        // strobe: kp, kd, kv or ka is new, +-1 cycle
    input  wire         [ 3:0] filters_in_use,       // level: filter n is in use
    input  wire                coefficient_write,    // strobe: write a filter coefficient
    input  wire         [ 4:0] coefficient_address,  // filter * 8 + number of the coefficient
    input  wire signed  [31:0] coefficient,          // 2^-30
    input  wire                tick,                 // strobe: servo tick
    input  wire signed  [47:0] target,               // 2^-16 period
    input  wire signed  [31:0] target_velocity,      // 2^-16 period/tick
    input  wire signed  [31:0] target_acceleration,  // 2^-16 period/tick2
    input  wire                moving,               // level: a profile is being played
    input  wire signed  [47:0] position,             // 2^-16 period
    input  wire signed  [31:0] velocity,             // 2^-16 period/tick
    input  wire signed  [15:0] open_command,         // full scale 2^15, the open-loop command
    input  wire                block_up,             // level: no positive command passes
    input  wire                block_down,           // level: no negative command passes
    output logic               valid,                // strobe: command and error are new
    output logic signed [15:0] command,              // full scale 2^15
    output logic signed [31:0] error,                // 2^-16 period, target - position; saturates
    output logic               saturated             // level: command is at output_limit
);
    localparam [2:0] INTEGRAL = 3'd0, PROPORTIONAL = 3'd1, DERIVATIVE = 3'd2, VELOCITY = 3'd3;
    localparam [2:0] LAST_TERM = 3'(TERMS - 1);

    if (TERMS < 2 || TERMS > 5) begin : g_check_terms
        TERMS_MUST_BE_FROM_2_TO_5 u_error ();
    end
    if (BIQUADS < 0 || BIQUADS > 4) begin : g_check_biquads
        BIQUADS_MUST_BE_FROM_0_TO_4 u_error ();
    end

    enum logic [2:0] {
        WAIT,
        SETTLE,
        TAKE,
        LOAD,
        MULTIPLY,
        LIMIT,
        FILTER
    } state;

    logic [4:0] step;  // cycle within a state
    logic [2:0] term;
    logic signed [32:0] velocity_error;
    logic signed [31:0] velocity_taken, acceleration_taken;
    logic               standing;  // no profile was being played
    // the drive was off in some cycle since the inputs were taken
    logic               stale;
    logic signed [63:0] operand;  // shifted left
    logic        [23:0] gain;  // shifted right
    // 2^-16 command; 2^-24 command while it is the integral
    logic signed [65:0] total;
    logic signed [39:0] integral;  // 2^-24 command
    logic limited_up, limited_down;  // the last command was at its limit
    // the drive was off since the last computed command
    logic fresh;
    // a gain changed: since the inputs were taken, before they were taken
    logic changed, changed_taken;
    logic retaking;  // the integral absorbs the jump
    // 2^-16 command, limited, before the filters
    logic signed [31:0] sum;

    wire signed [48:0] distance = {target[47], target} - {position[47], position};
    wire distance_fits = distance[48:31] == {18{distance[48]}};
    wire signed [31:0] nearest_error = {distance[48], {31{~distance[48]}}};
    wire [31:0] magnitude = error[31] ? -error : error;
    wire in_dead_band = standing && magnitude <= {16'd0, dead_band};
    wire powerless = !closed_loop || (block_up && block_down);
    wire into_limit = error[31] ? block_down || limited_down : block_up || limited_up;

    wire signed [65:0] integral_high = {27'd0, integral_limit, 24'd0};
    wire signed [65:0] integral_from_low = total < -integral_high ? -integral_high : total;
    wire signed [65:0] new_integral = total > integral_high ? integral_high : integral_from_low;

    // the command before the filters: computed, or held
    wire no_power = stale || powerless;
    wire retakes = (fresh || changed || changed_taken || gains_changed) && ki != '0;
    wire hold = no_power || retakes;
    // 2^0 command
    wire signed [49:0] asked = hold ? {{34{sum[31]}}, sum[31:16]} : total[65:16];
    wire signed [49:0] high = {35'd0, output_limit};
    wire too_high = asked > high;
    wire too_low = asked < -high;
    wire signed [31:0] limit = {1'b0, output_limit, 16'd0};
    wire signed [31:0] computed = {asked[15:0], hold ? sum[15:0] : total[15:0]};
    wire signed [31:0] held = too_high ? limit : too_low ? -limit : computed;

    wire total_fits = total[65:33] == {33{total[65]}};
    wire signed [33:0] total_near = total_fits ? total[33:0] : {total[65], {33{~total[65]}}};
    wire signed [34:0] jump = {{3{sum[31]}}, sum} - {total_near[33], total_near};

    // filters
    wire filter_ready, filtered_valid;
    wire signed [31:0] filtered;

    if (BIQUADS == 0) begin : g_plain
        assign filter_ready   = 1'b1;
        assign filtered_valid = state == FILTER;
        assign filtered       = sum;
        wire unused = &{1'b0, filters_in_use, coefficient_write, coefficient_address, coefficient};
    end else begin : g_filters
        biquad_cascade #(
            .SECTIONS(BIQUADS)
        ) u_filters (
            .clk,
            .rst,
            .in_use  (filters_in_use[BIQUADS-1:0]),
            .coefficient_write,
            .coefficient_address,
            .coefficient,
            .valid_in(state == LIMIT),
            .track   (no_power),
            .x       (closed_loop ? held : {open_command, 16'd0}),
            .ready   (filter_ready),
            .valid   (filtered_valid),
            .y       (filtered)
        );
        if (BIQUADS < 4) begin : g_fewer
            wire unused = &{1'b0, filters_in_use[3:BIQUADS]};
        end
    end

    wire signed [15:0] filtered_command = no_power ? sum[31:16] : filtered[31:16];
    wire               above_limit = filtered_command > $signed({1'b0, output_limit});
    wire               below_limit = filtered_command < -$signed({1'b0, output_limit});
    wire signed [15:0] from_low = below_limit ? -{1'b0, output_limit} : filtered_command;
    wire signed [15:0] closed_command = above_limit ? {1'b0, output_limit} : from_low;
    wire signed [15:0] new_command = closed_loop ? closed_command : open_command;
    wire               limited = limited_up || limited_down;
    wire               gives = state == FILTER && filtered_valid;
    wire               unused_low = &{1'b0, filtered[15:0]};  // rounded down

    always_ff @(posedge clk) begin
        valid <= 1'b0;
        step  <= step + 1'b1;
        case (state)
            SETTLE: if (step == 5'd6) state <= TAKE;
            TAKE: begin
                error <= distance_fits ? distance[31:0] : nearest_error;
                velocity_error <= {target_velocity[31], target_velocity} - {velocity[31], velocity};
                velocity_taken <= target_velocity;
                acceleration_taken <= target_acceleration;
                standing <= !moving;
                changed_taken <= changed;
                term <= INTEGRAL;
                state <= LOAD;
            end
            LOAD: begin
                case (term)
                    INTEGRAL: begin
                        total   <= powerless ? '0 : {{26{integral[39]}}, integral};
                        operand <= {{32{error[31]}}, error};
                        gain    <= into_limit || in_dead_band ? '0 : ki;
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
                    state <= term == LAST_TERM ? LIMIT : LOAD;
                end
            end
            LIMIT: begin
                if (!no_power) fresh <= 1'b0;
                retaking     <= retakes && !no_power;
                total        <= {{26{integral[39]}}, integral} + {{23{jump[34]}}, jump, 8'd0};
                sum          <= held;
                limited_up   <= closed_loop && too_high;
                limited_down <= closed_loop && too_low;
                state        <= FILTER;
            end
            FILTER: begin
                if (retaking) integral <= new_integral[39:0];
                if (gives) begin
                    valid        <= 1'b1;
                    command      <= new_command;
                    saturated    <= closed_loop && (limited || above_limit || below_limit);
                    limited_up   <= closed_loop && (limited_up || above_limit);
                    limited_down <= closed_loop && (limited_down || below_limit);
                    state        <= WAIT;
                end
            end
            default: begin
                step <= '0;
                if (tick && filter_ready) state <= SETTLE;
            end
        endcase
        stale   <= powerless || (stale && state != TAKE);
        changed <= gains_changed || (changed && state != TAKE);
        if (powerless) begin
            fresh    <= 1'b1;
            integral <= '0;
            sum      <= block_up && block_down ? '0 : {gives ? new_command : command, 16'd0};
        end
        if (rst) begin
            state        <= WAIT;
            valid        <= 1'b0;
            command      <= '0;
            error        <= '0;
            saturated    <= 1'b0;
            limited_up   <= 1'b0;
            limited_down <= 1'b0;
            stale        <= 1'b1;
            fresh        <= 1'b1;
            changed      <= 1'b0;
            integral     <= '0;
            sum          <= '0;
        end
    end

`ifdef FORMAL
    logic               past = 1'b0;
    logic signed [15:0] limit_q;  // output_limit of the cycle before
    always @(posedge clk) begin
        past    <= 1'b1;
        limit_q <= {1'b0, output_limit};
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if (valid && $past(closed_loop)) begin
                assert (command <= limit_q && command >= -limit_q);
                assert (saturated || $past(filtered_command) == command);
            end
            if (valid && !$past(closed_loop)) assert (command == $past(open_command) && !saturated);
            if (!valid) assert (command == $past(command));
            assert (!valid || $past(state) == FILTER);
            cover (state == LOAD && error == -3);
            cover (state == SETTLE && step == 3);
        end
    end
`endif
endmodule

`default_nettype wire
