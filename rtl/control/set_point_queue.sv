// SPDX-License-Identifier: Apache-2.0
// set_point_queue -- hold the set-points of all axes from their registers until they are played,
// and the limits of their streams.
//
// latency   1 cycle from stores to the settings, to dropped and to waiting, and from read_word to
//           stored
// rate      one word every 2 cycles; four commits, of which one is being written
// behaviour The player takes every word from what the register memory stores. A commit closes the
//           set-points that were written since the one before: they wait together, for one tick. A
//           set-point is complete if its position and its velocity were both written; nothing of an
//           earlier one is used again. While three commits wait, a further one is dropped.
// source    the registers of streamed set-points in tables/registers.rdl
// model     tb/control/set_point_queue.py, equal in every bit of every cycle
// proved    A commit is dropped if and only if three wait. A set-point that is complete has its
//           position and velocity of its own. The oldest commit stays as it is until it is taken.
// proof     depth 9, AXES = 2
`default_nettype none

module set_point_queue #(
    parameter int AXES = 1  // axes of the node, 1 to 8
) (
    input  wire             clk,
    input  wire             rst,
    // register memory
    input  wire             stores,        // strobe: a word is stored
    input  wire  [    13:0] stored_at,     // word of the register map
    input  wire  [    31:0] stored_value,  // bits of its settings, sign-extended
    input  wire  [    31:0] wdata_low,     // low word of a value of 64 bits
    // settings
    output logic [    15:0] late_limit,    // ticks, longest extrapolation
    output logic [AXES-1:0] allowed,       // levels: the axis is to follow set-points
    // commits
    output logic [     1:0] waiting,       // commits that wait
    output logic [    31:0] tick,          // tick count of the oldest one
    output logic [AXES-1:0] axes,          // levels: its axes
    output logic [AXES-1:0] complete,      // levels: axes whose set-point is complete
    input  wire             taken,         // strobe: the oldest commit is done
    output logic [AXES-1:0] dropped,       // strobes: a set-point of a commit that found no room
    // words
    input  wire  [     2:0] read_axis,     // number of an axis
    input  wire  [     2:0] read_word,     // 0 position, 1 velocity, of the oldest commit; limits
    output logic [    47:0] stored         // that word: 4 low, 5 high, 6 velocity, 7 acceleration
);
    if (AXES < 1 || AXES > 8) begin : g_check
        AXES_MUST_BE_FROM_1_TO_8 u_error ();
    end

    // words of the blocks, as in tables/registers.rdl
    localparam [5:0] TICK = 6'h10, COMMIT = 6'h11, LATE_LIMIT = 6'h13, STREAM_AXES = 6'h15;
    localparam [5:0] VELOCITY_LIMIT = 6'h1D, POSITION = 6'h39, TRAVEL_LOW = 6'h3B;
    localparam [5:0] TRAVEL_HIGH = 6'h3D, VELOCITY = 6'h3E, ACCELERATION_LIMIT = 6'h3F;
    localparam [1:0] MOST = 2'd3;  // commits that wait

    wire  [7:0] block = stored_at[13:6];
    wire  [5:0] word = stored_at[5:0];
    wire        of_node = stores && block == 8'd0;
    wire  [2:0] axis = {block[3], block[1:0]};  // of the blocks 4 to 11
    wire        built = {1'b0, axis} < 4'(AXES);
    wire        of_axis = stores && block[7:4] == 4'd0 && (block[3] ^ block[2]) && built;

    logic [1:0] oldest;
    logic [AXES-1:0] has_position, has_velocity;  // written since the last commit
    logic [    31:0] next_tick;
    wire  [     1:0] filled = oldest + waiting;  // slot that is being written
    wire  [AXES-1:0] named = stored_value[AXES-1:0];
    wire             commit = of_node && word == COMMIT && named != '0;
    wire             queued = commit && waiting != MOST;

    // where a word is stored: set-points by slot and axis, limits by axis
    logic [     2:0] place;
    logic            keeps;
    wire             limit = place[2];
    always_comb begin
        keeps = of_axis;
        place = 3'd0;
        case (word)
            POSITION:           place = 3'd0;
            VELOCITY:           place = 3'd1;
            TRAVEL_LOW:         place = 3'd4;
            TRAVEL_HIGH:        place = 3'd5;
            VELOCITY_LIMIT:     place = 3'd6;
            ACCELERATION_LIMIT: place = 3'd7;
            default:            keeps = 1'b0;
        endcase
    end
    wire wide = word == POSITION || word == TRAVEL_LOW || word == TRAVEL_HIGH;
    wire [47:0] value = wide ? {stored_value[15:0], wdata_low}
        : {{16{stored_value[31] && word == VELOCITY}}, stored_value};
    wire [6:0] at = limit ? {2'b10, axis, place[1:0]} : {1'b0, filled, axis, place[0]};
    wire [6:0] read_at = read_word[2] ? {2'b10, read_axis, read_word[1:0]}
        : {1'b0, oldest, read_axis, read_word[0]};

    logic [47:0] words[0:127];
    always_ff @(posedge clk) begin
        if (keeps) words[at] <= value;
        stored <= words[read_at];
    end

    (* ram_style = "distributed" *) logic [31+2*AXES:0] commits[0:3];
    always_ff @(posedge clk)
        if (queued)
            commits[filled] <= {next_tick, named & has_position & has_velocity, named};
    assign {tick, complete, axes} = commits[oldest];

    always_ff @(posedge clk) begin
        if (of_node && word == TICK) next_tick <= stored_value;
        if (of_node && word == LATE_LIMIT) late_limit <= stored_value[15:0];
        if (of_node && word == STREAM_AXES) allowed <= named;
        for (int n = 0; n < AXES; n++)
        if (keeps && axis == 3'(n)) begin
            if (word == POSITION) has_position[n] <= 1'b1;
            if (word == VELOCITY) has_velocity[n] <= 1'b1;
        end
        if (commit) {has_position, has_velocity} <= '0;
        dropped <= commit && !queued ? named : '0;
        waiting <= waiting + 2'(queued) - 2'(taken);
        if (taken) oldest <= oldest + 1'b1;
        if (rst) begin
            {late_limit, allowed, next_tick} <= '0;
            {waiting, oldest, dropped, has_position, has_velocity} <= '0;
        end
    end

`ifdef FORMAL
    logic past = 1'b0;
    always @(posedge clk) begin
        past <= 1'b1;
        if (!past) assume (rst);
        if (taken) assume (waiting != '0);
        if (past && !$past(rst)) begin
            assert ((dropped != '0) == $past(commit && waiting == MOST));
            if ($past(waiting) != '0 && !$past(taken)) begin
                assert (oldest == $past(oldest) && waiting >= $past(waiting));
                assert ($stable(tick) && $stable(axes) && $stable(complete));
            end
            if ($past(commit && waiting == 0))
                assert (complete == $past(named & has_position & has_velocity));
            if ($past(commit)) assert (has_position == '0 && has_velocity == '0);
            for (int n = 0; n < AXES; n++)
            if (has_position[n] && !$past(has_position[n]))
                assert ($past(keeps && word == POSITION && axis == 3'(n)));
        end
        cover (past && waiting == MOST && complete != '0);
        cover (past && dropped != '0);
    end
`endif
endmodule

`default_nettype wire
