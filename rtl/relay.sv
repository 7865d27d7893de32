// SPDX-License-Identifier: Apache-2.0
// relay -- correct A/B/Z between a read head and its controller: the outputs are those of an
// encoder without the error.
//
// latency  10 cycles from an edge at the input to its edge at the output, with the filter in
//          bypass; filter_required - 1 cycles more with the filter, whatever K is
// rate     one edge per cycle, and at most one per minimum_edge_separation
// behaviour  The output pins follow the input pins until the first edge. The edges are not
//          corrected until a set is loaded and the index has come: see `correcting`.
// source   S1: the angle is corrected between the read head and the CNC, neither of which changes
// model    the models of its blocks; tested together by tb/system/test_relay.py
//
// Bits of the flags: 0 illegal edge, 1 the counts between two indexes are wrong, 2 an index is
// missing, 3 a short pulse was filtered out, 4 the output is more than 4 counts behind, 5 a set of
// the host was refused.
// Bits of the levels: 0 the index has come, 1 a set is loaded, 2 correcting, 3 reading the flash.
`default_nettype none

module relay #(
    parameter int K        = 16,          // orders of the harmonic map
    parameter int SEGMENTS = 0,           // segments of a table instead of the orders; 0: orders
    parameter int CLK_HZ   = 48_000_000,  // Hz, clk frequency
    parameter int BAUD     = 115_200,     // bits/s of the UART
    parameter int FIRST    = 1048576,     // byte address of the set in the flash
    parameter int SECOND   = 1052672      // byte address of its second copy
) (
    input  wire  clk,
    input  wire  rst,
    // read head
    input  wire  encoder_a,            // pin
    input  wire  encoder_b,            // pin
    input  wire  encoder_z,            // pin, index
    // controller
    output logic relay_a,              // pin
    output logic relay_b,              // pin
    output logic relay_z,              // pin, index
    output logic correcting,           // pin, 1: the output is corrected
    output logic fault,                // pin, 1: a flag is set
    // host
    input  wire  rs485_rx,             // pin, idles high
    output logic rs485_tx,             // pin, idles high
    output logic rs485_driver_enable,  // pin, 1: drive the bus
    // flash
    output logic flash_chip_n,         // pin, low during an access
    output logic flash_sclk,           // pin
    output logic flash_sdo,            // pin, data to the flash
    input  wire  flash_sdi             // pin, data from the flash
);
    localparam int W = 32;
    localparam int TERMS = SEGMENTS == 0 ? K : (SEGMENTS + 1) / 2;
    localparam int LENGTH = 4 * (7 + 2 * TERMS);
    localparam int BIT_TIME = CLK_HZ / BAUD * 16 + (CLK_HZ % BAUD) * 16 / BAUD;
    localparam [5:0] ORDERS = SEGMENTS == 0 ? 6'(K) : 6'd0;

    // pins
    wire a, b, z, rx, sdi;
    // edges of the read head
    wire [2:0] filtered, rejected;
    wire signed [1:0] step;
    wire illegal, index_found, revolution_wrong;
    // angle and correction
    wire a_before, b_before, moved, known, referenced, missing, refreshed;
    wire [W-1:0] position, relayed;
    wire        [  31:0] angle;
    wire signed [  31:0] correction;
    wire signed [W+15:0] corrected;
    // set
    wire start, valid, write, swap, set_good, set_bad, loaded;
    wire        [ 7:0] data;
    wire        [ 4:0] term;
    wire signed [31:0] amplitude;
    wire        [31:0] phase;
    wire [31:0] identity, counts_per_turn, radians_per_count;
    wire [47:0] angle_per_count;
    wire [15:0] minimum_edge_separation, hysteresis;
    wire [7:0] filter_required;
    wire [1:0] index_gate_mask, index_gate;
    wire index_low;
    // set from the flash or the host
    wire stored_start, stored_valid, sent_start, sent_valid, reading;
    wire pass_select, pass_ready, pass_valid, pass_done;
    wire [7:0] stored_data, sent_data;
    wire [1:0] source;
    // status
    wire behind, follow;
    wire [7:0] flags, events, levels;

    synchroniser #(
        .W    (5),
        .RESET(2)
    ) u_pins (
        .clk,
        .rst,
        .d({encoder_a, encoder_b, encoder_z, rs485_rx, flash_sdi}),
        .q({a, b, z, rx, sdi})
    );

    // from the read head to the controller
    wire unused_direction, unused_time, unused_armed, unused_seen;
    wire unused_illegal_fault, unused_revolution_fault;
    wire signed [W-1:0] unused_count, unused_index_count;

    incremental_encoder #(
        .W          (W),
        .TIME_W     (1),
        .FILTER_W   (8),
        .TOLERATED_W(1),
        .SKIP_W     (1)
    ) u_encoder (
        .clk,
        .rst,
        // filter
        .filter_skip          (1'b0),
        .filter_required,
        .filter_tolerated     (1'b0),
        // index
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
        // pins
        .now                  (1'b0),
        .a,
        .b,
        .z,
        .own                  (1'b0),
        .own_a                (1'b0),
        .own_b                (1'b0),
        // counts
        .count                (unused_count),
        .step,
        .direction            (unused_direction),
        .edge_time            (unused_time),
        .index_found,
        .index_armed          (unused_armed),
        .index_count          (unused_index_count),
        // events
        .filtered,
        .rejected,
        .illegal,
        .illegal_seen         (unused_seen),
        .illegal_fault        (unused_illegal_fault),
        .revolution_wrong,
        .revolution_fault     (unused_revolution_fault)
    );
    // the levels must be at least as old as step
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
        // settings
        .counts_per_turn,
        .angle_per_count,
        // edges
        .a    (a_before),
        .b    (b_before),
        .step,
        .index(index_found),
        // angle
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
            // set
            .radians_per_count,
            .write,
            .term,
            .amplitude,
            .phase,
            .swap,
            // angle
            .angle,
            .step,
            .position,
            // corrected position
            .correction,
            .corrected,
            .refreshed
        );
    end else begin : g_segments
        segment_map #(
            .SEGMENTS(SEGMENTS),
            .W       (W)
        ) u_map (
            .clk,
            .rst,
            .enable(correcting),
            // set
            .write,
            .term,
            .even  (amplitude[23:0]),
            .odd   (phase[23:0]),
            .swap,
            // angle
            .angle,
            .position,
            // corrected position
            .correction,
            .corrected,
            .refreshed
        );
        wire unused_words = &{1'b0, radians_per_count, amplitude[31:24], phase[31:24]};
    end
    quadrature_encoder #(
        .W(W)
    ) u_output (
        .clk,
        .rst,
        // settings
        .minimum_edge_separation,
        .hysteresis,
        .counts_per_turn,
        // target
        .load         (follow),
        .target       (corrected),
        .home         (referenced),
        .home_position(position),
        // pins
        .a            (relay_a),
        .b            (relay_b),
        .z            (relay_z),
        // state
        .position     (relayed),
        .behind
    );

    // set of corrections
    relay_store #(
        .LENGTH(LENGTH),
        .FIRST (FIRST),
        .SECOND(SECOND)
    ) u_store (
        .clk,
        .rst,
        // result of a set
        .good     (set_good),
        .bad      (set_bad),
        // host's access to the flash
        .pass_select,
        .pass_ready,
        .pass_valid,
        .pass_data(sent_data),
        .pass_done,
        // set of the flash
        .start    (stored_start),
        .valid    (stored_valid),
        .data     (stored_data),
        .busy     (reading),
        .source,
        // pins
        .chip_n   (flash_chip_n),
        .sclk     (flash_sclk),
        .sdo      (flash_sdo),
        .sdi
    );
    relay_set_source u_set_source (
        .reading,
        .stored_start,
        .stored_valid,
        .stored_data,
        .sent_start,
        .sent_valid,
        .sent_data,
        .start,
        .valid,
        .data
    );
    relay_set #(
        .K       (TERMS),
        .SEGMENTS(SEGMENTS)
    ) u_set (
        .clk,
        .rst,
        // bytes
        .start,
        .valid,
        .data,
        // terms of the map
        .write,
        .term,
        .amplitude,
        .phase,
        .swap,
        // result
        .good(set_good),
        .bad (set_bad),
        .loaded,
        .identity,
        // settings
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

    // host
    relay_status u_status (
        // levels
        .known,
        .loaded,
        .reading,
        .moved,
        // events
        .illegal,
        .revolution_wrong,
        .missing,
        .rejected,
        .behind,
        .set_bad,
        .flags,
        // what follows
        .correcting,
        .fault,
        .follow,
        .events,
        .levels
    );
    relay_bridge u_bridge (
        .clk,
        .rst,
        // bus
        .bit_time     (20'(BIT_TIME)),
        .rx,
        .tx           (rs485_tx),
        .driver_enable(rs485_driver_enable),
        // status
        .events,
        .levels,
        .source,
        .orders       (ORDERS),
        .identity,
        .position,
        .correction,
        .flags,
        // set of the host
        .set_start    (sent_start),
        .set_valid    (sent_valid),
        .set_data     (sent_data),
        // host's access to the flash
        .pass_select,
        .pass_ready,
        .pass_valid,
        .pass_done,
        .pass_data    (stored_data)
    );

    wire unused = &{
        1'b0, unused_direction, unused_time, unused_armed, unused_seen, unused_illegal_fault,
        unused_revolution_fault, unused_count, unused_index_count, filtered[2], refreshed, relayed
    };
endmodule

`default_nettype wire
