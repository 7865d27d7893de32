// SPDX-License-Identifier: Apache-2.0
// interpolate_latency -- send one word through the Verilated feedback_channel, from the pins of the
// ADC to the position.
//
//   interpolate_latency BITS LEADING    the word has so many bits, after so many leading ones
//
// Prints the cycles from the word being complete in the receiver's register to its position. Only
// ports are read: the last bit of the word is taken with a falling edge of adc_sclk, so the
// word is complete when that edge is seen. Both data pins are at 1: sine and cosine are at their
// upper end, which is 45 degrees.
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "Vtop.h"

int main(int count, char** words) {
    if (count != 3) return std::fprintf(stderr, "usage: interpolate_latency BITS LEADING\n"), 2;
    constexpr int LONGEST = 1000;                                 // cycles
    constexpr uint64_t EIGHTH = 8192;                             // 2^-16 period
    const int edges = std::atoi(words[1]) + std::atoi(words[2]);  // of adc_sclk
    Vtop channel;
    int cycles = 0;
    const auto step = [&] {
        channel.clk = 0;
        channel.eval();
        channel.clk = 1;
        channel.eval();
        cycles++;
    };
    channel.adc_sin = channel.adc_cos = 1;
    channel.rst = 1;
    step();
    step();
    channel.rst = 0;
    channel.sample_tick = 1;
    step();
    channel.sample_tick = 0;
    for (int seen = 0; seen < edges && cycles < LONGEST;) {
        const bool high = channel.adc_sclk;
        step();
        seen += high && !channel.adc_sclk;
    }
    const int complete = cycles;
    while (!channel.position_valid && cycles < LONGEST) step();
    if (cycles == LONGEST || channel.position != EIGHTH) {
        std::fprintf(stderr, "no position of an eighth within %d cycles of the word: it is %lld\n",
                     cycles - complete, static_cast<long long>(channel.position));
        return 1;
    }
    std::printf("%d\n", cycles - complete);
}
