// SPDX-License-Identifier: Apache-2.0
// The host side of a PS/2 line, the PC of a machine: takes scan codes, requests damaged ones again
// (FE), sends commands with their arguments and waits for the answers. It holds the keyboard after
// each byte, as an 8042 does, and at random times.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "parts/random_source.h"

namespace twin {

class Ps2Computer {
 public:
    static constexpr uint64_t NEVER = ~uint64_t(0);
    struct Received {
        uint64_t at;
        uint8_t byte;
    };

    Ps2Computer(uint64_t seed, uint64_t stream) : random_(seed, stream) {}
    void configure(double clk_hz, double inhibits_per_s, double processing_s) {
        clk_hz_ = clk_hz;
        processing_ = processing_s;
        inhibits_ = inhibits_per_s;
        if (inhibits_ <= 0)
            inhibit_at_ = NEVER;
        else if (inhibit_at_ == NEVER)
            inhibit_at_ = 0;
    }
    void order(const uint8_t* bytes, int count) {
        orders_.insert(orders_.end(), bytes, bytes + count);
    }
    size_t waiting() const { return orders_.size(); }
    // takes the levels of the lines at cycle `now`, called when they change and at the requested
    // time; returns when to be called again
    uint64_t step(uint64_t now, bool clock, bool data);

    bool clock_low = false, data_low = false;  // pulls
    std::vector<Received> received;            // every good byte
    std::vector<uint8_t> keys;                 // of them those that are no answers, until taken
    uint64_t damaged = 0, unanswered = 0, inhibits = 0;

 private:
    static constexpr double HOLD = 110, LAST = 60, FRAME = 2000, FIRST = 15'000, ANSWER = 100'000,
                            PAUSE = 1000;  // us
    static constexpr int TRIES = 3;
    enum Mode { LISTENS, INHIBITS, ASKS, SENDS };

    uint64_t us(double n) const { return uint64_t(n * clk_hz_ / 1e6 + 0.5) + 1; }
    bool may_order() const {
        return mode_ == LISTENS && bit_ == 0 && !awaits_ && !again_ && !orders_.empty();
    }
    void fell(uint64_t now, bool data);
    void take(uint64_t now, uint8_t byte);
    void timers(uint64_t now);
    void hold(uint64_t now, uint64_t clk);
    void release_lines(uint64_t now);
    void send(uint64_t now, uint8_t byte);
    void failed(uint64_t now);
    uint64_t next() const;

    RandomSource random_;
    double clk_hz_ = 1, inhibits_ = 0, processing_ = 0;
    Mode mode_ = LISTENS;
    int bit_ = 0, tries_ = 0;
    unsigned frame_ = 0;
    bool clock_ = true, awaits_ = false,
         again_ = false;  // the answer to an order, a damaged byte once more
    uint64_t at_ = NEVER, inhibit_at_ = NEVER, processes_at_ = NEVER, pause_ = 0;
    std::deque<uint8_t> orders_;
};

}  // namespace twin
