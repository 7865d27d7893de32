// SPDX-License-Identifier: Apache-2.0
// tick_recorder -- record chosen results of one axis at each servo tick, evenly, into a block
// memory, so that a host can read them in its own time.
//
// latency  1 cycle from the last result to full; 2 cycles from full to the first word and from
//          read to the next word
// rate     one result per cycle while it records; one word per 2 cycles while it is read
// behaviour A sample begins at a tick and ends with the command of that tick. The first one begins
//          at the first tick at which `ready` is high. Its words are in the order of the bits of
//          signals: bit 0 are the samples of sine and cosine at the tick, bit n the result of kind
//          n. length times the number of signals must be at most WORDS. After the last word the
//          first one follows again.
// model    tb/control/tick_recorder.py, equal in every bit of every cycle
// proved   full and recording are never high together; nothing is stored unless recording
// proof    depth 12, WORDS = 4
`default_nettype none

module tick_recorder #(
    parameter int WORDS = 4096  // words of the memory, a power of two, 65536 at most
) (
    input  wire         clk,
    input  wire         rst,
    // settings
    input  wire         start,        // strobe: record from now on
    input  wire  [ 2:0] axis,         // number of the axis
    input  wire  [ 5:0] signals,      // bit n: record signal n
    input  wire  [15:0] length,       // samples, 1 at least
    input  wire  [15:0] every,        // one sample in so many ticks; 0 acts as 1
    // what is recorded
    input  wire         tick,         // strobe: servo tick
    input  wire         ready,        // level: the first sample may begin
    input  wire  [31:0] sine_cosine,  // samples of the axis, cosine in the upper half
    input  wire         valid,        // strobe: result is new
    input  wire  [ 2:0] result_axis,  // number of its axis
    input  wire  [ 2:0] kind,         // number of what it is
    input  wire  [31:0] result,       // its lower half
    // reading
    input  wire         read,         // strobe: go on to the next word
    output logic [31:0] word,         // word of the recording
    output logic        recording,    // level: the recording is not complete
    output logic        full          // level: the recording is complete
);
    if (WORDS < 2 || WORDS > 65536 || (WORDS & (WORDS - 1)) != 0) begin : g_check
        WORDS_MUST_BE_A_POWER_OF_TWO_UP_TO_65536 u_error ();
    end

    localparam [2:0] COMMAND = 3'd5;  // kind of result, as in tables/engine_microcode.py
    localparam int A = $clog2(WORDS);

    // number of signals below this one
    function [2:0] ones(input [5:0] bits);
        ones = '0;
        for (int n = 0; n < 6; n++) ones = ones + 3'(bits[n]);
    endfunction

    logic [31:0] memory[0:WORDS-1];
    logic [A-1:0] base, at;  // first word of the sample; word that is read
    logic [15:0] left, passed;  // samples that are missing; ticks since the last sample
    logic         begun;  // the first sample has begun
    logic         taking;  // the results of this tick are recorded

    wire          due = recording && tick && (begun ? passed + 1'b1 >= every : ready);
    wire          given = valid && taking && result_axis == axis && kind != '0 && kind <= COMMAND;
    wire  [  5:0] below = due ? '0 : signals & 6'((7'd1 << kind) - 7'd1);
    wire          keep = due ? signals[0] : given && signals[kind];
    wire          ends = given && kind == COMMAND && !due;
    wire  [A-1:0] place = keep ? base + A'(ones(below)) : at;

    always_ff @(posedge clk) begin
        // one port: a recording is read when it is complete
        if (keep) memory[place] <= due ? sine_cosine : result;
        else word <= memory[place];
    end

    always_ff @(posedge clk) begin
        if (recording && tick) passed <= due ? '0 : passed + 1'b1;
        if (due) {begun, taking} <= 2'b11;
        if (ends) begin
            taking <= 1'b0;
            base   <= base + A'(ones(signals));
            left   <= left - 1'b1;
            if (left <= 16'd1) {recording, full} <= 2'b01;
        end
        if (full && read) at <= at + 1'b1;
        if (start) begin
            {recording, full, begun, taking} <= 4'b1000;
            base   <= '0;
            at     <= '0;
            left   <= length;
            passed <= '0;
        end
        if (rst) {recording, full, begun, taking} <= '0;
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (past) begin
            assert (!(recording && full));
            assert (!taking || recording);
            assert (!keep || recording);
        end
        cover (past && full && word == 32'h1234_5678);
    end
`endif
endmodule

`default_nettype wire
