// SPDX-License-Identifier: Apache-2.0
// three_axes_bench -- the axes of S2 without their soft core: three scales at the pins, the
// registers on the bus.
`default_nettype none

module three_axes_bench (
    input  wire         clk,
    input  wire         rst,
    input  wire         tick,
    input  wire         sample_tick,
    input  wire  [ 2:0] select,           // strobe: access to the block of axis n
    input  wire  [ 2:0] feedback_select,  // to its feedback channel
    input  wire         write,
    input  wire  [ 5:0] word,
    input  wire  [31:0] wdata,
    output logic [31:0] rdata,
    input  wire  [ 2:0] a,
    input  wire  [ 2:0] b
);
    wire [31:0] now_high, now;
    wire [31:0] answer  [0:2];
    wire [31:0] feedback[0:2];

    time_stamp u_time (
        .clk,
        .rst,
        .now({now_high, now})
    );

    for (genvar n = 0; n < 3; n++) begin : g_axis
        wire [31:0] actuator_rdata;
        wire [47:0] target;
        wire [15:0] phase, fine_command;
        wire [12:0] faults;
        wire adc_cs_n, adc_sclk, bridge_a, bridge_b, step, direction, dac_cs_n, dac_sclk, dac_sdi;
        wire drive_enable, compare_pulse, line_stopped, step_made, step_down, moves, moved;
        wire block_up, block_down;
        wire closed_loop, play, arm, controlled_stop, hold_target, pending;
        wire [47:0] position, moved_by;
        wire [23:0] take_up;
        wire [ 7:0] chain_setting_written;
        wire chain_harmonic_enable, chain_learn, sample_valid;
        wire signed [7:0] sample_sin, sample_cos;
        wire signed [31:0] quadrature_count;

        axis #(
            .HAS_BRIDGE    (0),
            .HAS_DAC       (0),
            .HAS_FINE_STAGE(0),
            .FILTERS       (0),
            .HAS_SINE      (0)
        ) u_axis (
            .clk,
            .rst,
            .tick,
            .sample_tick,
            .limit_tick        (1'b0),
            .start             (1'b0),
            .sync              (1'b0),
            .estop             (1'b0),
            .watchdog_expired  (1'b0),
            .link_expired      (1'b0),
            .cpu_stopped       (1'b0),
            .servo_overrun     (1'b0),
            .sample_overrun    (1'b0),
            // without a motion engine: only positions are read
            .position,
            .step_made,
            .step_down,
            .moves,
            .moved,
            .moved_by,
            .take_up,
            .block_up,
            .block_down,
            .closed_loop,
            .play,
            .arm,
            .controlled_stop,
            .hold_target,
            .pending,
            .waits             (1'b0),
            .result_valid      (1'b0),
            .result_kind       (3'd0),
            .result            (48'd0),
            .result_flag       (1'b0),
            .line_start        (1'b0),
            .line_idle         (1'b0),
            .rate_valid        (1'b0),
            .rate              (37'd0),
            .rate_restart      (1'b0),
            .rate_steep        (1'b0),
            .line_stopped,
            // without streamed set-points
            .stream_state      (32'd0),
            .stream_counts     (32'd0),
            // without a shared chain
            .chain_setting_written,
            .chain_harmonic_enable,
            .chain_learn,
            .sample_valid,
            .sample_sin,
            .sample_cos,
            .quadrature_count,
            .chain_sampled     (1'b0),
            .chain_sin         (8'd0),
            .chain_cos         (8'd0),
            .chain_rejected    (1'b0),
            .chain_phase_valid (1'b0),
            .chain_plain_phase (16'd0),
            .chain_done        (1'b0),
            .chain_step        (17'sd0),
            .chain_phase       (16'd0),
            .chain_overspeed   (1'b0),
            .chain_disagreement(1'b0),
            .chain_lost        (1'b0),
            .target,
            .phase,
            .fine_command,
            .faults,
            .select            (select[n]),
            .write,
            .word,
            .wdata,
            .wdata_low         (32'd0),               // no setting of 64 bits is written
            .rdata             (answer[n]),
            .feedback_select   (feedback_select[n]),
            .feedback_rdata    (feedback[n]),
            .actuator_select   (1'b0),
            .actuator_rdata,
            .now,
            .encoder_a         (a[n]),
            .encoder_b         (b[n]),
            .encoder_z         (1'b0),
            .probe             (2'b00),
            .adc_sin           (1'b0),
            .adc_cos           (1'b0),
            .limit_low_open    (1'b0),
            .limit_high_open   (1'b0),
            .drive_fault_n     (1'b1),
            .adc_cs_n,
            .adc_sclk,
            .bridge_a,
            .bridge_b,
            .step,
            .direction,
            .dac_cs_n,
            .dac_sclk,
            .dac_sdi,
            .drive_enable,
            .compare_pulse
        );

        wire pins = &{1'b0, adc_cs_n, adc_sclk, bridge_a, bridge_b, step, direction};
        wire dac = &{1'b0, dac_cs_n, dac_sclk, dac_sdi, target, phase, fine_command, faults};
        wire engine = &{
            1'b0, position, step_made, step_down, moves, moved, moved_by, take_up, block_up,
            block_down, closed_loop, play, arm, controlled_stop, hold_target, pending
        };
        wire chain = &{
            1'b0, chain_setting_written, chain_harmonic_enable, chain_learn, sample_valid,
            sample_sin, sample_cos, quadrature_count
        };
        wire unused = &{
            pins, dac, engine, chain, actuator_rdata, drive_enable, compare_pulse, line_stopped
        };
    end

    assign rdata = answer[0] | answer[1] | answer[2] | feedback[0] | feedback[1] | feedback[2];

    wire unused = &{1'b0, now_high};
endmodule

`default_nettype wire
