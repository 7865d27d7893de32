// SPDX-License-Identifier: Apache-2.0
#include "nodes/bus.h"

namespace twin {

void HostUart::add(bool level, uint64_t duration) {
    cells_.push_back({uint8_t(level), duration});
    if (transmit_at_ == NEVER) transmit_at_ = 0;  // in the next cycle
}

void HostUart::send_words(const uint16_t* words, int count, const uint32_t* flips, int flip_count,
                          int gap_cells) {
    std::vector<uint8_t> levels;
    for (int n = 0; n < count; n++) {
        levels.push_back(0);
        for (int bit = 0; bit < 9; bit++) levels.push_back(words[n] >> bit & 1);
        levels.push_back(1);
        if (n + 1 < count) levels.insert(levels.end(), gap_cells, 1);
    }
    for (int n = 0; n < flip_count; n++)
        if (flips[n] < levels.size()) levels[flips[n]] ^= 1;
    for (const uint8_t level : levels) add(level, bit_time_);
}

void HostUart::send_levels(const uint8_t* levels, int count, double cell_clk) {
    const uint64_t duration = cell_clk > 0 ? uint64_t(cell_clk * FRACTION + 0.5) : bit_time_;
    for (int n = 0; n < count; n++) add(levels[n], duration);
}

void HostUart::transmit(uint64_t now) {
    if (cells_.empty()) {  // the last cell has ended
        driving_ = false;
        level_ = true;
        transmit_at_ = NEVER;
        last_cell = now;
        return;
    }
    if (!driving_) {
        driving_ = true;
        first_cell = now;
        cell_end_ = now * FRACTION;
    }
    level_ = cells_.front().level;
    cell_end_ += cells_.front().duration;
    cells_.pop_front();
    transmit_at_ = (cell_end_ + FRACTION - 1) / FRACTION;
}

void HostUart::begin(uint64_t now) {
    receiving_ = true;
    bit_ = 0;
    word_ = 0;
    sample_at_ = now * FRACTION + bit_time_ / 2;
    receive_at_ = sample_at_ / FRACTION;
}

void HostUart::receive(bool level) {
    if (bit_ == 0 && level) {  // not a start bit
        start_glitches++;
        receiving_ = false;
        return;
    }
    if (bit_ == 10) {
        if (!level) framing_errors++;
        if (level || word_) received.push_back(uint16_t(word_));
        receiving_ = false;
        return;
    }
    if (bit_) word_ |= uint32_t(level) << (bit_ - 1);
    bit_++;
    sample_at_ += bit_time_;
    receive_at_ = sample_at_ / FRACTION;
}

void Bus::cut_node(int node, Cut cut) {
    const uint32_t bit = 1u << node;
    cut_mask_ = cut == Cut::none ? cut_mask_ & ~bit : cut_mask_ | bit;
    broken_mask_ = cut == Cut::broken ? broken_mask_ | bit : broken_mask_ & ~bit;
}

void Bus::flip_reply(const uint32_t* cells, int count) {
    reply_flips_.clear();
    for (int n = 0; n < count; n++) {
        if (reply_flips_.size() <= cells[n]) reply_flips_.resize(cells[n] + 1);
        reply_flips_[cells[n]] ^= 1;
    }
    reply_start_ = NEVER;
    reply_flips_armed_ = count > 0;
}

bool Bus::reply_flip(uint64_t now, bool at_host) {
    if (reply_start_ == NEVER) {
        if (at_host) return false;
        reply_start_ = now;
    }
    const uint64_t cell = uint64_t(double(now - reply_start_) / bit_clk_);
    if (cell >= reply_flips_.size()) {
        reply_flips_armed_ = false;
        return false;
    }
    return reply_flips_[cell];
}

void Bus::spikes(double rate, double shortest, double longest, uint64_t now) {
    spike_rate_ = rate;
    spike_shortest_ = shortest;
    spike_longest_ = longest;
    draw_spike(now);
}

void Bus::draw_spike(uint64_t now) {
    if (spike_rate_ <= 0) {
        spike_start_ = spike_end_ = NEVER;
        return;
    }
    spike_start_ = now + 1 + uint64_t(random_.exponential(clk_hz_ / spike_rate_));
    spike_end_ =
        spike_start_ + uint64_t(random_.uniform(spike_shortest_, spike_longest_) * clk_hz_);
}

}  // namespace twin
