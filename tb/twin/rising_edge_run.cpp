// SPDX-License-Identifier: Apache-2.0
// rising_edge_run -- two nodes with the same pins and firmware, one evaluated by Verilator, one by
// rising_edge(); stops at the first cycle after which a register, a memory or an output differs.
// Near the end, random bits of the registers and memories flip in both.
//
//   rising_edge_run FIRMWARE CYCLES SEED      FIRMWARE: words in hex, one a line
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <random>
#include <string>

#include "verilated_node.h"  // made by twin/build.py
#include "signals.h"         // made by test_rising_edge.py: INPUTS(X), REGISTERS(X), MEMORIES(X)

// An input keeps its level for so many cycles on average: in the first half of the cycles, and in
// the second, in which the soft core waits and the other part of the node rests.
constexpr unsigned LIVELY = 64, QUIET = 65536;
constexpr uint64_t RESET_CYCLES = 16;   // at the beginning
constexpr uint64_t MEMORY_CYCLES = 97;  // from one look at the memories to the next
constexpr uint64_t FLIPPED = 50'000;    // cycles at the end in which bits flip
constexpr unsigned FLIP = 500;          // cycles from one flip to the next, on average

static void cycle(Vnode& node) {
    node.clk = 1;
    node.eval();
    node.clk = 0;
    node.eval();
}

int main(int count, char** arguments) {
    if (count != 4) return 2;
    std::ifstream firmware(arguments[1]);
    const uint64_t cycles = std::strtoull(arguments[2], nullptr, 0);
    std::mt19937_64 random(std::strtoull(arguments[3], nullptr, 0));
    VerilatedContext context;
    Vnode theirs(&context), ours(&context);
    Rest rest;
    auto &a = *theirs.rootp, &b = *ours.rootp;
    a.rst = b.rst = 1;
    theirs.eval();
    ours.eval();
    std::string word;
    for (int n = 0; firmware >> word; n++)
        a.NODE_MEMORY[n] = b.NODE_MEMORY[n] = uint32_t(std::stoul(word, nullptr, 16));
    uint64_t driving = 0, rested = 0, flips = 0;
    for (uint64_t n = 0; n < cycles; n++) {
#define SET(name, mask)                                    \
    if (random() % (n < cycles / 2 ? LIVELY : QUIET) == 0) \
        a.name = b.name = uint64_t(random()) & mask;
        INPUTS(SET)
        a.rst = b.rst = n < RESET_CYCLES;
        cycle(theirs);
        if (b.rst)
            cycle(ours);
        else
            rising_edge(b, rest);
#define COMPARE(name)                                                          \
    if (std::memcmp(&a.name, &b.name, sizeof a.name)) {                        \
        std::printf("cycle %llu: " #name " differs\n", (unsigned long long)n); \
        return 1;                                                              \
    }
        REGISTERS(COMPARE)
        if (n % MEMORY_CYCLES == 0 || n + 1 == cycles) {
            MEMORIES(COMPARE)
        }
        if (cycles - n < FLIPPED && random() % FLIP == 0) {
            const auto& where = REGISTERS[random() % REGISTERS.size()];
            const unsigned at = random() % where.words, bit = random() % where.bits;
            twin::flip(a, where, at, bit);
            twin::flip(b, where, at, bit);
            Vnode___024root___eval_settle(&a);
            Vnode___024root___eval_settle(&b);
            rest.forget();
            flips++;
        }
        driving += a.rs485_driver_enable;
        rested += rest.known_0;
    }
    std::printf(
        "the same for %llu cycles, with %llu flips; the node drove the bus in %llu, and "
        "rested in %llu\n",
        (unsigned long long)cycles, (unsigned long long)flips, (unsigned long long)driving,
        (unsigned long long)rested);
}
