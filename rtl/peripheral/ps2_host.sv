// SPDX-License-Identifier: Apache-2.0
// ps2_host -- be the host of a PS/2 line: receive the bytes of a keyboard, send it commands, and
// hold it by pulling the clock low.
//
// latency  2 cycles from the eleventh falling clock edge to received_valid
// rate     one byte per frame; a byte that waits holds the keyboard until it is taken
// limits   The time-outs are 300 us between two edges and 15 ms to the first edge of a command. A
//          byte that ends in a time-out is damaged.
// source   IBM PS/2 keyboard interface: 11 bits at 10 to 16.7 kHz, start, 8 data bits LSB first,
//          odd parity, stop; the keyboard makes the clock. A command: clock low for 100 us, then
//          data low, clock released; the keyboard clocks 10 bits in and pulls the 11th low
// model    tb/peripheral/ps2_host.py, equal in every bit of every cycle
// proof    depth 44, CLK_HZ = 40000, CHECKED = 0
// proved   the clock is pulled low for at least 100 us; data only for a command, first with the
//          clock low; a byte waits until it is taken, and the keyboard is held meanwhile
`default_nettype none

module ps2_host #(
    parameter int CLK_HZ  = 50_000_000,  // Hz, clk frequency
    parameter int CHECKED = 1            // 0: any CLK_HZ, for the proof
) (
    input  wire        clk,
    input  wire        rst,               // releases both lines, drops the frame
    input  wire        hold,              // level: no new frame; a frame on its way is completed
    input  wire        clock,             // level of the clock line, synchronous, filtered
    input  wire        data,              // level of the data line, synchronous, filtered
    input  wire        command_valid,     // level: a command waits
    output logic       command_ready,     // with command_valid: taken in this cycle
    input  wire  [7:0] command,           // byte for the keyboard
    input  wire        command_damaged,   // level: send it with wrong parity
    output logic       received_valid,    // level: a byte waits
    input  wire        received_ready,    // with received_valid: taken in this cycle
    output logic [7:0] received,          // byte of the keyboard
    output logic       received_damaged,  // level: wrong parity, no stop bit, or cut short
    output logic       sent,              // strobe: the keyboard acknowledged the command
    output logic       unsent,            // strobe: it did not, or a time-out ended it
    output logic       held,              // level: the keyboard is held, and no frame is on its way
    output logic       busy,              // level: a frame is on its way, in either direction
    output logic       clock_low,         // 1: pull the clock line low
    output logic       data_low           // 1: pull the data line low
);
    if (CHECKED != 0 && CLK_HZ < 400_000) begin : g_check
        CLK_HZ_MUST_BE_AT_LEAST_400_000 u_error ();
    end

    // all in cycles
    localparam int HOLD = CLK_HZ / 10_000;  // 100 us
    localparam int SETUP = (CLK_HZ / 1_000) / 50 + 1;  // 20 us, data low with the clock
    localparam int GAP = (CLK_HZ / 1_000) * 3 / 10;  // 300 us between two edges
    localparam int FIRST = (CLK_HZ / 1_000) * 15;  // 15 ms to the first edge of a command
    localparam int W = $clog2(FIRST + 1);

    typedef enum logic [2:0] {
        IDLE,
        RECEIVE,
        HELD,
        REQUEST,
        COMMAND,
        RELEASE
    } state_t;

    state_t         state;
    // cycles in this state, or since the last edge of a frame
    logic   [W-1:0] elapsed;
    logic   [  3:0] edges;  // of this frame
    logic   [  9:0] shifted;
    logic           clock_q;

    wire            fall = clock_q && !clock;
    wire    [  9:0] frame = {data, shifted[9:1]};  // stop, parity, data
    wire            cut = elapsed >= W'(GAP);
    wire            ready = state == HELD && elapsed >= W'(HOLD) && !received_valid;

    assign command_ready = ready;
    assign held          = ready && !command_valid;
    assign busy          = state == RECEIVE || state == REQUEST || state == COMMAND;
    assign clock_low     = state == HELD || state == REQUEST;

    always_ff @(posedge clk) begin
        clock_q <= clock;
        sent    <= 1'b0;
        unsent  <= 1'b0;
        if (!(&elapsed)) elapsed <= elapsed + 1'b1;
        if (received_valid && received_ready) received_valid <= 1'b0;
        case (state)
            IDLE: begin
                edges   <= 4'd1;
                elapsed <= '0;
                if (fall && !data) state <= RECEIVE;
                else if (hold || command_valid) state <= HELD;
            end
            RECEIVE: begin
                if (fall) begin
                    shifted <= frame;
                    edges   <= edges + 1'b1;
                    elapsed <= '0;
                end
                if (cut || (fall && edges == 4'd10)) begin
                    received         <= cut ? 8'd0 : frame[7:0];
                    received_damaged <= cut || !(^frame[8:0]) || !frame[9];
                    received_valid   <= 1'b1;
                    elapsed          <= '0;
                    state            <= HELD;
                end
            end
            HELD: begin
                shifted <= {1'b1, ~^command ^ command_damaged, command};
                edges   <= 4'd0;
                if (ready && command_valid) begin
                    elapsed  <= '0;
                    data_low <= 1'b1;
                    state    <= REQUEST;
                end else if (ready && !hold) state <= RELEASE;
            end
            REQUEST:
            if (elapsed >= W'(SETUP)) begin
                elapsed <= '0;
                state   <= COMMAND;
            end
            COMMAND:
            if (fall) begin
                data_low <= edges < 4'd10 && !shifted[0];
                shifted  <= {1'b1, shifted[9:1]};
                edges    <= edges + 1'b1;
                elapsed  <= '0;
                if (edges == 4'd10) begin
                    sent   <= !data;
                    unsent <= data;
                    state  <= RELEASE;
                end
            end else if (elapsed >= (edges == 4'd0 ? W'(FIRST) : W'(GAP))) begin
                data_low <= 1'b0;
                unsent   <= 1'b1;
                elapsed  <= '0;
                state    <= HELD;
            end
            RELEASE:
                if (clock) state <= IDLE;
            default:  // unreachable: state has one of its six values
                state <= IDLE;
        endcase
        if (rst) begin
            state          <= RELEASE;
            data_low       <= 1'b0;
            received_valid <= 1'b0;
            sent           <= 1'b0;
            unsent         <= 1'b0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [7:0] pulled;  // cycles that the clock has been pulled low
    always @(posedge clk) begin
        past   <= 1'b1;
        pulled <= rst || !clock_low ? 8'd0 : pulled + !(&pulled);
        if (!past) assume (rst);
        if (past) begin
            if (data_low) assert (state == REQUEST || state == COMMAND);
            if (state == REQUEST) assert (data_low && 32'(pulled) >= HOLD);
            if (state == HELD) assert (W'(pulled) == elapsed || (&pulled && elapsed > W'(HOLD)));
            if (received_valid) assert (state == HELD);
            assert (!(sent && unsent));
            if (state == COMMAND || state == RECEIVE) assert (edges <= 4'd10);
        end
        if (past && !$past(rst) && !rst) begin
            if ($past(clock_low) && !clock_low) assert (32'($past(pulled)) >= HOLD);
            if ($past(received_valid && !received_ready))
                assert (received_valid && $stable(received) && $stable(received_damaged));
            if (!$past(data_low) && data_low) assert (clock_low || $past(state) == COMMAND);
            cover (received_valid && !received_damaged && received == 8'h1C);
            cover (sent);
        end
    end
`endif
endmodule

`default_nettype wire
