// SPDX-License-Identifier: Apache-2.0
// ps2_run -- drive the Verilated ps2_pass between a keyboard and a host that know only the
// description of the interface.
//
//   ps2_run sequences COUNT SEED               keys of a person, commands, injections, frames that
//                                              the host cuts at random
//   ps2_run delay COUNT SEED                   keys alone: the longest delay, in us beyond the ten
//                                              bits of our frame
//   ps2_run wave RECORDING COUNT SEED FILE     a recorded keyboard (none if RECORDING is -), then
//                                              COUNT sequences, on wires that are written to FILE
//                                              for another decoder: one byte per cycle, clock |
//                                              data << 1; prints the bytes that it must find
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "figures/common.h"
#include "Vtop.h"
#include "verilated.h"

namespace {

using moire::Random;

constexpr int CLK_HZ = 400'000;
constexpr double US = CLK_HZ / 1e6;
// S4's shortcut, left Ctrl + W; our person never types 14, 1D
const std::vector<uint8_t> START = {0x14, 0x1D, 0xF0, 0x1D, 0xF0, 0x14};

int cycles(double us) { return std::max(1, int(us * US + 0.5)); }

bool parity(uint8_t byte) { return !(__builtin_popcount(byte) & 1); }  // of the frame
bool bit_of(uint8_t byte, int place) {
    return place == 0   ? false
           : place < 9  ? byte >> (place - 1) & 1
           : place == 9 ? parity(byte)
                        : true;
}

struct Keyboard {
    double half = 40;  // us, half a bit
    bool clock_low = false, data_low = false;
    std::deque<uint8_t> keys, answers;
    std::vector<uint8_t> commands;
    int64_t eleventh = 0;  // cycle of the last eleventh edge
    uint64_t aborts = 0;

    void step(int64_t now, bool clock, bool data) {
        if (state == FREE) {
            free = clock ? free + 1 : 0;
            if (free <= cycles(50)) return;
            if (!data)
                begin(HEAR);
            else if (!answers.empty() || !keys.empty())
                byte = answers.empty() ? keys.front() : answers.front(), begin(SAY);
            return;
        }
        if (--left > 0) return;
        phase++;
        left = cycles(phase == 1 ? half : half / 2);
        if (phase == 1) {  // the high half ends
            if (!clock) return stop();
            clock_low = true;
            if (place == 10) eleventh = now;
        } else if (phase == 2) {
            clock_low = false;
        } else {
            if (state == HEAR) bits |= int(data) << place;
            phase = 0;
            if (++place == 11) return finish();
            set_data();
        }
    }

 private:
    enum State { FREE, SAY, HEAR } state = FREE;
    int free = 0, left = 0, phase = 0, place = 0, bits = 0;
    uint8_t byte = 0, last = 0;

    void begin(State next) {
        state = next, phase = 0, place = 0, bits = 0, left = cycles(half / 2), set_data();
    }
    void set_data() {
        data_low = state == SAY ? !bit_of(byte, place) : place == 10 && (bits >> 9 & 1);
    }
    void stop() { clock_low = data_low = false, state = FREE, free = 0, aborts++; }
    void finish() {
        clock_low = data_low = false, free = 0;
        const State was = state;
        state = FREE;
        if (was == SAY) {
            last = byte;
            (answers.empty() ? keys : answers).pop_front();
            return;
        }
        const uint8_t command = uint8_t(bits);
        answers.clear();
        if ((bits >> 8 & 1) != parity(command) || !(bits >> 9 & 1))
            answers = {0xFE};
        else if (command == 0xFE)
            answers = {last};
        else
            commands.push_back(command), answers = {uint8_t(command == 0xEE ? 0xEE : 0xFA)};
    }
};

struct Host {
    double cut = 0;   // share of bits after which the clock is held low
    double rest = 0;  // us that it is held low after each byte
    bool clock_low = false, data_low = false;
    std::deque<uint8_t> orders;
    std::vector<uint8_t> received;
    int64_t eleventh = 0;
    uint64_t damaged = 0, unanswered = 0, cuts = 0;
    bool idle() const { return state == LISTEN && places == 0 && orders.empty(); }

