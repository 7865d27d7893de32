// SPDX-License-Identifier: Apache-2.0
// i2c_master -- I2C master, one byte per command: start, write and read with their acknowledge,
// stop, and the recovery of a stuck bus.
//
// latency  about 1 bit for start and stop, 9 bits for a byte, less than 1.25 times as long and 1
//          bit more; at most 10 bits for a recovery; a device may stretch each of them
// rate     BUS_HZ or a little less: the clock is low for 11/20 of a bit, high for 9/20, and the
//          rise time of the lines adds to that
// limits   A device may stretch the clock for STRETCH_US. Then the command ends with NO_BUS and
//          both lines are released.
// source   NXP UM10204: low at least 4.7 us, high 4.0 us at 100 kHz; 1.3 us and 0.6 us at 400 kHz;
//          nine clocks free a device that holds data low. Another master's low on a released data
//          line loses the bus
// model    tb/peripheral/i2c_master.py, equal in every bit of every cycle
// proof    depth 60, CLK_HZ = 400000, BUS_HZ = 50000, STRETCH_US = 40, CHECKED = 0
// proved   data changes with the clock released only for a start and a stop; the clock is pulled
//          low for at least 11/20 of a bit; between commands the bus is owned, or both lines are
//          released; each command gives one done
`default_nettype none

module i2c_master #(
    parameter int CLK_HZ     = 50_000_000,  // Hz, clk frequency
    parameter int BUS_HZ     = 100_000,     // Hz, up to 400 000
    parameter int STRETCH_US = 25_000,      // us, longest wait for a released line to go high
    parameter int CHECKED    = 1            // 0: any CLK_HZ, for the proof
) (
    input  wire        clk,
    input  wire        rst,            // releases both lines
    input  wire        scl,            // level of the clock line, synchronous, filtered
    input  wire        sda,            // level of the data line, synchronous, filtered
    input  wire        command_valid,  // level: a command waits
    output logic       command_ready,  // with command_valid: taken in this cycle
    input  wire  [2:0] command,        // 0 start, 1 stop, 2 write, 3 read, else recover
    input  wire  [7:0] write_data,     // byte of a write
    input  wire        acknowledge,    // of a read: more bytes follow
    output logic       done,           // strobe: the command has ended
    output logic [1:0] result,         // 0 ok, 1 not acknowledged, 2 bus lost, 3 no bus
    output logic [7:0] read_data,      // byte of a read, from done on
    output logic       owned,          // level: the bus is owned, from start to stop
    output logic       scl_low,        // 1: pull the clock line low
    output logic       sda_low         // 1: pull the data line low
);
    if (BUS_HZ < 1000 || BUS_HZ > 400_000) begin : g_check_bus
        BUS_HZ_MUST_BE_FROM_1000_TO_400_000 u_error ();
    end
    if (CHECKED != 0 && CLK_HZ < 10 * BUS_HZ) begin : g_check_clk
        CLK_HZ_MUST_BE_AT_LEAST_10_TIMES_BUS_HZ u_error ();
    end

    // cycles, rounded up: 11/20 and 9/20 of a bit
    localparam int LOW = (CLK_HZ / 10 * 11 + 2 * BUS_HZ - 1) / (2 * BUS_HZ);
    localparam int HIGH = (CLK_HZ / 10 * 9 + 2 * BUS_HZ - 1) / (2 * BUS_HZ);
    localparam int TURN = LOW / 4;  // cycles from the falling clock to a change of data
    localparam int STRETCH = (CLK_HZ / 1_000) * STRETCH_US / 1_000;
    localparam int W = $clog2(STRETCH + 2);
    localparam int L = $clog2(LOW + 1);

    if (STRETCH < 3 * LOW) begin : g_check_stretch
        STRETCH_US_MUST_BE_AT_LEAST_2_BITS u_error ();
    end

    localparam logic [2:0] START = 3'd0, STOP = 3'd1, WRITE = 3'd2, READ = 3'd3;
    localparam logic [1:0] OK = 2'd0, NOT_ACKNOWLEDGED = 2'd1, LOST = 2'd2, NO_BUS = 2'd3;

    typedef enum logic [2:0] {
        IDLE,
        PULLED,
        RISE,
        RAISED,
        WAIT_FREE,
        BEGUN,
        ENDED
    } state_t;

    state_t         state;
    logic   [  2:0] kind;
    logic   [W-1:0] elapsed;  // cycles in this state
    logic   [L-1:0] free;  // cycles that both lines have been high
    logic   [  3:0] bit_number;  // bit of the byte; 8 is the acknowledge
    logic   [  8:0] shifted;  // released data bits are 1

    wire    [  8:0] written = {write_data, 1'b1};
    wire    [  8:0] released = {8'hFF, command != READ || !acknowledge};
    wire            bytes = kind == WRITE || kind == READ;
    wire            late = elapsed >= W'(STRETCH);
    wire            high_end = state == RAISED && elapsed >= W'(HIGH - 1);
    wire            taken_by_another = kind == WRITE && bit_number != 4'd8 && !sda_low && !sda;

    assign command_ready = state == IDLE;

    always_ff @(posedge clk) begin
        done    <= 1'b0;
        elapsed <= elapsed + 1'b1;
        free    <= !scl || !sda ? '0 : free + L'(free != L'(LOW));
        case (state)
            IDLE: begin
                elapsed <= '0;
                bit_number   <= '0;
                kind    <= command;
                shifted <= command == WRITE ? written : released;
                if (command_valid) begin
                    result <= OK;
                    if (command == START && !owned) state <= WAIT_FREE;
                    else if (command <= READ && !owned) begin
                        result <= LOST;
                        done   <= 1'b1;
                    end else begin
                        scl_low <= 1'b1;
                        state   <= PULLED;
                    end
                end
            end
            PULLED: begin
                if (elapsed == W'(TURN)) sda_low <= bytes ? !shifted[8] : kind == STOP;
                if (elapsed >= W'(LOW - 1)) begin
                    scl_low <= 1'b0;
                    elapsed <= '0;
                    state   <= kind == START ? WAIT_FREE : RISE;
                end
            end
            RISE:
            if (scl) begin
                elapsed <= '0;
                state   <= RAISED;
            end
            RAISED:
            if (high_end) begin
                elapsed <= '0;
                if (bytes) begin
                    shifted <= {shifted[7:0], sda};
                    bit_number   <= bit_number + 1'b1;
                    scl_low <= 1'b1;
                    state   <= PULLED;
                    if (bit_number == 4'd8) begin
                        read_data <= kind == READ ? shifted[7:0] : read_data;
                        result    <= kind == WRITE && sda ? NOT_ACKNOWLEDGED : OK;
                        done      <= 1'b1;
                        state     <= IDLE;
                    end
                    if (taken_by_another) begin
                        result  <= LOST;
                        owned   <= 1'b0;
                        scl_low <= 1'b0;
                        done    <= 1'b1;
                        state   <= IDLE;
                    end
                end else if (kind == STOP) begin
                    sda_low <= 1'b0;
                    owned   <= 1'b0;
                    state   <= ENDED;
                end else begin  // recover: a stop as soon as data is free, or after nine clocks
                    bit_number   <= bit_number + 1'b1;
                    scl_low <= 1'b1;
                    state   <= PULLED;
                    if (sda || bit_number == 4'd8) kind <= STOP;
                end
            end
            WAIT_FREE:
            if (free == L'(LOW)) begin
                sda_low <= 1'b1;
                elapsed <= '0;
                state   <= BEGUN;
            end
            BEGUN:
            if (elapsed >= W'(HIGH - 1)) begin
                scl_low <= 1'b1;
                owned   <= 1'b1;
                done    <= 1'b1;
                state   <= IDLE;
            end
            ENDED:
            if (free == L'(LOW)) begin
                done  <= 1'b1;
                state <= IDLE;
            end
            default:  // unreachable: state has one of its seven values
                state <= IDLE;
        endcase
        if (late && (state == RISE || state == WAIT_FREE || state == ENDED)) begin
            result  <= NO_BUS;
            owned   <= 1'b0;
            scl_low <= 1'b0;
            sda_low <= 1'b0;
            done    <= 1'b1;
            state   <= IDLE;
        end
        if (rst) begin
            state   <= IDLE;
            free    <= '0;
            owned   <= 1'b0;
            scl_low <= 1'b0;
            sda_low <= 1'b0;
            done    <= 1'b0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            if (state == PULLED) assert (scl_low && elapsed < W'(LOW));
            if (state == RAISED) assert (!scl_low && elapsed < W'(HIGH));
            if (state == BEGUN) assert (!scl_low && sda_low && elapsed < W'(HIGH));
            if (state == IDLE) assert (scl_low == owned && (owned || !sda_low));
            if (state == RISE || state == WAIT_FREE || state == ENDED)
                assert (!scl_low && elapsed <= W'(STRETCH));
            if (state == WAIT_FREE || state == ENDED) assert (!sda_low);
            if (state == ENDED) assert (!owned);
            if (bytes && (state == PULLED || state == RISE || state == RAISED)) assert (owned);
            assert (32'(free) <= LOW && (!bytes || state == IDLE || bit_number <= 4'd8));
        end
        if (past && !$past(rst) && !rst) begin
            if (!scl_low && !$past(scl_low) && sda_low != $past(sda_low))
                assert (sda_low ? state == BEGUN : state == ENDED || (done && result == NO_BUS));
            if (done && $past(done)) assert ($past(command_valid && state == IDLE));
            if ($past(state) != IDLE && state == IDLE) assert (done);
            cover (done && result == LOST && $past(owned));
            cover (done && result == NO_BUS);
        end
    end
`endif
endmodule

`default_nettype wire
