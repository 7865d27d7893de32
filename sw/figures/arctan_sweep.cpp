// SPDX-License-Identifier: Apache-2.0
// Sends every pair of W-bit samples through the Verilated arctan_pipelined, one a clk, and prints,
// of those from a radius on: how many, the largest error of the phase in LSB, how many are not
// correctly rounded, the largest error of the amplitude in counts.
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
        double away = top.phase - double(std::atan2((long double)sin, (long double)cos) * lsb);
        away = std::fabs(
            away -
            65536 * std::round(
                        away /
                        65536));  // a tie is 2e-5 away at least up to 10 bits, a double 1e-11 out
        judged++, wrong += away > 0.5, worst = std::fmax(worst, away);
        worst_amplitude = std::fmax(worst_amplitude, std::fabs(top.amplitude - length));
    }
    if (answer != pairs) return 1;
    printf("%ld %.9f %ld %.3f\n", judged, worst, wrong, worst_amplitude);
}