    void step(int64_t now, bool clock, bool data, Random& random) {
        const bool fall = before && !clock;
        before = clock;
        switch (state) {
        case LISTEN:
            still++;
            if (fall) {
                still = 0;
                bits |= int(data) << places++;
                if (places == 11)
                    eleventh = now, judge();
                else if (cut > 0 && random.between(0, 1) < cut) {
                    // not just before the last edge: no device can know of it
                    then(BEFORE_PULL, random.between(1, places < 10 ? 75 : 60)),
                        pull_us = random.between(100, 400), cuts++;
                }
            } else if (places && still > cycles(300))
                places = bits = 0;
            else if (!places && !orders.empty())
                clock_low = true, then(REQUEST, 110);
            break;
        case BEFORE_PULL:
            if (--left <= 0) clock_low = true, then(PULL, pull_us);
            break;
        case PULL:
            if (--left <= 0) clock_low = false, then(SETTLE, 4);
            break;
        case REQUEST:
            if (--left <= 0) data_low = true, clock_low = false, places = 0, then(CLOCKED, 15'000);
            break;
        case CLOCKED:
            if (fall) {
                if (places == 10) {
                    unanswered += data, orders.pop_front(), then(SETTLE, 60);
                    break;
                }
                data_low = !bit_of(orders.front(), ++places), then(CLOCKED, 15'000);
            } else if (--left <= 0)
                unanswered++, data_low = false, orders.pop_front(), then(SETTLE, 60);
            break;
        case SETTLE:
            if (--left <= 0) state = LISTEN, places = bits = still = 0;
            break;
        }
    }

 private:
    enum State { LISTEN, BEFORE_PULL, PULL, REQUEST, CLOCKED, SETTLE } state = LISTEN;
    bool before = true;
    int places = 0, bits = 0, left = 0, still = 0;
    double pull_us = 0;

    void then(State next, double us) { state = next, left = cycles(us); }
    void judge() {
        const uint8_t byte = uint8_t(bits >> 1);
        const bool whole = !(bits & 1) && (bits >> 9 & 1) == parity(byte) && (bits >> 10 & 1);
        places = bits = 0;
        if (!whole)
            damaged++, orders.push_front(0xFE);
        else {
            received.push_back(byte);
            if (rest > 0) then(BEFORE_PULL, 60), pull_us = rest;
        }
    }
};

struct Bench {
    std::unique_ptr<VerilatedContext> context = std::make_unique<VerilatedContext>();
    std::unique_ptr<Vtop> pins = std::make_unique<Vtop>(context.get());
    Random random;
    Keyboard keyboard;
    Host host;
    std::deque<uint8_t> injection;
    std::string samples;
    bool writes = false;
    int64_t now = 0;

    explicit Bench(uint64_t seed) : random{seed * 0x9E3779B97F4A7C15ULL + 1} {
        pins->idle_ms = 20, pins->rst = 1;
        for (int n = 0; n < 4; n++) clk();
        pins->rst = 0;
        for (int n = 0; n < 40; n++) clk();
    }
    void clk() { clk(keyboard.clock_low, keyboard.data_low, true); }
    void clk(bool keyboard_clock_low, bool keyboard_data_low, bool live) {
        const bool keyboard_clock = !(pins->keyboard_clock_low || keyboard_clock_low);
        const bool keyboard_data = !(pins->keyboard_data_low || keyboard_data_low);
        const bool host_clock = !(pins->host_clock_low || host.clock_low),
                   host_data = !(pins->host_data_low || host.data_low);
        pins->keyboard_clock = keyboard_clock, pins->keyboard_data = keyboard_data;
        pins->host_clock = host_clock, pins->host_data = host_data;
        pins->inject_valid = !injection.empty();
        pins->inject = injection.empty() ? 0 : injection.front(),
        pins->inject_last = injection.size() == 1;
        pins->eval();
        const bool taken = pins->inject_valid && pins->inject_ready;
        if (writes) samples += char(host_clock | host_data << 1);
        pins->clk = 1, pins->eval();
        pins->clk = 0, pins->eval();
        now++;
        if (live) keyboard.step(now, keyboard_clock, keyboard_data);
        host.step(now, host_clock, host_data, random);
        if (taken) injection.pop_front();
    }
    void wait(double us) {
        for (int n = cycles(us); n > 0; n--) clk();
    }
};

// What the host may receive: keys in order, whole injections between whole sequences, answers.
struct Judge {
    std::deque<std::pair<uint8_t, bool>> expected;  // byte, last of its sequence
    size_t seen = 0, place = 0;
    uint64_t wrong = 0, bytes = 0, injections = 0, answers = 0;
    bool border = true;
    void judge(const std::vector<uint8_t>& received) {
        for (; seen < received.size(); seen++) {
            const uint8_t byte = received[seen];
            bytes++;
            if (byte == 0xFA || byte == 0xEE)
                answers++;
            else if (place || (byte == START[0] && border)) {
                wrong += byte != START[place];
                if (++place == START.size()) place = 0, injections++;
            } else if (expected.empty() || expected.front().first != byte)
                wrong++;
            else
                border = expected.front().second, expected.pop_front();
        }
    }
};

void type(Bench& bench, Judge& judge) {
    static const uint8_t codes[] = {0x1C, 0x1B, 0x23, 0x2B, 0x34, 0x33, 0x5A, 0x75, 0x83, 0x12};
    const uint8_t code = codes[bench.random.below(10)];
    std::vector<std::vector<uint8_t>> all;
    switch (bench.random.below(5)) {
    case 0: all = {{code}, {0xF0, code}}; break;
    case 1: all = {{0xE0, code}, {0xE0, 0xF0, code}}; break;
    case 2: all = {{0xE1, 0x12, 0x77, 0xE1, 0xF0, 0x12, 0xF0, 0x77}}; break;
    case 3:
        all = std::vector<std::vector<uint8_t>>(size_t(2 + bench.random.below(6)), {code});
        break;  // typematic
    default: all = {{0xE0, 0x12}, {0xE0, 0x7C}};
    }
    for (const auto& sequence : all)
        for (size_t n = 0; n < sequence.size(); n++) {
            bench.keyboard.keys.push_back(sequence[n]);
            judge.expected.emplace_back(sequence[n], n + 1 == sequence.size());
        }
}

int sequences(int count, uint64_t seed) {
    Bench bench(seed);
    Judge judge;
    std::vector<uint8_t> ordered;
    uint64_t started = 0, orders = 0;
    static const uint8_t commands[] = {0xED, 0xF3, 0xF4, 0xEE, 0x02, 0x20};
    for (int n = 0; n < count; n++) {
        bench.keyboard.half = bench.random.between(30, 50),
        bench.host.cut = bench.random.below(2) ? 0.02 : 0;
        type(bench, judge);
        if (bench.injection.empty() && bench.random.below(3) == 0)
            bench.injection.assign(START.begin(), START.end()), started++;
        if (bench.host.orders.empty() && bench.random.below(3) == 0) {
            bench.wait(bench.random.between(0, 30'000));
            const uint8_t command = commands[bench.random.below(6)];
            bench.host.orders.push_back(command), ordered.push_back(command), orders++;
        }
        bench.wait(bench.random.between(0, bench.random.below(2) ? 60'000 : 4'000));
        for (int ms = 0; ms < 200 && judge.answers < orders; ms++)  // the host waits for its answer
            bench.wait(1'000), judge.judge(bench.host.received);
        judge.judge(bench.host.received);
    }
    bench.host.cut = 0;
    bench.wait(1'500'000);
    judge.judge(bench.host.received);
    uint64_t wrong =
        judge.wrong + judge.expected.size() + bench.host.damaged + bench.host.unanswered;
    wrong += started - judge.injections + (ordered != bench.keyboard.commands) +
             (judge.answers != orders);
    std::printf("%llu wrong %llu bytes %llu injections %llu commands %llu cuts %.0f ms\n",
                (unsigned long long)wrong, (unsigned long long)judge.bytes,
                (unsigned long long)judge.injections, (unsigned long long)orders,
                (unsigned long long)bench.host.cuts, double(bench.now) * 1e3 / CLK_HZ);
    return 0;
}

int delay(int count, uint64_t seed) {
    Bench bench(seed);
    Judge judge;
    double longest = 0;
    for (int n = 0; n < count; n++) {
        bench.keyboard.half = bench.random.between(30, 50);
        bench.keyboard.keys.push_back(uint8_t(0x15 + bench.random.below(8) * 8));
        const size_t before = bench.host.received.size();
        for (int ms = 0; ms < 20 && bench.host.received.size() == before; ms++) bench.wait(1'000);
        if (bench.host.received.size() == before) return std::puts("1e9 us"), 0;
        longest =
            std::max(longest, double(bench.host.eleventh - bench.keyboard.eleventh) / US - 10 * 80);
        bench.wait(bench.random.between(0, 3'000));
    }
    std::printf("%.2f us\n", longest);
    return 0;
}

int wave(const char* recording, int count, uint64_t seed, const char* file) {
    Bench bench(seed);
    bench.host.rest = 150, bench.writes = true;
    std::ifstream lines(recording);
    std::string line;
    int64_t at = -1;
    int clock = 1, data = 1;
    while (std::getline(lines, line)) {
        long long next;
        int next_clock, next_data;
        if (std::sscanf(line.c_str(), "%lld,%d,%d", &next, &next_clock, &next_data) != 3) continue;
        if (at >= 0)
            for (int n = cycles(std::min(double(next - at) / 24, 5'000.0)); n > 0; n--)
                bench.clk(!clock, !data, false);
        at = next, clock = next_clock, data = next_data;
    }
    bench.wait(20'000);
    Judge judge;
    judge.seen = bench.host.received.size();
    for (int n = 0; n < count; n++) {
        type(bench, judge);
        if (bench.injection.empty() && bench.random.below(3) == 0)
            bench.injection.assign(START.begin(), START.end());
        bench.wait(bench.random.between(0, 50'000));
        judge.judge(bench.host.received);
    }
    bench.wait(500'000);
    judge.judge(bench.host.received);
    std::ofstream(file, std::ios::binary) << bench.samples;
    std::printf("%llu\n",
                (unsigned long long)(judge.wrong + judge.expected.size() + bench.host.damaged));
    for (uint8_t byte : bench.host.received) std::printf("%02x ", byte);
    std::puts("");
    return 0;
}

}  // namespace

int main(int count, char** words) {
    const std::string what = count > 1 ? words[1] : "";
    if (what == "sequences" && count == 4)
        return sequences(std::atoi(words[2]), std::strtoull(words[3], nullptr, 10));
    if (what == "delay" && count == 4)
        return delay(std::atoi(words[2]), std::strtoull(words[3], nullptr, 10));
    if (what == "wave" && count == 6)
        return wave(words[2], std::atoi(words[3]), std::strtoull(words[4], nullptr, 10), words[5]);
    std::fputs("ps2_run sequences COUNT SEED | delay COUNT SEED | wave RECORDING COUNT SEED FILE\n",
               stderr);
    return 2;
}
