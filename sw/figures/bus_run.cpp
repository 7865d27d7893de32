// SPDX-License-Identifier: Apache-2.0
// bus_run -- drive the Verilated RS-485 port of a node, with the firmware behind its registers,
// with good, damaged and senseless frames.
//
//   bus_run flips FRAME          every flip of 1, 2 and 3 bits of one of ten frames, start and stop
//                                bits included
//   bus_run bursts FRAME SEED    bursts of 2 to 16 bits at every position of it: inverted, stuck at
//                                0, stuck at 1, random
//   bus_run random COUNT SEED    frames of a right command byte and random bytes, most of them with
//                                a length that fits
//
// These print `tried wrong missed`. tried: the words on the bus differed from those sent; wrong:
// accepted, or something moved; missed: good ones between them that were not accepted.
//
//   bus_run disturb COUNT SEED   any disturbance, a character of silence, then a good exchange;
//                                prints `tried refused`
//   bus_run baud CYCLES SEED     so many cycles per bit; prints the mismatch from which on a frame
//                                is lost, in percent: sender too slow, sender too fast
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "figures/common.h"
#include "Vtop.h"
#include "verilated.h"

extern "C" {
#include "core/hardware.h"
#include "bus/bus.h"
#include "made/bus_protocol.h"
void firmware_start(void);
}

namespace {

using moire::Random;

constexpr unsigned ADDRESS = 1, TO_NODE = 0x20 | ADDRESS, FROM_NODE = 0x10 | ADDRESS, READY = 0x40;
constexpr unsigned CELLS = 11;   // of a character
constexpr unsigned ANSWER = 20;  // cells: the ready byte, with the lead and the trail of the driver
constexpr uint64_t POLL_CYCLES = 64;   // the firmware polls the port so often
constexpr unsigned ACCESS_CYCLES = 4;  // a register access with the instructions around it
constexpr uint32_t BAUD = 115200;

using Levels = std::vector<uint8_t>;
using Bytes = std::vector<uint8_t>;

uint32_t crc32(const Bytes& bytes) { return moire::crc32(bytes.data(), bytes.size()); }

void add_character(Levels& cells, unsigned word) {  // bit 8: the 9th
    cells.push_back(0);
    for (int n = 0; n < 9; n++) cells.push_back(word >> n & 1);
    cells.push_back(1);
}

Levels command(unsigned byte) {
    Levels cells;
    add_character(cells, byte | 0x100);
    return cells;
}

Levels payload(const Bytes& body) {
    Bytes bytes = {TO_NODE, uint8_t(body.size())};
    bytes.insert(bytes.end(), body.begin(), body.end());
    const uint32_t crc = crc32(bytes);
    for (int n = 0; n < 4; n++) bytes.push_back(uint8_t(crc >> 8 * n));
    Levels cells;
    for (size_t n = 1; n < bytes.size(); n++) add_character(cells, bytes[n]);
    return cells;
}

Bytes frame_of(unsigned number) {  // the bodies of the ten frames
    static const Bytes bodies[] = {
        {1, BUS_OPERATION_IDENTIFY},     {0x55, BUS_OPERATION_COUNTERS},
        {3, BUS_OPERATION_STATUS, 0},    {0xFF, BUS_OPERATION_STOP, 0},
        {0, BUS_OPERATION_HOME, 0},      {0x80, BUS_OPERATION_RESET_FAULTS, 0},
        {7, BUS_OPERATION_POSITION, 0},  {0xAA, BUS_OPERATION_START, 1},
        {9, BUS_OPERATION_ENABLE, 0, 1}, {10, BUS_OPERATION_GET_PARAMETER, 0, 15}};
    return bodies[number % (sizeof bodies / sizeof *bodies)];
}

class Node {
 public:
    explicit Node(unsigned bit_cycles) : bit_cycles_(bit_cycles) {
        top_.address = ADDRESS;
        top_.rs485_rx = 1;
        top_.rst = 1;
        for (int n = 0; n < 4; n++) clk();
        top_.rst = 0;
        now = this;
        firmware_start();
        set_bit_time(16 * bit_cycles);
        rest(CELLS);
    }
    static inline Node* now;      // whose registers the firmware accesses
    std::vector<unsigned> heard;  // words that the master receives

