// SPDX-License-Identifier: Apache-2.0
// engine_bus -- pass what is written to the register map to motion_engine, and the pieces of
// streamed set-points; let the soft core wait while a setting or a request is not done yet.
//
// latency   1 cycle from stores to setting_write and gains_changed for a value of 64 bits, 17 at
//           most for a shorter one; 3 from piece_valid; push when its setting is written
// rate      one word, then the next one when hold and waits are low
// method    A value enters at the top of the setting, and is shifted right, two bits per cycle, to
//           the unit of the engine. The engine's word has the number of its register in its block,
//           with bit 4 inverted.
// behaviour A word that is not of the engine, or of an axis or a filter that is not built, is left
//           out. gains_changed comes before the gain is written, so that no tick uses a gain
//           without it. waits is high while anything that was requested of the engine is not done
//           and shown: the registers always show the state after all requests, in their order. Only
//           one shift of an origin at a time waits, so there is one shift_by for all axes. A word
//           of a piece has the unit of the engine already. While it is offered, waits is high, and
//           it is taken when the last access to the registers is done: no access comes between.
//           The words of a segment in the registers are left out for an axis that is streamed.
// source    engine_words: which registers are words of the engine
// model     tb/control/engine_bus.py, equal in every bit of every cycle
// proved    A word of the engine or of a piece gives one setting, with hold high until it is
//           written, and a segment or a piece one push after that. No word of a segment in the
//           registers passes for an axis that is streamed. A piece is taken only while no request
//           waits and nothing is stored.
// proof     depth 23, AXES = 2, FILTERS = 1
`default_nettype none

module engine_bus #(
    parameter int AXES    = 1,  // axes of the node, 1 to 8
    parameter int FILTERS = 0   // filters of each servo, 0 to 4
) (
    input wire clk,
    input wire rst,
    // register memory
    input wire stores,  // strobe: a word is stored
    input wire [13:0] address,  // word of the register map
    input wire [31:0] value,  // bits of its settings, sign-extended
    input wire [31:0] value_low,  // low word of a value of 64 bits
    output logic hold,  // level: no first value may be stored
    output logic waits,  // level: the soft core must wait
    // pieces of streamed set-points
    input wire [AXES-1:0] streamed,  // levels: the segments are pieces
    input wire piece_valid,  // level: a word is offered
    input wire [2:0] piece_axis,  // number of its axis
    input wire [1:0] piece_part,  // 0 velocity, 1 acceleration, 2 jerk, 3 ticks
    input wire signed [63:0] piece_word,  // value
    output logic piece_taken,  // strobe: the word is taken in this cycle
    output logic settled,  // level: nothing was requested or is written
    // settings
    input wire ready,  // level: the engine takes settings
    input wire setting_waits,  // level: the engine has not written it yet
    output logic setting_write,  // strobe: write a setting
    output logic [2:0] setting_axis,  // number of its axis
    output logic [6:0] setting_word,  // number of its word
    output logic [1:0] setting_filter,  // number of its filter
    output logic signed [63:0] setting,  // value
    // requests
    output logic [AXES-1:0] gains_changed,  // strobes: a gain is new
    output logic [AXES-1:0] push,  // strobes: queue the segment
    input wire [AXES-1:0] pending,  // level: a request is not done and shown
    input wire [AXES-1:0] moves,  // level: position will jump
    input wire [AXES-1:0] moved,  // strobes: position jumps in the next cycle
    input wire [48*AXES-1:0] moved_by,  // 2^-16 period, of each axis
    output logic signed [47:0] shift_by  // 2^-16 period, of the last jump
);
    // of the map: 24 blocks of axes from 0x400 on, eight of each kind; the fourth to the 27th block
    wire [1:0] kind = address[10:9] - 2'(!address[8]);
    wire [2:0] axis = {!address[8], address[7:6]};
    wire       in_map = address[13:11] == '0 && address[10:8] != 3'd0 && address[10:8] != 3'd7;
    wire       of_axis = in_map && {1'b0, axis} < 4'(AXES);
    wire [4:0] places;
    wire of_engine, wide, has_sign, gain, queues, segment, filter_address, filter_value;
    logic [4:0] filter_at;  // value of a filter that filter_value writes
    logic       scales;  // the setting is being shifted
    logic [4:0] left;  // pairs of bits by which it is still to be shifted
    logic       fill;  // its sign
    logic       of_gain;  // it is a gain
    logic       pushes;  // it ends a segment
    logic [1:0] offered;  // a word of a piece was offered in the last cycles, by age
    // words of a segment, by the part of a piece: as in tables/engine_microcode.py
    localparam [27:0] PARTS = {7'h21, 7'h20, 7'h3F, 7'h3D};

    engine_words u_words (
        .kind,
        .word(address[5:0]),
        .places,
        .of_engine,
        .wide,
        .has_sign,
        .gain,
        .push(queues),
        .segment,
        .filter_address,
        .filter_value
    );

    wire        built = {1'b0, filter_at[4:3]} + 3'd1 <= 3'(FILTERS);
    wire        there = filter_value ? built : of_engine;
    wire [ 7:0] streamed_axes = 8'(streamed);
    wire        take = stores && of_axis && there && !(segment && streamed_axes[axis]);
    // 65536 is the largest fraction of the feed override; nothing else has bit 16 and these places
    wire        largest = places == 5'd8 && value[16];
    wire [15:0] fraction = largest ? '0 : value[15:0];

    wire        scaled = scales && left == 5'd1;
    wire        written = !scales && !setting_write && !setting_waits;

    assign hold  = scales || setting_write || setting_waits || pushes || !ready;
    assign settled = !(hold || |{push, pending, moves, moved});
    assign waits = !settled || piece_valid;
    assign piece_taken = piece_valid && offered == '1 && settled && !stores;

    always_ff @(posedge clk) begin
        scales        <= take ? !wide : scales && !scaled;
        setting_write <= take ? wide : scaled || piece_taken;
        offered       <= piece_taken ? '0 : {offered[0], 1'b1} & {2{piece_valid}};
        gains_changed <= '0;
        push          <= '0;
        if (written) pushes <= 1'b0;
        if (stores && of_axis && filter_address) filter_at <= value[4:0];
        if (scales) begin
            left    <= left - 1'b1;
            setting <= {{2{fill}}, setting[63:2]};
        end else if (take) begin
            pushes         <= queues;
            of_gain        <= gain;
            setting_axis   <= axis;
            setting_word   <= filter_value ? {4'hA, filter_at[2:0]} : {1'b0, address[5:0] ^ 6'h10};
            setting_filter <= filter_at[4:3];
            left           <= places;
            fill           <= has_sign && value[31];
            setting        <= {value[31:16], fraction, wide ? value_low : 32'd0};
        end else if (piece_taken) begin
            pushes         <= piece_part == 2'd3;
            of_gain        <= 1'b0;
            setting_axis   <= piece_axis;
            setting_word   <= PARTS[7*piece_part+:7];
            setting        <= piece_word;
        end
        for (int n = 0; n < AXES; n++) begin
            if (scaled && of_gain && setting_axis == 3'(n)) gains_changed[n] <= 1'b1;
            if (written && pushes && setting_axis == 3'(n)) push[n] <= 1'b1;
            if (moved[n]) shift_by <= moved_by[48*n+:48];
        end
        if (rst) begin
            {scales, setting_write, pushes, gains_changed, push, offered} <= '0;
            filter_at <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    logic owed = 1'b0;  // a segment was given and is not pushed
    logic [2:0] owed_axis, given_axis;
    wire ends = (take && queues) || (piece_taken && piece_part == 2'd3);
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (piece_valid) assume ({1'b0, piece_axis} < 4'(AXES));
        // the memory stores nothing while hold is high; the engine waits from setting_write on
        if (hold) assume (!stores);
        if (past && $past(setting_write) && !$past(rst))
            assume (setting_waits);
            else if (past && !$past(setting_waits)) assume (!setting_waits);
        owed <= !rst && (ends || (owed && push == '0));
        if (ends) owed_axis <= take ? axis : piece_axis;
        if (take || piece_taken) given_axis <= take ? axis : piece_axis;
        if (take && segment) assert (!streamed_axes[axis]);
        if (piece_taken) assert (settled && waits && !stores && !take && !scales && !pushes);
        if (past) begin
            assert (scales == ($past(take ? !wide : scales && left != 5'd1) && !$past(rst)));
            assert (setting_write == ($past(
                take ? wide : piece_taken || (scales && left == 5'd1)
            ) && !$past(
                rst
            )));
            if ($past(piece_taken && !rst)) assert (setting == $past(piece_word));
            if (scales) assert (left >= 5'd1 && left <= 5'd16 && !setting_write && !setting_waits);
            if (scales || setting_write) assert (hold && waits && setting_axis == given_axis);
            if (pushes) assert (setting_axis == owed_axis && !push[owed_axis[$clog2(AXES)-1:0]]);
            if (owed || pushes) assert ({1'b0, owed_axis} < 4'(AXES));
            if (owed)
                assert (waits && (pushes || push == (AXES'(1) << owed_axis)));
                else assert (!pushes && push == '0);
            assert ((push & (push - 1'b1)) == '0);
            if (push != '0) assert (!$past(setting_waits) && !$past(setting_write));
            cover (push != '0 && $past(setting_waits, 2));
            cover (push != '0 && $past(piece_taken, 4));
        end
    end
`endif
endmodule

`default_nettype wire
