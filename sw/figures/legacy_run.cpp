// SPDX-License-Identifier: Apache-2.0
// Sends samples through the Verilated legacy_bench, one in 30 clk. The file named first holds
// numbers: largest_move limit_counts, sin_offset cos_offset gain quadrature_error, the 256 points
// of the table, then sin cos of each sample. Prints for each sample the count of the printed path
// and the position of the corrected one.
#include "Vtop.h"
#include <cstdio>

int main(int, char** words) {
    constexpr int POINTS = 256, APART = 30, LAST = 60;
    std::FILE* file = std::fopen(words[1], "r");
    auto number = [&](int& value) { return std::fscanf(file, "%d", &value) == 1; };
    auto next = [&] {
        int value = 0;
        number(value);
        return value;
    };
    Vtop top;
    auto clk = [&] {
        top.clk = 1;
        top.eval();
        top.clk = 0;
        top.eval();
    };
    top.rst = 1, clk(), clk(), top.rst = 0;
    top.largest_move = next(), top.limit_counts = next();
    top.sin_offset = next(), top.cos_offset = next(), top.gain = next(),
    top.quadrature_error = next() & 0x1FFFF;
    top.load = 1, clk(), top.load = 0;
    for (int point = 0; point < POINTS; point++)
        top.write = 1, top.point = point, top.value = next() & 0x3FFFF, clk();
    top.write = 0, top.swap = 1, clk(), top.swap = 0;

    long count = 0, position = 0, counts = 0, positions = 0;
    for (int sin, cos; number(sin) && number(cos);) {
        top.sin = sin, top.cos = cos, top.valid = 1;
        for (int n = 0; n < LAST && (n < APART || counts != positions); n++) {
            clk(), top.valid = 0;
            if (top.legacy_done) count = int32_t(top.legacy_count), counts++;
            if (top.done) position = int64_t(top.position << 16) >> 16, positions++;
        }
        std::printf("%ld %ld\n", count, position);
        if (counts != positions) return 1;
    }
}
