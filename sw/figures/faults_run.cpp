// SPDX-License-Identifier: Apache-2.0
// faults_run -- run many Verilated signal_monitors side by side on the samples of standard input.
//
//   faults_run LANES LOW HIGH CLIP_LEVEL TOLERANCE JUMP BAND SPAN NO_NOISE_SAMPLES SIGN_THRESHOLD
//              OFFSET_LIMIT BALANCE_LIMIT QUADRATURE_LIMIT
//
// Input is a row of blocks. Each begins with its number of samples (32 bits); then come the samples
// of the first lane, of the second, and so on, four bytes each: sin, cos, a, b. The answer to a
// block holds 16 bits per sample in the same order: the faults 0 to 12 that the sample leads to.
// They are taken as many cycles after the sample as the header of the module states.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "Vtop.h"
#include "verilated.h"

namespace {

// cycles from a sample to its faults, and to the next sample that the module sees, for W = 8
constexpr int LATENCY = 32, PERIOD = 21, SETTINGS = 12;
constexpr uint16_t JUDGED = (1u << 13) - 1;  // the faults that the samples lead to

struct Sample {
    int8_t sin, cos;
    uint8_t a, b;
};

void clock(Vtop& top) {
    top.clk = 1, top.eval();
    top.clk = 0, top.eval();
}

// A block of one lane; then nothing comes in until the last sample is judged.
void run_block(Vtop& top, const Sample* samples, uint16_t* found, int count) {
    const int cycles = (count - 1) * PERIOD + LATENCY;
    for (int cycle = 0; cycle < cycles; cycle++) {
        const int n = cycle / PERIOD;
        top.valid = cycle % PERIOD == 0 && n < count;
        if (top.valid) {
            const Sample& sample = samples[n];
            top.sin = uint8_t(sample.sin), top.cos = uint8_t(sample.cos);
            top.a = sample.a, top.b = sample.b;
        }
        clock(top);
        const int since = cycle + 1 - LATENCY;
        if (since >= 0 && since % PERIOD == 0) found[since / PERIOD] = top.faults & JUDGED;
    }
}

}  // namespace

double sc_time_stamp() { return 0; }

int main(int count, char** words) {
    if (count != 2 + SETTINGS)
        return std::fprintf(stderr, "usage: faults_run LANES and 12 settings\n"), 2;
    const auto setting = [&](int n) { return unsigned(std::atoi(words[2 + n])); };
    const size_t lanes = size_t(std::atoi(words[1]));
    VerilatedContext context;
    std::vector<std::unique_ptr<Vtop>> tops;
    for (size_t lane = 0; lane < lanes; lane++) {
        tops.push_back(std::make_unique<Vtop>(&context));
        Vtop& top = *tops.back();
        top.low = setting(0), top.high = setting(1), top.clip_level = setting(2);
        top.tolerance = setting(3), top.jump = setting(4), top.band = setting(5);
        top.span = setting(6), top.no_noise_samples = setting(7);
        top.sign_threshold = setting(8), top.offset_limit = setting(9);
        top.balance_limit = setting(10), top.quadrature_limit = setting(11);
        top.rst = 1, clock(top), clock(top), top.rst = 0;
    }
    std::vector<Sample> samples;
    std::vector<uint16_t> found;
    for (uint32_t size = 0; std::fread(&size, sizeof size, 1, stdin) == 1;) {
        samples.resize(lanes * size), found.resize(lanes * size);
        if (std::fread(samples.data(), sizeof(Sample), samples.size(), stdin) != samples.size())
            return std::fprintf(stderr, "faults_run: a block ends early\n"), 1;
        for (size_t lane = 0; lane < lanes; lane++) {
            const size_t first = lane * size;
            run_block(*tops[lane], &samples[first], &found[first], int(size));
        }
        std::fwrite(found.data(), sizeof(uint16_t), found.size(), stdout);
        std::fflush(stdout);
    }
}
