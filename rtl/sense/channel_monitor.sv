// SPDX-License-Identifier: Apache-2.0
// channel_monitor -- find faults of the channels (sine and cosine) of a signal from their samples
// and their comparators.
//
// latency  12 cycles from valid to done and every flag
// rate     one sample per 12 cycles; one that comes sooner is not seen
// behaviour One subtractor and one comparator check the cosine, then the sine. A flag is high if
//          either of them has the fault.
//          jump: a channel moves by more than `jump` and twice the distance of the preceding
//          sample, which is the larger one of both channels.
//          channel_stuck: the channel stays within `band` of one sample for four or more samples
//          while the other channel is more than `span` away, twice within four samples. Near the
//          top of a circle of amplitude A a good channel also stays within `band`, but there the
//          other channel moves by 4 sqrt(A band) at most. no_noise: the channel has the same code
//          for `no_noise_samples` samples, moving or not, so the noise of a working ADC is
//          missing. With 0.5 LSB of noise a code lasts 256 samples once in 10^42, with 0.2 LSB
//          4096 samples once in 10^21; set no_noise_samples to 0 if there is less noise.
//          comparator_mismatch: three samples in a row have the same sign and are beyond
//          `sign_threshold`, and at the middle one the comparator has the opposite sign, so the
//          comparator may be early or late by one sample.
// source   S0: comparators and ADC look at the same photodetector
// model    tb/sense/channel_monitor.py, equal in every bit of every cycle
// proved   a comparator that has the sign of every sample is never reported as comparator_mismatch
//          or comparator_stuck, whatever the settings are
// proof    depth 40
`default_nettype none

module channel_monitor #(
    parameter int W = 8  // bits of a sample, 8 to 16
) (
    input wire clk,
    input wire rst,  // level: clears all flags and the history
    input wire [15:0] clip_level,  // counts: largest good magnitude; 65535: off
    input wire [15:0] jump,  // counts: smallest sudden step that is a fault
    input wire [7:0] band,  // counts: largest noise of a channel at rest
    input wire [15:0] span,  // counts: motion of the other; 65535: off
    input wire [15:0] no_noise_samples,  // samples with the same code; 0: off
    input wire [15:0] sign_threshold,  // counts: beyond it a sign is sure; 65535: off
    input wire valid,  // strobe: the next four are new
    input wire signed [W-1:0] sin,  // counts, full scale = 2^(W-1)
    input wire signed [W-1:0] cos,  // counts, full scale = 2^(W-1)
    input wire a,  // level: comparator of cos, 1 above 0
    input wire b,  // level: comparator of sin, 1 above 0
    output logic done,  // strobe: the flags belong to a new sample
    output logic clipped,  // level, with done: beyond clip_level
    output logic jumped,  // level, with done: beyond the distance allowed
    output logic channel_stuck,  // level, with done: until it leaves the band
    output logic no_noise,  // level, with done: until the code changes
    output logic comparator_mismatch,  // level, with done: for three samples
    output logic comparator_stuck,  // level, with done: 3 sign changes, no edge
    output logic channel_missing  // level, with done: 3 edges, no sign change
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    // 0: idle; difference 1 to 5 of the cosine, 6 to 10 of the sine; judged in the next step
    logic [3:0] step;
    logic started, followed;  // there was a sample, there were two
    logic signed [W-1:0] sin_q, cos_q;
    logic [     1:0] levels;  // of the comparators, {b, a}
    wire             second = step > 4'd6;  // the sine is judged

    // From each channel are subtracted: 0, 0, the value at which it rests, its last value; from the
    // other channel the value that it had then. They move on by one place in each step.
    logic [W*10-1:0] places;
    logic signed [W-1:0] channel_q, place_q;
    logic signed [W:0] difference;
    wire signed [W-1:0] channel = step >= 4'd5 && step <= 4'd9 ? sin_q : cos_q;
    wire signed [W-1:0] place = places[W-1:0];

    // The difference is compared with the limit.
    logic [17:0] limit;
    logic renew;  // the channel takes the place of what was subtracted
    logic [17:0] allowed;  // largest distance that is no jump
    wire negative = difference[W];
    wire [W:0] steps = negative ? ~difference : difference;  // the size; one less if negative
    wire beyond = {18'(steps), negative} > {limit, 1'b0};
    wire for_sign = step == 4'd2 || step == 4'd7;
    wire for_clip = step == 4'd3 || step == 4'd8;
    wire for_band = step == 4'd4 || step == 4'd9;
    wire for_jump = step == 4'd5 || step == 4'd10;
    wire for_span = step == 4'd6 || step == 4'd11;

    always_comb begin
        case (step)
            4'd2, 4'd7: limit = 18'(sign_threshold);
            4'd3, 4'd8: limit = 18'(clip_level);
            4'd4, 4'd9: limit = 18'(band);
            4'd5, 4'd10: limit = allowed;
            default: limit = 18'(span);
        endcase
        renew = for_jump || (for_band && (beyond || !started)) || (for_span && !at_rest);
    end

    // Of the channel that has moved further since the preceding sample: twice the distance, one
    // less if it is negative.
    logic [W+1:0] moved;

    // what is known of a channel
    typedef struct packed {
        logic channel_stuck;
        logic no_noise;
        logic comparator_mismatch;
        logic comparator_stuck;
        logic channel_missing;
        logic [1:0] stayed;  // samples at rest, up to 3
        // samples for which the last excursion of the other channel counts
        logic [1:0] recent;
        logic [15:0] same;  // samples since the code changed
        logic [1:0] sign, sign_q;  // of the last two samples: 1 plus, 3 minus, 0 unsure
        logic [1:0] side;  // the last sure sign
        logic level;  // of its comparator
        logic edge_other;  // the other level at the last change of level
        // sign changes of the channel since its comparator changed; half periods of the comparators
        // since the channel changed its sign; both up to 3
        logic [1:0] changes, turns;
    } history_t;
    history_t history, history_q, now;  // the _q is that of the channel that is not judged

    logic at_rest, same_code;
    logic [1:0] sign;  // of this sample
    wire        level = levels[second];
    wire        other_level = levels[!second];
    wire        sure = sign[0] && history.sign == sign && history.sign_q == sign;
    wire        crossing = sign[0] && history.side[0] && sign != history.side;
    wire        toggled = started && level != history.level;
    wire        half_period = toggled && other_level != history.edge_other;
    wire  [1:0] changes_next = history.changes == 2'd3 ? 2'd3 : history.changes + 1'b1;
    wire  [1:0] turns_next = history.turns == 2'd3 ? 2'd3 : history.turns + 1'b1;

    always_comb begin
        now = history;
        now.stayed = !at_rest ? 2'd0 : history.stayed == 2'd3 ? 2'd3 : history.stayed + 1'b1;
        now.recent =
            !at_rest ? 2'd0 : beyond ? 2'd3 : history.recent == '0 ? 2'd0 : history.recent - 1'b1;
        now.channel_stuck = at_rest && (history.channel_stuck ||
                                        (history.stayed[1] && beyond && history.recent != '0));
        now.same = same_code ? history.same + 1'b1 : '0;
        now.no_noise = same_code && no_noise_samples != '0 &&
            (history.no_noise || now.same >= no_noise_samples);
        {now.sign_q, now.sign} = {history.sign, sign};
        if (sign[0]) now.side = sign;
        now.comparator_mismatch = sure && history.level == sign[1];
        now.level = level;
        if (toggled) now.edge_other = other_level;
        now.changes = toggled ? 2'd0 : crossing ? changes_next : history.changes;
        now.turns =
            crossing ? 2'd0 : half_period ? turns_next : toggled ? 2'd0 : history.turns;
        now.comparator_stuck = now.changes == 2'd3;
        now.channel_missing = now.turns == 2'd3 && now.side[0];
    end

    always_ff @(posedge clk) begin
        done <= step == 4'd11;
        if (valid && step == '0) begin
            {sin_q, cos_q} <= {sin, cos};
            levels <= {b, a};
            allowed <= 18'(jump) + 18'(moved) + 18'(moved[0]);
        end
        if (valid || step != '0) step <= step == 4'd11 ? '0 : step + 1'b1;
        if (step != '0) begin
            places <= {renew ? channel_q : place_q, places[W*10-1:W]};
            {channel_q, place_q} <= {channel, place};
            difference <= channel - place;
        end
        if (for_sign) sign <= beyond ? {negative, 1'b1} : 2'd0;
        if (for_clip) clipped <= beyond || (second && clipped);
        if (for_band) at_rest <= started && !beyond;
        if (for_jump) begin
            same_code <= started && difference == '0;
            jumped <= (followed && beyond) || (second && jumped);
            if (!second || {steps, negative} > moved) moved <= {steps, negative};
        end
        if (for_span) {history_q, history} <= {now, history_q};
        if (step == 4'd11) {followed, started} <= {started, 1'b1};
        if (rst) begin
            step <= '0;
            done <= 1'b0;
            places <= '0;
            {followed, started} <= '0;
            {clipped, jumped} <= '0;
            {history_q, history} <= '0;
        end
    end
    assign channel_stuck = history.channel_stuck || history_q.channel_stuck;
    assign no_noise = history.no_noise || history_q.no_noise;
    assign comparator_mismatch = history.comparator_mismatch || history_q.comparator_mismatch;
    assign comparator_stuck = history.comparator_stuck || history_q.comparator_stuck;
    assign channel_missing = history.channel_missing || history_q.channel_missing;

`ifdef FORMAL
    logic past = 1'b0;
    logic [3:0] head;  // the difference for which the first of the places is
    wire [1:0] seen = {started || second, started};  // there was a sample, for history_q, history
    wire [1:0] minus = {sin_q[W-1], cos_q[W-1]};
    history_t both;
    assign head = step == '0 ? 4'd1 : step;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (valid) assume ({b, a} == ~{sin[W-1], cos[W-1]});
        if (past) begin
            assert (!comparator_mismatch && !comparator_stuck);
            // the further assertions make the claim inductive
            assert (step <= 4'd11);
            if (step != '0) assert (levels == ~minus);
            for (int n = 0; n < 10; n++)
            if (head + n == 1 || head + n == 2 || head + n == 6 || head + n == 7 ||
                head + n == 12 || head + n == 13 || head + n == 17 || head + n == 18)
                assert (places[W*n+:W] == '0);
            if (for_sign || for_clip) assert (place_q == '0 && difference == (W + 1)'(channel_q));
            if (for_sign || for_clip) assert (channel_q == (second ? sin_q : cos_q));
            if ((for_clip || for_band || for_jump || for_span) && sign[0])
                assert (sign[1] == minus[second]);
            for (int n = 0; n < 2; n++) begin
                both = n == 0 ? history : history_q;
                if (both.sign[0]) assert (seen[n] && both.level == !both.sign[1]);
                if (both.sign_q[0]) assert (started);
                if (!both.side[0])
                    assert (both.changes == 0 && !both.sign[0]);
                    else assert (seen[n] && both.changes <= (both.level == !both.side[1]));
                assert (!both.comparator_mismatch && !both.comparator_stuck);
            end
        end
        cover (past && for_span && crossing && second);
        cover (past && for_span && history.turns == 1);
    end
`endif
endmodule

`default_nettype wire
