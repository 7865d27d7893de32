// SPDX-License-Identifier: Apache-2.0
// pi_loop -- compute a PI controller in serial arithmetic: 2^16 command = kp e + integral, where e
// = target - position, and integral += ki e.
//
// latency   53 cycles from tick to valid
// rate      one command per tick, a tick at least 53 cycles after the one before. An earlier tick
//           is ignored.
// behaviour The inputs are sampled with tick. Anti-windup: the integral is limited to limit, does
//           not grow in a direction in which the last command was at its limit, and is zero in open
//           loop and without power. Bumpless transfer: after the loop was closed, the power came on
//           or kp changed, the command is held for one tick (at 0 while the power was off), and the
//           integral takes the value from which the next command continues, as far as limit allows;
//           with ki = 0 the command follows kp at once. A tick whose inputs were taken without
//           power does not count: the command is held. Opening the loop gives open_command at once.
// model     tb/drive/pi_loop.py, equal in every bit of every cycle
// proved    A command of the closed loop is within limit, whatever gains and inputs do. An
//           open-loop command is passed on unchanged. command changes only with valid.
// proof     depth 12
`default_nettype none

module pi_loop (
    input  wire                clk,
    input  wire                rst,
    input  wire                power,          // level: commands pass to the drive
    input  wire                closed_loop,    // level: 0: command is open_command
    input  wire         [23:0] kp,             // 2^-16 command/LSB of position
    input  wire         [23:0] ki,             // 2^-24 command/LSB of position, each tick
    input  wire         [14:0] limit,          // largest |command| and |integral|, full scale 2^15
    input  wire                gains_changed,  // strobe: kp is new, +-1 cycle
    input  wire                tick,           // strobe: take the inputs
    input  wire signed  [47:0] target,         // 2^-16 period
    input  wire signed  [47:0] position,       // 2^-16 period
    input  wire signed  [15:0] open_command,   // full scale 2^15, the open-loop command
    output logic               valid,          // strobe: command is new
    output logic signed [15:0] command         // full scale 2^15
);
    enum logic [2:0] {
        WAIT,
        LOAD,
        MULTIPLY,
        LIMIT,
        GIVE
    } state;

    logic [4:0] step;  // cycle within a product
    logic proportional;  // the second term is being added
    logic signed [31:0] error;  // 2^-16 period; saturates
    logic stale;  // there was no power in some cycle since the inputs were taken
    logic signed [63:0] operand;  // shifted left
    logic [23:0] gain;  // shifted right
    // 2^-16 command; 2^-24 command while it is the integral
    logic signed [65:0] total;
    logic signed [39:0] integral;  // 2^-24 command
    logic limited_up, limited_down;  // the last command was at its limit
    logic fresh;  // there was no power since the last computed command
    // kp changed: since the inputs were taken, before they were taken
    logic changed, changed_taken;
    logic               retaking;  // the integral absorbs the jump
    // 2^-16 command, limited
    logic signed [31:0] sum;

    wire                take = state == WAIT && tick;
    wire signed  [48:0] distance = {target[47], target} - {position[47], position};
    wire                fits = distance[48:31] == {18{distance[48]}};
    wire signed  [31:0] nearest_error = {distance[48], {31{~distance[48]}}};
    wire                powerless = !closed_loop || !power;
    wire                into_limit = error[31] ? limited_down : limited_up;

    wire signed  [65:0] integral_high = {27'd0, limit, 24'd0};
    wire signed  [65:0] from_low = total < -integral_high ? -integral_high : total;
    wire signed  [65:0] new_integral = total > integral_high ? integral_high : from_low;

    wire                no_power = stale || powerless;
    wire                retakes = (fresh || changed || changed_taken || gains_changed) && ki != '0;
    wire                hold = no_power || retakes;
    // the limit may have changed since the sum was limited
    wire signed  [15:0] summed = sum[31:16];
    wire                above = summed > $signed({1'b0, limit});
    wire                below = summed < -$signed({1'b0, limit});

    // 2^0 command; what is held and what is computed are compared at once, since hold is known late
    wire signed  [49:0] whole = total[65:16];
    wire signed  [49:0] high = {35'd0, limit};
    wire                too_high = hold ? above : whole > high;
    wire                too_low = hold ? below : whole < -high;
    wire signed  [31:0] most = {1'b0, limit, 16'd0};
    wire signed  [31:0] computed = hold ? sum : total[31:0];

    wire                total_fits = total[65:33] == {33{total[65]}};
    wire signed  [33:0] total_near = total_fits ? total[33:0] : {total[65], {33{~total[65]}}};
    wire signed  [34:0] jump = {{3{sum[31]}}, sum} - {total_near[33], total_near};

    wire signed  [15:0] not_below = below ? -{1'b0, limit} : summed;
    wire signed  [15:0] closed_command = above ? {1'b0, limit} : not_below;
    wire signed  [15:0] new_command = closed_loop ? closed_command : open_command;

    always_ff @(posedge clk) begin
        valid <= state == GIVE;
        step  <= step + 1'b1;
        case (state)
            LOAD: begin
                if (proportional) begin
                    integral <= new_integral[39:0];
                    total    <= {{8{new_integral[65]}}, new_integral[65:8]};
                    gain     <= kp;
                end else begin
                    total <= powerless ? '0 : {{26{integral[39]}}, integral};
                    gain  <= into_limit ? '0 : ki;
                end
                operand <= {{32{error[31]}}, error};
                step    <= '0;
                state   <= MULTIPLY;
            end
            MULTIPLY: begin
                if (gain[0]) total <= total + {{2{operand[63]}}, operand};
                operand <= operand <<< 1;
                gain    <= gain >> 1;
                if (step == 5'd23) begin
                    proportional <= 1'b1;
                    state        <= proportional ? LIMIT : LOAD;
                end
            end
            LIMIT: begin
                if (!no_power) fresh <= 1'b0;
                retaking     <= retakes && !no_power;
                total        <= {{26{integral[39]}}, integral} + {{23{jump[34]}}, jump, 8'd0};
                sum          <= too_high ? most : too_low ? -most : computed;
                limited_up   <= closed_loop && too_high;
                limited_down <= closed_loop && too_low;
                state        <= GIVE;
            end
            GIVE: begin
                if (retaking) integral <= new_integral[39:0];
                command      <= new_command;
                limited_up   <= closed_loop && (limited_up || above);
                limited_down <= closed_loop && (limited_down || below);
                state        <= WAIT;
            end
            default: begin
                proportional <= 1'b0;
                if (tick) begin
                    error         <= fits ? distance[31:0] : nearest_error;
                    changed_taken <= changed;
                    state         <= LOAD;
                end
            end
        endcase
        stale   <= powerless || (stale && !take);
        changed <= gains_changed || (changed && !take);
        if (powerless) begin
            fresh    <= 1'b1;
            integral <= '0;
            sum      <= !power ? '0 : {state == GIVE ? new_command : command, 16'd0};
        end
        if (rst) begin
            state <= WAIT;
            {valid, command, error, limited_up, limited_down, changed, integral, sum} <= '0;
            {stale, fresh} <= '1;
        end
    end

`ifdef FORMAL
    logic               past = 1'b0;
    logic signed [15:0] limit_q;  // limit of the cycle before
    always @(posedge clk) begin
        past    <= 1'b1;
        limit_q <= {1'b0, limit};
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if (valid && $past(closed_loop)) assert (command <= limit_q && command >= -limit_q);
            if (valid && !$past(closed_loop)) assert (command == $past(open_command));
            if (!valid) assert (command == $past(command));
            assert (!valid || $past(state) == GIVE);
            cover (state == LOAD && error == -3);
        end
    end
`endif
endmodule

`default_nettype wire
