// SPDX-License-Identifier: Apache-2.0
// encoder_counter -- an incremental encoder input with three registers, for designs that need a
// counter but no axis.
//
//   word 0  read   {time of the last edge, count}, both of the same cycle
//   word 1  read   {latched count, 8'b0, illegal, probed, found, armed, probe, z, b, a}
//   flags (illegal, probed, found), the state `armed`, and levels after the filter
//   write  bit 4 arms the index; bits 5, 6, 7 clear found, probed, illegal: an event in
//   that cycle sets its flag again
//   word 2  both   settings, 0 after reset: [3:0] filter_required [5:4] mode [6] index_low
//   [7] the index requires [9:8] = {b, a} [10] index_up [11] index_down
//   [12] index_each [13] index_clears [14] probe_latches [15] probe_low
//   [19:16] filter_tolerated [31:20] filter_skip, as far as the widths allow;
//   their meaning is given in incremental_encoder
//
// latency  1 cycle from select to rdata and from a write to the new setting; N samples of the
//          filter and 2 cycles from a, b, z to count and latched count; 3 cycles from probe to
//          latched count. The latched count is the count of the pins at the edge of probe, if the
//          filter is bypassed.
// rate     one access per cycle
// source   the functions of HostMot2's encoder counter: count, time of its last edge, count
//          latched by index or probe, flags
// model    tb/decode/encoder_counter.py, equal in every bit of every cycle
// proved   a flag is cleared only by a write; the latched count changes only together with a flag,
//          the time only together with a step of count
// proof    FILTER_W = 1
`default_nettype none

module encoder_counter #(
    parameter int FILTER_W    = 4,  // bits of filter_required, 1 to 4
    parameter int TOLERATED_W = 0,  // bits of filter_tolerated, 0 to 4
    parameter int SKIP_W      = 0   // bits of filter_skip, 0 to 12
) (
    input  wire         clk,
    input  wire         rst,     // level: count and settings become 0
    input  wire         select,  // level: an access to this block in this cycle
    input  wire         write,   // level: with select, wdata is written to the word
    input  wire  [ 1:0] word,    // word address, 0 to 2; word 3 reads 0
    input  wire  [31:0] wdata,   // bits to be written
    input  wire  [15:0] now,     // time stamp, in any unit
    input  wire         a,       // level: channel A, synchronous to clk
    input  wire         b,       // level: channel B, synchronous to clk
    input  wire         z,       // level: index, synchronous to clk
    input  wire         probe,   // level, synchronous and free of bounce; its edge latches
    output logic [31:0] rdata    // the word read, for one cycle; 0 in all other cycles
);
    if (FILTER_W < 1 || FILTER_W > 4) begin : g_check_filter
        FILTER_W_MUST_BE_FROM_1_TO_4 u_error ();
    end
    if (TOLERATED_W < 0 || TOLERATED_W > 4) begin : g_check_spare
        TOLERATED_W_MUST_BE_FROM_0_TO_4 u_error ();
    end
    if (SKIP_W < 0 || SKIP_W > 12) begin : g_check_skip
        SKIP_W_MUST_BE_FROM_0_TO_12 u_error ();
    end

    // the bits of the settings that exist
    localparam logic [3:0] REQUIRED = 4'((1 << FILTER_W) - 1);
    localparam logic [3:0] TOLERATED = 4'((1 << TOLERATED_W) - 1);
    localparam logic [11:0] SKIP = 12'((1 << SKIP_W) - 1);

    logic [31:0] settings;
    logic [15:0] edge_time;
    logic illegal_seen, found_seen, probed_seen;
    logic probe_q, probe_2q, probing;

    wire [2:0] filtered, rejected;
    wire signed [15:0] count, index_count;
    wire signed [1:0] step;
    wire a_later, b_later, ready, stepping, direction, illegal;
    wire clear, armed, found, revolution_wrong;

    wire [3:0] flags = {illegal_seen, probed_seen, found_seen, armed};
    wire       status_write = select && write && word == 2'd1;

    event_filter #(
        .LEVELS     (3),
        .W          (4),
        .TOLERATED_W(4),
        .SKIP_W     (12),
        .SETTLE     (3)
    ) u_filter (
        .clk,
        .rst,
        .skip     (settings[31:20]),
        .required (settings[3:0]),
        .tolerated(settings[19:16]),
        .level    ({z, b, a}),
        .filtered,
        .rejected
    );
    quadrature_decoder #(
        .W     (16),
        .SETTLE(7)
    ) u_decoder (
        .clk,
        .rst,
        .mode(settings[5:4]),
        .clear,
        .a   (a_later),
        .b   (b_later),
        .ready,
        .stepping,
        .count,
        .step,
        .direction,
        .illegal
    );
    index_latch #(
        .W    (16),
        .CHECK(0)
    ) u_index (
        .clk,
        .rst,
        .active_low           (settings[6]),
        .gate_mask            ({2{settings[7]}}),
        .gate                 (settings[9:8]),
        .take_up              (settings[10]),
        .take_down            (settings[11]),
        .each                 (settings[12]),
        .clears               (settings[13]),
        .counts_per_revolution(16'd0),
        .arm                  (status_write && wdata[4]),
        .probe                (probing),
        .ready,
        .direction,
        .stepping,
        .count,
        .a                    (filtered[0]),
        .b                    (filtered[1]),
        .z                    (filtered[2]),
        .a_later,
        .b_later,
        .clear,
        .armed,
        .found,
        .index_count,
        .revolution_wrong
    );

    wire unused = &{1'b0, rejected, step, revolution_wrong};

    always_ff @(posedge clk) begin
        probe_q  <= probe;
        probe_2q <= probe_q;
        probing  <= settings[14] && probe_q != probe_2q && probe_q != settings[15];
        if (stepping) edge_time <= now;
        found_seen   <= found || (found_seen && !(status_write && wdata[5]));
        probed_seen  <= probing || (probed_seen && !(status_write && wdata[6]));
        illegal_seen <= illegal || (illegal_seen && !(status_write && wdata[7]));
        if (select && write && word == 2'd2)
            settings <= wdata & {SKIP, TOLERATED, 12'hFFF, REQUIRED};
        rdata <= '0;
        if (select)
            case (word)
                2'd0:    rdata <= {edge_time, count};
                2'd1:    rdata <= {index_count, 8'd0, flags, probe_q, filtered};
                2'd2:    rdata <= settings;
                default: rdata <= '0;
            endcase
        if (rst) begin
            settings     <= '0;
            found_seen   <= 1'b0;
            probed_seen  <= 1'b0;
            illegal_seen <= 1'b0;
            probing      <= 1'b0;
            rdata        <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) assert ((settings & ~{SKIP, TOLERATED, 12'hFFF, REQUIRED}) == 0);
        if (past && !$past(rst)) begin
            if ($past(found)) assert (found_seen);
            if ($past(illegal)) assert (illegal_seen);
            if (!found_seen && $past(found_seen)) assert ($past(status_write && wdata[5]));
            if (!probed_seen && $past(probed_seen)) assert ($past(status_write && wdata[6]));
            if (!illegal_seen && $past(illegal_seen)) assert ($past(status_write && wdata[7]));
            if (probing) assert ($past(settings[14]) && $past(probe_q) != $past(probe_2q));
            if (index_count != $past(index_count)) assert (found || probed_seen);
            if (ready && $past(ready) && edge_time != $past(edge_time)) assert (step != 0);
            if (!$past(select)) assert (rdata == 0);
            cover (found_seen && probed_seen && index_count == -2);
        end
    end
`endif
endmodule

`default_nettype wire
