// SPDX-License-Identifier: Apache-2.0
// channel_monitor -- find faults of one channel (sine or cosine) of a signal from its samples, the
// other channel and the comparators.
//
// latency  1 cycle from valid to every flag
// rate     one sample per cycle
// behaviour channel_stuck: the channel stays within `band` of one sample for four or more samples
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
// proof    depth 12
`default_nettype none

module channel_monitor #(
    parameter int W = 8  // bits of a sample, 8 to 16
) (
    input  wire                clk,
    input  wire                rst,                  // level: clears all flags and the history
    input  wire        [ 15:0] clip_level,           // counts: largest good magnitude; 65535: off
    input  wire        [  7:0] band,                 // counts: largest noise of a channel at rest
    input  wire        [ 15:0] span,                 // counts: motion of the other; 65535: off
    input  wire        [ 15:0] no_noise_samples,     // samples with the same code; 0: off
    input  wire        [ 15:0] sign_threshold,       // counts: beyond it a sign is sure; 65535: off
    input  wire                valid,                // strobe: channel and other are new
    input  wire signed [W-1:0] channel,              // counts, full scale = 2^(W-1)
    input  wire signed [W-1:0] other,                // counts: the other channel
    input  wire                level,                // level: comparator of channel, 1 above 0
    input  wire                other_level,          // level: comparator of the other channel
    output logic               clipped,              // level: this sample is beyond clip_level
    output logic               channel_stuck,        // level: until the channel leaves the band
    output logic               no_noise,             // level: until the code changes
    output logic               comparator_mismatch,  // level: at this sample and the two before it
    output logic               comparator_stuck,     // level: 3 sign changes without its edge
    output logic               channel_missing       // level: 3 edges without a sign change
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    logic                started;  // there was a sample
    logic signed [W-1:0] last;
    // band around the sample at which the channel rests; span around the other channel
    logic signed [17:0] rest_low, rest_high, far_low, far_high;
    logic [ 1:0] stayed;  // samples since then, up to 3
    // samples for which the last excursion of the other channel counts
    logic [ 1:0] recent;
    logic [15:0] same;  // samples since the code changed
    logic [1:0] sign, sign_q;  // signs of the last two samples: 1 plus, 3 minus, 0 unsure
    logic [1:0] side;  // the last sure sign
    // edge_other: other_level at the last change of level
    logic level_q, edge_other;
    // sign changes of the channel since its comparator changed; half periods of the comparators
    // since the channel changed its sign; both up to 3
    logic [1:0] changes, turns;

    wire [W-1:0] size = channel < 0 ? -channel : channel;
    wire         at_rest = started && 18'(channel) >= rest_low && 18'(channel) <= rest_high;
    wire         far = span != '1 && (18'(other) < far_low || 18'(other) > far_high);
    wire [  1:0] sign_now = 17'(size) <= {1'b0, sign_threshold} ? 2'd0 : {channel[W-1], 1'b1};
    wire         sure = sign_now[0] && sign == sign_now && sign_q == sign_now;
    wire         crossing = sign_now[0] && side[0] && sign_now != side;
    wire         toggled = started && level != level_q;
    wire [ 15:0] same_now = !started || channel != last ? '0 : &same ? same : same + 1'b1;
    wire         half_period = toggled && other_level != edge_other;
    wire [  1:0] changes_next = changes == 2'd3 ? changes : changes + 1'b1;
    wire [  1:0] turns_next = turns == 2'd3 ? turns : turns + 1'b1;
    wire [  1:0] changes_now = toggled ? 2'd0 : crossing ? changes_next : changes;
    wire [  1:0] turns_now = crossing ? 2'd0 : half_period ? turns_next : toggled ? 2'd0 : turns;

    always_ff @(posedge clk) begin
        if (valid) begin
            started <= 1'b1;
            last    <= channel;
            clipped <= clip_level != '1 && 17'(size) > {1'b0, clip_level};

            if (!at_rest) begin
                rest_low  <= 18'(channel) - $signed({10'b0, band});
                rest_high <= 18'(channel) + $signed({10'b0, band});
                far_low   <= 18'(other) - $signed({2'b0, span});
                far_high  <= 18'(other) + $signed({2'b0, span});
            end
            stayed   <= !at_rest ? 2'd0 : stayed == 2'd3 ? stayed : stayed + 1'b1;
            recent  <= !at_rest ? 2'd0 : far ? 2'd3 : recent == '0 ? recent : recent - 1'b1;
            channel_stuck  <= at_rest && (channel_stuck || (stayed >= 2'd2 && far && recent != '0));

            same    <= same_now;
            no_noise  <= no_noise_samples != '0 && same_now >= no_noise_samples;

            sign    <= sign_now;
            sign_q  <= sign;
            if (sign_now[0]) side <= sign_now;
            comparator_mismatch <= sure && level_q == channel[W-1];

            level_q <= level;
            if (toggled) edge_other <= other_level;
            changes     <= changes_now;
            turns       <= turns_now;
            comparator_stuck <= changes_now == 2'd3;
            channel_missing <= turns_now == 2'd3 && side[0];
        end
        if (rst) begin
            started     <= 1'b0;
            clipped     <= 1'b0;
            channel_stuck      <= 1'b0;
            no_noise      <= 1'b0;
            comparator_mismatch     <= 1'b0;
            comparator_stuck <= 1'b0;
            channel_missing <= 1'b0;
            sign        <= 2'd0;
            sign_q      <= 2'd0;
            side        <= 2'd0;
            changes     <= 2'd0;
            turns       <= 2'd0;
            edge_other  <= 1'b0;
            stayed       <= 2'd0;
            recent      <= 2'd0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (valid) assume (level == !channel[W-1]);
        if (past) begin
            assert (!comparator_mismatch && !comparator_stuck);
            // the further assertions make the claim inductive
            if (sign[0]) assert (started && level_q == !sign[1]);
            if (sign_q[0]) assert (started);
            if (!side[0]) begin
                assert (changes == 0 && !sign[0]);
            end else begin
                assert (started && changes <= (level_q == !side[1]));
            end
            cover (crossing && changes == 1);
            cover (channel_missing);
        end
    end
`endif
endmodule

`default_nettype wire
