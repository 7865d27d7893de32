// SPDX-License-Identifier: Apache-2.0
// sine_channel -- turn sine and cosine of a scale into steps of its position: ADCs, interpolation,
// signal monitor and recorder of a feedback channel.
//
// latency  see interpolation_chain for the time from an ADC word to tracked; tracked follows a
//          shared chain in the same cycle
// rate     one sample per conversion
// behaviour  A feature that is not built has no logic, and what it would report is 0. Without
//          HAS_OWN_CHAIN an interpolation_chain of the node computes the steps of several axes; the
//          ports chain_... and sample_... connect it. With a chain of its own these outputs are 0,
//          but sample_sin and sample_cos.
// source   S0: interferometer with sine, cosine and comparator outputs
// model    the models of its blocks; tested together by tb/interpolate/test_feedback_channel.py
`default_nettype none

module sine_channel #(
    parameter int W             = 8,   // bits of a sample, 8 to 16
    parameter int ADC_FRAME     = 14,  // clocks of a conversion
    parameter int HAS_SINE      = 1,   // 0: no logic, the pins are idle
    parameter int HAS_OWN_CHAIN = 1,   // 1: build a chain for this axis; 0: one of the node
    parameter int HAS_MONITOR   = 1,   // 1: build the signal monitor
    parameter int HAS_HARMONICS = 1,   // 1: build the harmonic correction
    parameter int HAS_RECORDER  = 1    // 1: build the recorder
) (
    input wire clk,
    input wire rst,
    // ADC
    input wire convert,  // strobe: start a conversion
    input wire adc_sin,  // serial data, synchronous to adc_sclk
    input wire adc_cos,  // serial data, synchronous to adc_sclk
    output logic adc_cs_n,  // pin, low during a conversion
    output logic adc_sclk,  // pin, idles high
    // settings of the chain
    input wire [31:0] wdata,  // value of a setting, before its strobe
    input wire [7:0] setting_written,  // strobes, as in interpolation_chain
    input wire harmonic_enable,  // level: correct the harmonics
    input wire learn,  // level: learn the count again
    // settings of the signal monitor
    input wire by_counts,  // level: no samples are taken, so that none can be bad
    input wire [15:0] amplitude_low,  // ADC counts, smallest amplitude
    input wire [15:0] amplitude_high,  // ADC counts, largest amplitude
    input wire [15:0] clip_level,  // ADC counts, largest good magnitude of a sample
    input wire [15:0] tolerance,  // ADC counts, largest good distance from the circle
    input wire [15:0] jump,  // ADC counts, smallest sudden step that is a fault
    input wire [15:0] no_noise_samples,  // samples with the same code; 0: off
    input wire [15:0] span,  // ADC counts, motion of the other channel
    input wire [7:0] band,  // ADC counts, largest noise of a channel at rest
    input wire [15:0] offset_limit,  // ADC counts, largest good offset
    input wire [15:0] balance_limit,  // ADC counts, largest good difference of amplitudes
    input wire [15:0] quadrature_limit,  // ADC counts, largest amplitude * sin phase error
    input wire [15:0] sign_threshold,  // ADC counts, beyond it a sign is sure
    input wire clear_signal_faults,  // strobe: forget the first fault
    // settings and reading of the recorder
    input wire [15:0] decimation,  // samples, of which one is recorded
    input wire phases,  // level: 1: record phases, 0: samples
    input wire record,  // strobe: record a burst
    input wire recorder_read,  // strobe: go on to the next word
    output logic [31:0] recorded,  // two samples or two phases of 16 bits
    output logic full,  // level: the burst is complete
    output logic invalid,  // level: disturbed was high during the burst
    // from the encoder
    input wire [1:0] levels,  // {b, a}: levels of the comparators
    input wire signed [31:0] quadrature_count,  // 1/4 period
    input wire disturbed,  // level: the signal is not fit for a calibration
    // to a shared chain, as its ports of this axis
    output logic [7:0] chain_setting_written,  // strobes of its settings
    output logic chain_harmonic_enable,  // level: correct the harmonics
    output logic chain_learn,  // level: learn the count again
    output logic sample_valid,  // strobe: a new sample
    output logic signed [W-1:0] sample_sin,  // ADC counts, held until the next one
    output logic signed [W-1:0] sample_cos,  // ADC counts, held until the next one
    // from a shared chain
    input wire chain_sampled,  // strobe: the filtered sample is new
    input wire signed [W-1:0] chain_sin,  // ADC counts
    input wire signed [W-1:0] chain_cos,  // ADC counts
    input wire chain_rejected,  // strobe: an outlier was held back
    input wire chain_phase_valid,  // strobe: the plain phase is new
    input wire [15:0] chain_plain_phase,  // 2^-16 period, before the harmonics
    input wire chain_done,  // strobe: step leads to phase
    input wire signed [16:0] chain_step,  // 2^-16 period
    input wire [15:0] chain_phase,  // 2^-16 period, corrected
    input wire chain_overspeed,  // strobe: the speed is too high
    input wire chain_disagreement,  // level: position and count differ
    input wire chain_lost,  // strobe: a sample of this axis was lost
    // signals
    output logic signed [W-1:0] sin,  // ADC counts, after the outlier filter
    output logic signed [W-1:0] cos,  // ADC counts, after the outlier filter
    output logic [15:0] phase,  // 2^-16 period, corrected
    output logic [15:0] amplitude,  // ADC counts
    // events
    output logic sample_rejected,  // strobe: an outlier was held back
    output logic overspeed,  // strobe: the speed is too high, or a sample was lost
    output logic disagreement,  // level: position and count differ
    output logic [14:0] signal_faults,  // levels, as in signal_monitor
    output logic [14:0] first_signal_faults,  // levels, held until clear_signal_faults
    // step of the position
    output logic tracked,  // strobe: tracked_step leads to tracked_phase
    output logic signed [16:0] tracked_step,  // 2^-16 period
    output logic [15:0] tracked_phase  // 2^-16 period
);
    if (HAS_SINE == 0) begin : g_idle
        assign {adc_cs_n, adc_sclk} = 2'b11;
        assign {sin, cos, phase, amplitude} = '0;
        assign {sample_rejected, overspeed, disagreement, signal_faults, first_signal_faults} = '0;
        assign {tracked, tracked_step, tracked_phase} = '0;
        assign {recorded, full, invalid} = '0;
        assign {chain_setting_written, chain_harmonic_enable, chain_learn} = '0;
        assign {sample_valid, sample_sin, sample_cos} = '0;

        wire unused_pins = &{1'b0, clk, rst, adc_sin, adc_cos, convert, levels};
        wire unused_axis = &{1'b0, amplitude_low, amplitude_high, quadrature_count, by_counts};
        wire unused_limits = &{
            1'b0, clip_level, tolerance, jump, band, span, no_noise_samples, sign_threshold,
            offset_limit, balance_limit, quadrature_limit, clear_signal_faults
        };
        wire unused_correction = &{1'b0, wdata, setting_written, harmonic_enable, learn};
        wire unused_chain = &{
            1'b0, chain_sampled, chain_sin, chain_cos, chain_rejected, chain_phase_valid,
            chain_plain_phase, chain_done, chain_step, chain_phase, chain_overspeed,
            chain_disagreement, chain_lost
        };
        wire unused_recorder = &{1'b0, record, phases, decimation, recorder_read, disturbed};
    end else begin : g_built
        wire converted, sampled, phase_valid, too_fast, sample_lost;
        wire signed [W-1:0] raw_sin, raw_cos, sampled_sin, sampled_cos;
        wire [15:0] plain_phase;

        dual_adc_reader #(
            .W    (W),
            .FRAME(ADC_FRAME)
        ) u_adc (
            .clk,
            .rst,
            .start  (convert),
            // pins
            .sdata_a(adc_sin),
            .sdata_b(adc_cos),
            .cs_n   (adc_cs_n),
            .sclk   (adc_sclk),
            // sample
            .valid  (converted),
            .sin    (raw_sin),
            .cos    (raw_cos)
        );
        if (HAS_OWN_CHAIN != 0) begin : g_own_chain
            wire own_overrun;  // never: one axis has nothing to wait for

            interpolation_chain #(
                .AXES         (1),
                .W            (W),
                .SAMPLE_CYCLES(2 * ADC_FRAME + 1),
                .HAS_HARMONICS(HAS_HARMONICS)
            ) u_chain (
                .clk,
                .rst,
                // settings
                .setting  (wdata),
                .setting_written,
                .harmonic_enable,
                .learn,
                // sample and count
                .valid    (converted),
                .sin      (raw_sin),
                .cos      (raw_cos),
                .count    (quadrature_count),
                // filtered sample
                .sampled,
                .sampled_sin,
                .sampled_cos,
                .rejected (sample_rejected),
                // phase before the harmonic correction
                .phase_valid,
                .plain_phase,
                // step of the position
                .done     (tracked),
                .step     (tracked_step),
                .phase    (tracked_phase),
                .overspeed(too_fast),
                // faults
                .disagreement,
                .overrun  (own_overrun),
                .lost     (sample_lost)
            );
            assign {sin, cos, phase} = {sampled_sin, sampled_cos, tracked_phase};
            assign {chain_setting_written, chain_harmonic_enable, chain_learn} = '0;
            assign {sample_valid, sample_sin, sample_cos} = {1'b0, raw_sin, raw_cos};

            wire unused = &{
                1'b0, own_overrun, chain_sampled, chain_sin, chain_cos, chain_rejected,
                chain_phase_valid, chain_plain_phase, chain_done, chain_step, chain_phase,
                chain_overspeed, chain_disagreement, chain_lost
            };
        end else begin : g_shared_chain
            assign chain_setting_written = setting_written;
            assign chain_harmonic_enable = harmonic_enable;
            assign chain_learn = learn;
            assign {sample_valid, sample_sin, sample_cos} = {converted, raw_sin, raw_cos};
            assign {sampled, sampled_sin, sampled_cos} = {chain_sampled, chain_sin, chain_cos};
            assign sample_rejected = chain_rejected;
            assign {phase_valid, plain_phase} = {chain_phase_valid, chain_plain_phase};
            assign {tracked, tracked_step, tracked_phase} = {chain_done, chain_step, chain_phase};
            assign {too_fast, disagreement} = {chain_overspeed, chain_disagreement};
            assign sample_lost = chain_lost;

            sample_hold #(
                .W(W)
            ) u_hold (
                .clk,
                // from the chain
                .sampled,
                .sampled_sin,
                .sampled_cos,
                .tracked,
                .tracked_phase,
                // last values of this axis
                .sin,
                .cos,
                .phase
            );

            wire unused = &{1'b0, wdata, quadrature_count};
        end
        assign overspeed = too_fast || sample_lost;
        if (HAS_MONITOR != 0) begin : g_monitor
            wire ready;

            signal_monitor #(
                .W(W)
            ) u_monitor (
                .clk,
                .rst       (rst || by_counts),
                .clear     (clear_signal_faults),
                // limits
                .low       (amplitude_low),
                .high      (amplitude_high),
                .clip_level,
                .tolerance,
                .jump,
                .band,
                .span,
                .no_noise_samples,
                .sign_threshold,
                .offset_limit,
                .balance_limit,
                .quadrature_limit,
                // signals
                .valid     (sampled),
                .sin       (sampled_sin),
                .cos       (sampled_cos),
                .a         (levels[0]),
                .b         (levels[1]),
                .phase_jump(overspeed),
                .lost_count(disagreement),
                // faults
                .amplitude,
                .ready,
                .faults    (signal_faults),
                .first     (first_signal_faults)
            );

            wire unused = &{1'b0, ready};
        end else begin : g_no_monitor
            assign {amplitude, signal_faults, first_signal_faults} = '0;

            wire unused_axis = &{1'b0, amplitude_low, amplitude_high, sampled};
            wire unused_limits = &{
                1'b0, clip_level, tolerance, jump, band, span, no_noise_samples, sign_threshold,
                offset_limit, balance_limit, quadrature_limit, clear_signal_faults, levels,
                by_counts
            };
        end
        if (HAS_RECORDER != 0) begin : g_recorder
            calibration_recorder #(
                .W(W)
            ) u_recorder (
                .clk,
                .rst,
                // settings
                .start  (record),
                .phases,
                .decimation,
                // signals
                .sampled(converted),
                .sin    (raw_sin),
                .cos    (raw_cos),
                .phase_valid,
                .phase  (plain_phase),
                .disturbed,
                // burst
                .read   (recorder_read),
                .word   (recorded),
                .full,
                .invalid
            );
        end else begin : g_no_recorder
            assign {recorded, full, invalid} = '0;
            wire unused_settings = &{1'b0, record, phases, decimation, recorder_read};
            wire unused_signals = &{1'b0, disturbed, phase_valid, plain_phase};
        end
    end
endmodule

`default_nettype wire
