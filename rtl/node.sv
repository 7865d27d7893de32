// SPDX-License-Identifier: Apache-2.0
// node -- a complete motion controller on an RS-485 bus: soft core, bus port, motion engine, axes
// and peripherals.
//
// latency  see the blocks
// rate     see the blocks
// behaviour  The HAS_... parameters of axes are masks: bit n builds the feature in axis n, and bits
//            from AXES up are ignored, so 255 means all axes and 0 none. FILTERS and SEGMENTS are
//            sizes, for the axes whose bit is set in HAS_FILTERS or HAS_SEGMENTS. A mask that is
//            not given has its default below. A feature without what it needs stops the build, with
//            the rule as the message, and so do more axes and filters than motion_engine can serve
//            in the cycles of a servo tick, CLK_HZ / TICK_HZ.
// source   S0: one slave computer per axis, many on one bus; here one node may have several axes
// model    the models of its blocks; tested together by tb/system
`default_nettype none

module node #(
    parameter int CLK_HZ = 4_000_000,  // Hz, clk frequency
    parameter int TICK_HZ = 4000,  // Hz, servo tick that the firmware sets
    parameter int AXES = 1,  // axes of the node, 1 to 8
    parameter int W = 8,  // bits of a sample
    parameter int ADC_FRAME = 14,  // clocks of a conversion, at half of CLK_HZ
    parameter int FILTERS = 2,  // biquads of a servo, 0 to 4
    parameter int SEGMENTS = 0,  // most segments of a scale's table; 0: none
    parameter int HAS_SINE = 255,  // axes with sine and cosine; else counts only
    // axes with an interpolation chain of their own, the other sine axes share one; by default a
    // single sine axis has its own
    parameter int HAS_OWN_CHAIN = (HAS_SINE & (HAS_SINE - 1)) % (1 << AXES) == 0 ? 255 : 0,
    parameter int HAS_MONITOR = HAS_SINE,  // axes with a signal monitor, needs the sine
    parameter int HAS_HARMONICS = HAS_SINE,  // axes with harmonic correction, needs the sine
    parameter int HAS_RECORDER = HAS_SINE,  // axes with a recorder of bursts, needs the sine
    parameter int HAS_SEGMENTS = 255,  // axes with a table of SEGMENTS segments
    parameter int HAS_CAPTURE = 255,  // axes with a queue of captures
    parameter int HAS_COMPARE = 255,  // axes with compare
    parameter int HAS_ENCODER_CHECK = 255,  // axes with the check of the encoder
    parameter int HAS_VELOCITY = 255,  // axes of which the engine has the velocity
    parameter int HAS_DRIVE = 255,  // axes with a drive; the others only measure
    parameter int HAS_FILTERS = HAS_DRIVE,  // axes with FILTERS biquads, needs the drive
    parameter int HAS_BRIDGE = HAS_DRIVE,  // axes with a bridge, needs the drive
    parameter int HAS_STEPPER = HAS_DRIVE,  // axes with a step generator, needs the drive
    parameter int HAS_DAC = HAS_DRIVE,  // axes with a DAC, needs the drive
    parameter int HAS_FINE_STAGE = HAS_DAC,  // axes with a fine stage, needs the DAC
    parameter int HAS_SET_POINTS = 0,  // axes that can follow streamed set-points, needs the drive
    parameter int HAS_BACKLASH = 0,  // axes with compensation of backlash, needs the drive
    parameter int HAS_I2C = 0,  // 1: build the I2C master
    parameter int HAS_PS2 = 0,  // 1: build the PS/2 pass-through
    parameter int HAS_PEER = 0,  // 1: build the peer port
    parameter int HAS_ANGLE_SENSOR = 0,  // 1: build the receiver of the angle sensor
    parameter int HAS_DISPLAY = 0,  // 1: build the numeric display
    parameter int HAS_STATUS_INPUTS = 0,  // 1: build the status inputs
    parameter int SCOPE_WORDS = 0,  // words of the recorder of ticks; 0: none, and no excitation
    parameter int HAS_LINK = 0,  // 1: build the real-time link
    parameter int LINK_CARRIER = 0,  // of the link, 0: serial line, 1: UDP datagrams, 2: SPI
    parameter int LINK_PLL = 0,  // 1: build its PLL, which captures the feedback before a request
    parameter int HAS_SERIAL_CORE = 0,  // 1: bit-serial soft core, with its firmware in a flash
    parameter int MEMORY_BYTES = 98304,  // bytes of the soft core, program and data
    parameter FIRMWARE = "",  // file of its contents at power-up
    parameter int PROGRAM_BYTES = 32768,  // bytes that a serial core copies, a power of two
    parameter int CODE_BYTES = 0,  // of a soft core: bytes of its program in the flash; 0: none
    parameter int FLASH_START = 131072,  // byte address of the firmware in the flash
    parameter int HAS_UPDATE = 0,  // 1: a serial core can write new firmware into the flash
    parameter REGISTER_STYLE = "auto",  // ram_style of the memory of the settings
    parameter QUEUE_STYLE = "distributed"  // ram_style of the queues of the bus
) (
    input  wire               clk,
    input  wire               rst,
    // RS-485 bus
    input  wire  [       3:0] address,              // address of the node, static
    input  wire               rs485_rx,             // pin, idles high
    output logic              rs485_tx,             // pin, idles high
    output logic              rs485_driver_enable,  // pin, 1: drive the bus
    // serial line of the real-time link
    input  wire               link_rx,              // pin, idles high
    output logic              link_tx,              // pin, idles high
    output logic              link_driver_enable,   // pin, 1: drive the line
    // SPI of the real-time link, whose host has the clock
    input  wire               link_cs_n,            // pin, low during a transfer
    input  wire               link_sclk,            // pin, idles low
    input  wire               link_mosi,            // pin, data of the host
    output logic              link_miso,            // pin, data to the host
    // UDP datagrams of the real-time link, from and to an Ethernet core with the same clock
    input  wire               udp_rx_valid,         // level, synchronous to clk: a byte
    input  wire  [       7:0] udp_rx_data,          // byte, synchronous to clk
    input  wire               udp_rx_last,          // level, synchronous to clk: the last byte
    input  wire               udp_rx_error,         // level, synchronous to clk: it is damaged
    input  wire  [      47:0] udp_rx_sender,        // IP address and port, synchronous to clk
    output logic              udp_rx_ready,         // level: with udp_rx_valid, the byte is taken
    output logic              udp_tx_valid,         // level: a byte
    output logic [       7:0] udp_tx_data,          // byte
    output logic              udp_tx_last,          // level: with udp_tx_valid, the last byte
    output logic [      47:0] udp_tx_receiver,      // IP address, UDP port in bits 15:0
    output logic [      15:0] udp_tx_length,        // bytes of the datagram
    input  wire               udp_tx_ready,         // level, synchronous to clk: the byte is taken
    // flash of a serial core, or of a soft core with CODE_BYTES
    output logic              flash_cs_n,           // pin, low during a command
    output logic              flash_sclk,           // pin, idles low
    output logic              flash_mosi,           // pin, data to the flash
    input  wire               flash_miso,           // pin, data of it, synchronous to flash_sclk
    // emergency stop
    input  wire               estop_open,           // pin, 1: pressed or wire cut
    // scales, bit n or bits 2 n + 1 .. 2 n: axis n
    input  wire  [  AXES-1:0] encoder_a,            // pins
    input  wire  [  AXES-1:0] encoder_b,            // pins
    input  wire  [  AXES-1:0] encoder_z,            // pins, index
    input  wire  [2*AXES-1:0] probe,                // pins of the touch probes, two of each axis
    input  wire  [  AXES-1:0] adc_sin,              // pins, serial data, synchronous to adc_sclk
    input  wire  [  AXES-1:0] adc_cos,              // pins, serial data, synchronous to adc_sclk
    output logic [  AXES-1:0] adc_cs_n,             // pins, low during a conversion
    output logic [  AXES-1:0] adc_sclk,             // pins, idle high
    output logic [  AXES-1:0] compare_pulse,        // pins, high during a compare pulse
    // machine
    input  wire  [  AXES-1:0] limit_low_open,       // pins, 1: pressed or wire cut
    input  wire  [  AXES-1:0] limit_high_open,      // pins, 1: pressed or wire cut
    input  wire  [  AXES-1:0] drive_fault_n,        // pins, 0: the drive reports a fault
    // drives
    output logic [  AXES-1:0] bridge_a,             // pins, alone high for a positive command
    output logic [  AXES-1:0] bridge_b,             // pins, alone high for a negative command
    output logic [  AXES-1:0] step,                 // pins, as step_output_mode says
    output logic [  AXES-1:0] direction,            // pins, as step_output_mode says
    output logic [  AXES-1:0] dac_cs_n,             // pins, low during a word
    output logic [  AXES-1:0] dac_sclk,             // pins, idle low
    output logic [  AXES-1:0] dac_sdi,              // pins, data of the DAC
    output logic [  AXES-1:0] drive_enable,         // pins, 1: the drive may be on
    // peripherals: I2C
    input  wire               i2c_scl,              // level of the clock line
    input  wire               i2c_sda,              // level of the data line
    output logic              i2c_scl_low,          // 1: pull the clock line low
    output logic              i2c_sda_low,          // 1: pull the data line low
    // peripherals: PS/2, the keyboard's side
    input  wire               keyboard_clock,       // level of the clock line
    input  wire               keyboard_data,        // level of the data line
    output logic              keyboard_clock_low,   // 1: pull the clock line low
    output logic              keyboard_data_low,    // 1: pull the data line low
    // peripherals: PS/2, where the node is the keyboard of the EDM machine
    input  wire               edm_clock,            // level of the clock line
    input  wire               edm_data,             // level of the data line
    output logic              edm_clock_low,        // 1: pull the clock line low
    output logic              edm_data_low,         // 1: pull the data line low
    // peripherals: the others
    input  wire               peer_rx,              // pin, idles high
    output logic              peer_tx,              // pin, idles high
    input  wire               sensor_rx,            // pin, idles high
    output logic              display_cs_n,         // pin, low during a word
    output logic              display_sclk,         // pin, idles low
    output logic              display_data,         // pin
    input  wire  [       1:0] edm_status            // pins, asynchronous
);
    localparam int LIMIT_PERIOD = CLK_HZ / 80_000;  // cycles
    localparam int SERVO_FILTERS = HAS_FILTERS % (1 << AXES) != 0 ? FILTERS : 0;

    // masters of the register bus: the soft core, then the real-time link, if there is one
    localparam int MASTERS = 1 + HAS_LINK;
    wire [MASTERS-1:0] master_request, master_ready, master_select, master_write;
    wire [16*MASTERS-1:0] master_address;
    wire [32*MASTERS-1:0] master_wdata;
    wire [   MASTERS-1:0] master_waits = MASTERS'(core_waits || crc_waits);
    // register bus
    wire select, write, node_select, bus_select, peripherals_select, link_select;
    wire [AXES-1:0] axis_select, feedback_select, actuator_select;
    wire [15:0] bus_address;
    wire [31:0] wdata, wdata_low, rdata;
    wire [31:0] memory_rdata, node_rdata, bus_rdata, peripherals_rdata, link_rdata;
    wire memory_ready, stores, hold, engine_waits, core_waits, crc_waits;
    wire [13:0] stored_at;
    wire [31:0] stored_value;
    wire [32*AXES-1:0] axis_rdata, feedback_rdata, actuator_rdata;
    wire [ 5:0] word = bus_address[7:2];
    // time
    wire [63:0] now;
    wire [23:0] tick_period;
    wire [15:0] sample_period;
    wire tick, sample_tick, limit_tick, restart_tick;
    // waiting of the soft core
    wire wait_time_written, word_received;
    wire [23:0] wait_time;
    // start of several axes
    wire start_axes_written, sync;
    wire [7:0] start_axes, sync_axes;
    wire [AXES-1:0] start;
    // motion engine
    wire [48*AXES-1:0] position, moved_by;
    wire [24*AXES-1:0] take_up;
    wire [AXES-1:0] step_made, step_down, moves, moved, block_up, block_down, closed_loop;
    wire [AXES-1:0] play, arm, controlled_stop, hold_target, request_waits, pending;
    wire result_valid, integral_valid, result_flag, servo_overrun;
    wire [2:0] result_axis, result_kind;
    wire [47:0] result, computed;  // with and without the excitation
    wire [15:0] cycles;
    wire [31:0] tick_count;
    wire [32*AXES-1:0] stream_states, stream_counts;
    // recorder of ticks, excitation
    wire [2:0] scope_axis, excitation_axis;
    wire [2:0] scope_last, scope_mode;
    wire [3:0] scope_trigger;
    wire [31:0] scope_channels_0, scope_channels_4;
    wire [15:0] scope_length, scope_every, scope_earlier, scope_delay;
    wire scope_start, scope_read, excitation_written;
    wire [31:0] scope_level, scope_word;
    wire [ 1:0] scope_phase;
    wire [16:0] scope_available;
    wire [16*AXES-1:0] phases, fine_commands;
    wire        [48*AXES-1:0] targets;
    wire        [13*AXES-1:0] axis_faults;
    wire        [       12:0] excitation_period;
    wire        [       14:0] excitation_limit;
    wire signed [       15:0] excitation_value;
    wire        [       11:0] excitation_at;
    // lines of motor steps
    wire line_start, line_idle, rate_restart, rate_steep;
    wire [AXES-1:0] rate_valid, line_stopped;
    wire signed [36:0] rate;
    // interpolation chain that sine axes share
    localparam int SHARED = HAS_SINE % (1 << AXES) & ~HAS_OWN_CHAIN;
    wire [8*AXES-1:0] chain_setting_written;
    wire [AXES-1:0] chain_harmonic_enable, chain_learn, sample_valid;
    wire [W*AXES-1:0] sample_sin, sample_cos;
    wire [32*AXES-1:0] quadrature_count;
    wire [AXES-1:0] chain_sampled, chain_rejected, chain_phase_valid, chain_done;
    wire [AXES-1:0] chain_overspeed, chain_disagreement, chain_lost;
    wire signed [W-1:0] chain_sin, chain_cos;
    wire [15:0] chain_plain_phase, chain_phase;
    wire signed [16:0] chain_step;
    wire               sample_overrun;
    // interlock
    wire link_request, link_makes, link_writes, link_expired;
    wire [15:0] link_address;
    wire [31:0] link_wdata;
    wire trap, heartbeat_kick, armed, cpu_stopped, estop, watchdog_expired;

    if (HAS_SERIAL_CORE != 0) begin : g_serial_core
        serial_core #(
            .MEMORY_BYTES (MEMORY_BYTES),
            .PROGRAM_BYTES(PROGRAM_BYTES),
            .FLASH_START  (FLASH_START),
            .HAS_UPDATE   (HAS_UPDATE)
        ) u_core (
            .clk,
            .rst,
            .request(master_request[0]),
            .ready  (master_ready[0]),
            .select (master_select[0]),
            .write  (master_write[0]),
            .address(master_address[15:0]),
            .wdata  (master_wdata[31:0]),
            .rdata,
            .trap,
            // flash
            .flash_cs_n,
            .flash_sclk,
            .flash_mosi,
            .flash_miso
        );
    end else begin : g_core
        soft_core #(
            .MEMORY_BYTES(MEMORY_BYTES),
            .FIRMWARE    (FIRMWARE),
            .CODE_BYTES  (CODE_BYTES),
            .CODE_START  (FLASH_START)
        ) u_core (
            .clk,
            .rst,
            .request(master_request[0]),
            .ready  (master_ready[0]),
            .select (master_select[0]),
            .write  (master_write[0]),
            .address(master_address[15:0]),
            .wdata  (master_wdata[31:0]),
            .rdata,
            .trap,
            // flash
            .flash_cs_n,
            .flash_sclk,
            .flash_mosi,
            .flash_miso
        );
    end
    register_arbiter #(
        .MASTERS(MASTERS),
        .HOLD   (HAS_SERIAL_CORE != 0 ? 1023 : 63)
    ) u_arbiter (
        .clk,
        .rst,
        // masters
        .request   (master_request),
        .waits     (master_waits),
        .ready     (master_ready),
        .select    (master_select),
        .write     (master_write),
        .address   (master_address),
        .wdata     (master_wdata),
        // register bus
        .bus_ready (memory_ready && !engine_waits),
        .bus_select(select),
        .bus_write (write),
        .bus_address,
        .bus_wdata (wdata)
    );
    register_memory #(
        .AXES             (AXES),
        .FILTERS          (FILTERS == 0 ? 0 : HAS_FILTERS),
        .HAS_BACKLASH     (HAS_BACKLASH),
        .HAS_BRIDGE       (HAS_BRIDGE),
        .HAS_COMPARE      (HAS_COMPARE),
        .HAS_DAC          (HAS_DAC),
        .HAS_DRIVE        (HAS_DRIVE),
        .HAS_ENCODER_CHECK(HAS_ENCODER_CHECK),
        .HAS_FINE_STAGE   (HAS_FINE_STAGE),
        .HAS_HARMONICS    (HAS_HARMONICS),
        .HAS_MONITOR      (HAS_MONITOR),
        .HAS_RECORDER     (HAS_RECORDER),
        .HAS_SET_POINTS   (HAS_SET_POINTS),
        .HAS_SINE         (HAS_SINE),
        .HAS_STEPPER      (HAS_STEPPER),
        .HAS_VELOCITY     (HAS_VELOCITY),
        .STYLE            (REGISTER_STYLE)
    ) u_register_memory (
        .clk,
        .rst,
        .hold,
        .select,
        .write,
        .address(bus_address[15:2]),
        .wdata,
        .ready  (memory_ready),
        .rdata  (memory_rdata),
        .wdata_low,
        .stores,
        .stored_at,
        .stored_value
    );
    register_bus #(
        .AXES(AXES)
    ) u_bus (
        .clk,
        // access of the soft core
        .select,
        .address(bus_address),
        .rdata,
        // answers of the memory and the blocks
        .memory_rdata,
        .node_rdata,
        .bus_rdata,
        .peripherals_rdata,
        .link_rdata,
        .axis_rdata,
        .feedback_rdata,
        .actuator_rdata,
        // selected block
        .node_select,
        .bus_select,
        .peripherals_select,
        .link_select,
        .axis_select,
        .feedback_select,
        .actuator_select
    );
    node_registers u_node_registers (
        .clk,
        .rst,
        // register bus
        .select                  (node_select),
        .write,
        .word,
        .wdata,
        .rdata                   (node_rdata),
        // what is built
        .clk_hz                  (32'(CLK_HZ)),
        .build_axes              (4'(AXES)),
        .build_address           (address),
        .build_memory            (8'(MEMORY_BYTES / 1024)),
        .build_scope             (9'(SCOPE_WORDS / 256)),
        // time
        .time_stamp              (now),
        .tick_period,
        .sample_period,
        // firmware
        .heartbeat_kick,
        .start_axes,
        .start_axes_written,
        .wait_time,
        .wait_time_written,
        // streamed set-points
        .tick_count,
        // recorder of ticks
        .scope_axis,
        .scope_last,
        .scope_trigger,
        .scope_mode,
        .scope_channels_0,
        .scope_channels_4,
        .scope_samples_length    (scope_length),
        .scope_samples_every     (scope_every),
        .scope_place_earlier     (scope_earlier),
        .scope_place_delay       (scope_delay),
        .scope_level,
        .scope_level_written     (scope_start),
        .scope_state_phase       (scope_phase),
        .scope_state_available   (scope_available),
        .scope_word,
        .scope_word_read         (scope_read),
        // excitation
        .excitation_axis,
        .excitation_period,
        .excitation_limit,
        .excitation_value,
        .excitation_value_at     (excitation_at),
        .excitation_value_written(excitation_written)
    );

    // the soft core waits while it has nothing to do
    core_wait u_core_wait (
        .clk,
        .rst,
        .start (wait_time_written),
        .cycles(wait_time),
        .wake  (word_received),
        .waits (core_waits)
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
    // a limit switch must be stable for 0.1 ms
    tick_divider #(
        .W($clog2(LIMIT_PERIOD + 1))
    ) u_limit_tick (
        .clk,
        .rst,
        .period ($clog2(LIMIT_PERIOD + 1)'(LIMIT_PERIOD)),
        .restart(1'b0),
        .tick   (limit_tick)
    );
    common_start #(
        .AXES(AXES)
    ) u_start (
        .request     (start_axes_written),
        .request_axes(start_axes),
        .sync,
        .sync_axes,
        .start,
        .restart_tick
    );

    motion #(
        .AXES          (AXES),
        .FILTERS       (SERVO_FILTERS),
        .TICK_CYCLES   (CLK_HZ / TICK_HZ),
        .HAS_VELOCITY  (32'(HAS_VELOCITY % (1 << AXES) != 0)),
        .HAS_SET_POINTS(HAS_SET_POINTS),
        .HAS_STEPPER   (32'(HAS_STEPPER % (1 << AXES) != 0))
    ) u_motion (
        .clk,
        .rst,
        // time
        .tick,
        .tick_period(tick_period[17:0]),
        .now        (now[31:0]),
        // register memory
        .stores,
        .stored_at,
        .stored_value,
        .wdata_low,
        .hold,
        .waits      (engine_waits),
        // the axes
        .position,
        .step_made,
        .step_down,
        .moves,
        .moved,
        .moved_by,
        .block_up,
        .block_down,
        .closed_loop,
        .take_up,
        .enabled    (drive_enable),
        // requests
        .play,
        .arm,
        .controlled_stop,
        .hold_target,
        .request_waits,
        .pending,
        // streamed set-points
        .tick_count,
        .stream_states,
        .stream_counts,
        // results
        .result_valid,
        .integral_valid,
        .result_axis,
        .result_kind,
        .result     (computed),
        .result_flag,
        // schedule
        .servo_overrun,
        .cycles,
        // lines of motor steps
        .line_start,
        .line_idle,
        .rate_valid,
        .rate,
        .rate_restart,
        .rate_steep,
        .line_stopped
    );

    if (SCOPE_WORDS != 0) begin : g_scope
        wire first, triggered;
        wire [  2:0] seen_axis;
        wire [W-1:0] sine = sample_sin[W*seen_axis+:W];
        wire [W-1:0] cosine = sample_cos[W*seen_axis+:W];

        command_excitation u_excitation (
            .clk,
            .rst,
            // settings
            .axis       (excitation_axis),
            .period     (excitation_period),
            .running    (triggered),
            .limit      (excitation_limit),
            .store      (excitation_written),
            .store_at   (excitation_at),
            .store_value(excitation_value),
            // motion engine
            .valid      (result_valid),
            .result_axis,
            .kind       (result_kind),
            .result     (computed),
            // to the axes
            .excited    (result),
            .first
        );
        tick_recorder #(
            .AXES (AXES),
            .WORDS(SCOPE_WORDS)
        ) u_recorder (
            .clk,
            .rst,
            // settings
            .start       (scope_start),
            .last        (scope_last),
            .channels    ({scope_channels_4, scope_channels_0}),
            .trigger     ({1'b0, scope_axis, scope_trigger}),
            .trigger_mode(scope_mode),
            .level       (scope_level),
            .length      (scope_length),
            .every       (scope_every),
            .earlier     (scope_earlier),
            .delay       (scope_delay),
            // what is recorded
            .tick,
            .ready       (first),
            .seen_axis,
            .sine_cosine ({16'($signed(cosine)), 16'($signed(sine))}),
            .target      (targets[48*seen_axis+:32]),
            .position    (position[48*seen_axis+:32]),
            .interpolated(32'(phases[16*seen_axis+:16])),
            .fine_command(32'($signed(fine_commands[16*seen_axis+:16]))),
            .faults      (32'(axis_faults[13*seen_axis+:13])),
            .valid       (result_valid),
            .integral_valid,
            .result_axis,
            .kind        (result_kind),
            .result      (result[31:0]),
            // reading
            .read        (scope_read),
            .word        (scope_word),
            .phase       (scope_phase),
            .available   (scope_available),
            // excitation
            .triggered
        );
    end else begin : g_no_scope
        assign result = computed;
        assign {scope_word, scope_phase, scope_available} = '0;

        wire unused_scope = &{
            1'b0, scope_axis, scope_last, scope_trigger, scope_mode, scope_level, scope_length,
            scope_channels_0, scope_channels_4, scope_every, scope_earlier, scope_delay,
            scope_start, scope_read, integral_valid, phases, fine_commands, axis_faults, targets
        };
        wire unused_excitation = &{
            1'b0, excitation_axis, excitation_period, excitation_limit, excitation_value,
            excitation_at, excitation_written
        };
    end

    // interlock
    core_watchdog #(
        .CLK_HZ(CLK_HZ),
        .AXES  (AXES)
    ) u_core_watchdog (
        .clk,
        .rst,
        .trap,
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

    rs485_port #(
        .CLK_HZ     (CLK_HZ),
        .QUEUE_STYLE(QUEUE_STYLE)
    ) u_rs485 (
        .clk,
        .rst,
        // register bus
        .select(bus_select),
        .write,
        .word,
        .wdata,
        .rdata (bus_rdata),
        // node
        .address,
        .armed,
        .watchdog_expired,
        .word_received,
        .crc_waits,
        .sync,
        .sync_axes,
        // pins
        .rs485_rx,
        .rs485_tx,
        .rs485_driver_enable
    );

    link_port #(
        .CLK_HZ (CLK_HZ),
        .BUILT  (HAS_LINK),
        .CARRIER(LINK_CARRIER),
        .PLL    (LINK_PLL)
    ) u_link (
        .clk,
        .rst,
        // register bus, as one of its blocks
        .select          (link_select),
        .write,
        .word,
        .wdata,
        .rdata           (link_rdata),
        // register bus, as one of its masters
        .request         (link_request),
        .ready           (master_ready[MASTERS-1] && HAS_LINK != 0),
        .link_select     (link_makes),
        .link_write      (link_writes),
        .link_address,
        .link_wdata,
        .link_rdata      (rdata),
        // node
        .now             (now[31:0]),
        .drive_on        (|drive_enable),
        .watchdog_expired(link_expired),
        // pins of the serial line
        .link_rx,
        .link_tx,
        .link_driver_enable,
        // pins of the SPI
        .link_cs_n,
        .link_sclk,
        .link_mosi,
        .link_miso,
        // UDP datagrams
        .udp_rx_valid,
        .udp_rx_data,
        .udp_rx_last,
        .udp_rx_error,
        .udp_rx_sender,
        .udp_rx_ready,
        .udp_tx_valid,
        .udp_tx_data,
        .udp_tx_last,
        .udp_tx_receiver,
        .udp_tx_length,
        .udp_tx_ready
    );
    if (HAS_LINK != 0) begin : g_master
        assign master_request[1] = link_request;
        assign master_select[1] = link_makes;
        assign master_write[1] = link_writes;
        assign master_address[31:16] = link_address;
        assign master_wdata[63:32] = link_wdata;
    end else begin : g_no_master
        wire unused_link = &{1'b0, link_request, link_makes, link_writes, link_address, link_wdata};
    end

    peripherals #(
        .CLK_HZ           (CLK_HZ),
        .HAS_I2C          (HAS_I2C),
        .HAS_PS2          (HAS_PS2),
        .HAS_PEER         (HAS_PEER),
        .HAS_ANGLE_SENSOR (HAS_ANGLE_SENSOR),
        .HAS_DISPLAY      (HAS_DISPLAY),
        .HAS_STATUS_INPUTS(HAS_STATUS_INPUTS)
    ) u_peripherals (
        .clk,
        .rst,
        // register bus
        .select(peripherals_select),
        .write,
        .word,
        .wdata,
        .rdata (peripherals_rdata),
        // I2C
        .i2c_scl,
        .i2c_sda,
        .i2c_scl_low,
        .i2c_sda_low,
        // PS/2
        .keyboard_clock,
        .keyboard_data,
        .keyboard_clock_low,
        .keyboard_data_low,
        .edm_clock,
        .edm_data,
        .edm_clock_low,
        .edm_data_low,
        // the others
        .peer_rx,
        .peer_tx,
        .sensor_rx,
        .display_cs_n,
        .display_sclk,
        .display_data,
        .edm_status
    );

    if (SHARED != 0) begin : g_chain
        interpolation_chain #(
            .AXES         (AXES),
            .W            (W),
            .SAMPLE_CYCLES(2 * ADC_FRAME + 1),
            .HAS_HARMONICS(32'((HAS_HARMONICS & SHARED) != 0))
        ) u_chain (
            .clk,
            .rst,
            // settings
            .setting        (wdata),
            .setting_written(chain_setting_written),
            .harmonic_enable(chain_harmonic_enable),
            .learn          (chain_learn),
            // samples and counts
            .valid          (sample_valid),
            .sin            (sample_sin),
            .cos            (sample_cos),
            .count          (quadrature_count),
            // filtered sample
            .sampled        (chain_sampled),
            .sampled_sin    (chain_sin),
            .sampled_cos    (chain_cos),
            .rejected       (chain_rejected),
            // phase before the harmonic correction
            .phase_valid    (chain_phase_valid),
            .plain_phase    (chain_plain_phase),
            // step of the position
            .done           (chain_done),
            .step           (chain_step),
            .phase          (chain_phase),
            .overspeed      (chain_overspeed),
            // faults
            .disagreement   (chain_disagreement),
            .overrun        (sample_overrun),
            .lost           (chain_lost)
        );
    end else begin : g_no_chain
        assign {chain_sampled, chain_sin, chain_cos, chain_rejected} = '0;
        assign {chain_phase_valid, chain_plain_phase} = '0;
        assign {chain_done, chain_step, chain_phase, chain_overspeed} = '0;
        assign {chain_disagreement, sample_overrun, chain_lost} = '0;

        wire unused_settings = &{1'b0, chain_setting_written, chain_harmonic_enable, chain_learn};
        wire unused_samples = &{1'b0, sample_valid, sample_sin, sample_cos, quadrature_count};
    end

    for (genvar n = 0; n < AXES; n++) begin : g_axis
        axis #(
            .W                (W),
            .ADC_FRAME        (ADC_FRAME),
            .HAS_SINE         (HAS_SINE >> n & 1),
            .HAS_OWN_CHAIN    ((HAS_SINE & HAS_OWN_CHAIN) >> n & 1),
            .HAS_MONITOR      (HAS_MONITOR >> n & 1),
            .HAS_HARMONICS    (HAS_HARMONICS >> n & 1),
            .HAS_RECORDER     (HAS_RECORDER >> n & 1),
            .SEGMENTS         ((HAS_SEGMENTS >> n & 1) * SEGMENTS),
            .HAS_CAPTURE      (HAS_CAPTURE >> n & 1),
            .HAS_COMPARE      (HAS_COMPARE >> n & 1),
            .HAS_ENCODER_CHECK(HAS_ENCODER_CHECK >> n & 1),
            .HAS_VELOCITY     (HAS_VELOCITY >> n & 1),
            .HAS_DRIVE        (HAS_DRIVE >> n & 1),
            .FILTERS          ((HAS_FILTERS >> n & 1) * FILTERS),
            .HAS_BRIDGE       (HAS_BRIDGE >> n & 1),
            .HAS_STEPPER      (HAS_STEPPER >> n & 1),
            .HAS_DAC          (HAS_DAC >> n & 1),
            .HAS_FINE_STAGE   (HAS_FINE_STAGE >> n & 1),
            .HAS_SET_POINTS   (HAS_SET_POINTS >> n & 1),
            .HAS_BACKLASH     (HAS_BACKLASH >> n & 1)
        ) u_axis (
            .clk,
            .rst,
            // register bus
            .select               (axis_select[n]),
            .feedback_select      (feedback_select[n]),
            .actuator_select      (actuator_select[n]),
            .write,
            .word,
            .wdata,
            .wdata_low,
            .rdata                (axis_rdata[32*n+:32]),
            .feedback_rdata       (feedback_rdata[32*n+:32]),
            .actuator_rdata       (actuator_rdata[32*n+:32]),
            // time
            .tick,
            .sample_tick,
            .limit_tick,
            .now                  (now[31:0]),
            // node
            .start                (start[n]),
            .servo_overrun,
            .sample_overrun,
            .sync,
            .estop,
            .watchdog_expired,
            .link_expired,
            .cpu_stopped,
            // motion_engine: what it is given
            .position             (position[48*n+:48]),
            .step_made            (step_made[n]),
            .step_down            (step_down[n]),
            .moves                (moves[n]),
            .moved                (moved[n]),
            .moved_by             (moved_by[48*n+:48]),
            .block_up             (block_up[n]),
            .block_down           (block_down[n]),
            .closed_loop          (closed_loop[n]),
            .take_up              (take_up[24*n+:24]),
            .play                 (play[n]),
            .arm                  (arm[n]),
            .controlled_stop      (controlled_stop[n]),
            .hold_target          (hold_target[n]),
            // motion_engine: its results
            .waits                (request_waits[n]),
            .pending              (pending[n]),
            .result_valid         (result_valid && result_axis == 3'(n)),
            .result_kind,
            .result,
            .result_flag,
            // set_point_player
            .stream_state         (stream_states[32*n+:32]),
            .stream_counts        (stream_counts[32*n+:32]),
            // step_lines
            .line_start,
            .line_idle,
            .rate_valid           (rate_valid[n]),
            .rate,
            .rate_restart,
            .rate_steep,
            .line_stopped         (line_stopped[n]),
            // pins of the scale
            .encoder_a            (encoder_a[n]),
            .encoder_b            (encoder_b[n]),
            .encoder_z            (encoder_z[n]),
            .probe                (probe[2*n+:2]),
            .adc_sin              (adc_sin[n]),
            .adc_cos              (adc_cos[n]),
            .adc_cs_n             (adc_cs_n[n]),
            .adc_sclk             (adc_sclk[n]),
            .compare_pulse        (compare_pulse[n]),
            // shared chain
            .chain_setting_written(chain_setting_written[8*n+:8]),
            .chain_harmonic_enable(chain_harmonic_enable[n]),
            .chain_learn          (chain_learn[n]),
            .sample_valid         (sample_valid[n]),
            .sample_sin           (sample_sin[W*n+:W]),
            .sample_cos           (sample_cos[W*n+:W]),
            .quadrature_count     (quadrature_count[32*n+:32]),
            .chain_sampled        (chain_sampled[n]),
            .chain_sin,
            .chain_cos,
            .chain_rejected       (chain_rejected[n]),
            .chain_phase_valid    (chain_phase_valid[n]),
            .chain_plain_phase,
            .chain_done           (chain_done[n]),
            .chain_step,
            .chain_phase,
            .chain_overspeed      (chain_overspeed[n]),
            .chain_disagreement   (chain_disagreement[n]),
            .chain_lost           (chain_lost[n]),
            // tick_recorder
            .target               (targets[48*n+:48]),
            .phase                (phases[16*n+:16]),
            .fine_command         (fine_commands[16*n+:16]),
            .faults               (axis_faults[13*n+:13]),
            // pins of the machine
            .limit_low_open       (limit_low_open[n]),
            .limit_high_open      (limit_high_open[n]),
            .drive_fault_n        (drive_fault_n[n]),
            // pins of the drive
            .bridge_a             (bridge_a[n]),
            .bridge_b             (bridge_b[n]),
            .step                 (step[n]),
            .direction            (direction[n]),
            .dac_cs_n             (dac_cs_n[n]),
            .dac_sclk             (dac_sclk[n]),
            .dac_sdi              (dac_sdi[n]),
            .drive_enable         (drive_enable[n])
        );
    end

    wire unused = &{1'b0, bus_address[1:0], cycles};
endmodule

`default_nettype wire
