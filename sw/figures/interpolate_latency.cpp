// SPDX-License-Identifier: Apache-2.0
// interpolate_latency: one word through the measuring path, from its converter's pins to the
// position; prints the clk from the word standing in the converter's register to its position. Only
// ports are looked at: the last bit of the word is taken with a falling edge of adc_sclk, so the
// word stands when that edge is seen. Both data lines stand at 1: sin and cos are at their upper
// end, 45 degrees.
#include <cstdint>
#include <cstdio>
#include "Vfeedback_channel.h"

int main() {
    constexpr int LONGEST = 1000;                     // clk
    constexpr int BITS = LEADING_BITS + SAMPLE_BITS;  // of adc_sclk, to the last one of the word
    constexpr uint64_t EIGHTH = 8192;                 // 2^-16 period
    Vfeedback_channel grating;
    int clk = 0;
    const auto step = [&] {
        grating.clk = 0;
        grating.eval();
        grating.clk = 1;
        grating.eval();
        clk++;
    };
    grating.adc_sin = grating.adc_cos = 1;
    grating.rst = 1;
    step();
    step();
    grating.rst = 0;
    grating.sample_tick = 1;
    step();
    grating.sample_tick = 0;
    for (int bits = 0; bits < BITS && clk < LONGEST;) {
        const bool high = grating.adc_sclk;
        step();
        bits += high && !grating.adc_sclk;
    }
    const int word = clk;
    while (!grating.position_valid && clk < LONGEST) step();
    if (clk == LONGEST || grating.position != EIGHTH) {
        std::fprintf(stderr, "no position of an eighth within %d clk of the word: it is %lld\n",
                     clk - word, static_cast<long long>(grating.position));
        return 1;
    }
    std::printf("%d\n", clk - word);
}
