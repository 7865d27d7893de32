// SPDX-License-Identifier: Apache-2.0
// engine_words -- translate a word of the register map into the word of motion_engine that it sets.
//
// latency   0 cycles, combinational
// rate      one word per cycle
// source    tables/registers.rdl; tables/engine_microcode.py
// model     tb/control/engine_words.py, equal for every word
// made      by tables/engine_words.py, not to be edited
`default_nettype none

module engine_words (
    input wire [1:0] kind,  // number of the kind of block: 0 axis, 1 feedback channel, 2 actuator
    input wire [5:0] word,  // word of the block
    output logic [6:0] number,  // number of the engine's word
    output logic [2:0] scale,  // number of the shift to the left: 0, 2, 8, 16, 24 bits
    output logic of_engine,  // level: the engine has this word
    output logic wide,  // level: it is the high word of a value of 64 bits
    output logic has_sign,  // level: its value is signed
    output logic gain,  // level: it is a gain of the servo
    output logic push,  // level: a write of it queues the segment
    output logic filter_address,  // level: it is the number of a value of a filter
    output logic filter_value  // level: it is the value of a filter
);
    wire [7:0] entry = {kind, word};

    always_comb begin
        case (entry)
            8'h08: number = 7'h31;  // following_limit
            8'h1C: number = 7'h2E;  // integral_limit
            8'h20: number = 7'h28;  // kp
            8'h21: number = 7'h29;  // ki
            8'h22: number = 7'h2A;  // kd
            8'h23: number = 7'h2B;  // kv
            8'h24: number = 7'h2C;  // ka
            8'h25: number = 7'h2D;  // output_limit
            8'h26: number = 7'h2F;  // dead_band
            8'h29: number = 7'h30;  // open_command
            8'h2D: number = 7'h36;  // segment_velocity
            8'h2F: number = 7'h37;  // segment_acceleration
            8'h30: number = 7'h38;  // segment_jerk
            8'h31: number = 7'h39;  // segment_ticks
            8'h32: number = 7'h0C;  // stop_deceleration
            8'h33: number = 7'h0D;  // stop_jerk
            8'h34: number = 7'h27;  // override
            8'h35: number = 7'h04;  // override_slope
            8'h36: number = 7'h05;  // override_curve
            8'h37: number = 7'h35;  // start_at
            8'h67: number = 7'h34;  // quantum
            8'h85: number = 7'h33;  // trim_scale
            8'h87: number = 7'h32;  // step_ratio
            default: number = '0;
        endcase
        case (entry)
            8'h2B: scale = 3'd1;  // 2 bits
            8'h24, 8'h32: scale = 3'd2;  // 8 bits
            8'h25, 8'h34: scale = 3'd3;  // 16 bits
            8'h1C: scale = 3'd4;  // 24 bits
            default: scale = '0;
        endcase
        {of_engine, wide, has_sign, gain, push, filter_address, filter_value} = '0;
        case (entry)
            8'h08, 8'h1C, 8'h20, 8'h21, 8'h22, 8'h23, 8'h24, 8'h25, 8'h26, 8'h29, 8'h2B, 8'h2D,
                8'h2F, 8'h30, 8'h31, 8'h32, 8'h33, 8'h34, 8'h35, 8'h36, 8'h37, 8'h67, 8'h85, 8'h87:
                of_engine = 1'b1;
            default: ;
        endcase
        case (entry)
            8'h2D, 8'h2F, 8'h87: wide = 1'b1;
            default: ;
        endcase
        case (entry)
            8'h29, 8'h2B, 8'h2D, 8'h2F, 8'h30, 8'h87: has_sign = 1'b1;
            default: ;
        endcase
        case (entry)
            8'h20, 8'h22, 8'h23, 8'h24: gain = 1'b1;
            default: ;
        endcase
        case (entry)
            8'h31: push = 1'b1;
            default: ;
        endcase
        case (entry)
            8'h2A: filter_address = 1'b1;
            default: ;
        endcase
        case (entry)
            8'h2B: filter_value = 1'b1;
            default: ;
        endcase
    end
endmodule

`default_nettype wire
