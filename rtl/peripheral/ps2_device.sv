// SPDX-License-Identifier: Apache-2.0
// ps2_device -- be the keyboard of a PS/2 line: make the clock, send bytes, receive the host's
// commands and acknowledge them.
//
// latency  70 us of released lines before the first falling clock edge of a byte; 20 us if they
//          were released for 50 us before send_valid
// rate     80 us per bit (12.5 kHz), 11 bits per byte; send_ready comes with the eleventh falling
//          edge
// limits   No device can distinguish a host that pulls the clock low in the last microsecond before
//          its eleventh edge from one that does so after it.
// source   IBM PS/2 keyboard interface. A host that pulls the clock low before the eleventh edge
//          has not received the byte: it is sent again from its start. Data low with the clock high
//          requests a command
// model    tb/peripheral/ps2_device.py, equal in every bit of every cycle
// proof    depth 40, CLK_HZ = 100000, CHECKED = 0
// proved   the clock is pulled low for 40 us; data is stable from 20 us before and does not change
//          meanwhile; a received byte waits until it is taken; no line is pulled low outside a
//          frame
`default_nettype none

module ps2_device #(
    parameter int CLK_HZ  = 50_000_000,  // Hz, clk frequency
    parameter int CHECKED = 1            // 0: any CLK_HZ, for the proof
) (
    input  wire        clk,
    input  wire        rst,               // releases both lines, drops the frame
    input  wire        clock,             // level of the clock line, synchronous, filtered
    input  wire        data,              // level of the data line, synchronous, filtered
    input  wire        send_valid,        // level until send_ready: a byte waits
    output logic       send_ready,        // strobe: sent
    input  wire  [7:0] send,              // byte; may change during and after a command
    input  wire        send_damaged,      // level: send it with wrong parity
    output logic       received_valid,    // level: a command waits
    input  wire        received_ready,    // with received_valid: taken in this cycle
    output logic [7:0] received,          // command of the host
    output logic       received_damaged,  // level: wrong parity or no stop bit
    output logic       aborted,           // strobe: the host cut a frame short
    output logic       busy,              // level: a frame is on its way, in either direction
    output logic       clock_low,         // 1: pull the clock line low
    output logic       data_low           // 1: pull the data line low
);
    if (CHECKED != 0 && CLK_HZ < 400_000) begin : g_check
        CLK_HZ_MUST_BE_AT_LEAST_400_000 u_error ();
    end

    localparam int QUARTER = CLK_HZ / 50_000;  // clk: 20 us
    localparam int FREE = CLK_HZ / 20_000;  // 50 us
    localparam int W = $clog2(FREE + 1);

    typedef enum logic [1:0] {
        IDLE,
        SEND,
        RECEIVE,
        RELEASE
    } state_t;

    state_t state;
    // cycles in this quarter, or with both lines released
    logic [W-1:0] elapsed;
    logic [1:0] quarter;  // of a bit: 0 high, 1 and 2 low, 3 high
    logic [3:0] bit_number;  // bit of the frame
    logic [9:0] shifted;

    wire next = elapsed == W'(QUARTER - 1);
    wire free = elapsed >= W'(FREE);
    wire        cut      = (state == SEND || state == RECEIVE) && !clock &&
                          (quarter == 2'd0 || (quarter == 2'd3 && next && bit_number != 4'd10));
    wire eleventh = next && quarter == 2'd0 && bit_number == 4'd10;
    wire [9:0] frame = {1'b1, ~^send ^ send_damaged, send};

    assign busy       = state == SEND || state == RECEIVE;
    assign send_ready = state == SEND && eleventh && clock;

    always_ff @(posedge clk) begin
        aborted <= cut;
        if (received_valid && received_ready) received_valid <= 1'b0;
        if (state != IDLE) elapsed <= next ? '0 : elapsed + 1'b1;
        case (state)
            IDLE: begin
                quarter <= 2'd0;
                bit_number   <= 4'd0;
                shifted <= frame;
                elapsed <= !clock ? '0 : free ? elapsed : elapsed + 1'b1;
                if (clock && free && !data && !received_valid) begin
                    elapsed <= '0;
                    state   <= RECEIVE;
                end else if (clock && free && data && send_valid) begin
                    elapsed  <= '0;
                    data_low <= 1'b1;
                    state    <= SEND;
                end
            end
            SEND: begin
                if (next) quarter <= quarter + 1'b1;
                if (next && quarter == 2'd0) clock_low <= 1'b1;
                if (next && quarter == 2'd2) clock_low <= 1'b0;
                if (next && quarter == 2'd3) begin
                    bit_number    <= bit_number + 1'b1;
                    data_low <= !shifted[0];
                    shifted  <= {1'b1, shifted[9:1]};
                    if (bit_number == 4'd10) state <= RELEASE;
                end
            end
            RECEIVE: begin
                if (next) quarter <= quarter + 1'b1;
                if (next && quarter == 2'd0) clock_low <= 1'b1;
                if (next && quarter == 2'd2) clock_low <= 1'b0;
                if (next && quarter == 2'd3) begin
                    bit_number   <= bit_number + 1'b1;
                    shifted <= {data, shifted[9:1]};
                    data_low <= bit_number == 4'd9 && data;
                    if (bit_number == 4'd10) state <= RELEASE;
                end
                if (eleventh) begin
                    received         <= shifted[7:0];
                    received_damaged <= !(^shifted[8:0]) || !shifted[9];
                    received_valid   <= clock;
                end
            end
            RELEASE: begin
                elapsed <= '0;
                if (data || !clock) state <= IDLE;
            end
            default:  // unreachable: state has one of its four values
                state <= IDLE;
        endcase
        if (cut) begin
            clock_low <= 1'b0;
            data_low  <= 1'b0;
            elapsed   <= '0;
            state     <= IDLE;
        end
        if (rst) begin
            state          <= RELEASE;
            elapsed        <= '0;
            clock_low      <= 1'b0;
            data_low       <= 1'b0;
            received_valid <= 1'b0;
            aborted        <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [7:0] pulled;  // cycles that the clock has been pulled low
    logic       data_low_q;
    // cycles before this one in which data_low was as in the last one
    logic [7:0] stable = '0;
    always @(posedge clk) begin
        past   <= 1'b1;
        pulled <= rst || !clock_low ? 8'd0 : pulled + 1'b1;
        data_low_q <= data_low;
        stable  <= data_low != data_low_q ? 8'd1 : stable + !(&stable);
        if (!past) assume (rst);
        if (past) begin
            assert (clock_low == (busy && (quarter == 2'd1 || quarter == 2'd2)));
            if (!busy) assert (!data_low && elapsed <= W'(FREE));
            if (busy) begin
                assert (bit_number <= 4'd10 && elapsed < W'(QUARTER));
                if (quarter == 2'd0)
                    assert (stable >= 8'(elapsed) && (elapsed == '0 || data_low == data_low_q));
                if (clock_low)
                    assert (32'(pulled) == 32'(elapsed) + (quarter == 2'd2 ? QUARTER : 0));
            end
            if (state == RECEIVE && (bit_number != 4'd10 || quarter == 2'd0))
                assert (!received_valid);
            if (state == SEND)
                assert ((shifted | 10'((11'd1 << (4'd10 - bit_number)) - 1'b1)) == 10'h3FF);
        end
        if (past && !$past(rst) && !rst) begin
            if ($past(clock_low) && !clock_low) assert (32'($past(pulled)) == 2 * QUARTER - 1);
            if (clock_low && $past(clock_low)) assert ($stable(data_low));
            if ($past(received_valid && !received_ready))
                assert (received_valid && $stable(received) && $stable(received_damaged));
            if ($past(send_ready)) assert ($past(state) == SEND && clock_low);
            if (clock_low && !$past(clock_low)) assert (32'(stable) >= QUARTER);
            if (aborted) assert (!clock_low && !data_low);
            cover (aborted && $past(state) == SEND && $past(bit_number) == 4'd2);
            cover (state == RECEIVE && bit_number == 4'd3);
        end
    end
`endif
endmodule

`default_nettype wire
