// SPDX-License-Identifier: Apache-2.0
// arctan_quotient_rom -- the arctangent of 0 to 1 as 32 parabolas; made by
// tables/arctan_quotient.py, not to be edited.
//
// latency  0 cycles from index to its outputs: a table without a register
// rate     one parabola per cycle
// source   the Taylor series about the middle of each part, with its cubic term replaced by a line
// model    PARABOLAS of tables/arctan_quotient.py
`default_nettype none

module arctan_quotient_rom (
    input  wire  [ 4:0] index,  // 1/32 of the quotient
    output logic [18:0] base,   // 1/64 LSB of phase, rounding included
    output logic [15:0] slope,  // 1/4 LSB of phase for a quotient of 1
    output logic [ 7:0] bend    // 16 LSB of phase for a quotient of 1
);
    logic [42:0] parabola;

    assign {base, slope, bend} = parabola;

    always_comb
        case (index)
            5'd0:  parabola = {19'd10462, 16'd41709, 8'd10};
            5'd1:  parabola = {19'd31301, 16'd41628, 8'd30};
            5'd2:  parabola = {19'd52079, 16'd41466, 8'd50};
            5'd3:  parabola = {19'd72756, 16'd41226, 8'd70};
            5'd4:  parabola = {19'd93294, 16'd40910, 8'd88};
            5'd5:  parabola = {19'd113656, 16'd40522, 8'd106};
            5'd6:  parabola = {19'd133807, 16'd40066, 8'd122};
            5'd7:  parabola = {19'd153714, 16'd39547, 8'd137};
            5'd8:  parabola = {19'd173347, 16'd38970, 8'd151};
            5'd9:  parabola = {19'd192677, 16'd38341, 8'd163};
            5'd10: parabola = {19'd211681, 16'd37665, 8'd174};
            5'd11: parabola = {19'd230337, 16'd36948, 8'd184};
            5'd12: parabola = {19'd248625, 16'd36197, 8'd192};
            5'd13: parabola = {19'd266530, 16'd35417, 8'd198};
            5'd14: parabola = {19'd284039, 16'd34614, 8'd203};
            5'd15: parabola = {19'd301141, 16'd33793, 8'd207};
            5'd16: parabola = {19'd317830, 16'd32959, 8'd210};
            5'd17: parabola = {19'd334099, 16'd32116, 8'd211};
            5'd18: parabola = {19'd349946, 16'd31270, 8'd212};
            5'd19: parabola = {19'd365369, 16'd30424, 8'd211};
            5'd20: parabola = {19'd380370, 16'd29582, 8'd210};
            5'd21: parabola = {19'd394951, 16'd28746, 8'd208};
            5'd22: parabola = {19'd409117, 16'd27919, 8'd205};
            5'd23: parabola = {19'd422872, 16'd27105, 8'd202};
            5'd24: parabola = {19'd436223, 16'd26304, 8'd198};
            5'd25: parabola = {19'd449178, 16'd25518, 8'd194};
            5'd26: parabola = {19'd461744, 16'd24749, 8'd190};
            5'd27: parabola = {19'd473930, 16'd23999, 8'd185};
            5'd28: parabola = {19'd485745, 16'd23267, 8'd181};
            5'd29: parabola = {19'd497199, 16'd22555, 8'd176};
            5'd30: parabola = {19'd508303, 16'd21862, 8'd171};
            default: parabola = {19'd519064, 16'd21190, 8'd166};
        endcase
endmodule

`default_nettype wire
