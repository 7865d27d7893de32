// SPDX-License-Identifier: Apache-2.0
// axis_on_wishbone -- one axis behind Wishbone, for a design with a processor of its own: the axis
// with its motion engine, its register memory and its time, without soft core and RS-485 bus.
//
// The registers are those of docs/registers.md, at the same addresses: node at 0x000, axis at
// 0x400, its feedback channel at 0xC00, its actuator at 0x1400. The first access waits until the
// settings have their first values, 2048 cycles after rst. While the drive is on, the processor
// must write node.heartbeat every 20 ms + 1 200 000 cycles at most, else the fault `cpu` switches
// the drive off. The fault of the bus watchdog never comes.
`default_nettype none

module axis_on_wishbone #(
    parameter int CLK_HZ = 48_000_000,  // Hz, clk frequency, a multiple of 1000
    parameter int TICK_HZ = 4000,  // Hz, servo tick that the processor sets in node.tick_period
    parameter int W = 8,  // bits of a sample
    parameter int ADC_FRAME = 14,  // clocks of a conversion, at half of CLK_HZ
    parameter int SEGMENTS = 0,  // most segments of the scale's table; 0: no table
    parameter int FILTERS = 0,  // biquads of the servo, 0 to 4
    parameter int HAS_SINE = 0,  // 1: sine and cosine; 0: positions of counts only
    parameter int HAS_BRIDGE = 1,  // 1: build the bridge
    parameter int HAS_STEPPER = 1,  // 1: build the step generator
    parameter int HAS_DAC = 0,  // 1: build the DAC
    parameter int HAS_FINE_STAGE = HAS_DAC  // 1: build the fine stage; needs the DAC
) (
    input  wire         clk,
    input  wire         rst,
    // Wishbone
    input  wire         wb_cyc,           // level: a bus cycle
    input  wire         wb_stb,           // level: an access to this port
    input  wire         wb_we,            // level: it writes
    input  wire  [13:0] wb_adr,           // word address
    input  wire  [ 3:0] wb_sel,           // bit n: byte n is written
    input  wire  [31:0] wb_dat_w,         // word to be written
    output logic [31:0] wb_dat_r,         // word read, with wb_ack
    output logic        wb_ack,           // strobe: the access is done
    output logic        wb_err,           // strobe: the access is refused
    // pins of the scale
    input  wire         encoder_a,        // pin
    input  wire         encoder_b,        // pin
    input  wire         encoder_z,        // pin, index
    input  wire  [ 1:0] probe,            // pins of the touch probes
    input  wire         adc_sin,          // pin, serial data, synchronous to adc_sclk
    input  wire         adc_cos,          // pin, serial data, synchronous to adc_sclk
    output logic        adc_cs_n,         // pin, low during a conversion
    output logic        adc_sclk,         // pin, idles high
    output logic        compare_pulse,    // pin, high during a compare pulse
    // pins of the machine
    input  wire         estop_open,       // pin, 1: pressed or wire cut
    input  wire         limit_low_open,   // pin, 1: pressed or wire cut
    input  wire         limit_high_open,  // pin, 1: pressed or wire cut
    input  wire         drive_fault_n,    // pin, 0: the drive reports a fault
    // pins of the drive
    output logic        bridge_a,         // pin, alone high for a positive command
    output logic        bridge_b,         // pin, alone high for a negative command
    output logic        step,             // pin, as step_output_mode says
    output logic        direction,        // pin, as step_output_mode says
    output logic        dac_cs_n,         // pin, low during a word
    output logic        dac_sclk,         // pin, idles low
    output logic        dac_sdi,          // pin, data of the DAC
    output logic        drive_enable      // pin, 1: the drive may be on
);
    localparam int LIMIT_PERIOD = CLK_HZ / 80_000;  // cycles

    // register bus
    wire select, write, memory_ready, waits, hold, stores;
    wire node_select, bus_select, peripherals_select, link_select;
    wire axis_select, feedback_select, actuator_select;
    wire [15:0] address;
    wire [31:0] wdata, wdata_low, rdata, memory_rdata, node_rdata;
    wire [31:0] axis_rdata, feedback_rdata, actuator_rdata;
    wire [13:0] stored_at;
    wire [31:0] stored_value;
    // time
    wire [63:0] now;
    wire [23:0] tick_period;
    wire [15:0] sample_period;
    wire tick, sample_tick, limit_tick, restart_tick;
    wire start, start_axes_written, wait_time_written;
    wire [ 7:0] start_axes;
    wire [23:0] wait_time;
    // interlock
    wire estop, heartbeat_kick, armed, cpu_stopped, servo_overrun;
    // motion engine
    wire pending, moves, moved, request_waits, step_made, step_down, block_up, block_down;
    wire closed_loop, play, arm, controlled_stop, hold_target;
    wire result_valid, integral_valid, result_flag;
    wire [2:0] result_axis, result_kind;
    wire [47:0] position, moved_by, result;
    wire [23:0] take_up;
    wire [15:0] cycles;
    // lines of motor steps
    wire line_start, line_idle, rate_valid, rate_restart, rate_steep, line_stopped;
    wire signed [36:0] rate;
    // ports of a shared interpolation chain, which there is not
    wire        [ 7:0] chain_setting_written;
    wire chain_harmonic_enable, chain_learn, sample_valid;
    wire signed [W-1:0] sample_sin, sample_cos;
    wire signed [31:0] quadrature_count;
    wire        [47:0] target;
    wire [15:0] phase, fine_command;
    wire [12:0] faults;
    // the count of servo ticks, and the state of streamed set-points, which there are not
    wire [31:0] tick_count, stream_state, stream_counts;
    // registers of a recorder of ticks, which there is not
    wire [2:0] excitation_axis, scope_axis, scope_last, scope_mode;
    wire        [12:0] excitation_period;
    wire        [14:0] excitation_limit;
    wire signed [15:0] excitation_value;
    wire        [11:0] excitation_value_at;
    wire excitation_value_written, scope_word_read, scope_level_written;
    wire [3:0] scope_trigger;
    wire [31:0] scope_channels_0, scope_channels_4;
    wire [15:0] scope_samples_length, scope_samples_every, scope_place_earlier, scope_place_delay;
    wire signed [31:0] scope_level;

    wishbone_port u_port (
        .clk,
        .rst,
        // Wishbone
        .wb_cyc,
        .wb_stb,
        .wb_we,
        .wb_adr,
        .wb_sel,
        .wb_dat_w,
        .wb_dat_r,
        .wb_ack,
        .wb_err,
        // register bus
        .ready(memory_ready && !waits),
        .select,
        .write,
        .address,
        .wdata,
        .rdata
    );
    register_memory #(
        .FILTERS       (FILTERS == 0 ? 0 : 1),
        .HAS_BRIDGE    (HAS_BRIDGE),
        .HAS_DAC       (HAS_DAC),
        .HAS_FINE_STAGE(HAS_FINE_STAGE),
        .HAS_HARMONICS (HAS_SINE),
        .HAS_MONITOR   (HAS_SINE),
        .HAS_RECORDER  (HAS_SINE),
        .HAS_SINE      (HAS_SINE),
        .HAS_STEPPER   (HAS_STEPPER)
    ) u_memory (
        .clk,
        .rst,
        .hold,
        .select,
        .write,
        .address(address[15:2]),
        .wdata,
        .ready  (memory_ready),
        .rdata  (memory_rdata),
        .wdata_low,
        .stores,
        .stored_at,
        .stored_value
    );
    register_bus u_bus (
        .clk,
        .select,
        .address,
        .memory_rdata,
        .node_rdata,
        .bus_rdata        (32'd0),
        .peripherals_rdata(32'd0),
        .link_rdata       (32'd0),
        .axis_rdata,
        .feedback_rdata,
        .actuator_rdata,
        .node_select,
        .bus_select,
        .peripherals_select,
        .link_select,
        .axis_select,
        .feedback_select,
        .actuator_select,
        .rdata
    );
    node_registers u_node_registers (
        .clk,
        .rst,
        .select               (node_select),
        .write,
        .word                 (address[7:2]),
        .wdata,
        .rdata                (node_rdata),
        .clk_hz               (32'(CLK_HZ)),
        .build_axes           (4'd1),
        .build_address        (4'd0),
        .build_memory         (8'd0),
        .build_scope          (9'd0),
        .time_stamp           (now),
        .tick_period,
        .sample_period,
        .heartbeat_kick,
        .start_axes,
        .start_axes_written,
        .wait_time,
        .wait_time_written,
        .tick_count,
        .excitation_axis,
        .excitation_period,
        .excitation_limit,
        .excitation_value,
        .excitation_value_at,
        .excitation_value_written,
        .scope_state_phase    (2'd0),
        .scope_state_available(17'd0),
        .scope_word           (32'd0),
        .scope_word_read,
        .scope_axis,
        .scope_last,
        .scope_trigger,
        .scope_mode,
        .scope_channels_0,
        .scope_channels_4,
        .scope_samples_length,
        .scope_samples_every,
        .scope_place_earlier,
        .scope_place_delay,
        .scope_level,
        .scope_level_written
    );

    // time
    time_stamp u_time (
        .clk,
        .rst,
        .now
    );
    tick_divider #(
        .W(24)
    ) u_tick (
        .clk,
        .rst,
        .period (tick_period),
        .restart(restart_tick),
        .tick
    );
    tick_divider #(
        .W(16)
    ) u_sample_tick (
        .clk,
        .rst,
        .period (sample_period),
        .restart(1'b0),
        .tick   (sample_tick)
    );
    tick_divider #(
        .W($clog2(LIMIT_PERIOD + 1))
    ) u_limit_tick (
        .clk,
        .rst,
        .period ($clog2(LIMIT_PERIOD + 1)'(LIMIT_PERIOD)),
        .restart(1'b0),
        .tick   (limit_tick)
    );
    common_start u_start (
        .request     (start_axes_written),
        .request_axes(start_axes),
        .sync        (1'b0),
        .sync_axes   (8'd0),
        .start,
        .restart_tick
    );

    // interlock: the processor must kick while the drive is on
    core_watchdog #(
        .CLK_HZ(CLK_HZ)
    ) u_watchdog (
        .clk,
        .rst,
        .trap   (1'b0),
        .kick   (heartbeat_kick),
        .drive_enable,
        .armed,
        .stopped(cpu_stopped)
    );
    synchroniser #(
        .RESET(1)
    ) u_estop (
        .clk,
        .rst,
        .d(estop_open),
        .q(estop)
    );

    motion #(
        .FILTERS    (FILTERS),
        .TICK_CYCLES(CLK_HZ / TICK_HZ),
        .HAS_STEPPER(HAS_STEPPER)
    ) u_motion (
        .clk,
        .rst,
        .tick,
        .tick_period  (tick_period[17:0]),
        .now          (now[31:0]),
        .stores,
        .stored_at,
        .stored_value,
        .wdata_low,
        .hold,
        .waits,
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
        .enabled      (drive_enable),
        .tick_count,
        .stream_states(stream_state),
        .stream_counts,
        .play,
        .arm,
        .controlled_stop,
        .hold_target,
        .request_waits,
        .pending,
        .result_valid,
        .integral_valid,
        .result_axis,
        .result_kind,
        .result,
        .result_flag,
        .servo_overrun,
        .cycles,
        .line_start,
        .line_idle,
        .rate_valid,
        .rate,
        .rate_restart,
        .rate_steep,
        .line_stopped
    );
    axis #(
        .W             (W),
        .ADC_FRAME     (ADC_FRAME),
        .SEGMENTS      (SEGMENTS),
        .FILTERS       (FILTERS),
        .HAS_SINE      (HAS_SINE),
        .HAS_BRIDGE    (HAS_BRIDGE),
        .HAS_STEPPER   (HAS_STEPPER),
        .HAS_DAC       (HAS_DAC),
        .HAS_FINE_STAGE(HAS_FINE_STAGE)
    ) u_axis (
        .clk,
        .rst,
        .select            (axis_select),
        .feedback_select,
        .actuator_select,
        .write,
        .word              (address[7:2]),
        .wdata,
        .wdata_low,
        .rdata             (axis_rdata),
        .feedback_rdata,
        .actuator_rdata,
        .tick,
        .sample_tick,
        .limit_tick,
        .now               (now[31:0]),
        .start,
        .servo_overrun,
        .sample_overrun    (1'b0),
        .sync              (1'b0),
        .estop,
        .watchdog_expired  (1'b0),
        .link_expired      (1'b0),
        .cpu_stopped,
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
        .waits             (request_waits),
        .pending,
        .result_valid,
        .result_kind,
        .result,
        .result_flag,
        .line_start,
        .line_idle,
        .rate_valid,
        .rate,
        .rate_restart,
        .rate_steep,
        .line_stopped,
        .stream_state,
        .stream_counts,
        .chain_setting_written,
        .chain_harmonic_enable,
        .chain_learn,
        .sample_valid,
        .sample_sin,
        .sample_cos,
        .quadrature_count,
        .chain_sampled     (1'b0),
        .chain_sin         (W'(0)),
        .chain_cos         (W'(0)),
        .chain_rejected    (1'b0),
        .chain_phase_valid (1'b0),
        .chain_plain_phase (16'(0)),
        .chain_done        (1'b0),
        .chain_step        (17'(0)),
        .chain_phase       (16'(0)),
        .chain_overspeed   (1'b0),
        .chain_disagreement(1'b0),
        .chain_lost        (1'b0),
        .target,
        .phase,
        .fine_command,
        .faults,
        .encoder_a,
        .encoder_b,
        .encoder_z,
        .probe,
        .adc_sin,
        .adc_cos,
        .adc_cs_n,
        .adc_sclk,
        .compare_pulse,
        .limit_low_open,
        .limit_high_open,
        .drive_fault_n,
        .bridge_a,
        .bridge_b,
        .step,
        .direction,
        .dac_cs_n,
        .dac_sclk,
        .dac_sdi,
        .drive_enable
    );

    wire unused_bus = &{1'b0, address[1:0], bus_select, peripherals_select, link_select, wait_time};
    wire unused_time = &{1'b0, wait_time_written, tick_period[23:18], armed, cycles, result_axis,
        integral_valid
    };
    wire unused_chain = &{
        1'b0, chain_setting_written, chain_harmonic_enable, chain_learn, sample_valid, sample_sin,
        sample_cos, quadrature_count
    };
    wire unused_signals = &{1'b0, target, phase, fine_command, faults};
    wire unused_excitation = &{
        1'b0, excitation_axis, excitation_period, excitation_limit, excitation_value,
        excitation_value_at, excitation_value_written
    };
    wire unused_recorder = &{
        1'b0, scope_word_read, scope_axis, scope_last, scope_trigger, scope_mode, scope_channels_0,
        scope_channels_4, scope_samples_length, scope_samples_every, scope_place_earlier,
        scope_place_delay, scope_level, scope_level_written
    };
endmodule

`default_nettype wire
