// SPDX-License-Identifier: Apache-2.0
// engine_bus -- pass what is written to the register map to motion_engine, and let the soft core
// wait while a setting or a request is not done yet.
//
// latency   1 cycle from stores to setting_write and gains_changed; push when its setting is
//           written
// rate      one word, then the next one when hold and waits are low
// behaviour A word that is not of the engine, or of an axis or a filter that is not built, is left
//           out. gains_changed comes before the gain is written, so that no tick uses a gain
//           without it. waits is high while anything that was requested of the engine is not done
//           and shown: the registers always show the state after all requests, in their order. Only
//           one shift of an origin at a time waits, so there is one shift_by for all axes.
// source    engine_words: which register is which word
// model     tb/control/engine_bus.py, equal in every bit of every cycle
// proved    A word of the engine gives one setting, with hold high until it is written, and a
//           segment one push after that.
// proof     depth 8, AXES = 2, FILTERS = 1
`default_nettype none

module engine_bus #(
    parameter int AXES    = 1,  // axes of the node, 1 to 8
    parameter int FILTERS = 0   // filters of each servo, 0 to 4
) (
    input  wire                       clk,
    input  wire                       rst,
    // register memory
    input  wire                       stores,          // strobe: a word is stored
    input  wire         [       13:0] address,         // word of the register map
    input  wire         [       31:0] value,           // bits of its settings, sign-extended
    input  wire         [       31:0] value_low,       // low word of a value of 64 bits
    output logic                      hold,            // level: no first value may be stored
    output logic                      waits,           // level: the soft core must wait
    // settings
    input  wire                       ready,           // level: the engine takes settings
    input  wire                       setting_waits,   // level: the engine has not written it yet
    output logic                      setting_write,   // strobe: write a setting
    output logic        [        2:0] setting_axis,    // number of its axis
    output logic        [        6:0] setting_word,    // number of its word
    output logic        [        1:0] setting_filter,  // number of its filter
    output logic signed [       63:0] setting,         // value
    // requests
    output logic        [   AXES-1:0] gains_changed,   // strobes: a gain is new
    output logic        [   AXES-1:0] push,            // strobes: queue the segment
    input  wire         [   AXES-1:0] pending,         // level: a request is not done and shown
    input  wire         [   AXES-1:0] moves,           // level: position will jump
    input  wire         [   AXES-1:0] moved,           // strobes: position jumps in the next cycle
    input  wire         [48*AXES-1:0] moved_by,        // 2^-16 period, of each axis
    output logic signed [       47:0] shift_by         // 2^-16 period, of the last jump
);
    // of the map: 24 blocks of axes from 0x400 on, eight of each kind
    wire [7:0] block = address[13:6] - 8'd4;
    wire [2:0] axis = block[2:0];
    wire       of_axis = block < 8'd24 && {1'b0, axis} < 4'(AXES);
    wire [6:0] number;
    wire [2:0] scale;
    wire of_engine, wide, has_sign, gain, segment, filter_address, filter_value;
    logic [4:0] filter_at;  // value of a filter that filter_value writes
    logic       pushes;  // the setting ends a segment

    engine_words u_words (
        .kind(block[4:3]),
        .word(address[5:0]),
        .number,
        .scale,
        .of_engine,
        .wide,
        .has_sign,
        .gain,
        .push(segment),
        .filter_address,
        .filter_value
    );

    wire there = filter_value ? FILTERS != 0 && filter_at[4:3] <= 2'(FILTERS - 1) : of_engine;
    wire take = stores && of_axis && there;
    wire [31:0] low = wide ? value_low : value;
    wire [31:0] high = wide ? value : {32{has_sign && value[31]}};
    // 65536 is the largest fraction of the feed override
    wire [15:0] fraction = value[16] ? '0 : value[15:0];

    wire written = !setting_write && !setting_waits;

    assign hold  = setting_write || setting_waits || pushes || !ready;
    assign waits = hold || |{push, pending, moves, moved};

    always_ff @(posedge clk) begin
        setting_write <= take;
        gains_changed <= '0;
        push          <= '0;
        if (written) pushes <= 1'b0;
        if (stores && of_axis && filter_address) filter_at <= value[4:0];
        if (take) begin
            pushes         <= segment;
            setting_axis   <= axis;
            setting_word   <= filter_value ? 7'h50 + {4'd0, filter_at[2:0]} : number;
            setting_filter <= filter_at[4:3];
            case (scale)
                3'd1:    setting <= {high[29:0], low, 2'd0};
                3'd2:    setting <= {high[23:0], low, 8'd0};
                3'd3:    setting <= {31'd0, value[16], fraction, 16'd0};
                3'd4:    setting <= {8'd0, low, 24'd0};
                default: setting <= {high, low};
            endcase
        end
        for (int n = 0; n < AXES; n++) begin
            if (take && gain && axis == 3'(n)) gains_changed[n] <= 1'b1;
            if (written && pushes && setting_axis == 3'(n)) push[n] <= 1'b1;
            if (moved[n]) shift_by <= moved_by[48*n+:48];
        end
        if (rst) begin
            {setting_write, pushes, gains_changed, push} <= '0;
            filter_at <= '0;
        end
    end

`ifdef FORMAL
    logic       past = 1'b0;
    logic       owed = 1'b0;  // a segment was given and is not pushed
    logic [2:0] owed_axis;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        // the memory stores nothing while hold is high; the engine waits from setting_write on
        if (hold) assume (!stores);
        if (past && $past(setting_write) && !$past(rst))
            assume (setting_waits);
            else if (past && !$past(setting_waits)) assume (!setting_waits);
        owed <= !rst && ((take && segment) || (owed && push == '0));
        if (take && segment) owed_axis <= axis;
        if (past) begin
            assert (setting_write == ($past(take) && !$past(rst)));
            if (setting_write) assert (hold && waits && setting_axis == $past(axis));
            if (pushes) assert (setting_axis == owed_axis && !push[owed_axis[$clog2(AXES)-1:0]]);
            if (owed || pushes) assert ({1'b0, owed_axis} < 4'(AXES));
            if (owed)
                assert (waits && (pushes || push == (AXES'(1) << owed_axis)));
                else assert (!pushes && push == '0);
            assert ((push & (push - 1'b1)) == '0);
            if (push != '0) assert (!$past(setting_waits) && !$past(setting_write));
            cover (push != '0 && $past(setting_waits, 2));
        end
    end
`endif
endmodule

`default_nettype wire
