// SPDX-License-Identifier: Apache-2.0
// channel_monitor -- what is wrong with one channel (sine or cosine) of a signal, told from its
// samples, the other channel and the comparators.
//
// latency  1 clk
// rate     one sample per clk
// faults   channel_stuck: the channel stays within `band` of a sample for four samples and more while
//          the other channel is more than `span` away, twice within four samples. Near the top of a
//          circle of amplitude A, where a good channel also stays within `band`, the other one moves
//          by 4 sqrt(A band) at most.
//          no_noise: the same code for `no_noise_samples` samples, moving or not: the noise of a
//          working ADC is missing. With 0.5 LSB of noise a code lasts 256 samples once in 10^42,
//          with 0.2 LSB 4096 samples once in 10^21; with less noise, set no_noise_samples to 0.
//          comparator_mismatch: three samples in a row have the same sign and are beyond
//          `sign_threshold`, and the comparator has the opposite sign at the middle one, so the
//          comparator may be early or late by a sample.
// source   S0: comparators and converter look at the same photo-receiver
// model    tb/sense/channel_monitor.py, equal in every bit of every cycle
// proof    depth 12
// proved   a comparator that has the sign of every sample is never found comparator_mismatch nor
//          stuck, whatever the settings
`default_nettype none

module channel_monitor #(
    parameter int W = 8  // bits of a sample
) (
    input wire clk,
    input wire rst,  // all flags fall, all that was seen is forgotten
    input wire [15:0] clip_level,  // largest good size of a code; 65535: not judged
    input wire [7:0] band,  // noise of a channel that stands, its largest deviation
    input wire [15:0] span,  // way of the other channel while this one stands; 65535: not judged
    input wire [15:0] no_noise_samples,  // samples; 0: not judged
    input  wire        [15:0]  sign_threshold,        // larger samples have a sure sign; 65535: comparators are not judged
    input wire valid,  // strobe: channel and other are new
    input wire signed [W-1:0] channel,  // full scale = 2^(W-1)
    input wire signed [W-1:0] other,
    input wire level,  // comparator of this channel: 1 above zero
    input wire other_level,
    output logic clipped,  // level: this sample is
    output logic channel_stuck,  // level: until it leaves the band
    output logic no_noise,  // level: until the code changes
    output logic comparator_mismatch,  // level: this sample and the two before it
    output logic               comparator_stuck, // level: the channel changed sign three times, its comparator never
    output logic               channel_missing  // level: the comparators went through three half periods, the channel never changed sign
);
    if (W < 8 || W > 16) begin : g_check
        W_MUST_BE_FROM_8_TO_16 u_error ();
    end

    logic                started;  // there was a sample
    logic signed [W-1:0] last;
    // band about where the channel stands; span about the other channel then
    logic signed [17:0] home_low, home_high, far_low, far_high;
    logic [ 1:0] stood;  // samples since it came there, up to 3
    // samples for which the other channel's last time far away counts
    logic [ 1:0] recent;
    logic [15:0] same;  // samples since the code changed
    logic [1:0] sign, sign_q;  // of the last two samples: 1 plus, 3 minus, 0 not sure
    logic [1:0] side;  // the last sure sign
    // edge_other: other_level when level changed last
    logic level_q, edge_other;
    // of the channel since its comparator's; of the comparators since the channel's; up to 3
    logic [1:0] changes, turns;

    wire [W-1:0] size = channel < 0 ? -channel : channel;
    wire homely = started && 18'(channel) >= home_low && 18'(channel) <= home_high;
    wire far = span != '1 && (18'(other) < far_low || 18'(other) > far_high);
    wire [1:0] sign_now = 17'(size) <= {1'b0, sign_threshold} ? 2'd0 : {channel[W-1], 1'b1};
    wire crossing = sign_now[0] && side[0] && sign_now != side;
    wire toggled = started && level != level_q;
    wire [15:0] same_now = !started || channel != last ? '0 : &same ? same : same + 1'b1;
    wire        [1:0] changes_now = toggled ? 2'd0 : crossing && changes != 2'd3 ? changes + 1'b1 : changes;
    wire        [1:0] turns_now  = crossing ? 2'd0 : !toggled ? turns : other_level == edge_other ? 2'd0 : turns == 2'd3 ? turns
                                 : turns + 1'b1;

    always_ff @(posedge clk) begin
        if (valid) begin
            started <= 1'b1;
            last    <= channel;
            clipped <= clip_level != '1 && 17'(size) > {1'b0, clip_level};

            if (!homely) begin
                home_low  <= 18'(channel) - $signed({10'b0, band});
                home_high <= 18'(channel) + $signed({10'b0, band});
                far_low   <= 18'(other) - $signed({2'b0, span});
                far_high  <= 18'(other) + $signed({2'b0, span});
            end
            stood   <= !homely ? 2'd0 : stood == 2'd3 ? stood : stood + 1'b1;
            recent  <= !homely ? 2'd0 : far ? 2'd3 : recent == '0 ? recent : recent - 1'b1;
            channel_stuck  <= homely && (channel_stuck || (stood >= 2'd2 && far && recent != '0));

            same    <= same_now;
            no_noise  <= no_noise_samples != '0 && same_now >= no_noise_samples;

            sign    <= sign_now;
            sign_q  <= sign;
            if (sign_now[0]) side <= sign_now;
            comparator_mismatch <= sign_now[0] && sign == sign_now && sign_q == sign_now && level_q == channel[W-1];

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
            stood       <= 2'd0;
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
            // what follows leads to the claim
            if (sign[0]) assert (started && level_q == !sign[1]);
            if (sign_q[0]) assert (started);
            if (!side[0])
                assert (changes == 0 && !sign[0]);
                else assert (started && changes <= (level_q == !side[1]));
            cover (crossing && changes == 1);
            cover (channel_missing);
        end
    end
`endif
endmodule

`default_nettype wire
