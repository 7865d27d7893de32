// SPDX-License-Identifier: Apache-2.0
// relay_set -- receive the settings and coefficients of a relay as bytes, and put them into use
// only as a whole.
//
// latency  2 cycles from the last byte to good or bad, swap and settings
// rate     one byte per cycle
// behaviour  The set is 32-bit words, low byte first: marker 4D4F49 and K in its low byte;
//          counts_per_turn; angle_per_count, low word; its high half and minimum_edge_separation
//          above; radians_per_count; hysteresis, filter_required from bit 16, {index_low,
//          gate_mask, gate} from bit 24; amplitude and phase of each order from 1 up; CRC-32 of all
//          before. With SEGMENTS the map is a table: the low byte of the marker is 128 + SEGMENTS,
//          and K = (SEGMENTS + 1) / 2 terms hold two of its points each.
// limits   An incomplete set is never in use: settings change in one cycle, together with swap. A
//          complete set is refused too if its counts_per_turn are not 1609 to 2^25, or if its
//          amplitudes, without sign, add up to 2^29 or more, or a point is 2^23 or more.
// model    tb/relay/relay_set.py, equal in every bit of every cycle
// proved   swap comes with good only, and settings change with it only
// proof    K = 1
`default_nettype none

module relay_set #(
    parameter int K        = 16,  // orders, or terms of the table
    parameter int SEGMENTS = 0    // segments of a table instead of the orders; 0: orders
) (
    input wire clk,
    input wire rst,  // no set is in use: settings are zero
    // bytes
    input wire start,  // strobe: a set begins, after the byte of this cycle
    input wire valid,  // strobe: data is new
    input wire [7:0] data,  // byte of the set
    // terms of the map
    output logic write,  // strobe: store a term in the set that is not in use
    output logic [4:0] term,  // number of the term
    output logic signed [31:0] amplitude,  // 2^-16 count, or the even point of a table
    output logic [31:0] phase,  // 2^-32 turn, or the odd point of a table
    output logic swap,  // strobe: use the set that was written
    // result
    output logic good,  // strobe: the set was complete and is in use now
    output logic bad,  // strobe: the set was refused
    output logic loaded,  // level: a set is in use
    output logic [31:0] identity,  // CRC-32 of the set in use
    // settings
    output logic [31:0] counts_per_turn,  // counts
    output logic [47:0] angle_per_count,  // 2^-48 turn
    output logic [15:0] minimum_edge_separation,  // cycles
    output logic [31:0] radians_per_count,  // 2^-40
    output logic [15:0] hysteresis,  // 2^-16 count
    output logic [7:0] filter_required,  // samples
    output logic index_low,  // level: the index is active low
    output logic [1:0] index_gate_mask,  // {b, a}, 1: it must equal index_gate
    output logic [1:0] index_gate  // {b, a}, levels at the index
);
    if (K < 1 || K > 32) begin : g_check
        K_MUST_BE_FROM_1_TO_32 u_error ();
    end
    if (SEGMENTS != 0 && K != (SEGMENTS + 1) / 2) begin : g_check_segments
        K_MUST_BE_HALF_THE_SEGMENTS u_error ();
    end

    localparam logic [31:0] WHOLE = 32'h2144DF1C;  // CRC-32 of anything followed by its own CRC-32
    localparam logic [31:0] MARKER = 32'h4D4F4900 + 32'(SEGMENTS == 0 ? K : 128 + SEGMENTS);
    localparam logic [31:0] FEWEST = 32'd1609, MOST = 32'd1 << 25;
    localparam int SETTINGS = 5;  // words after the marker
    localparam int LAST = 1 + SETTINGS + 2 * K;

    logic [ 6:0] at;  // word
    logic [ 1:0] part;  // byte of it
    logic [31:0] word;
    // a set has begun; its values are allowed; it has just ended
    logic open, fits, ended;
    logic [28:0] reach;  // sum of the amplitudes
    logic [32*SETTINGS-1:0] shadow, settings;
    wire [31:0] crc;

    wire [31:0] full = {data, word[31:8]};
    wire        take = valid && open;
    wire        filled = take && part == 2'd3;
    wire        terms = filled && at > 7'(SETTINGS) && at != 7'(LAST);
    wire        term_0 = terms && !at[0];  // first word of a term
    wire        whole = ended && crc == WHOLE && fits;
    wire [31:0] size = full ^ {32{full[31]}};
    wire [32:0] sum = 33'(reach) + {1'b0, size};
    wire        absurd = SEGMENTS == 0 ? term_0 && |sum[32:29] : terms && |size[31:23];
    wire        turns = full >= FEWEST && full <= MOST;

    crc32_stream u_crc (
        .clk,
        .rst,
        .start,
        .valid(take && !start),
        .data,
        .crc
    );

    assign {index_low, index_gate_mask, index_gate, filter_required, hysteresis, radians_per_count,
        minimum_edge_separation, angle_per_count, counts_per_turn} = settings[156:0];

    wire unused = &{1'b0, settings[159:157]};

    always_ff @(posedge clk) begin
        write <= terms && at[0];
        term  <= 5'((at - 7'(SETTINGS + 2)) >> 1);
        phase <= full;
        swap  <= whole;
        good  <= whole;
        bad   <= ended && !whole;
        ended <= filled && at == 7'(LAST) && !start;
        if (take) begin
            part <= part + 1'b1;
            word <= full;
        end
        if (filled) begin
            at <= at + 1'b1;
            if (at == 7'd0) fits <= full == MARKER;
            else if (at == 7'd1 && !turns) fits <= 1'b0;
            else if (absurd) fits <= 1'b0;
            if (at != 7'd0 && at <= 7'(SETTINGS)) shadow <= {full, shadow[32*SETTINGS-1:32]};
            if (!at[0]) amplitude <= full;
            if (term_0) reach <= sum[28:0];
            if (at == 7'(LAST)) open <= 1'b0;
        end
        if (start) begin
            at    <= '0;
            part  <= '0;
            open  <= 1'b1;
            reach <= '0;
        end
        if (whole) begin
            settings <= shadow;
            identity <= word;
            loaded   <= 1'b1;
        end
        if (rst) begin
            open     <= 1'b0;
            ended    <= 1'b0;
            write    <= 1'b0;
            swap     <= 1'b0;
            good     <= 1'b0;
            bad      <= 1'b0;
            loaded   <= 1'b0;
            settings <= '0;
            identity <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst)) begin
            assert (swap == good && !(good && bad));
            if (!good)
                assert (settings == $past(
                    settings
                ) && identity == $past(
                    identity
                ) && loaded == $past(
                    loaded
                ));
            if (good) assert ($past(crc) == WHOLE && $past(fits));
            cover (open && fits && at == 3);
        end
    end
`endif
endmodule

`default_nettype wire