    uint32_t access(bool write, uint32_t offset, uint32_t value) {
        while (top_.crc_waits) clk();
        top_.select = 1, top_.write = write, top_.word = uint8_t(offset / 4), top_.wdata = value;
        clk();
        const uint32_t read = top_.rdata;
        top_.select = 0;
        for (unsigned n = 1; n < ACCESS_CYCLES; n++) clk();
        return read;
    }
    // One level per cell, whose cycles may be a fraction; they begin `phase` of a cell late.
    void send(const Levels& cells, double cell_cycles = 0, double phase = 0) {
        if (cell_cycles == 0) cell_cycles = bit_cycles_;
        Levels levels;
        for (size_t n = 0; n < cells.size(); n++)
            while (double(levels.size()) < (double(n + 1) + phase) * cell_cycles)
                levels.push_back(n || double(levels.size()) >= phase * cell_cycles ? cells[n] : 1);
        send_levels(levels);
    }
    void send_levels(const Levels& levels) {  // a level per cycle
        wave_ = &levels, at_ = 0;
        while (at_ < levels.size()) step();
        wave_ = nullptr;
    }
    void rest(unsigned cells) {  // until the bus has been silent for so long
        for (uint64_t silent = 0; silent < uint64_t(cells) * bit_cycles_;
             silent = top_.rs485_driver_enable ? 0 : silent + 1)
            step();
    }
    uint32_t frames_good() { return access(false, BUS_FRAMES_GOOD, 0); }
    void set_bit_time(uint32_t sixteenths) { access(true, BUS_BIT_TIME, sixteenths); }

    // Both halves of an exchange by a master that receives nothing wrong; the reply must belong to
    // this request.
    bool exchange(const Bytes& body) {
        heard.clear();
        send(command(TO_NODE));
        rest(ANSWER);
        if (heard.size() != 1 || heard[0] != (READY | TO_NODE)) return false;
        send(payload(body));
        rest(ANSWER);
        heard.clear();
        send(command(FROM_NODE));
        rest(ANSWER);
        if (heard.size() < 9 || heard.size() != heard[1] + 6u || heard[0] != (READY | FROM_NODE))
            return false;
        Bytes reply(heard.begin(), heard.end() - 4);
        uint32_t crc = 0;
        for (size_t n = 0; n < 4; n++) crc |= uint32_t(heard[heard.size() - 4 + n]) << 8 * n;
        return crc == crc32(reply) && reply[2] == body[0] && reply[3] == body[1];
    }

 private:
    void clk() {
        const bool driven = top_.rs485_driver_enable,
                   level = !wave_ || at_ >= wave_->size() || (*wave_)[at_];
        at_++;
        top_.rs485_rx = level && (!driven || top_.rs485_tx);  // both at once: low wins
        top_.clk = 1;
        top_.eval();
        top_.clk = 0;
        top_.eval();
        hear(!top_.rs485_driver_enable || top_.rs485_tx);
    }
    void step() {
        clk();
        if (++since_poll_ >= POLL_CYCLES) {
            since_poll_ = 0;
            bus_poll();
        }
    }
    void hear(bool level) {  // each bit in its middle
        if (age_ < 0) {
            if (!level) age_ = 0, word_ = 0;
            return;
        }
        if (++age_ % int(bit_cycles_) != int(bit_cycles_) / 2) return;
        const unsigned bit = unsigned(age_) / bit_cycles_;
        word_ |= unsigned(level) << bit;
        if (bit + 1 < CELLS) return;
        if (level) heard.push_back(word_ >> 1 & 0x1FF);
        age_ = -1;
    }

