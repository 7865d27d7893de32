// SPDX-License-Identifier: Apache-2.0
// fringe_tracker -- compute the signed step from phase to phase, including whole periods, by
// predicting the next phase.
//
// latency  1 cycle from valid to done; the step itself has no lag
// rate     one phase per cycle
// method   The tracker predicts that the last step is repeated. A phase less than a quarter period
//          from the prediction gives the step, at any speed below one period per sample. A phase
//          farther away is an overspeed: the step still ends on the phase, but an outlier does not
//          update the prediction, so one bad sample affects nothing but itself (below a quarter
//          period per sample; proved there). At a second outlier in a row, or a step of a period
//          or more, the nearest step is taken, and tracking continues from there as from
//          standstill; whole periods may then be lost, which overspeed reports.
// behaviour  With AXES above 1 it serves several axes, each with its own last phase and speed.
// source   S0 limit filter 2 (a count is compared with its predecessor), with the speed added to
//          the prediction
// model    tb/interpolate/fringe_tracker.py, equal in every bit of every cycle
// proved   modulo a period the step is the phase less the preceding phase; without overspeed it is
//          less than a quarter period from the predicted step; at any constant speed below a
//          quarter period per sample, one bad sample in four moves nothing
// proof    depth 6
`default_nettype none

module fringe_tracker #(
    parameter  int AXES = 1,                            // axes that are served
    // bits of the number of an axis
    localparam int A    = AXES == 1 ? 1 : $clog2(AXES)
) (
    input wire clk,
    input wire rst,  // level: the phase is forgotten; the next one has step 0
    input wire valid,  // strobe: phase is new
    input wire [A-1:0] axis,  // number of its axis; 0 for one axis
    input wire [15:0] phase,  // 2^-16 period
    output logic done,  // strobe: step is new
    output logic signed [16:0] step,  // 2^-16 period since the preceding phase
    output logic [15:0] phase_out,  // 2^-16 period: the phase after step; held until done
    output logic overspeed  // strobe, with done: a quarter period or more off
);
    logic       [AXES-1:0] started;
    wire                   outlier;  // the last phase was an overspeed
    wire        [    15:0] last;
    wire signed [    16:0] speed;  // step per sample, without outliers
    // speed, or after an outlier the step that leads back to the line
    wire signed [    17:0] predicted_step;

    wire                   known = started[axis];
    wire        [    15:0] moved = phase - last;  // the step, modulo a period
    // It borrows if moved is less than the fraction of a period in predicted_step.
    wire                   borrow;
    wire signed [    15:0] deviation;  // from the predicted phase
    assign {borrow, deviation} = {1'b0, moved} - {1'b0, predicted_step[15:0]};
    // predicted_step + deviation is moved and so many periods; no adder is needed for its fraction
    wire signed  [ 2:0] periods = 3'(predicted_step >>> 16) - 3'(deviation[15]) + 3'(borrow);
    // less than a quarter period; equal fractions show -QUARTER before the difference is there
    wire                same_fraction = moved[13:0] == predicted_step[13:0];
    wire                near = deviation[15] == deviation[14] && !(deviation[15] && same_fraction);
    wire                fits = periods == '0 || periods == '1;
    wire                follows = known && fits && near;
    wire                strays = known && fits && !near && !outlier;
    wire signed  [16:0] measured_step = {periods[0], moved};  // if it fits
    wire signed  [17:0] step_back = 18'(speed) - 18'(deviation);

    // state after this phase
    logic signed [16:0] new_speed;
    wire signed  [17:0] new_predicted_step = strays ? step_back : 18'(new_speed);
    always_comb begin
        new_speed = '0;
        if (follows && !outlier) new_speed = measured_step;
        else if (follows || strays) new_speed = speed;
    end

    axis_memory #(
        .AXES (AXES),
        .WIDTH(52)
    ) u_state (
        .clk,
        .write     (valid),
        .write_axis(axis),
        .value     ({strays, new_speed, new_predicted_step, phase}),
        .axis,
        .stored    ({outlier, speed, predicted_step, last})
    );

    always_ff @(posedge clk) begin
        done      <= valid;
        overspeed <= valid && known && !follows;
        if (valid) begin
            started[axis] <= 1'b1;
            phase_out     <= phase;
            step          <= {follows || strays ? periods[0] : moved[15], moved};
            if (!known) step <= '0;
        end
        if (rst) begin
            started   <= '0;
            step      <= '0;
            done      <= 1'b0;
            overspeed <= 1'b0;
        end
    end

`ifdef FORMAL
    localparam signed [15:0] QUARTER = 16'sd16384;
    wire signed [18:0] wide_step = {periods, moved};
    logic              past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        assume (axis == '0);
        if (past && started) begin
            assert (phase_out == last);
            assert (wide_step == 19'(predicted_step) + 19'(deviation));
        end
        if (past && !$past(rst)) begin
            assert (done == $past(valid));
            if (done) assert (phase_out == $past(phase));
            if (done && $past(started)) assert (step[15:0] == last - $past(last));
            if (done && $past(started) && !overspeed) begin
                assert (19'(step) - 19'($past(predicted_step)) < 19'(QUARTER));
                assert (19'($past(predicted_step)) - 19'(step) < 19'(QUARTER));
            end
            if (overspeed) assert (done);
            cover (overspeed && !outlier);
            cover (done && $past(outlier) && !overspeed);
        end
    end

    // A scale moves by `increment` per sample; now and then a sample is bad, with at least three
    // good ones in between.
    (* anyconst *)logic signed [16:0] increment;
    (* anyconst *)logic               modelled;  // the phases follow this model; 0: any
    (* anyseq *)logic               bad;
    // position of the scale at the next sample; sum of the steps
    logic signed [23:0] scale, seen;
    // samples since the last bad one, up to 3; samples since reset, up to 2
    logic [1:0] good, samples;
    wire signed [23:0] sum = done ? seen + 24'(step) : seen;
    wire signed [23:0] away = sum - (scale - 24'(increment));
    // error of speed left by a bad sample that was no outlier
    wire signed [23:0] drag = 24'(speed) - 24'(increment);
    always @(posedge clk) begin
        if (modelled) begin
            assume (increment > -17'sd16384 && increment < 17'sd16384);
            if (bad) assume (good == 3 && samples == 2);
            if (valid && !bad) assume (phase == scale[15:0]);
        end
        if (done) seen <= sum;
        if (valid) begin
            scale   <= scale + 24'(increment);
            good    <= bad ? 2'd0 : good == 3 ? 2'd3 : good + 1'b1;
            samples <= samples == 2 ? 2'd2 : samples + 1'b1;
        end
        if (rst) begin
            scale   <= '0;
            seen    <= '0;
            good    <= 2'd3;
            samples <= '0;
        end
        if (past && modelled) begin
            // the claim; the further assertions only make it inductive
            if (samples != 0 && good != 0) assert (away == 0);
            assert (started == (samples != 0) && samples <= 2);
            if (started) begin
                assert (sum[15:0] == last);
            end else begin
                assert (sum == 0 && scale == 0);
            end
            if (samples < 2) begin
                assert (good == 3);
                if (started) assert (!outlier && speed == 0 && predicted_step == 0);
            end else if (good == 0 && outlier) begin
                assert (speed == increment && 24'(predicted_step) == 24'(increment) - away);
                assert (away >= -32768 && away < 32768);
            end else if (good == 0) begin
                assert (drag == away && predicted_step == 18'(speed));
                assert (away > -16384 && away < 16384);
            end else if (good == 1 && outlier) begin
                assert (24'(predicted_step) == 24'(increment) + drag + drag + drag);
                assert (drag > -16384 && drag < 16384 && (drag >= 8192 || drag <= -8192));
            end else if (good == 1) begin
                assert (predicted_step == 18'(speed) && drag > -8192 && drag < 8192);
            end else begin
                assert (!outlier && predicted_step == 18'(speed));
                assert (speed == increment || (good == 2 && speed == 0));
            end
        end
        cover (past && modelled && good == 0 && outlier && increment == 17'sd1000);
    end
`endif
endmodule

`default_nettype wire
