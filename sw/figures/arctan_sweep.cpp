// SPDX-License-Identifier: Apache-2.0
// arctan_sweep -- send every pair of W-bit samples through the Verilated arctan_pipelined, one per
// cycle.
//
//   arctan_sweep W RADIUS    judges the pairs from this radius on, a share of full scale
//
// Prints how many were judged, the largest error of the phase in LSB, how many are not correctly
// rounded, and the largest error of the amplitude in counts.
#include "Vtop.h"
#include <cmath>
#include <cstdio>
#include <cstdlib>

int main(int, char** words) {
    const int bits = atoi(words[1]), full = 1 << (bits - 1), mask = 2 * full - 1;
    const double radius = atof(words[2]) * full;
    const long pairs = 1L << (2 * bits);
    const long double lsb = 65536 / (2 * std::acos(-1.0L));
    Vtop top;
    auto clk = [&] {
        top.clk = 1;
        top.eval();
        top.clk = 0;
        top.eval();
    };
    top.rst = 1, top.clk = 0, top.eval(), clk(), clk(), top.rst = 0;

    long judged = 0, wrong = 0, answer = 0;
    double worst = 0, worst_amplitude = 0;
    for (long sent = 0; answer < pairs && sent < pairs + 100; sent++) {
        top.valid = sent < pairs;
        top.sin = (sent / (2 * full) - full) & mask, top.cos = (sent % (2 * full) - full) & mask;
        clk();
        if (!top.done) continue;
        const int sin = answer / (2 * full) - full, cos = answer % (2 * full) - full;
        answer++;
        const double length = std::hypot(double(sin), double(cos));
        if (length < radius || length == 0) continue;
        // up to 10 bits no sample is closer to a tie than 2e-5; a double is wrong by 1e-11
        const double angle = double(std::atan2((long double)sin, (long double)cos) * lsb);
        const double error = std::fabs(std::remainder(top.phase - angle, 65536.0));
        judged++, wrong += error > 0.5, worst = std::fmax(worst, error);
        worst_amplitude = std::fmax(worst_amplitude, std::fabs(top.amplitude - length));
    }
    if (answer != pairs) return 1;
    printf("%ld %.9f %ld %.3f\n", judged, worst, wrong, worst_amplitude);
}
