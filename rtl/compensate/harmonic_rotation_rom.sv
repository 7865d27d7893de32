// SPDX-License-Identifier: Apache-2.0
// harmonic_rotation_rom -- look up the angle of each rotation of harmonic_map.
//
// latency   0 cycles: combinational
// source    Rotation n turns by atan(2^-n), rounded to 2^-32 turn.
// model     angles() of tables/harmonic_rotation.py
// made      by tables/harmonic_rotation.py, not to be edited
`default_nettype none

module harmonic_rotation_rom (
    input  wire  [ 4:0] rotation,  // number of the rotation, 0 to 23
    output logic [31:0] angle      // 2^-32 turn
);
    always_comb begin
        case (rotation)
            5'd0: angle = 32'd536870912;
            5'd1: angle = 32'd316933406;
            5'd2: angle = 32'd167458907;
            5'd3: angle = 32'd85004756;
            5'd4: angle = 32'd42667331;
            5'd5: angle = 32'd21354465;
            5'd6: angle = 32'd10679838;
            5'd7: angle = 32'd5340245;
            5'd8: angle = 32'd2670163;
            5'd9: angle = 32'd1335087;
            5'd10: angle = 32'd667544;
            5'd11: angle = 32'd333772;
            5'd12: angle = 32'd166886;
            5'd13: angle = 32'd83443;
            5'd14: angle = 32'd41722;
            5'd15: angle = 32'd20861;
            5'd16: angle = 32'd10430;
            5'd17: angle = 32'd5215;
            5'd18: angle = 32'd2608;
            5'd19: angle = 32'd1304;
            5'd20: angle = 32'd652;
            5'd21: angle = 32'd326;
            5'd22: angle = 32'd163;
            default: angle = 32'd81;
        endcase
    end
endmodule

`default_nettype wire