    Vtop top_;
    unsigned bit_cycles_;
    const Levels* wave_ = nullptr;
    size_t at_ = 0;
    uint64_t since_poll_ = 0;
    int age_ = -1;
    unsigned word_ = 0;
};

uint32_t held[0x2000 / 4], moved;  // registers outside the port; writes to them
uint64_t stamp;

// ------------------------------------------------------------------ damaged frames

struct Count {
    uint64_t tried = 0, wrong = 0, missed = 0;
};

// What a receiver makes of the two halves of an exchange: words with a stop bit. A burst may turn a
// character into the same one a bit later: then nothing is damaged.
std::vector<unsigned> words_of(const Levels& cells) {
    Levels line(cells.begin(), cells.begin() + CELLS);
    line.insert(line.end(), ANSWER, 1);
    line.insert(line.end(), cells.begin() + CELLS, cells.end());
    line.insert(line.end(), CELLS, 1);
    std::vector<unsigned> words;
    bool idle = true;
    for (size_t at = 0; at + CELLS <= line.size();) {
        if (line[at] || !idle) {
            idle = line[at++];
            continue;
        }
        unsigned word = 0;
        for (unsigned n = 0; n < 9; n++) word |= unsigned(line[at + 1 + n]) << n;
        idle = line[at + CELLS - 1];
        if (idle) words.push_back(word);
        at += CELLS;
    }
    return words;
}

class Campaign {
 public:
    // The master sends the payload whether or not the node has reported that it is ready.
    void damaged(const Levels& cells, const std::vector<unsigned>& sent) {
        if (words_of(cells) == sent) return;
        play(cells);
        count_.tried++;
        count_.wrong += good_ + (moved != moved_);
        if (count_.tried % 1000 == 0) whole();
    }
    void whole() {
        Levels cells = command(TO_NODE);
        const Levels more = payload({uint8_t(++sequence_), BUS_OPERATION_COUNTERS});
        cells.insert(cells.end(), more.begin(), more.end());
        play(cells);
        count_.missed += good_ != 1;
    }
    void print() const {
        std::printf("%llu %llu %llu\n", (unsigned long long)count_.tried,
                    (unsigned long long)count_.wrong, (unsigned long long)count_.missed);
    }

