// SPDX-License-Identifier: Apache-2.0
// node -- a complete motion controller on a multi-drop line: soft core, line, axes, links to other
// things.
//
// latency  see axis and the rooms link and cpu
// rate     see there
// source   S0: one slave computer per axis, many on one line; here one node may have several axes
// model    the models of its blocks; proved in motion by tb/system
`default_nettype none

module node #(
    parameter int CLK_HZ       = 4_000_000,  // clk frequency
    parameter int AXES         = 1,          // 1..8
    parameter int W            = 8,          // bits of a sample
    parameter int DRIVES       = 15,         // what each axis can drive, see actuator
    parameter int FILTERS      = 2,          // of each servo, see biquad_cascade
    parameter int SEGMENTS     = 0,          // most segments of each scale's table, see grating
    parameter int SINE         = 1,          // of each grating: 0 for A/B/Z only, see grating
    parameter int PERIPHERALS  = 0,          // what else it speaks to, see links
    parameter int MEMORY_BYTES = 98304,      // of the soft core, program and data
    parameter     FIRMWARE     = ""          // file of its contents at power-up
) (
    input wire clk,
    input wire rst,
    input wire [3:0] address,  // on the line
    input wire estop_open,  // 1: pressed or wire cut
    input wire rs485_rx,  // idles high
    output logic rs485_tx,
    output logic rs485_driver_enable,
    input wire [AXES-1:0] encoder_a,
    input wire [AXES-1:0] encoder_b,
    input wire [AXES-1:0] encoder_z,  // index
    input wire [2*AXES-1:0] probe,  // two of each axis
    input wire [AXES-1:0] adc_sin,
    input wire [AXES-1:0] adc_cos,
    input wire [AXES-1:0] limit_low_open,  // 1: pressed or wire cut
    input wire [AXES-1:0] limit_high_open,
    input wire [AXES-1:0] drive_fault_n,
    output logic [AXES-1:0] adc_cs_n,
    output logic [AXES-1:0] adc_sclk,
    output logic [AXES-1:0] bridge_a,
    output logic [AXES-1:0] bridge_b,
    output logic [AXES-1:0] step,
    output logic [AXES-1:0] direction,
    output logic [AXES-1:0] dac_cs_n,
    output logic [AXES-1:0] dac_sclk,
    output logic [AXES-1:0] dac_sdi,
    output logic [AXES-1:0] drive_enable,
    output logic [AXES-1:0] compare_pulse,
    input wire i2c_scl,  // links from here on: levels of the lines; without links all are idle
    input wire i2c_sda,
    output logic i2c_scl_low,  // pull the lines low
    output logic i2c_sda_low,
    input wire keyboard_clock,
    input wire keyboard_data,
    output logic keyboard_clock_low,
    output logic keyboard_data_low,
    input wire edm_clock,  // PS/2, where the node is the keyboard
    input wire edm_data,
    output logic edm_clock_low,
    output logic edm_data_low,
    input wire peer_rx,  // idles high
    output logic peer_tx,
    input wire sensor_rx,
    output logic display_cs_n,
    output logic display_sclk,
    output logic display_data,
    input wire [1:0] edm_status
);
    // cpu
    wire select, write, trap, node_select, bus_select, peripherals_select;
    wire [15:0] bus_address;
    wire [31:0] wdata, rdata, node_rdata, bus_rdata, peripherals_rdata;
    wire [AXES-1:0] axis_select, feedback_select, actuator_select;
    wire [32*AXES-1:0] axis_rdata, feedback_rdata, actuator_rdata;
    wire [5:0] word = bus_address[7:2];

    soft_core #(
        .MEMORY_BYTES(MEMORY_BYTES),
        .FIRMWARE    (FIRMWARE)
    ) u_core (
        .clk,
        .rst,
        .select,
        .write,
        .address(bus_address),
        .wdata,
        .rdata,
        .trap
    );
    register_bus #(
        .AXES(AXES)
    ) u_bus (
        .clk,
        .select,
        .address(bus_address),
        .node_rdata,
        .bus_rdata,
        .peripherals_rdata,
        .axis_rdata,
        .feedback_rdata,
        .actuator_rdata,
        .node_select,
        .bus_select,
        .peripherals_select,
        .axis_select,
        .feedback_select,
        .actuator_select,
        .rdata
    );

    // time; the watchdog of the soft core gives it as many clk however slow they are. Nodes that
    // start at a sync tick together from there on
    localparam int CORE_SILENCE_MS = 20 + 1_200_000_000 / CLK_HZ;

    wire [63:0] now;
    wire [23:0] tick_period;
    wire [15:0] sample_period;
    wire tick, sample_tick, alive, silent, start_axes_written, sync;
    wire [7:0] start_axes, sync_axes;

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
        .restart(sync && |sync_axes),
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
    node_registers u_node_registers (
        .clk,
        .rst,
        .select        (node_select),
        .write,
        .word,
        .wdata,
        .rdata         (node_rdata),
        .clk_hz        (32'(CLK_HZ)),
        .build_axes    (4'(AXES)),
        .build_address (address),
        .build_memory  (8'(MEMORY_BYTES / 1024)),
        .time_stamp    (now),
        .tick_period,
        .sample_period,
        .heartbeat_kick(alive),
        .start_axes,
        .start_axes_written
    );
    heartbeat_watchdog #(
        .CLK_HZ(CLK_HZ)
    ) u_core_watchdog (
        .clk,
        .rst,
        .time_ms(16'(CORE_SILENCE_MS)),
        .kick   (alive),
        .armed  (|drive_enable),
        .expired(silent)
    );

    // line
    wire estop, watchdog_expired;

    synchroniser #(
        .RESET(1)
    ) u_estop (
        .clk,
        .rst,
        .d(estop_open),
        .q(estop)
    );
    rs485_port #(
        .CLK_HZ(CLK_HZ)
    ) u_rs485 (
        .clk,
        .rst,
        .address,
        .select(bus_select),
        .write,
        .word,
        .wdata,
        .rdata (bus_rdata),
        .armed (|drive_enable),
        .watchdog_expired,
        .sync,
        .sync_axes,
        .rs485_rx,
        .rs485_tx,
        .rs485_driver_enable
    );

    wire unused = &{1'b0, bus_address[1:0], start_axes, sync_axes};

    // links
    peripherals #(
        .CLK_HZ     (CLK_HZ),
        .PERIPHERALS(PERIPHERALS)
    ) u_peripherals (
        .clk,
        .rst,
        .select(peripherals_select),
        .write,
        .word,
        .wdata,
        .rdata (peripherals_rdata),
        .i2c_scl,
        .i2c_sda,
        .i2c_scl_low,
        .i2c_sda_low,
        .keyboard_clock,
        .keyboard_data,
        .keyboard_clock_low,
        .keyboard_data_low,
        .edm_clock,
        .edm_data,
        .edm_clock_low,
        .edm_data_low,
        .peer_rx,
        .peer_tx,
        .sensor_rx,
        .display_cs_n,
        .display_sclk,
        .display_data,
        .edm_status
    );

    // axes
    for (genvar n = 0; n < AXES; n++) begin : g_axis
        axis #(
            .CLK_HZ  (CLK_HZ),
            .W       (W),
            .DRIVES  (DRIVES),
            .FILTERS (FILTERS),
            .SINE    (SINE),
            .SEGMENTS(SEGMENTS)
        ) u_axis (
            .clk,
            .rst,
            .tick,
            .tick_period,
            .sample_tick,
            .start          ((start_axes_written && start_axes[n]) || (sync && sync_axes[n])),
            .sync,
            .estop,
            .watchdog_expired,
            .cpu_stopped    (trap || silent),
            .select         (axis_select[n]),
            .write,
            .word,
            .wdata,
            .rdata          (axis_rdata[32*n+:32]),
            .feedback_select(feedback_select[n]),
            .feedback_rdata (feedback_rdata[32*n+:32]),
            .actuator_select(actuator_select[n]),
            .actuator_rdata (actuator_rdata[32*n+:32]),
            .now            (now[31:0]),
            .encoder_a      (encoder_a[n]),
            .encoder_b      (encoder_b[n]),
            .encoder_z      (encoder_z[n]),
            .probe          (probe[2*n+:2]),
            .adc_sin        (adc_sin[n]),
            .adc_cos        (adc_cos[n]),
            .limit_low_open (limit_low_open[n]),
            .limit_high_open(limit_high_open[n]),
            .drive_fault_n  (drive_fault_n[n]),
            .adc_cs_n       (adc_cs_n[n]),
            .adc_sclk       (adc_sclk[n]),
            .bridge_a       (bridge_a[n]),
            .bridge_b       (bridge_b[n]),
            .step           (step[n]),
            .direction      (direction[n]),
            .dac_cs_n       (dac_cs_n[n]),
            .dac_sclk       (dac_sclk[n]),
            .dac_sdi        (dac_sdi[n]),
            .drive_enable   (drive_enable[n]),
            .compare_pulse  (compare_pulse[n])
        );
    end
endmodule

`default_nettype wire
