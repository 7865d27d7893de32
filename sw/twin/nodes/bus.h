// SPDX-License-Identifier: Apache-2.0
// The RS-485 bus with bias (idles 1), shared by the host and the nodes, each with a driver
// enable; receivers are off while their own driver is on. The host's end is a UART of 9-bit
// characters: start, 8 data LSB first, 9th bit, stop.
#pragma once
#include <cstdint>
#include <deque>
#include <vector>

#include "parts/random_source.h"

namespace twin {

enum class Cut { none, idle, broken };  // what a cut end receives: ones or zeros

class HostUart {
 public:
    static constexpr int CELLS = 12 - 1;  // bits of a character on the line

    void set_bit_time(double clk) { bit_time_ = uint64_t(clk * FRACTION + 0.5); }
    void send_words(const uint16_t* words, int count, const uint32_t* flips, int flip_count,
                    int gap_cells);
    void send_levels(const uint8_t* levels, int count,
                     double cell_clk);  // any levels, cell by cell

    void step(uint64_t now, bool level) {  // once a cycle, with the level its receiver sees
        if (now >= transmit_at_) transmit(now);
        if (receiving_) {
            if (now >= receive_at_) receive(level);
        } else if (!level && was_high_) {
            begin(now);
        }
        was_high_ = level;
    }
    bool drives() const { return driving_; }
    bool level() const { return level_; }  // of the driver

    std::deque<uint16_t>
        received;  // as a PC's port gives them: without a stop bit too, but no break
    uint32_t framing_errors = 0, start_glitches = 0;
    uint64_t first_cell = 0, last_cell = 0;  // cycles at which the last burst began and ended

 private:
    static constexpr uint64_t FRACTION = 1 << 16, NEVER = ~uint64_t(0);
    struct Cell {
        uint8_t level;
        uint64_t duration;  // cycles * FRACTION
    };
    void add(bool level, uint64_t duration);
    void transmit(uint64_t now);
    void receive(bool level);
    void begin(uint64_t now);

    uint64_t bit_time_ = 8 * FRACTION;
    std::deque<Cell> cells_;
    uint64_t transmit_at_ = NEVER, cell_end_ = 0;
    bool driving_ = false, level_ = true;
    bool receiving_ = false, was_high_ = true;
    uint64_t receive_at_ = 0, sample_at_ = 0;
    int bit_ = 0;
    uint32_t word_ = 0;
};

class Bus {
 public:
    Bus(uint64_t seed, double clk_hz, double bit_clk)
        : clk_hz_(clk_hz), bit_clk_(bit_clk), random_(seed, 0x11E) {
        host.set_bit_time(bit_clk);
    }

    // once a cycle: nodes_driving and nodes_level are bit masks over the nodes
    void step(uint64_t now, uint32_t nodes_driving, uint32_t nodes_level) {
        const bool host_on = host.drives() && host_cut == Cut::none;
        const uint32_t on = nodes_driving & ~cut_mask_;
        if (host_on | (on != 0)) {
            const bool several = (on & (on - 1)) != 0 || (host_on && on);
            collisions += several && !was_several_;
            was_several_ = several;
            level = !(host_on && !host.level()) && !(on & ~nodes_level);
            last_driven = now;
        } else {
            was_several_ = false;
            level = true;
        }
        bool at_receivers = level;
        if (now >= spike_start_) {
            at_receivers = !at_receivers;
            if (now >= spike_end_) draw_spike(now);
        }
        edges += at_receivers != at_nodes;
        at_nodes = at_receivers;
        bool at_host =
            host.drives() || (host_cut == Cut::none ? at_receivers : host_cut == Cut::idle);
        if (reply_flips_armed_) at_host ^= reply_flip(now, at_host);
        host.step(now, at_host);
    }
    bool level_at(int node, bool own_driver) const {  // the output of a node's receiver
        return own_driver ||
               (cut_mask_ >> node & 1 ? broken_mask_ >> node & 1 ? false : true : at_nodes);
    }
    void cut_node(int node, Cut cut);
    void flip_reply(const uint32_t* cells,
                    int count);  // of the next reply, counted from its first start bit
    void spikes(double rate, double shortest, double longest, uint64_t now);

    HostUart host;
    Cut host_cut = Cut::none;
    bool level = true, at_nodes = true;
    uint32_t collisions = 0;
    uint64_t edges = 0, last_driven = 0;

 private:
    static constexpr uint64_t NEVER = ~uint64_t(0);
    void draw_spike(uint64_t now);
    bool reply_flip(uint64_t now, bool at_host);

    double clk_hz_, bit_clk_, spike_rate_ = 0, spike_shortest_ = 0, spike_longest_ = 0;
    RandomSource random_;
    uint64_t spike_start_ = NEVER, spike_end_ = NEVER, reply_start_ = NEVER;
    uint32_t cut_mask_ = 0, broken_mask_ = 0;
    bool was_several_ = false, reply_flips_armed_ = false;
    std::vector<uint8_t> reply_flips_;
};

}  // namespace twin