 private:
    void play(const Levels& cells) {
        const uint32_t before = node_.frames_good();
        moved_ = moved;
        node_.heard.clear();
        node_.send({cells.begin(), cells.begin() + CELLS});
        node_.rest(ANSWER);
        node_.send({cells.begin() + CELLS, cells.end()});
        node_.rest(CELLS + 1);
        good_ = node_.frames_good() - before;
    }
    Node node_{8};
    Count count_;
    uint32_t good_ = 0, moved_ = 0, sequence_ = 0;
};

Levels cells_of_frame(unsigned number) {
    Levels cells = command(TO_NODE);
    const Levels more = payload(frame_of(number));
    cells.insert(cells.end(), more.begin(), more.end());
    return cells;
}

void flips(unsigned number) {
    Campaign campaign;
    Levels cells = cells_of_frame(number);
    const size_t count = cells.size();
    const std::vector<unsigned> sent = words_of(cells);
    for (size_t a = 0; a < count; a++) {
        cells[a] ^= 1;
        campaign.damaged(cells, sent);
        for (size_t b = a + 1; b < count; b++) {
            cells[b] ^= 1;
            campaign.damaged(cells, sent);
            for (size_t c = b + 1; c < count; c++) {
                cells[c] ^= 1;
                campaign.damaged(cells, sent);
                cells[c] ^= 1;
            }
            cells[b] ^= 1;
        }
        cells[a] ^= 1;
    }
    campaign.whole();
    campaign.print();
}

void bursts(unsigned number, Random random) {
    Campaign campaign;
    const Levels cells = cells_of_frame(number);
    const std::vector<unsigned> sent = words_of(cells);
    for (size_t length = 2; length <= 16; length++)
        for (size_t first = 0; first + length <= cells.size(); first++)
            for (int kind = 0; kind < 8; kind++) {
                Levels damaged = cells;
                for (size_t n = first; n < first + length; n++) {
                    const bool end = n == first || n == first + length - 1;
                    damaged[n] = kind == 0  ? !cells[n]
                                 : kind < 3 ? uint8_t(kind - 1)
                                 : end      ? !cells[n]
                                            : uint8_t(random.below(2));
                }
                campaign.damaged(damaged, sent);
            }
    campaign.whole();
    campaign.print();
}

void random_frames(uint64_t count, Random random) {
    Campaign campaign;
    while (count--) {
        Levels cells = command(TO_NODE);
        const unsigned length = random.below(8) ? 1 + random.below(6) : random.below(256);
        const unsigned bytes = random.below(8) ? length + 4 : random.below(20);
        add_character(cells, length);
        for (unsigned n = 0; n < std::min(bytes, 70u); n++) add_character(cells, random.below(256));
        campaign.damaged(cells, {});
    }
    campaign.whole();
    campaign.print();
}

// ------------------------------------------------------------------ disturbances

constexpr unsigned BIT_CYCLES = 16;

Levels in_cycles(const Levels& cells, double cell_cycles) {
    Levels levels;
    for (size_t n = 0; n < cells.size(); n++)
        while (double(levels.size()) < double(n + 1) * cell_cycles) levels.push_back(cells[n]);
    return levels;
}

Levels some_frame(Random& random) {
    Levels cells = command(random.below(4) ? TO_NODE : random.below(256));
    if (random.below(2)) cells.insert(cells.end(), ANSWER, 1);
    const Levels more = payload(frame_of(random.below(10)));
    cells.insert(cells.end(), more.begin(), more.end());
    return cells;
}

Levels disturbance(Random& random) {  // a level per cycle
    Levels cells = some_frame(random), levels = in_cycles(cells, BIT_CYCLES), other;
    const auto somewhere = [&](const Levels& in) { return random.below(int64_t(in.size())); };
    switch (random.below(10)) {
    case 0:  // flips
        for (unsigned n = 1 + random.below(3); n--;) cells[somewhere(cells)] ^= 1;
        return in_cycles(cells, BIT_CYCLES);
    case 1: {  // a burst
        const unsigned first = somewhere(cells),
                       last =
                           std::min(unsigned(cells.size()), first + 2 + unsigned(random.below(15)));
        for (unsigned n = first; n < last; n++) cells[n] = uint8_t(random.below(2));
        return in_cycles(cells, BIT_CYCLES);
    }
    case 2:  // a slip of a cell
        if (random.below(2))
            cells.erase(cells.begin() + somewhere(cells));
        else
            cells.insert(cells.begin() + somewhere(cells), uint8_t(random.below(2)));
        return in_cycles(cells, BIT_CYCLES);
    case 3:  // random cells
        cells.resize(1 + random.below(400));
        for (auto& cell : cells) cell = uint8_t(random.below(2));
        return in_cycles(cells, BIT_CYCLES);
    case 4:  // half a frame
        levels.resize(1 + somewhere(levels));
        return levels;
    case 5:  // another baud rate
        return in_cycles(cells, BIT_CYCLES * random.between(0.2, 4));
    case 6:  // a second master; a low wins
        other = in_cycles(some_frame(random), BIT_CYCLES);
        for (size_t n = 0, from = somewhere(levels); n < other.size() && from + n < levels.size();
             n++)
            levels[from + n] &= other[n];
        return levels;
    case 7:  // a break
        return Levels(BIT_CYCLES * (CELLS + random.below(300)), 0);
    case 8:  // spikes, shorter than a bit
        levels.assign(1 + random.below(4000), 1);
        for (unsigned n = 1 + random.below(20); n--;)
            for (unsigned at = somewhere(levels), left = 1 + random.below(BIT_CYCLES);
                 left-- && at < levels.size();)
                levels[at++] = 0;
        return levels;
    default:  // noise
        levels.resize(1 + random.below(3000));
        for (auto& level : levels) level = uint8_t(random.below(2));
        return levels;
    }
}

void disturb(uint64_t count, Random random) {
    Node node(BIT_CYCLES);
    uint64_t refused = 0;
    for (uint64_t n = 0; n < count; n++) {
        node.send_levels(disturbance(random));
        node.rest(CELLS);
        refused += !node.exchange({uint8_t(n), BUS_OPERATION_STATUS, 0});
    }
    std::printf("%llu %llu\n", (unsigned long long)count, (unsigned long long)refused);
}

// ------------------------------------------------------------------ baud rate

// The mismatch in percent at which the node does not accept a frame, as the sender gets slower or
// faster by 0.1 % of its bit time. Characters have no gaps: the error of one adds to the next.
double mismatch(Node& node, double bit_cycles, int sign, const std::vector<Bytes>& bodies) {
    for (int permille = 0;; permille++) {
        const double cell = bit_cycles * (1 + sign * permille / 1000.0);
        for (const Bytes& body : bodies)
            for (int phase = 0; phase < 8; phase++) {
                const uint32_t before = node.frames_good();
                node.send(command(TO_NODE), cell, phase / 8.0 / cell);
                node.rest(ANSWER + CELLS);
                node.send(payload(body), cell, phase / 8.0 / cell);
                node.rest(CELLS);
                if (node.frames_good() != before + 1) return permille / 10.0;
            }
    }
}

void baud(double bit_cycles, Random random) {
    Node node(unsigned(bit_cycles + 0.5));
    std::vector<Bytes> bodies = {Bytes(16, 0x00), Bytes(16, 0xFF), Bytes(16, 0x55),
                                 Bytes(16, 0xAA), Bytes(16, 0x80), Bytes(16, 0x7F)};
    for (int n = 0; n < 3; n++) {
        bodies.push_back(Bytes(16));
        for (auto& byte : bodies.back()) byte = uint8_t(random.below(256));
    }
    node.set_bit_time(uint32_t(bit_cycles * 16 + 0.5));
    const double slow = mismatch(node, bit_cycles, 1, bodies);
    std::printf("%.1f %.1f\n", slow, mismatch(node, bit_cycles, -1, bodies));
}

}  // namespace

