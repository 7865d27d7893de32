// SPDX-License-Identifier: Apache-2.0
// link_run -- send damaged, foreign, replayed, truncated and hostile packets to the Verilated
// process_link, with good ones between them; or as datagrams to datagram_bench, from its host and,
// while a drive is on, from others.
//
//   link_run COUNT SEED      prints: bad packets sent, bad ones acted upon or not counted once,
//   good
//                            ones refused
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <type_traits>
#include <vector>

#include "figures/common.h"
#include "figures/link_packet.h"
#include "Vtop.h"
#include "verilated.h"

namespace {

using moire::Random;
using Bytes = std::vector<uint8_t>;

constexpr uint32_t SESSION = 0x5A17C3, WINDOW = 60'000;
constexpr uint32_t WRITES = 9, READS = 4;
constexpr uint32_t REPLY_BYTES = 4 * (READS + link_packet::REPLY_FRAME_WORDS);
constexpr int GOOD_EACH = 8;               // one good packet after so many bad ones
constexpr uint64_t HOST = 0xC0A801010FA0;  // address and port of a datagram

// The carrier of a Verilated top: a datagram ends with its last byte, and has a sender.
template <class Pins, class = void>
constexpr bool DATAGRAMS = false;
template <class Pins>
constexpr bool DATAGRAMS<Pins, std::void_t<decltype(Pins::rx_last)>> = true;

template <class Pins>
void set_end(Pins& pins, bool last, uint64_t sender) {
    if constexpr (DATAGRAMS<Pins>) pins.rx_last = last, pins.sender = sender, pins.locked = 1;
}
template <class Pins>
void set_ends(Pins& pins, bool ends) {
    if constexpr (!DATAGRAMS<Pins>) pins.rx_ends = ends;
}
template <class Pins>
bool misses(const Pins& pins, uint64_t host) {  // a reply has another receiver or length
    if constexpr (DATAGRAMS<Pins>) return pins.receiver != host || pins.length != REPLY_BYTES;
    return false;
}

struct Node {
    std::unique_ptr<VerilatedContext> context = std::make_unique<VerilatedContext>();
    std::unique_ptr<Vtop> pins = std::make_unique<Vtop>(context.get());
    uint64_t selects = 0, replies = 0;

