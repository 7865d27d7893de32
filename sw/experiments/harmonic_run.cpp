// SPDX-License-Identifier: Apache-2.0
// harmonic_run -- print the correction of the Verilated harmonic_map at given angles, at rest.
//
// Standard input holds numbers: radians_per_count; how many terms, and of each its amplitude and
// phase; how many angles, and the angles (2^-32 turn). Each line of the output is the correction at
// an angle (2^-16 count).
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "Vtop.h"
#include "verilated.h"

namespace {

constexpr int LONGEST = 2000, AFTER = 3;  // cycles of a round; from its sum to the correction

long long number() {
    long long value = 0;
    if (std::scanf("%lld", &value) != 1)
        std::fprintf(stderr, "harmonic_run: a number is missing\n"), std::exit(1);
    return value;
}

}  // namespace

double sc_time_stamp() { return 0; }

int main() {
    VerilatedContext context;
    Vtop top{&context};
    const auto clock = [&] {
        top.clk = 1, top.eval();
        top.clk = 0, top.eval();
    };
    top.rst = 1, clock(), clock(), top.rst = 0;
    top.radians_per_count = uint32_t(number());
    const int terms = int(number());
    for (int term = 0; term < terms; term++) {
        top.term = unsigned(term), top.write = 1;
        top.amplitude = uint32_t(number()), top.phase = uint32_t(number());
        clock();
    }
    top.write = 0, top.swap = 1, clock(), top.swap = 0;
    for (auto left = number(); left > 0; left--) {
        top.enable = 0, clock();  // the next round begins with this angle
        top.angle = uint32_t(number()), top.enable = 1;
        int cycles = 0;
        do clock();
        while (!top.refreshed && ++cycles < LONGEST);
        if (!top.refreshed) return std::fprintf(stderr, "harmonic_run: no sum\n"), 1;
        for (int n = 0; n < AFTER; n++) clock();
        std::printf("%d\n", int32_t(top.correction));
    }
}
