// SPDX-License-Identifier: Apache-2.0
// pid_loop -- compute a PID controller in bit-serial arithmetic: 2^16 command = kp e + integral +
// kd (e - last e), where e = target - position, and integral += ki e.
//
// latency   134 cycles from tick to valid, 125 in a tick in which the integral is retaken
// rate      one command per tick, a tick at least 134 cycles after the one before. An earlier tick
//           is ignored.
// behaviour The inputs are sampled with tick. Anti-windup: the integral is limited to limit, does
//           not grow in a direction in which integral + kp e was above limit in the last tick, and
//           is zero in open loop and without power. Bumpless transfer: after the loop was closed,
//           the power came on or kp changed, the command is held for one tick (at 0 while the power
//           was off), and the integral is retaken: it takes the value from which the next command
//           continues, as far as limit allows; with ki = 0 the command follows kp at once. A tick
//           whose inputs were taken without power does not count: the command is held. Opening the
//           loop gives open_command at once. The change of the error is added to the sum after that
//           was limited, and is counted from the last tick, whether or not the loop was closed; it
//           has no part in a tick in which the integral is retaken, nor if one of its two errors is
//           2^30 LSB or more.
// method    A number of 40 bits, 2^-24 command each, passes in 40 cycles, the lowest bit first.
//           INTEGRATE adds ki e to the integral, ADD adds kp e to that, DAMP adds kd times the
//           change of e to the upper 32 bits of that, and GIVE shifts the command out of its
//           result. Each adds error << n for bit n of the gain, and the number bit by bit as the
//           carry. Whether the result is above limit is known when its last bit is, so the pass
//           that reads it puts limit in its place. To retake the integral, ADD subtracts kp e from
//           the held command; then GIVE follows at once and lasts 40 cycles, since it limits the
//           integral.
// model     tb/drive/pid_loop.py, equal in every bit of every cycle
// proved    A command of the closed loop is within the limit that was sampled with its tick,
//           whatever gains and inputs do. An open-loop command is passed on unchanged. command
//           changes only with valid.
// proof     depth 12
`default_nettype none

module pid_loop (
    input  wire                clk,
    input  wire                rst,
    input  wire                power,          // level: commands pass to the drive
    input  wire                closed_loop,    // level: 0: command is open_command
    input  wire         [23:0] kp,             // 2^-16 command/LSB of position
    input  wire         [23:0] ki,             // 2^-24 command/LSB of position, each tick
    input  wire         [23:0] kd,             // 2^-16 command/LSB of position per tick
    input  wire         [14:0] limit,          // largest |command| and |integral|, full scale 2^15
    input  wire                gains_changed,  // strobe: kp is new, +-1 cycle
    input  wire                tick,           // strobe: take the inputs
    input  wire signed  [47:0] target,         // 2^-16 period
    input  wire signed  [47:0] position,       // 2^-16 period
    input  wire signed  [15:0] open_command,   // full scale 2^15, the open-loop command
    output logic               valid,          // strobe: command is new
    output logic signed [15:0] command,        // full scale 2^15
    output logic               at_limit        // level: command is of the closed loop, and +-limit
);
    // steps of a pass: the first one, the first bit of the fraction of a command, its first whole
    // bit, the sign
    localparam bit [5:0] FIRST = 6'd24, FRACTION = 6'd32, WHOLE = 6'd48, SIGN = 6'd63;

    enum logic [2:0] {
        WAIT,
        INTEGRATE,
        ADD,
        DAMP,
        GIVE
    } state;

    logic [5:0] step;  // number of the bit that passes in the next cycle, plus FIRST
    logic passes;  // a bit passes
    logic done;  // all bits have passed

    // inputs of this tick; the error is 2^-16 period and saturates if it is far. When ADD has read
    // it, it becomes the change of the error, which counts if this error and the last one are near.
    logic [23:0] taken_kp, taken_ki, taken_kd;
    logic [14:0] taken_limit;
    logic [30:0] error, last_error;
    logic far, negative;
    logic near, last_near;  // |error| is below 2^30

    // the bit that passes: of limit and of the held command; the gain adds the error, which can be
    // 2^31 - 1 or negative
    logic limit_bit, held_bit, adds_error, adds_ones, adds_sign;
    // it is among those of the fraction and above, of the whole command, the sign
    logic fraction_on, whole_on, sign_bit;

    logic signed [31:0] high;  // bits of the sum that have not passed yet
    logic        [39:0] integral;  // 2^-24 command
    logic        [15:0] whole;  // of the sum, then of the new command
    logic        [15:0] fraction;  // 2^-16 command, of the sum and of the last command

    logic               stale;  // there was no power in some cycle since the inputs were taken
    logic               stopped;  // the power was off since the last command: it counts as 0
    logic               fresh;  // there was no power since the last computed command
    // kp changed: since the inputs were taken, before they were taken
    logic changed, changed_taken;
    logic integrates;  // ki is not 0
    logic retaking;  // the integral absorbs the jump
    logic hold;  // the command is held

    // the bits that have passed are above those of limit: as a number of 0 or more, and below it
    logic positive_above, negative_above, held_above, held_below;
    logic last_bit;  // bit of the result that passed last
    logic integral_over, integral_low;  // the integral is to be limited, at -limit
    logic sum_over, sum_low;  // integral and kp e were to be limited, at -limit
    logic over, low;  // the command is to be limited, at -limit
    logic bound_one;  // a bit of limit was 1
    logic is_high, is_low;  // the bits of the new command that have passed are those of +-limit

    wire               take = state == WAIT && tick;
    wire signed [48:0] distance = {target[47], target} - {position[47], position};
    wire signed [31:0] change = {error[30], error} - {last_error[30], last_error};
    wire               powerless = !closed_loop || !power;
    wire               no_power = stale || powerless;

    // the bits of step
    wire        [63:0] ki_bits = {16'd0, taken_ki, 24'd0};
    wire        [63:0] kp_bits = {8'd0, taken_kp, 32'd0};
    wire        [63:0] kd_bits = {8'd0, taken_kd, 32'd0};
    wire        [63:0] limit_bits = {1'b0, taken_limit, 48'd0};
    wire        [63:0] held_bits = {command, fraction, 32'd0};
    wire               blocked = sum_over && sum_low == negative;
    // the step of a done pass is the first one of the next: of it, DAMP has a bit of its gain
    wire               ki_bit = state == INTEGRATE && !done && ki_bits[step];
    wire               kp_bit = state == ADD && !done && kp_bits[step];
    wire               damps = state == DAMP ? !done : state == ADD && done;
    wire               kd_bit = damps && near && kd_bits[step];
    wire               gain = (ki_bit && !blocked) || kp_bit || kd_bit;

    wire               integral_bound = limit_bit ^ (bound_one && integral_low);
    wire               integral_bit = integral_over ? integral_bound : integral[0];
    wire               command_bound = limit_bit ^ (bound_one && low);
    wire               command_bit = over ? command_bound : hold ? held_bit : whole[0];

    // The sum of the product and a number, plus 2^39 so that what is above 40 bits is 0 if the sum
    // fits. The held command less the product is the complement of its complement plus the product.
    wire               sum_limited = over && whole_on ? command_bound : fraction[0];
    wire               integral_start = retaking && fraction_on ? held_bit : integral_bit;
    wire               start_bit = state == DAMP ? sum_limited : integral_start;
    wire               carry = start_bit ^ retaking ^ sign_bit;
    wire        [31:0] operand = {adds_sign, ({31{adds_error}} & error) | {31{adds_ones}}};
    wire        [33:0] sum = {high[31], high, 1'b1} + {operand[31], operand, carry};
    wire               sum_bit = sum[1] ^ retaking ^ sign_bit;
    wire               unused = &{1'b0, sum[0]};

    wire        [ 5:0] after_add = retaking ? FIRST : FRACTION;
    wire        [ 5:0] next_first = state == ADD ? after_add : state == DAMP ? WHOLE : FIRST;

    // the result of a pass, when it is done; it has 64 bits at most
    wire               too_long = high[23:0] != '0;
    wire               result_low = too_long ? high[23] ^ retaking : last_bit;
    wire               result_over = too_long || (result_low ? negative_above : positive_above);
    wire               held_low = command[15] && !stopped;
    wire               held_over = held_low ? held_below : held_above;
    wire               holds = retaking || no_power;
    wire               to_limit = holds ? held_over : result_over;
    wire               command_low = holds ? held_low : result_low;
    wire               summed = state == ADD || state == DAMP;  // the result is a command

    always_ff @(posedge clk) begin
        valid       <= state == GIVE && done;
        step        <= step + 1'b1;
        passes      <= state != WAIT && step != '0;
        done        <= step == '0;
        limit_bit   <= limit_bits[step];
        held_bit    <= held_bits[step] && !stopped;
        adds_error  <= gain && !far;
        adds_ones   <= gain && far && !negative;
        adds_sign   <= gain && negative;
        fraction_on <= step[5];
        whole_on    <= step[5:4] == WHOLE[5:4];
        sign_bit    <= step == SIGN;

        high        <= passes ? sum[33:2] : '0;
        last_bit    <= sum_bit;
        bound_one   <= whole_on && (bound_one || limit_bit);
        if (whole_on) begin
            if (sum_bit != limit_bit) positive_above <= sum_bit;
            if (sum_bit == limit_bit) negative_above <= !sum_bit;
            if (held_bit != limit_bit) held_above <= held_bit;
            if (held_bit == limit_bit) held_below <= !held_bit;
            if (command_bit != limit_bit) is_high <= 1'b0;
            if (command_bit != (limit_bit ^ bound_one)) is_low <= 1'b0;
        end else begin
            positive_above <= state == INTEGRATE || retaking;  // limit itself counts as above it
            negative_above <= 1'b1;
            held_above     <= 1'b0;
            held_below     <= 1'b1;
            is_high        <= 1'b1;
            is_low         <= 1'b1;
        end
        if (step == '0) step <= next_first;
        case (state)
            INTEGRATE: begin
                integrates <= integrates || ki_bit;
                if (passes) integral <= {sum_bit, integral[39:1]};
                if (done) begin
                    integral_over <= result_over;
                    integral_low  <= result_low;
                    retaking      <= (fresh || changed || changed_taken) && integrates && !no_power;
                    state         <= ADD;
                end
            end
            ADD: begin
                if (passes) integral <= {retaking ? sum_bit : integral_bit, integral[39:1]};
                if (step == '0) begin
                    error      <= change[30:0];
                    negative   <= change[31];
                    far        <= 1'b0;
                    near       <= near && last_near;
                    last_error <= error;
                    last_near  <= near;
                end
                if (passes && !retaking) begin
                    {whole, fraction} <= {sum_bit, whole, fraction[15:1]};
                end
                if (done) begin
                    integral_over <= result_over;
                    integral_low  <= result_low;
                    sum_over      <= to_limit;
                    sum_low       <= command_low;
                    if (!no_power) fresh <= 1'b0;
                    state <= retaking ? GIVE : DAMP;
                end
            end
            DAMP: begin
                if (passes) {whole, fraction} <= {sum_bit, whole, fraction[15:1]};
                if (done) state <= GIVE;
            end
            GIVE: begin
                if (passes && retaking) integral <= {integral_bit, integral[39:1]};
                if (passes) whole <= {command_bit, whole[15:1]};
                if (done) begin
                    command  <= closed_loop ? whole : open_command;
                    at_limit <= !no_power && (is_high || is_low);
                    sum_over <= sum_over && closed_loop;
                    stopped  <= 1'b0;
                    state    <= WAIT;
                end
            end
            default: begin
                step          <= FIRST;
                integral_over <= 1'b0;
                integrates    <= 1'b0;
                retaking      <= 1'b0;
                if (tick) begin
                    taken_kp      <= kp;
                    taken_ki      <= ki;
                    taken_kd      <= kd;
                    taken_limit   <= limit;
                    error         <= distance[30:0];
                    far           <= distance[48:31] != {18{distance[48]}};
                    near          <= distance[48:30] == {19{distance[48]}};
                    negative      <= distance[48];
                    changed_taken <= changed;
                    state         <= INTEGRATE;
                end
            end
        endcase
        stale   <= powerless || (stale && !take);
        changed <= gains_changed || (changed && !take);
        if (summed && done) begin
            hold <= holds;
            over <= to_limit;
            low  <= command_low;
        end
        if (powerless) fresh <= 1'b1;
        if (!power) stopped <= 1'b1;
        if (no_power) integral <= '0;
        if (no_power || (summed && done && to_limit)) fraction <= '0;
        if (stopped && no_power) whole <= '0;
        if (rst) begin
            state <= WAIT;
            step  <= FIRST;
            {valid, command, at_limit, sum_over, changed, integral, fraction, last_near} <= '0;
            {stale, fresh, stopped} <= '1;
        end
    end

`ifdef FORMAL
    logic               past = 1'b0;
    logic signed [15:0] source = '0;  // what GIVE limits
    wire         [ 5:0] now = step - 1'b1;  // number of the bit that passes
    // of the 16 bits of a command: those that have passed, and in limit, the sum and what is held
    wire         [ 4:0] passed = whole_on ? {1'b0, now[3:0]} : {done, 4'd0};
    wire         [15:0] mask = ~(16'hFFFF << passed);
    wire         [15:0] limit_passed = mask & {1'b0, taken_limit};
    wire         [15:0] held_passed = mask & command;
    wire         [15:0] whole_passed = whole >> (5'd16 - passed);
    wire signed  [15:0] most = {1'b0, taken_limit};
    wire signed  [15:0] expected = !over ? source : low ? -most : most;
    wire                powered = !(stopped && stale);
    always @(posedge clk) begin
        past <= 1'b1;
        if (summed && done) source <= !holds ? whole : stopped ? '0 : command;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            if (valid && $past(closed_loop)) assert (command <= most && command >= -most);
            if (valid && !$past(closed_loop)) assert (command == $past(open_command));
            if (!valid) assert (command == $past(command) && at_limit == $past(at_limit));
            if (valid) assert (!at_limit || command == most || command == -most);
            if (valid && !$past(no_power))
                assert (at_limit == (command == most || command == -most));
            assert (!valid || $past(state) == GIVE);
            cover (state == INTEGRATE && negative && error[1:0] == 2'b01);
        end
        if (past && state == WAIT) assert (step == FIRST || step == FIRST + 1'b1);
        if (past && state != WAIT) begin
            // the steps
            assert (!(passes && done));
            if (!passes) assert (step == (done ? next_first : state == DAMP ? FRACTION : FIRST));
            assert (step == '0 || step >= FIRST);
            assert (passes || done || state == INTEGRATE);
            assert (state <= GIVE);
            if (state == DAMP) assert (!retaking && (step == '0 || step > FRACTION || done));
            assert (whole_on == (passes && now[5:4] == 2'b11));
            if (passes) assert (fraction_on == now[5]);
            if (state == INTEGRATE) assert (!retaking && step <= SIGN);
            if (state == GIVE && passes && !retaking) assert (step == '0 || step >= WHOLE);
            // the bits that pass, and what has been compared
            assert (limit_bit == (whole_on && limit_bits[now]));
            if (passes) assert (bound_one == (limit_passed != '0));
            if (summed && !stopped) begin
                if (whole_on) assert (held_bit == command[now[3:0]]);
                assert (held_above == (held_passed > limit_passed));
                assert (held_below == ((mask & ~command) >= limit_passed));
            end
            if (summed && !retaking && powered && (fraction_on || done)) begin
                if (done) assert (last_bit == whole[15]);
                assert (positive_above == (whole_passed > limit_passed));
                assert (negative_above == ((mask & ~whole_passed) >= limit_passed));
            end
            // the command that is given
            if (state == GIVE) begin
                assert (!retaking || hold);
                assert (over || (source <= most && source >= -most));
                if (hold && powered) begin
                    assert (source == (stopped ? 16'sd0 : command));
                    if (whole_on) assert (held_bit == source[now[3:0]]);
                end
                if (powered) begin
                    assert (is_high == ((mask & expected) == limit_passed));
                    assert (is_low == ((mask & expected) == (mask & -limit_passed)));
                end
                assert (whole_passed == (mask & expected) || (!powered && whole == '0));
                assert (hold || over || !whole_on || !powered ||
                        (whole & (16'hFFFF >> passed)) == (source[15:0] >> passed));
            end
        end
    end
`endif
endmodule

`default_nettype wire