    void cycle() {
        pins->clk = 0, pins->eval();
        selects += pins->select;
        replies += pins->tx_valid && pins->tx_last;
        pins->clk = 1, pins->eval();
        pins->now++;
    }
    Node() {
        pins->rst = 1, pins->ready = 1, pins->tx_taken = 1;
        pins->session = SESSION, pins->writes = WRITES, pins->reads = READS;
        pins->time_window = WINDOW;
        cycle(), cycle();
        pins->rst = 0;
        for (uint32_t n = 0; n < WRITES; n++) {
            pins->list_put = 1, pins->list_at = n, pins->list_entry = 0x400 + 4 * n;
            cycle();
        }
        pins->list_put = 0, pins->enable = 1;
    }
    uint32_t refused() const {  // sum of the counts modulo 256 of each
        uint32_t sum = 0;
        for (int n = 0; n < 6; n++) sum += uint8_t(pins->refused >> 8 * n);
        return sum;
    }
    void send(const Bytes& bytes, int broken_at = -1, uint64_t sender = HOST) {
        for (size_t n = 0; n < bytes.size(); n++) {
            set_end(*pins, n + 1 == bytes.size(), sender);
            pins->rx_valid = 1, pins->rx_data = bytes[n], pins->rx_broken = int(n) == broken_at;
            cycle();
        }
        pins->rx_valid = pins->rx_broken = 0;
        set_ends(*pins, true), cycle();
        set_ends(*pins, false);
        for (int n = 0; n < 4; n++) cycle();
    }
};

void seal(Bytes& bytes) {
    const uint32_t crc = moire::crc32(bytes.data(), bytes.size());
    for (int n = 0; n < 4; n++) bytes.push_back(uint8_t(crc >> 8 * n));
}

Bytes packet(uint32_t identity, uint32_t sequence, uint32_t time, uint32_t writes, Random& random) {
    Bytes bytes;
    auto word = [&](uint32_t w) {
        for (int n = 0; n < 4; n++) bytes.push_back(uint8_t(w >> 8 * n));
    };
    word(identity), word(sequence), word(time);
    for (uint32_t n = 0; n < writes; n++) word(random.bits32());
    word(random.bits32()), word(random.bits32());  // spare access
    seal(bytes);
    return bytes;
}

int campaign(long count, uint64_t seed) {
    Node node;
    Random random{seed * 0x9E3779B97F4A7C15ULL | 1};
    for (int n = 0; n < 8; n++) random();
    const uint32_t ours = link_packet::KIND_REQUEST | SESSION << 8;
    uint32_t sequence = 0;
    Bytes good;  // the last one that was accepted
    long wrong = 0, missed = 0;
    auto play_good = [&] {
        good = packet(ours, ++sequence, node.pins->now, WRITES, random);
        const uint64_t selects = node.selects, replies = node.replies;
        node.send(good);
        for (int n = 0; n < 2000 && node.pins->busy; n++) node.cycle();
        missed += node.selects - selects != WRITES + READS + 1 || node.replies != replies + 1 ||
                  misses(*node.pins, HOST);
    };
    play_good();
    for (long n = 0; n < count; n++) {
        Bytes bad = packet(ours, sequence + 1, node.pins->now, WRITES, random);
        int broken_at = -1;
        uint64_t sender = HOST;
        switch (random.below(DATAGRAMS<Vtop> ? 12 : 11)) {
        case 0:  // up to 3 bits
            for (int k = 0; k <= int(n % 3); k++) {
                const uint64_t bit = random.below(2 * bad.size()) + k * 2 * bad.size();
                bad[bit / 8] ^= uint8_t(1 << bit % 8);
            }
            break;
        case 1:  // a burst of up to 32 bits
            for (uint64_t at = random.below(bad.size() - 3), k = 0; k < 4; k++)
                bad[at + k] ^= uint8_t(k ? random.bits32() : 1 + random.below(255));
            break;
        case 2: bad.resize(1 + random.below(bad.size() - 1)); break;
        case 3:  // bytes more
            for (int64_t k = random.from(1, 600); k > 0; k--) bad.push_back(random.bits32());
            break;
        case 4: bad = good; break;
        case 5:  // another session
            bad = packet(ours ^ uint32_t(random.from(1, 0xFFFFFF)) << 8, sequence + 1,
                         node.pins->now, WRITES, random);
            break;
        case 6:  // another kind, such as a reply
            bad = packet(ours ^ uint32_t(random.from(1, 255)), sequence + 1, node.pins->now, WRITES,
                         random);
            break;
        case 7: {  // another length
            const uint32_t writes = uint32_t(random.below(link_packet::MOST_VALUES));
            bad = packet(ours, sequence + 1, node.pins->now, writes + (writes >= WRITES), random);
            break;
        }
        case 8:  // an earlier sequence
            bad = packet(ours, sequence - uint32_t(random.below(1LL << 31)), node.pins->now, WRITES,
                         random);
            break;
        case 9:  // too late or too early
            bad = packet(ours, sequence + 1,
                         node.pins->now + uint32_t(random.from(WINDOW + 2000, 1LL << 31)), WRITES,
                         random);
            break;
        case 10: broken_at = int(random.below(bad.size())); break;
        default:  // a good one of another host
            sender ^= 1ULL << random.below(48);
        }
        const uint64_t selects = node.selects, replies = node.replies;
        const uint32_t refused = node.refused();
        node.send(bad, broken_at, sender);
        const bool acted = node.selects != selects || node.replies != replies || node.pins->busy;
        wrong += acted || (node.refused() - refused) % 256 != 1;
        if (n % GOOD_EACH == 0) play_good();
    }
    std::printf("%ld %ld %ld\n", count, wrong, missed);
    return 0;
}

}  // namespace

int main(int count, char** words) {
    if (count == 3) return campaign(std::atol(words[1]), std::strtoull(words[2], nullptr, 10));
    std::fputs("link_run COUNT SEED\n", stderr);
    return 2;
}
