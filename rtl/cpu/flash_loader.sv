// SPDX-License-Identifier: Apache-2.0
// flash_loader -- copies the firmware from a serial flash into the memory of the soft core after
// each reset; then exchanges single bytes with the flash, for the firmware.
//
// latency   64 * (PAUSE + WORDS + 2) cycles from the end of rst to done, 16 cycles from send to
//           answer
// rate      a word in 64 cycles, then a byte in 17 cycles
// behaviour SPI mode 0, sclk at half of clk, the highest bit of a byte first. The flash is woken by
//           command ABh, since an FPGA sends it to sleep after it has read its configuration. After
//           a pause of PAUSE * 64 cycles command 03h reads WORDS words from address START on,
//           or from 64 KiB behind it for each unit of slot; the first byte of the flash is the
//           lowest byte of a word. After done, send begins the exchange of a byte, with cs_n low;
//           with `ends`, cs_n rises after it. send is ignored before done.
// model     tb/cpu/flash_loader.py, equal in every bit of every cycle
// proved    A word is stored once in 64 cycles, the addresses follow each other from 0 on, and done
//           comes after the last one and stays. sclk is low whenever cs_n is high. After done
//           sclk moves only in the 16 cycles after send.
// proof     depth 4, WORDS = 4, PAUSE = 2
`default_nettype none

module flash_loader #(
    parameter int WORDS = 4096,  // words to be copied, a power of two from 2 up
    parameter int START = 131072,  // byte address of the first word in the flash
    parameter int PAUSE = 64,  // periods of 64 cycles until the flash is awake, 1 to WORDS - 1
    parameter int HAS_PORT = 1  // 1: exchange bytes for the firmware; 0: send is ignored
) (
    input  wire                      clk,
    input  wire                      rst,
    input  wire  [              1:0] slot,     // image that is copied, static while it is
    // flash
    output logic                     cs_n,     // pin, low during a command
    output logic                     sclk,     // pin, idles low
    output logic                     mosi,     // pin, data to the flash
    input  wire                      miso,     // pin, data of the flash, synchronous to sclk
    // memory
    output logic                     store,    // strobe: word is to be stored at address
    output logic [$clog2(WORDS)-1:0] address,  // number of a word
    output logic [             31:0] word,     // value
    output logic                     done,     // level: all words are stored
    // bytes of the firmware
    input  wire                      send,     // strobe: send data, at least 17 cycles apart
    input  wire  [              7:0] data,     // byte to the flash
    input  wire                      ends,     // level: with send, the last byte of a command
    output logic [              7:0] answer    // byte of the flash, received meanwhile
);
    localparam int A = $clog2(WORDS);
    localparam [31:0] WAKE = 32'hAB00_0000;

    if (WORDS < 2 || WORDS != 1 << A) begin : g_check_words
        WORDS_MUST_BE_A_POWER_OF_TWO_FROM_2_UP u_error ();
    end
    if (PAUSE < 1 || PAUSE >= WORDS) begin : g_check_pause
        PAUSE_MUST_BE_FROM_1_TO_WORDS_LESS_1 u_error ();
    end

    typedef enum logic [1:0] {
        WAKING,
        PAUSING,
        COMMANDING,
        COPYING
    } state_t;

    state_t         state;
    logic   [  5:0] half;  // half periods of sclk since the last 32 bits
    logic   [ 31:0] shifted;  // bits to send from the highest one on, bits received from the lowest
    logic   [A-1:0] count;  // of the periods of 64 cycles in this state
    logic           releases;  // cs_n rises after this byte

    wire            last = half == 6'd63;
    wire            rests = HAS_PORT != 0 && done && half == '0;  // until the next byte
    wire    [ 31:0] received = {shifted[30:0], miso};
    wire    [ 31:0] read = {8'h03, 8'(START >> 16) + 8'(slot), 16'(START)};

    assign mosi    = shifted[31];
    assign sclk    = half[0] && !cs_n;
    assign store   = state == COPYING && last && !done;
    assign address = count;
    assign word    = {received[7:0], received[15:8], received[23:16], received[31:24]};
    assign answer  = shifted[7:0];

    always_ff @(posedge clk) begin
        if (!rests) half <= half + 1'b1;
        if (half[0]) shifted <= received;
        if (last) begin
            count <= count + 1'b1;
            case (state)
                WAKING: begin
                    state <= PAUSING;
                    cs_n  <= 1'b1;
                    count <= '0;
                end
                PAUSING: begin
                    if (count == A'(PAUSE - 1)) begin
                        state   <= COMMANDING;
                        cs_n    <= 1'b0;
                        shifted <= read;
                    end
                end
                COMMANDING: begin
                    state <= COPYING;
                    count <= '0;
                end
                default: begin
                    if (&count) done <= 1'b1;
                    if (&count || HAS_PORT != 0 && done) cs_n <= HAS_PORT == 0 || releases;
                end
            endcase
        end
        if (rests && send) begin
            half     <= 6'd48;
            shifted  <= {data, 24'd0};
            releases <= ends;
            cs_n     <= 1'b0;
        end
        if (rst) begin
            state   <= WAKING;
            half    <= '0;
            cs_n    <= 1'b0;
            shifted <= WAKE;
            done    <= 1'b0;
            count   <= '0;
            releases <= 1'b1;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic [A:0] stored;  // words since rst
    logic [6:0] since;  // cycles since the last word, at most 64
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        stored <= rst ? '0 : stored + (A + 1)'(store);
        since  <= rst || store ? 7'd1 : since + 7'(since != 7'd64);
        if (past) begin
            if (cs_n) assert (!sclk);
            assert (stored <= (A + 1)'(WORDS) && done == (stored == (A + 1)'(WORDS)));
            if (state != COPYING) assert (stored == '0 && !done);
            if (state == COPYING && !done) assert (count == stored[A-1:0] && !cs_n);
            if (state == PAUSING) assert (cs_n);
            if (done) assert (half == '0 || half >= 6'd48);
            if (done && half == '0) assert (!sclk);
            if (!done) assert (releases);
            if (state == PAUSING) assert (count < A'(PAUSE));
            if (state == COMMANDING || state == WAKING) assert (!cs_n);
            if (stored != '0 && !done) assert (since == {1'b0, half} + 7'd1);
            if (store && stored != '0) assert (since == 7'd64);
            if ($past(done) && !$past(rst) && half == '0 && $past(half) == '0)
                assert (cs_n == $past(cs_n));
        end
        if (past && !$past(rst) && $past(done)) assert (done && !store);
        cover (past && sclk && mosi);
    end
`endif
endmodule

`default_nettype wire
