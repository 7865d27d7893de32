// SPDX-License-Identifier: Apache-2.0
// profile_microcode -- the microcode of profile_player: what it does between two ticks, line by
// line.
//
// latency   1 cycle from next to code
// rate      one line per cycle
// method    A code is target 7 bits, job 5, halved 1, acc 1, sign 2, operand 5, word 5.
// limits    Block memory would answer too late for the adder behind it, so the table is logic.
// model     assembled() of tables/profile_microcode.py
// made      by tables/profile_microcode.py, not to be edited
`default_nettype none

module profile_microcode (
    input  wire         clk,
    input  wire  [ 6:0] next,  // number of the line to be read
    output logic [25:0] code   // code of the line
);
    (* rom_style = "logic" *) logic [25:0] lines[0:127];

    initial begin
        lines[0] = 26'h2465318;  // wait: acc ; wait begin
        lines[1] = 26'h0069078;  // make: acc + step ; make wait
        lines[2] = 26'h06ec118;  // change ; dispatch brake
        lines[3] = 26'h0000738;  // - limit
        lines[4] = 26'h268c638;  // - slope ; positive at_once
        lines[5] = 26'h06081b8;  // rate ; negative distance
        lines[6] = 26'h0000332;  // choose: limit -> increment
        lines[7] = 26'h0001758;  // acc - curve
        lines[8] = 26'h0588758;  // - curve ; negative chosen
        lines[9] = 26'h058c358;  // curve ; positive chosen
        lines[10] = 26'h0001312;  // acc -> increment
        lines[11] = 26'h08481b8;  // chosen: rate ; stopping divide
        lines[12] = 26'h1305773;  // distance: acc - setting -> value ; goto law
        lines[13] = 26'h1344738;  // brake: - limit ; later law
        lines[14] = 26'h3f8c318;  // 0 ; positive stop
        lines[15] = 26'h0304318;  // 0 ; goto choose
        lines[16] = 26'h0054518;  // divide: - change ; set_upward
        lines[17] = 26'h000090e;  // along change -> part
        lines[18] = 26'h002024f;  // increment -> base ; count_31
        lines[19] = 26'h09951ef;  // double: acc + base -> base ; loop double
        lines[20] = 26'h00001d8;  // digit: part
        lines[21] = 26'h00015f8;  // acc - base
        lines[22] = 26'h0c11318;  // acc ; quotient smaller
        lines[23] = 26'h000130e;  // acc -> part
        lines[24] = 26'h00021f8;  // smaller: base >> 1
        lines[25] = 26'h0a1530f;  // acc -> base ; loop digit
        lines[26] = 26'h00001d8;  // part
        lines[27] = 26'h0001658;  // acc - increment
        lines[28] = 26'h3f8c918;  // along change ; positive stop
        lines[29] = 26'h00015d1;  // acc - part -> slope
        lines[30] = 26'h0000310;  // 0 -> area
        lines[31] = 26'h0001210;  // square: acc + area -> area
        lines[32] = 26'h0f99230;  // acc + slope -> area ; multiply square
        lines[33] = 26'h3fcf238;  // acc + slope >> 1 ; wide stop
        lines[34] = 26'h0001310;  // acc -> area
        lines[35] = 26'h0000638;  // - slope
        lines[36] = 26'h13085d8;  // - part ; negative law
        lines[37] = 26'h2108318;  // 0 ; negative move
        lines[38] = 26'h0000638;  // law: - slope
        lines[39] = 26'h1b0c278;  // value ; positive turn
        lines[40] = 26'h0000e6e;  // against value -> part
        lines[41] = 26'h0001618;  // acc - area
        lines[42] = 26'h1f08338;  // limit ; negative fall
        lines[43] = 26'h0001638;  // acc - slope
        lines[44] = 26'h1f081d8;  // part ; negative fall
        lines[45] = 26'h0001618;  // try: acc - area
        lines[46] = 26'h0001638;  // acc - slope
        lines[47] = 26'h0001658;  // acc - increment
        lines[48] = 26'h2108338;  // limit ; negative move
        lines[49] = 26'h0001638;  // acc - slope
        lines[50] = 26'h0001658;  // acc - increment
        lines[51] = 26'h2108238;  // slope ; negative move
        lines[52] = 26'h0001251;  // acc + increment -> slope
        lines[53] = 26'h2105210;  // acc + area -> area ; goto move
        lines[54] = 26'h0054278;  // turn: value ; set_upward
        lines[55] = 26'h2150e6e;  // against value -> part ; arrived move
        lines[56] = 26'h0001658;  // acc - increment
        lines[57] = 26'h168c1d8;  // part ; positive try
        lines[58] = 26'h2140318;  // 0 ; first move
        lines[59] = 26'h3fc81b8;  // rate ; stopping stop
        lines[60] = 26'h000166d;  // acc - value -> rate
        lines[61] = 26'h285c5d8;  // - part ; arrive advance
        lines[62] = 26'h2140218;  // fall: area ; first move
        lines[63] = 26'h0001630;  // acc - slope -> area
        lines[64] = 26'h0000238;  // slope
        lines[65] = 26'h0001651;  // acc - increment -> slope
        lines[66] = 26'h3dc8a28;  // move: along slope -> change ; stopping set
        lines[67] = 26'h00011ad;  // acc + rate -> rate
        lines[68] = 26'h2389798;  // acc - full ; negative below
        lines[69] = 26'h2808318;  // 0 ; negative advance
        lines[70] = 26'h280438d;  // full -> rate ; goto advance
        lines[71] = 26'h280430d;  // below: 0 -> rate ; goto advance
        lines[72] = 26'h0000303;  // begin: 0 -> step
        lines[73] = 26'h0000308;  // 0 -> change
        lines[74] = 26'h0000309;  // 0 -> low
        lines[75] = 26'h000030a;  // 0 -> offset
        lines[76] = 26'h06c830b;  // 0 -> fraction ; stopping brake
        lines[77] = 26'h0000311;  // at_once: 0 -> slope
        lines[78] = 26'h0000310;  // 0 -> area
        lines[79] = 26'h285036d;  // setting -> rate ; arrived advance
        lines[80] = 26'h2f3454f;  // advance: - offset -> base ; ready go_on
        lines[81] = 26'h3f2c318;  // load: 0 ; last ended
        lines[82] = 26'h06b0318;  // 0 ; starved brake
        lines[83] = 26'h0024318;  // 0 ; word
        lines[84] = 26'h00243d8;  // queue_low ; word
        lines[85] = 26'h00253e0;  // acc + queue_high -> velocity ; word
        lines[86] = 26'h00243d8;  // queue_low ; word
        lines[87] = 26'h00253e1;  // acc + queue_high -> acceleration ; word
        lines[88] = 26'h00243d8;  // queue_low ; word
        lines[89] = 26'h00013e2;  // acc + queue_high -> jerk
        lines[90] = 26'h00283ec;  // queue_high -> left ; pop
        lines[91] = 26'h0000598;  // - left
        lines[92] = 26'h288c318;  // 0 ; positive load
        lines[93] = 26'h36bc318;  // 0 ; crossed scale
        lines[94] = 26'h0000178;  // go_on: fraction
        lines[95] = 26'h00011ab;  // acc + rate -> fraction
        lines[96] = 26'h0001798;  // acc - full
        lines[97] = 26'h3689318;  // acc ; negative scale
        lines[98] = 26'h003930b;  // acc -> fraction ; cross
        lines[99] = 26'h00001f8;  // base
        lines[100] = 26'h000100f;  // acc + velocity -> base
        lines[101] = 26'h0000038;  // acceleration
        lines[102] = 26'h0001000;  // acc + velocity -> velocity
        lines[103] = 26'h0000038;  // acceleration
        lines[104] = 26'h0001041;  // acc + jerk -> acceleration
        lines[105] = 26'h0000198;  // left
        lines[106] = 26'h000178c;  // acc - full -> left
        lines[107] = 26'h0000598;  // - left
        lines[108] = 26'h288c318;  // 0 ; positive load
        lines[109] = 26'h0000578;  // scale: - fraction
        lines[110] = 26'h3c0e018;  // velocity >> 1 ; positive known
        lines[111] = 26'h001c178;  // fraction ; factor
        lines[112] = 26'h381b038;  // slope_of: acc + acceleration >> 1 ; multiply slope_of
        lines[113] = 26'h0003318;  // acc >> 1
        lines[114] = 26'h000100e;  // acc + velocity -> part
        lines[115] = 26'h001c178;  // fraction ; factor
        lines[116] = 26'h3a1b1d8;  // mean_of: acc + part >> 1 ; multiply mean_of
        lines[117] = 26'h000130e;  // acc -> part
        lines[118] = 26'h0002018;  // velocity >> 1
        lines[119] = 26'h00011d8;  // acc + part
        lines[120] = 26'h000130a;  // known: acc -> offset
        lines[121] = 26'h00011f8;  // finish: acc + base
        lines[122] = 26'h0001468;  // acc - step -> change
        lines[123] = 26'h0001063;  // set: acc + step -> step
        lines[124] = 26'h0001129;  // acc + low -> low
        lines[125] = 26'h00613b8;  // acc + half ; prepared wait
        lines[126] = 26'h3cd830a;  // ended: 0 -> offset ; end finish
        lines[127] = 26'h3dd8468;  // stop: - step -> change ; end set
        for (int n = 128; n < 128; n++) lines[n] = '0;
    end

    always_ff @(posedge clk) code <= lines[next];
endmodule

`default_nettype wire
