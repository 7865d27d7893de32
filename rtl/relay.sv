// SPDX-License-Identifier: Apache-2.0
// relay -- a box between a read head and its controller: A/B/Z in, corrected A/B/Z out, as if it
// were the encoder.
//
// latency  edge in to edge out 10 clk with the filter in bypass, `filter_required` - 1 clk more
//          with it; the same whatever K is
// rate     one edge per clk; 1 / minimum_edge_separation if that is longer
// start    the pins follow until the first edge; uncorrected until a set is in force and the index
//          has come: see `correcting`
// flags    0 illegal edge, 1 counts between two indexes wrong, 2 index missing, 3 glitch rejected,
//          4 output more than 4 counts behind, 5 a set of the host was refused             levels
//          0 index was seen, 1 a set is in force, 2 correcting, 3 reading flash
// source   S1: the angle is corrected between the read head and the CNC, neither of which changes
// model    the models of its blocks; proved in motion by tb/system/test_relay.py
`default_nettype none

module relay #(
    parameter int K        = 16,          // orders
    parameter int SEGMENTS = 0,           // of a table instead of the orders
    parameter int CLK_HZ   = 48_000_000,  // clk frequency
    parameter int BAUD     = 115_200,     // of the UART
    parameter int FIRST    = 1048576,     // address of the set in flash
    parameter int SECOND   = 1052672      // of its second copy
) (
    input  wire  clk,
    input  wire  rst,
    input  wire  encoder_a,            // pins of the read head
    input  wire  encoder_b,
    input  wire  encoder_z,
    output logic relay_a,              // pins to the controller
    output logic relay_b,
    output logic relay_z,
    output logic correcting,           // pin: what goes out is corrected
    output logic fault,                // pin: a flag stands
    input  wire  rs485_rx,             // pins to the host
    output logic rs485_tx,
    output logic rs485_driver_enable,
    output logic flash_chip_n,         // pins to the flash
    output logic flash_sclk,
    output logic flash_sdo,
    input  wire  flash_sdi
);
    localparam int W = 32;
    localparam int TERMS = SEGMENTS == 0 ? K : (SEGMENTS + 1) / 2;
    localparam int LENGTH = 4 * (7 + 2 * TERMS);
    localparam int BIT_TIME = CLK_HZ / BAUD * 16 + (CLK_HZ % BAUD) * 16 / BAUD;

    wire a, b, z, rx, sdi, a_before, b_before;
    wire                 illegal, index_found, revolution_wrong, moved, known, referenced, missing, behind, refreshed;
    wire signed [1:0] step;
    wire [2:0] filtered, rejected;
    wire [W-1:0] position, relayed;
    wire        [  31:0] angle;
    wire signed [  31:0] correction;
    wire signed [W+15:0] corrected;
    wire write, swap, set_good, set_bad, loaded, index_low;
    wire        [ 4:0] term;
    wire signed [31:0] amplitude;
    wire [31:0] phase, identity, counts_per_turn, radians_per_count;
    wire [47:0] angle_per_count;
    wire [15:0] minimum_edge_separation, hysteresis;
    wire [7:0] filter_required, flags;
    wire [1:0] index_gate_mask, index_gate, source;
    wire                 stored_start, stored_valid, sent_start, sent_valid, pass_select, pass_ready, pass_valid, pass_done, reading;
    wire [7:0] stored, sent;
    wire                 unused_direction, unused_time, unused_armed, unused_seen, unused_illegal_fault, unused_revolution_fault;
    wire signed [W-1:0] unused_count, unused_index_count;
    wire                 unused = &{1'b0, unused_direction, unused_time, unused_armed, unused_seen, unused_illegal_fault, unused_revolution_fault,
                                    unused_count, unused_index_count, filtered[2], refreshed, relayed};

    assign fault      = |flags;
    assign correcting = known && loaded;

    synchroniser #(
        .W    (5),
        .RESET(2)
    ) u_pins (
        .clk,
        .rst,
        .d({encoder_a, encoder_b, encoder_z, rs485_rx, flash_sdi}),
        .q({a, b, z, rx, sdi})
    );

    incremental_encoder #(
        .W          (W),
        .TIME_W     (1),
        .FILTER_W   (8),
        .TOLERATED_W(1),
        .SKIP_W     (1)
    ) u_encoder (
        .clk,
        .rst,
        .filter_skip          (1'b0),
        .filter_required,
        .filter_tolerated     (1'b0),
        .mode                 (2'd0),
        .index_low,
        .index_gate_mask,
        .index_gate,
        .index_up             (1'b1),
        .index_down           (1'b1),
        .index_each           (1'b1),
        .index_clears         (1'b0),
        .counts_per_revolution(counts_per_turn),
        .illegal_enable       (1'b0),
        .arm_index            (1'b0),
        .clear_flags          (1'b0),
        .now                  (1'b0),
        .a,
        .b,
        .z,
        .own                  (1'b0),
        .own_a                (1'b0),
        .own_b                (1'b0),
        .count                (unused_count),
        .step,
        .direction            (unused_direction),
        .edge_time            (unused_time),
        .index_found,
        .index_armed          (unused_armed),
        .index_count          (unused_index_count),
        .filtered,
        .rejected,
        .illegal,
        .illegal_seen         (unused_seen),
        .illegal_fault        (unused_illegal_fault),
        .revolution_wrong,
        .revolution_fault     (unused_revolution_fault)
    );
    // as old as step at least
    synchroniser #(
        .W(2)
    ) u_before (
        .clk,
        .rst,
        .d(filtered[1:0]),
        .q({b_before, a_before})
    );
    turn_angle #(
        .W(W)
    ) u_angle (
        .clk,
        .rst,
        .counts_per_turn,
        .angle_per_count,
        .a    (a_before),
        .b    (b_before),
        .step,
        .index(index_found),
        .moved,
        .position,
        .angle,
        .known,
        .referenced,
        .missing
    );
    if (SEGMENTS == 0) begin : g_harmonics
        harmonic_map #(
            .K(K),
            .W(W)
        ) u_map (
            .clk,
            .rst,
            .enable(correcting),
            .radians_per_count,
            .write,
            .term,
            .amplitude,
            .phase,
            .swap,
            .angle,
            .step,
            .position,
            .correction,
            .corrected,
            .refreshed
        );
    end else begin : g_segments
        wire unused_words = &{1'b0, radians_per_count, amplitude[31:24], phase[31:24]};
        segment_map #(
            .SEGMENTS(SEGMENTS),
            .W       (W)
        ) u_map (
            .clk,
            .rst,
            .enable(correcting),
            .write,
            .term,
            .even  (amplitude[23:0]),
            .odd   (phase[23:0]),
            .swap,
            .angle,
            .position,
            .correction,
            .corrected,
            .refreshed
        );
    end
    quadrature_encoder #(
        .W(W)
    ) u_output (
        .clk,
        .rst,
        .minimum_edge_separation,
        .hysteresis,
        .counts_per_turn,
        .load         (!moved),
        .target       (corrected),
        .home         (referenced),
        .home_position(position),
        .a            (relay_a),
        .b            (relay_b),
        .z            (relay_z),
        .position     (relayed),
        .behind
    );

    relay_store #(
        .LENGTH(LENGTH),
        .FIRST (FIRST),
        .SECOND(SECOND)
    ) u_store (
        .clk,
        .rst,
        .good     (set_good),
        .bad      (set_bad),
        .pass_select,
        .pass_ready,
        .pass_valid,
        .pass_data(sent),
        .start    (stored_start),
        .valid    (stored_valid),
        .data     (stored),
        .pass_done,
        .busy     (reading),
        .source,
        .chip_n   (flash_chip_n),
        .sclk     (flash_sclk),
        .sdo      (flash_sdo),
        .sdi
    );
    relay_set #(
        .K       (TERMS),
        .SEGMENTS(SEGMENTS)
    ) u_set (
        .clk,
        .rst,
        .start(reading ? stored_start : sent_start),
        .valid(reading ? stored_valid : sent_valid),
        .data (reading ? stored : sent),
        .write,
        .term,
        .amplitude,
        .phase,
        .swap,
        .good (set_good),
        .bad  (set_bad),
        .loaded,
        .identity,
        .counts_per_turn,
        .angle_per_count,
        .minimum_edge_separation,
        .radians_per_count,
        .hysteresis,
        .filter_required,
        .index_low,
        .index_gate_mask,
        .index_gate
    );
    relay_bridge u_bridge (
        .clk,
        .rst,
        .bit_time(20'(BIT_TIME)),
        .rx,
        .tx(rs485_tx),
        .driver_enable(rs485_driver_enable),
        .events({2'd0, set_bad && !reading, behind, |rejected, missing, revolution_wrong, illegal}),
        .levels({4'd0, reading, correcting, loaded, known}),
        .source,
        .orders(SEGMENTS == 0 ? 6'(K) : 6'd0),
        .identity,
        .position,
        .correction,
        .flags,
        .set_start(sent_start),
        .set_valid(sent_valid),
        .set_data(sent),
        .pass_select,
        .pass_ready,
        .pass_valid,
        .pass_done,
        .pass_data(stored)
    );
endmodule

`default_nettype wire
