// SPDX-License-Identifier: Apache-2.0
// peak_offset_tracker -- remove the offset of sine and cosine by their last turning points, as in
// S0.
//
//   fell, and now above the preceding sample: that one is Pmin, and the channel rises
//   rose, and now below the preceding sample: that one is Pmax, and the channel falls
//   offset = |full - Pmax - Pmin| / 2, rounded down, with samples from 0 to full = 2^W - 1
//
// latency  2 cycles from valid to done
// rate     one sample per cycle
// behaviour S0 gives the magnitude of the offset; its sign is the sign of full - Pmax - Pmin.
//          Nothing is removed before both turning points of a channel are known. A corrected
//          sample saturates at full scale.
// limits   The method notices a change one fringe late, takes every noisy sample for a turning
//          point, and cannot correct gain and phase. It serves as a comparison for the
//          auto-calibration and does not replace it.
// source   S0, chapter 4.4
// model    tb/sense/peak_offset_tracker.py, equal in every bit of every cycle
// proved   each sample leaves less its offset, or unchanged with enable = 0; an offset is computed
//          from two samples that were turning points
// proof    W = 8
`default_nettype none

module peak_offset_tracker #(
    parameter int W = 8  // bits of a sample
) (
    input wire clk,
    input wire rst,  // level: the turning points are forgotten
    input wire enable,  // level: 0: samples pass, peaks are still found
    input wire valid,  // strobe: sin and cos are new
    input wire signed [W-1:0] sin,  // counts, full scale = 2^(W-1)
    input wire signed [W-1:0] cos,  // counts, full scale = 2^(W-1)
    output logic done,  // strobe: sin_out and cos_out are new
    output logic signed [W-1:0] sin_out,  // counts, full scale = 2^(W-1)
    output logic signed [W-1:0] cos_out,  // counts, full scale = 2^(W-1)
    output logic signed [W-1:0] sin_offset,  // counts: offset of the sample of done, removed or not
    output logic signed [W-1:0] cos_offset  // counts: offset of the sample of done, removed or not
);
    if (W < 2) begin : g_check
        W_MUST_BE_AT_LEAST_2 u_error ();
    end

    // held: the sample of each channel is new; taken: there was one since reset
    logic held, taken;

    always_ff @(posedge clk) begin
        held <= valid;
        done <= held;
        if (valid) taken <= 1'b1;
        if (rst) begin
            held  <= 1'b0;
            done  <= 1'b0;
            taken <= 1'b0;
        end
    end

    for (genvar channel = 0; channel < 2; channel++) begin : g_channel
        logic rising, high_known, low_known;  // rising: f1 of S0
        logic signed [W-1:0] sample, high, low, sample_out, offset;  // high, low: Pmax, Pmin

        wire signed [W-1:0] new_sample = channel == 0 ? sin : cos;
        // Pmax + Pmin - full
        wire signed [  W:0] span = {high[W-1], high} + {low[W-1], low} + (W + 1)'(1);
        wire        [  W:0] size = (span[W] ? -span : span) >> 1;
        wire signed [  W:0] drift = !(high_known && low_known) ? '0 : span[W] ? -size : size;
        wire signed [W+1:0] less = {{2{sample[W-1]}}, sample} - {drift[W], drift};
        wire                fits = less[W+1:W-1] == {3{less[W-1]}};
        wire        [W-1:0] full = {less[W+1], {(W - 1) {~less[W+1]}}};

        always_ff @(posedge clk) begin
            if (valid) begin
                sample <= new_sample;
                if (taken && !rising && new_sample > sample) begin
                    low       <= sample;
                    low_known <= 1'b1;
                    rising    <= 1'b1;
                end
                if (taken && rising && new_sample < sample) begin
                    high       <= sample;
                    high_known <= 1'b1;
                    rising     <= 1'b0;
                end
            end
            if (held) begin
                offset     <= drift[W-1:0];
                sample_out <= !enable ? sample : fits ? less[W-1:0] : full;
            end
            if (rst) begin
                rising     <= 1'b0;
                high_known <= 1'b0;
                low_known  <= 1'b0;
            end
        end
    end

    assign sin_out    = g_channel[0].sample_out;
    assign cos_out    = g_channel[1].sample_out;
    assign sin_offset = g_channel[0].offset;
    assign cos_offset = g_channel[1].offset;

`ifdef FORMAL
    logic past = 1'b0;
    // the last sample, the one before it
    logic signed [W-1:0] old_sin, old_2_sin, old_cos;
    logic [1:0] samples;  // since reset, up to 2
    logic       enable_q;
    logic signed [W-1:0] whole_sin, whole_cos;  // the sample that belongs to done
    wire signed [W+1:0] sin_less = whole_sin - sin_offset;
    wire signed [W+1:0] cos_less = whole_cos - cos_offset;
    wire signed [W+1:0] most = (1 <<< (W - 1)) - 1, least = -(1 <<< (W - 1));
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        enable_q  <= enable;
        whole_sin <= old_sin;
        whole_cos <= old_cos;
        if (valid) begin
            old_sin   <= sin;
            old_cos   <= cos;
            old_2_sin <= old_sin;
            samples   <= samples == 2 ? 2'd2 : samples + 1'b1;
        end
        if (rst) samples <= '0;
        if (past) begin
            assert (samples <= 2 && taken == (samples != 0));
            if (samples != 0)
                assert (g_channel[0].sample == old_sin && g_channel[1].sample == old_cos);
            if (held) assert (taken);
            if (samples < 2) begin
                assert (!g_channel[0].high_known && !g_channel[0].low_known);
                assert (!g_channel[0].rising);
            end
        end
        if (past && !$past(rst)) begin
            if (done && enable_q) begin
                assert (sin_out == (sin_less > most ? most : sin_less < least ? least : sin_less));
                assert (cos_out == (cos_less > most ? most : cos_less < least ? least : cos_less));
            end
            if (done && !enable_q) assert (sin_out == whole_sin && cos_out == whole_cos);
            if (g_channel[0].high != $past(g_channel[0].high))
                assert (samples == 2 && g_channel[0].high == old_2_sin && old_sin < old_2_sin);
            if (g_channel[0].low != $past(g_channel[0].low))
                assert (samples == 2 && g_channel[0].low == old_2_sin && old_sin > old_2_sin);
            cover (done && sin_offset == 10 && cos_offset == -7);
        end
    end
`endif
endmodule

`default_nettype wire