extern "C" uint32_t register_read(uint32_t offset) {
    switch (offset) {
    case NODE_MAP_CRC: return MAP_CRC;
    case NODE_CLK_HZ: return 16 * BAUD;
    case NODE_BUILD: return FIELD_PUT(NODE_BUILD_AXES, 1) | FIELD_PUT(NODE_BUILD_ADDRESS, ADDRESS);
    case NODE_TIME_STAMP_LOW: return uint32_t(stamp++);
    case AXIS_BASE + AXIS_STATE: return FIELD_PUT(AXIS_STATE_QUEUE_FREE, 16);
    default:
        return offset >= BUS_BASE && offset < BUS_BASE + 0x100
                   ? Node::now->access(false, offset - BUS_BASE, 0)
                   : held[offset / 4 % (0x2000 / 4)];
    }
}

extern "C" void register_write(uint32_t offset, uint32_t value) {
    if (offset >= BUS_BASE && offset < BUS_BASE + 0x100) {
        Node::now->access(true, offset - BUS_BASE, value);
    } else {
        held[offset / 4 % (0x2000 / 4)] = value;
        moved++;
    }
}

int main(int count, char** arguments) {
    const std::string what = count > 1 ? arguments[1] : "";
    const auto number = [&](int n) { return std::strtoull(arguments[n], nullptr, 10); };
    const auto random = [&](int n) { return Random{number(n) * 0x9E3779B97F4A7C15ULL + 1}; };
    if (what == "flips" && count == 3)
        flips(unsigned(number(2)));
    else if (what == "bursts" && count == 4)
        bursts(unsigned(number(2)), random(3));
    else if (what == "random" && count == 4)
        random_frames(number(2), random(3));
    else if (what == "disturb" && count == 4)
        disturb(number(2), random(3));
    else if (what == "baud" && count == 4)
        baud(std::strtod(arguments[2], nullptr), random(3));
    else
        return std::fprintf(stderr,
                            "bus_run flips|bursts|random|disturb|baud …, see its first lines\n"),
               2;
    return 0;
}
