// SPDX-License-Identifier: Apache-2.0
// relay_pins.h -- the Verilated relay between a ring, whose read head moves in whole counts, and a
// counter behind it, with its UART.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "Vtop.h"
#include "verilated.h"

namespace moire {

class RelayPins {
 public:
    static constexpr int K = 16, BIT = 16, STEPS = 22;  // orders; cycles per bit; rotations
    static constexpr int ROUND = (STEPS + 2) * K + 35;  // cycles from one correction to the next
    static constexpr int EMPTY_FLASH = 2048 + 66 * (4 * (7 + 2 * K) + 5);  // cycles of a copy

    VerilatedContext context;
    Vtop pins{&context};
    const int64_t counts;       // per turn
    int64_t position, counted;  // of the ring and of the output, counts from the index
    uint64_t cycles = 0, double_edges = 0, last_edge = 0;

    RelayPins(int64_t counts, int64_t position)
        : counts(counts), position(position), counted(position) {
        pins.rs485_rx = pins.flash_sdi = 1, pins.rst = 1, show();
        wait(4);
        pins.rst = 0;
        wait(2 * EMPTY_FLASH + 1000);  // the relay reads both copies
        counting = true;
    }
    virtual ~RelayPins() = default;

    void show() {
        const unsigned b = position >> 1 & 1, a = b ^ (position & 1);
        pins.encoder_a = a, pins.encoder_b = b, pins.encoder_z = position % counts == 0;
    }
    void cycle() {
        pins.clk = 1, pins.eval();
        pins.clk = 0, pins.eval();
        cycles++;
        const unsigned now = pins.relay_b << 1 | (pins.relay_a ^ pins.relay_b);
        const unsigned turned = (now - levels) & 3;
        if (counting && turned) {
            counted += turned == 1 ? 1 : turned == 3 ? -1 : 0, double_edges += turned == 2;
            last_edge = cycles;
        }
        levels = now;
        judge();
    }
    void wait(int count) {
        while (count--) cycle();
    }
    // Sends 9-bit words and returns those of the answer.
    std::vector<unsigned> exchange(const std::vector<unsigned>& words) {
        for (unsigned sent : words)
            for (int bit = 0; bit < 11; bit++) {
                pins.rs485_rx = bit == 0 ? 0 : bit < 10 ? sent >> (bit - 1) & 1 : 1;
                wait(BIT);
            }
        for (int silent = 0; silent < 1000 && !pins.rs485_driver_enable; silent++) cycle();
        std::vector<unsigned> answer;
        while (pins.rs485_driver_enable) {
            if (pins.rs485_tx) {
                cycle();
                continue;
            }
            unsigned heard = 0;
            wait(BIT / 2);
            for (int bit = 0; bit < 10; bit++) {
                wait(BIT);
                if (bit < 9) heard |= unsigned(pins.rs485_tx) << bit;
            }
            answer.push_back(heard);
        }
        return answer;
    }

 protected:
    virtual void judge() {}  // after every cycle

 private:
    unsigned levels = 0;
    bool counting = false;
};

}  // namespace moire
