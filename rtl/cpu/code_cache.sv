// SPDX-License-Identifier: Apache-2.0
// code_cache -- reads the program of the soft core from a serial flash, line by line, and keeps the
// lines that were read last.
//
// latency   1 cycle from request to ready for a word of a line that is kept, 579 cycles for another
//           one; the first line waits for 64 * (PAUSE + 1) cycles more after rst.
// rate      a word in 2 cycles
// behaviour A line has 8 words. The flash is woken by command ABh, since an FPGA sends it to sleep
//           after it has read its configuration; after a pause of PAUSE * 64 cycles each line that
//           is asked for and is not kept is read by command 03h, in SPI mode 0, sclk at half of
//           clk, the highest bit of a byte first; the first byte of the flash is the lowest byte of
//           a word. A line replaces the one LINES lines further on or back; rst forgets all.
// model     tb/cpu/code_cache.py, equal in every bit of every cycle
// proved    ready is a strobe, only for a request, and the word with it was stored at this address
//           since rst. sclk is low whenever cs_n is high, and nothing moves without a request once
//           the flash is awake.
// proof     depth 12, BYTES = 128, START = 256, LINES = 2, PAUSE = 1
`default_nettype none

module code_cache #(
    parameter int BYTES = 65536,  // bytes of the program, a power of two, more than the lines have
    parameter int START = 131072,  // byte address of the first of them, a multiple of BYTES
    parameter int LINES = 128,  // lines of 32 bytes that are kept, a power of two from 2 up
    parameter int PAUSE = 64  // periods of 64 cycles until the flash is awake, LINES / 64 or more
) (
    input wire clk,
    input wire rst,
    input wire request,  // level: the word at address is asked for, until ready
    input wire [$clog2(BYTES)-3:0] address,  // number of a word, stable during request
    output logic ready,  // strobe: word is the one at address
    output logic [31:0] word,  // value
    // flash
    output logic cs_n,  // pin, low during a command
    output logic sclk,  // pin, idles low
    output logic mosi,  // pin, data to the flash
    input wire miso  // pin, data of the flash, synchronous to sclk
);
    localparam int A = $clog2(BYTES) - 2;  // bits of the number of a word
    localparam int L = $clog2(LINES);
    localparam int T = A - 3 - L;  // bits that tell the lines apart which replace each other
    localparam int P = $clog2(PAUSE + 1) > 3 ? $clog2(PAUSE + 1) : 3;
    localparam [31:0] WAKE = 32'hAB00_0000;

    if (BYTES != 1 << (A + 2) || LINES < 2 || LINES != 1 << L || T < 1) begin : g_check_sizes
        BYTES_AND_LINES_MUST_BE_POWERS_OF_TWO_AND_BYTES_MORE_THAN_32_LINES u_error ();
    end
    if (START < 0 || START % BYTES != 0 || START > (1 << 24) - BYTES) begin : g_check_start
        START_MUST_BE_A_MULTIPLE_OF_BYTES_IN_16_MIB u_error ();
    end
    if (PAUSE < 1 || PAUSE * 64 < LINES) begin : g_check_pause
        PAUSE_MUST_BE_AT_LEAST_LINES_DIVIDED_BY_64 u_error ();
    end

    typedef enum logic [2:0] {
        WAKING,
        PAUSING,
        RESTING,
        COMMANDING,
        COPYING
    } state_t;

    state_t state;
    logic [5:0] half;  // half periods of sclk since the last 32 bits
    logic [31:0] shifted;  // bits to send from the highest one on, bits received from the lowest
    logic [P-1:0] count;  // of the periods of 64 cycles in this state
    logic looked;  // tag and word are those at address
    logic [T:0] tag;  // bit T: the line is kept; others: upper bits of its address

    logic [T:0] tags[0:LINES-1];
    logic [31:0] kept[0:8*LINES-1];

    wire [L-1:0] line = address[3+:L];
    wire [T-1:0] upper = address[A-1:L+3];
    wire [31:0] received = {shifted[30:0], miso};
    wire [31:0] ordered = {received[7:0], received[15:8], received[23:16], received[31:24]};
    wire last = half == 6'd63;
    wire clears = state == PAUSING;
    wire whole = state == COPYING && last && count[2:0] == 3'd7;
    wire misses = looked && !ready;

    assign mosi  = shifted[31];
    assign sclk  = half[0] && !cs_n;
    assign ready = looked && tag == {1'b1, upper};

    always_ff @(posedge clk) begin
        tag  <= tags[line];
        word <= kept[address[L+2:0]];
        if (clears) tags[L'({count, half})] <= '0;
        else if (whole) tags[line] <= {1'b1, upper};
        if (state == COPYING && last) kept[{line, count[2:0]}] <= ordered;
    end

    always_ff @(posedge clk) begin
        looked <= request && state == RESTING && !looked;
        if (state != RESTING) half <= half + 1'b1;
        if (half[0]) shifted <= received;
        if (last) count <= count + 1'b1;
        case (state)
            WAKING:
            if (last) begin
                state <= PAUSING;
                cs_n  <= 1'b1;
                count <= '0;
            end
            PAUSING: if (last && count == P'(PAUSE - 1)) state <= RESTING;
            RESTING:
            if (misses) begin
                state   <= COMMANDING;
                cs_n    <= 1'b0;
                shifted <= {8'h03, 24'(START) | 24'({address[A-1:3], 5'd0})};
            end
            COMMANDING:
            if (last) begin
                state <= COPYING;
                count <= '0;
            end
            default:
            if (whole) begin
                state <= RESTING;
                cs_n  <= 1'b1;
            end
        endcase
        if (rst) begin
            state   <= WAKING;
            half    <= '0;
            cs_n    <= 1'b0;
            shifted <= WAKE;
            count   <= '0;
            looked  <= 1'b0;
        end
    end

`ifdef FORMAL
    // one word of the program, whichever: whether it was stored since rst, and its value then
    (* anyconst *)logic [A-1:0] watched;
    logic         past = 1'b0;
    logic         stored;
    logic [ 31:0] value;
    wire  [L-1:0] its_line = watched[3+:L];
    wire  [T-1:0] its_upper = watched[A-1:L+3];
    wire          reads = state == COMMANDING || state == COPYING;
    wire          at_it = reads && line == its_line;
    wire          has_it = tags[its_line] == {1'b1, its_upper};
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past && !$past(rst) && $past(request && !ready)) assume (request && $stable(address));
        if (state == COPYING && last && {line, count[2:0]} == watched[L+2:0]) begin
            stored <= upper == its_upper;
            value  <= ordered;
        end
        if (rst) stored <= 1'b0;
        if (past) begin
            if (cs_n) assert (!sclk);
            assert (cs_n == (state == PAUSING || state == RESTING));
            assert (state <= COPYING);
            if (reads || looked) assert (request);
            if (looked) assert (state == RESTING && $stable(address));
            if (state == RESTING) assert (half == '0);
            if (state == WAKING || state == COMMANDING) assert (!cs_n);
            if (state == PAUSING) assert (count < P'(PAUSE));
            if (state == COPYING) assert ({1'b0, count} < (P + 1)'(8));
            if (!$past(rst) && $past(ready)) assert (!ready);
            if (!$past(rst) && $past(state == RESTING && !request))
                assert (state == RESTING && $stable(mosi));
            // what is kept of it
            if (stored) assert (kept[watched[L+2:0]] == value);
            if (state == PAUSING && {count, half} > (P + 6)'(its_line)) assert (!tags[its_line][T]);
            if (at_it && upper == its_upper) assert (!has_it);
            if (state == COPYING && at_it && upper == its_upper && count[2:0] > watched[2:0])
                assert (stored);
            if (state == RESTING || (reads && !at_it)) assert (!has_it || stored);
            if (looked) assert (tag == tags[line] && word == kept[address[L+2:0]]);
            if (ready && address == watched) assert (stored && word == value);
            cover (sclk && mosi);
        end
    end
`endif
endmodule

`default_nettype wire
