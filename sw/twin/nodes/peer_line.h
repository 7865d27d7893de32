// SPDX-License-Identifier: Apache-2.0
// One direction of the serial line between two nodes, idle high, characters of 8 bits without
// parity: the level of the sender, pulled low by disturbances and by random bytes at random times,
// and a log of the bytes that arrive.
#pragma once
#include <algorithm>
#include <cstdint>
#include <deque>
#include <vector>

#include "parts/random_source.h"

namespace twin {

class PeerLine {
 public:
    static constexpr uint64_t NEVER = ~uint64_t(0);
    static constexpr int CELLS = 10;

    PeerLine(uint64_t seed, uint64_t stream, double clk_hz, double baud)
        : random_(seed, stream), clk_hz_(clk_hz), bit_(clk_hz / baud) {}

    bool step(uint64_t now, bool tx) {  // once a cycle; returns the level at the receiver
        if (now >= disturb_at_) disturb(now);
        const bool level = (tx && disturbance_) || cut;
        if (now >= sample_at_)
            sample(level);
        else if (before_ && !level && sample_at_ == NEVER)
            begin(now);
        return before_ = level;
    }
    // Sends bytes beside the sender, from cycle `now` on.
    void put(const uint8_t* bytes, int count, uint64_t now) {
        if (count && !disturbs()) start(now + 1);
        pending_.insert(pending_.end(), bytes, bytes + count);
    }
    // Sends some random bytes `rate` times a second; 0 ends it.
    void garbage(double rate, uint64_t now) {
        rate_ = rate;
        draw(now);
    }

    bool cut = false;               // fault: the receiver sees an idle line
    std::vector<uint8_t> received;  // bytes that a receiver decodes, until they are taken
    uint64_t framing_errors = 0, garbage_bytes = 0;

 private:
    static constexpr unsigned MOST = 4;  // bytes of garbage in a row

    bool disturbs() const { return !pending_.empty() || cell_ > 0; }
    void start(uint64_t now) {
        cell_ = 0;
        begun_ = now;
        disturb_at_ = now;
    }
    void draw(uint64_t now) {
        next_garbage_ =
            rate_ > 0 ? now + 1 + uint64_t(random_.exponential(clk_hz_ / rate_)) : NEVER;
        if (!disturbs()) disturb_at_ = next_garbage_;
    }
    void disturb(uint64_t now) {  // a new cell, or a new burst
        if (!disturbs()) {
            if (now < next_garbage_) {
                disturb_at_ = next_garbage_;
                return;
            }
            for (uint64_t n = 1 + random_.bits() % MOST; n; n--)
                pending_.push_back(uint8_t(random_.bits() % 3 ? random_.bits() : 0xFF));
            garbage_bytes += pending_.size();
            start(now);
        }
        if (cell_ == CELLS) {
            cell_ = 0;
            pending_.pop_front();
            begun_ = now;
            if (pending_.empty()) return draw(now);
        }
        const uint8_t byte = pending_.front();
        disturbance_ = cell_ == 0 ? false : cell_ == CELLS - 1 ? true : byte >> (cell_ - 1) & 1;
        disturb_at_ = begun_ + uint64_t(++cell_ * bit_);
    }
    void begin(uint64_t now) {
        bit_number_ = 0;
        byte_ = 0;
        first_ = now;
        sample_at_ = now + uint64_t(bit_ / 2);
    }
    void sample(bool level) {
        if (bit_number_ == 0 && level) {  // no start bit
            sample_at_ = NEVER;
            return;
        }
        if (bit_number_ == CELLS - 1) {
            if (level)
                received.push_back(byte_);
            else
                framing_errors++;
            sample_at_ = NEVER;
            return;
        }
        if (bit_number_) byte_ |= uint8_t(level << (bit_number_ - 1));
        sample_at_ = first_ + uint64_t((++bit_number_ + 0.5) * bit_);
    }

    RandomSource random_;
    double clk_hz_, bit_, rate_ = 0;
    uint64_t disturb_at_ = NEVER, next_garbage_ = NEVER, begun_ = 0, sample_at_ = NEVER, first_ = 0;
    std::deque<uint8_t> pending_;
    int cell_ = 0, bit_number_ = 0;
    uint8_t byte_ = 0;
    bool disturbance_ = true, before_ = true;
};

}  // namespace twin
