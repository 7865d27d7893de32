// SPDX-License-Identifier: Apache-2.0
// register_layout -- find the place of a word of the register map in the register memory, and the
// bits that a write of the word stores there.
//
// latency  0 cycles: combinational
// rate     one word per cycle
// behaviour A word without a setting is stored as 0. An address without a block is in the last 64
//          words of the memory, where all values are 0.
// source   tables/registers.rdl
// model    tb/registers/register_layout.py, equal for every word
// made     by tables/registers.py, not to be edited
`default_nettype none

module register_layout #(
    parameter int AXES = 1,  // axes of the node, 1 to 8
    parameter int FILTERS = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_BACKLASH = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_BRIDGE = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_COMPARE = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_DAC = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_DRIVE = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_ENCODER_CHECK = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_FINE_STAGE = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_HARMONICS = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_MONITOR = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_RECORDER = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_SET_POINTS = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_SINE = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_STEPPER = 255,  // bit n: axis n has it, else its settings are 0
    parameter int HAS_VELOCITY = 255,  // bit n: axis n has it, else its settings are 0
    localparam int PLACES = $clog2(3 + 3 * AXES)  // bits of the number of a block
) (
    input wire [13:0] address,  // word of the register map
    input wire [31:0] wdata,  // value to write
    output logic [PLACES+5:0] place,  // word of the register memory
    output logic [31:0] stored_bits,  // what the write stores: bits of settings, sign-extended
    output logic [31:0] first,  // value after reset
    output logic low,  // level: low word of a setting of 64 bits; it waits for the high word
    output logic high  // level: high word of such a setting; both words are stored
);
    if (AXES < 1 || AXES > 8) begin : g_check
        AXES_MUST_BE_FROM_1_TO_8 u_error ();
    end

    wire [7:0] block = address[13:6];
    wire [5:0] word = address[5:0];
    logic [2:0] kind, axis;
    wire  [       8:0] entry = {kind, word};
    logic [      31:0] mask;
    logic              sign;
    logic [PLACES-1:0] slot;
    wire               filters = 1'(FILTERS >> axis);
    wire               has_backlash = 1'(HAS_BACKLASH >> axis);
    wire               has_bridge = 1'(HAS_BRIDGE >> axis);
    wire               has_compare = 1'(HAS_COMPARE >> axis);
    wire               has_dac = 1'(HAS_DAC >> axis);
    wire               has_drive = 1'(HAS_DRIVE >> axis);
    wire               has_encoder_check = 1'(HAS_ENCODER_CHECK >> axis);
    wire               has_fine_stage = 1'(HAS_FINE_STAGE >> axis);
    wire               has_harmonics = 1'(HAS_HARMONICS >> axis);
    wire               has_monitor = 1'(HAS_MONITOR >> axis);
    wire               has_recorder = 1'(HAS_RECORDER >> axis);
    wire               has_set_points = 1'(HAS_SET_POINTS >> axis);
    wire               has_sine = 1'(HAS_SINE >> axis);
    wire               has_stepper = 1'(HAS_STEPPER >> axis);
    wire               has_velocity = 1'(HAS_VELOCITY >> axis);

    always_comb begin
        kind = 3'd7;
        axis = 3'd0;
        slot = '1;
        if (block == 8'h00) begin
            kind = 3'd0;  // node
            slot = PLACES'(0);
        end
        if (block == 8'h01) begin
            kind = 3'd1;  // bus
            slot = PLACES'(1);
        end
        if (block == 8'h02) begin
            kind = 3'd2;  // peripherals
            slot = PLACES'(2);
        end
        for (int n = 0; n < AXES; n++) begin
            if (block == 8'(4 + n)) begin
                kind = 3'd3;  // axis
                axis = 3'(n);
                slot = PLACES'(3 + 3 * n);
            end
            if (block == 8'(12 + n)) begin
                kind = 3'd4;  // feedback
                axis = 3'(n);
                slot = PLACES'(4 + 3 * n);
            end
            if (block == 8'(20 + n)) begin
                kind = 3'd5;  // actuator
                axis = 3'(n);
                slot = PLACES'(5 + 3 * n);
            end
        end
    end

    assign place = {slot, word};
    assign stored_bits  = (wdata & mask) | ({32{sign}} & ~mask);

    always_comb begin
        case (entry)
            9'h0EC, 9'h0EE, 9'h0F8, 9'h0FA, 9'h0FC, 9'h11E, 9'h120, 9'h12E, 9'h130, 9'h146: low =
                1'b1;
            default: low = 1'b0;
        endcase
        case (entry)
            9'h0ED, 9'h0EF: high = has_drive;
            9'h0F9, 9'h0FB, 9'h0FD: high = has_set_points;
            9'h11F, 9'h121: high = has_compare;
            9'h147: high = has_stepper;
            default: high = 1'b0;
        endcase
        case (entry)
            9'h006, 9'h090: mask = 32'h00FFFFFF;
            9'h007, 9'h013, 9'h04C, 9'h084, 9'h099: mask = 32'h0000FFFF;
            9'h010, 9'h014, 9'h01D, 9'h01E, 9'h01F, 9'h020, 9'h021, 9'h091, 9'h0CF: mask =
                32'hFFFFFFFF;
            9'h011, 9'h015, 9'h050, 9'h102: mask = 32'h000000FF;
            9'h018: mask = 32'h7FFFFFFF;
            9'h01C: mask = 32'h070F0707;
            9'h040, 9'h08A, 9'h08F, 9'h100: mask = 32'h000FFFFF;
            9'h0C0: mask = (has_drive ? 32'h0000003F : 32'd0);
            9'h0C8, 9'h0ED, 9'h0EF, 9'h0F0, 9'h0F2, 9'h0F3, 9'h0F5, 9'h0F6, 9'h0F7: mask =
                (has_drive ? 32'hFFFFFFFF : 32'd0);
            9'h0C9: mask = 32'h00FFFF1F;
            9'h0D1: mask = 32'h0000003F | (has_sine ? 32'hFFFF0000 : 32'd0);
            9'h0D2, 9'h113, 9'h114, 9'h116, 9'h117: mask = (has_monitor ? 32'hFFFFFFFF : 32'd0);
            9'h0D3: mask = (has_sine ? 32'h000FFFFF : 32'd0);
            9'h0D8: mask = 32'h0000003F;
            9'h0DC, 9'h0E5: mask = (has_drive ? 32'h00007FFF : 32'd0);
            9'h0DD: mask = (has_set_points ? 32'h7FFFFFFF : 32'd0);
            9'h0E0, 9'h0E1, 9'h0E2, 9'h0E3, 9'h0E4: mask = (has_drive ? 32'h00FFFFFF : 32'd0);
            9'h0E6, 9'h0E9: mask = (has_drive ? 32'h0000FFFF : 32'd0);
            9'h0EA: mask = (filters ? 32'h0000001F : 32'd0);
            9'h0EB: mask = (filters ? 32'hFFFFFFFF : 32'd0);
            9'h0F1: mask = (has_drive ? 32'h01FFFFFF : 32'd0);
            9'h0F4: mask = (has_drive ? 32'h0001FFFF : 32'd0);
            9'h0F9, 9'h0FB, 9'h0FD: mask = (has_set_points ? 32'h0000FFFF : 32'd0);
            9'h0FE, 9'h0FF: mask = (has_set_points ? 32'hFFFFFFFF : 32'd0);
            9'h101, 9'h12A, 9'h140: mask = 32'h00000003;
            9'h103: mask = (has_encoder_check ? 32'hFFFFFFFF : 32'd0);
            9'h108: mask = (has_sine ? 32'hFFFFFFFF : 32'd0);
            9'h109, 9'h10A: mask = (has_sine ? 32'h0001FFFF : 32'd0);
            9'h10B: mask = (has_harmonics ? 32'h00000001 : 32'd0);
            9'h10C: mask = (has_harmonics ? 32'h03FFFFFF : 32'd0);
            9'h10D: mask = (has_recorder ? 32'h0001FFFF : 32'd0);
            9'h112: mask = (has_monitor ? 32'h00007FFF : 32'd0);
            9'h115: mask = (has_monitor ? 32'h00FFFFFF : 32'd0);
            9'h118: mask = 32'h0000007F;
            9'h11F, 9'h121: mask = (has_compare ? 32'h0000FFFF : 32'd0);
            9'h122: mask = (has_compare ? 32'hFFFFFFFF : 32'd0);
            9'h123, 9'h124: mask = (has_compare ? 32'h00FFFFFF : 32'd0);
            9'h127: mask = (has_velocity ? 32'h0000FFFF : 32'd0);
            9'h12B: mask = 32'h00000007;
            9'h136: mask = (has_backlash ? 32'h00FFFFFF : 32'd0);
            9'h137: mask = (has_backlash ? 32'hFFFFFFFF : 32'd0);
            9'h141: mask = (has_bridge ? 32'h0000FFFF : 32'd0);
            9'h142, 9'h143: mask = (has_stepper ? 32'h0FFFFFFF : 32'd0);
            9'h144: mask = (has_stepper ? 32'h0000000F : 32'd0);
            9'h145, 9'h147: mask = (has_stepper ? 32'h0000FFFF : 32'd0);
            9'h149: mask = (has_dac ? 32'h00FFFFFF : 32'd0);
            9'h14A: mask = (has_dac ? 32'h0000FFFF : 32'd0);
            9'h14C, 9'h14D, 9'h150: mask = (has_fine_stage ? 32'h00FFFFFF : 32'd0);
            9'h14E: mask = (has_fine_stage ? 32'h00007FFF : 32'd0);
            default: mask = '0;
        endcase
        case (entry)
            9'h0E9: sign = has_drive && wdata[15];
            9'h0F9, 9'h0FB, 9'h0FD: sign = has_set_points && wdata[15];
            9'h10A: sign = has_sine && wdata[16];
            9'h11F, 9'h121: sign = has_compare && wdata[15];
            9'h12B: sign = wdata[2];
            9'h147: sign = has_stepper && wdata[15];
            9'h14A: sign = has_dac && wdata[15];
            default: sign = '0;
        endcase
        case (entry)
            9'h01F: first = 32'h00010001;
            9'h040, 9'h08A, 9'h08F: first = 32'h0000022B;
            9'h04C: first = 32'h000003E8;
            9'h084: first = 32'h0000012C;
            9'h090: first = 32'h00FFFFFF;
            9'h099: first = 32'h0000000A;
            9'h0D1: first = 32'h00000010 | (has_sine ? 32'h03000000 : 32'd0);
            9'h0D2: first = (has_monitor ? 32'hFFFF0000 : 32'd0);
            9'h0F2: first = (has_drive ? 32'hFFFFFFFF : 32'd0);
            9'h0F4: first = (has_drive ? 32'h00010000 : 32'd0);
            9'h102: first = 32'h00000060;
            9'h109: first = (has_sine ? 32'h00010000 : 32'd0);
            9'h10B: first = (has_harmonics ? 32'h00000001 : 32'd0);
            9'h10D: first = (has_recorder ? 32'h00000001 : 32'd0);
            9'h113, 9'h116, 9'h117: first = (has_monitor ? 32'hFFFFFFFF : 32'd0);
            9'h114, 9'h115: first = (has_monitor ? 32'h0000FFFF : 32'd0);
            9'h123, 9'h124: first = (has_compare ? 32'h00000001 : 32'd0);
            9'h142, 9'h143: first = (has_stepper ? 32'h00004001 : 32'd0);
            9'h145: first = (has_stepper ? 32'h00000001 : 32'd0);
            9'h149: first = (has_dac ? 32'h00FFFF01 : 32'd0);
            default: first = '0;
        endcase
    end
endmodule

`default_nettype wire
