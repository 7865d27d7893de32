// SPDX-License-Identifier: Apache-2.0
// engine_words -- report what motion_engine does with a word of the register map.
//
// latency   0 cycles, combinational
// rate      one word per cycle
// source    tables/registers.rdl
// model     tb/control/engine_words.py, equal for every word
// made      by tables/engine_words.py, not to be edited
`default_nettype none

module engine_words (
    input wire [1:0] kind,  // number of the kind of block: 0 axis, 1 feedback channel, 2 actuator
    input wire [5:0] word,  // word of the block
    output logic [4:0] places,  // pairs of bits: shift to the right from the top of 64 bits
    output logic of_engine,  // level: the engine has this word
    output logic wide,  // level: it is the high word of a value of 64 bits
    output logic has_sign,  // level: its value has 32 bits or less and is signed
    output logic gain,  // level: it is a gain of the servo
    output logic push,  // level: a write of it queues the segment
    output logic segment,  // level: it is a word of the segment
    output logic filter_address,  // level: it is the number of a value of a filter
    output logic filter_value  // level: it is the value of a filter
);
    wire [7:0] entry = {kind, word};

    always_comb begin
        case (entry)
            8'h2D, 8'h2F, 8'h87: places = 5'd0;
            8'h1C: places = 5'd4;
            8'h25, 8'h34: places = 5'd8;
            8'h24, 8'h32: places = 5'd12;
            8'h2B: places = 5'd15;
            default: places = 5'd16;
        endcase
        {of_engine, wide, has_sign, gain, push, segment, filter_address, filter_value} = '0;
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
            8'h29, 8'h2B, 8'h30: has_sign = 1'b1;
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
            8'h2D, 8'h2F, 8'h30, 8'h31: segment = 1'b1;
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
