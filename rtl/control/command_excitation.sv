// SPDX-License-Identifier: Apache-2.0
// command_excitation -- add a periodic waveform to the commands of one axis, one value for each
// servo tick, to measure how the axis responds.
//
// latency  0 cycles from result to excited; 2 cycles from a command until the next value is added
// rate     one result per cycle, but commands of the axis at least three cycles apart
// behaviour Results that are not commands of this axis pass unchanged, and all do while period is
//          0 or running is low. The sum is limited to +-limit. The waveform begins with its value 0
//          after that.
// source   multisine excitation at the input of the plant, in closed loop; here any waveform
// model    tb/control/command_excitation.py, equal in every bit of every cycle
// proved   A result that is not a command of the axis passes; a command of it is within +-limit.
// proof    depth 6, DEPTH = 2
`default_nettype none

module command_excitation #(
    parameter int DEPTH = 4096  // values of the waveform, a power of two, 4096 at most
) (
    input  wire                clk,
    input  wire                rst,
    // settings
    input  wire         [ 2:0] axis,         // number of the axis
    input  wire         [12:0] period,       // values of the waveform, DEPTH at most; 0: off
    input  wire                running,      // level: the waveform is added
    input  wire         [14:0] limit,        // largest |command|, full scale 2^15
    input  wire                store,        // strobe: store a value of the waveform
    input  wire         [11:0] store_at,     // its number
    input  wire signed  [15:0] store_value,  // value, full scale 2^15
    // motion_engine
    input  wire                valid,        // strobe: result is new
    input  wire         [ 2:0] result_axis,  // number of its axis
    input  wire         [ 2:0] kind,         // number of what it is
    input  wire signed  [47:0] result,       // value
    // to the axes
    output logic signed [47:0] excited,      // the result, or the command with the waveform
    output logic               first         // level: the next command gets value 0, or none
);
    if (DEPTH < 2 || DEPTH > 4096 || (DEPTH & (DEPTH - 1)) != 0) begin : g_check
        DEPTH_MUST_BE_A_POWER_OF_TWO_UP_TO_4096 u_error ();
    end

    localparam [2:0] COMMAND = 3'd5;  // kind of result, as in tables/engine_microcode.py
    localparam int A = $clog2(DEPTH);

    logic signed [15:0] waveform                                                     [0:DEPTH-1];
    logic signed [15:0] value;  // of the next command
    logic        [12:0] at;  // its number

    wire                on = |period && running;
    wire                adds = valid && on && kind == COMMAND && result_axis == axis;
    wire         [12:0] following = at + 1'b1;
    wire signed  [16:0] sum = 17'($signed(result[15:0])) + 17'(value);
    wire signed  [16:0] most = $signed({2'b00, limit});
    wire signed  [16:0] limited = sum > most ? most : sum < -most ? -most : sum;

    assign excited = adds ? 48'(limited) : result;
    assign first   = at == '0;

    always_ff @(posedge clk) begin
        if (store) waveform[store_at[A-1:0]] <= store_value;
        value <= waveform[at[A-1:0]];
    end

    always_ff @(posedge clk) begin
        if (!on) at <= '0;
        else if (adds) at <= following >= period ? '0 : following;
        if (rst) at <= '0;
    end

    wire unused = &{1'b0, store_at, at};

`ifdef FORMAL
    wire signed [47:0] bound = $signed({33'd0, limit});
    wire signed [47:0] example = 48'sd5;
    always_comb begin
        if (!adds)
            assert (excited == result);
            else assert (excited <= bound && excited >= -bound);
        cover (adds && excited == example && result != example && !first);
    end
`endif
endmodule

`default_nettype wire
