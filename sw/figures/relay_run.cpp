// SPDX-License-Identifier: Apache-2.0
// relay_run -- drive the Verilated relay with the edges of a ring, and compare what comes out with
// the corrected position.
//
//   relay_run accuracy POINTS SEED           at rest, all orders on: the largest difference of the
//                                            correction from double precision
//   relay_run latency SEED                   the longest time from an edge in to the edge out
//   relay_run edges PER_SECOND COUNT SEED    edges from a clock of their own, with reversals: the
//                                            cycles with a wrong count
//
// The set of coefficients goes in over the UART, byte for byte, as a host sends it. At rest the
// output is right if it is within half a count and the hysteresis of the position that the set
// means for the ring. In motion it is judged in every cycle against the position of LATENCY cycles
// before; one edge under way and the lag that harmonic_map states are allowed besides.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "experiments/relay_pins.h"
#include "figures/common.h"

namespace {

using moire::Random;
using moire::RelayPins;

constexpr int K = RelayPins::K, STEPS = RelayPins::STEPS, ROUND = RelayPins::ROUND;
constexpr int LATENCY = 10, COUNTS = 32768;
constexpr double CLK_HZ = 48e6, PI = 3.14159265358979323846, ARCSEC = 1296000.0 / COUNTS;
constexpr double HYSTERESIS = 0.25;
constexpr unsigned BEHIND = 16;  // flag: the relay makes up a jump, as when correction begins

void word(std::vector<uint8_t>& row, uint32_t value) {
    for (int n = 0; n < 32; n += 8) row.push_back(uint8_t(value >> n));
}

void word_of_crc(std::vector<uint8_t>& row) { word(row, moire::crc32(row.data(), row.size())); }

struct Ring {  // the terms, as the words that are written mean them
    int32_t amplitude[K];
    uint32_t phase[K];
    double gain = 1, curve = 0;
    explicit Ring(Random& random) {  // the paper's: 134.59 arcsec at its peak, small higher orders
        for (int n = 0; n < STEPS; n++) gain *= std::sqrt(1 + std::pow(4.0, -n));
        for (int k = 1; k <= K; k++) {
            const double small = 6 + (k > 3 ? 2 * random.share() : 0);
            const double arcsec = k == 1 ? 105 : k == 2 ? 40 : k == 3 ? 12 : small;
            amplitude[k - 1] = int32_t(std::lround(arcsec / ARCSEC * 65536 / gain));
            phase[k - 1] = random.bits32();
            curve += k * k * arcsec / ARCSEC;
        }
        curve *= std::pow(2 * PI / COUNTS, 2);
    }
    double correction(double position) const {
        double sum = 0;
        for (int k = 1; k <= K; k++)
            sum += amplitude[k - 1] / 65536.0 * gain *
                   std::sin(2 * PI * (k * position / COUNTS + phase[k - 1] / 4294967296.0));
        return sum;
    }
    std::vector<uint8_t> image() const {
        const uint64_t angle = (uint64_t(1) << 48) / COUNTS;
        const double radians = 2 * PI / COUNTS;
        std::vector<uint8_t> row;
        word(row, 0x4D4F4900 + K), word(row, COUNTS);
        word(row, uint32_t(angle)), word(row, uint32_t(angle >> 32) | 1 << 16);
        word(row, uint32_t(std::llround(radians * std::pow(2.0, 40))));
        word(row, uint32_t(HYSTERESIS * 65536));
        for (int n = 0; n < K; n++) word(row, uint32_t(amplitude[n])), word(row, phase[n]);
        word_of_crc(row);
        return row;
    }
};

class Relay : public RelayPins {
 public:
    double bound = 0;  // counts that the output may be off in motion; 0: it is not judged
    uint64_t wrong = 0;

    explicit Relay(const Ring& ring) : RelayPins(COUNTS, -8) {
        for (int at = 0; at < COUNTS; at++) corrections.push_back(ring.correction(at));
        const auto image = ring.image();
        for (size_t begin = 0; begin < image.size(); begin += 62)
            ask(begin ? 3 : 2, image.data() + begin, std::min<size_t>(62, image.size() - begin));
        while (position < 8) position++, show(), wait(8);
        wait(3 * ROUND);
        if (!pins.correcting)
            std::fprintf(stderr, "relay_run: the set was not taken, or the index not met\n"),
                std::exit(1);
    }
    double right(int64_t at) const {  // what the output should be
        return double(at) - corrections[size_t((at % COUNTS + COUNTS) % COUNTS)];
    }
    double correction() {
        const auto status = ask(0);
        int32_t value;
        std::memcpy(&value, status.data() + 11, 4);
        return value / 65536.0;
    }
    unsigned flags() { return ask(0)[0]; }

 protected:
    void judge() override {
        positions[cycles % (LATENCY + 1)] = position;
        const int64_t before = positions[(cycles + 1) % (LATENCY + 1)];
        if (bound > 0) wrong += std::fabs(double(counted) - right(before)) > bound;
    }

 private:
    int64_t positions[LATENCY + 1] = {};  // of the cycles before, in a ring
    std::vector<double> corrections;      // by position
    uint8_t sequence = 0;

    // The answer to a request, from its flags on.
    std::vector<uint8_t> ask(uint8_t kind, const uint8_t* more = nullptr, size_t size = 0) {
        std::vector<uint8_t> row{0x21, uint8_t(size + 2), ++sequence, kind};
        row.insert(row.end(), more, more + size);
        word_of_crc(row);
        std::vector<unsigned> words(row.begin(), row.end());
        words[0] |= 0x100;
        const auto answer = exchange(words);
        if (answer.size() != 23) std::fprintf(stderr, "relay_run: no answer\n"), std::exit(1);
        return {answer.begin() + 4, answer.end() - 4};
    }
};

int accuracy(Relay& relay, const Ring& ring, int points) {
    double worst = 0;
    for (int point = 0; point < points; point++) {
        const int64_t goal = int64_t(COUNTS) * (point + 1) / points;
        while (relay.position < goal) relay.position++, relay.show(), relay.wait(1);
        relay.wait(2 * ROUND + 16);
        const double error = relay.correction() - ring.correction(double(relay.position));
        worst = std::max(worst, std::fabs(error));
    }
    return std::printf("%.6f arcsec %d points\n", worst * ARCSEC, points), 0;
}

int latency(Relay& relay, Random& random) {
    uint64_t longest = 0;
    unsigned long long answered = 0;
    for (int n = 0; n < 20000; n++) {
        const int64_t before = relay.counted;
        const uint64_t begin = relay.cycles;
        relay.position++, relay.show(), relay.wait(16 + int(random.bits32() % 64));
        if (relay.counted == before) continue;  // where the correction takes the edge back
        longest = std::max(longest, relay.last_edge - begin);
        answered++;
    }
    std::printf("%llu clk %llu answered\n", (unsigned long long)longest, answered);
    return 0;
}

int edges(Relay& relay, const Ring& ring, Random& random, double per_second, uint64_t count) {
    const double each = CLK_HZ / per_second, moved = ROUND / each;  // cycles per edge
    const double still = 0.5 + HYSTERESIS + 0.001;
    uint64_t made = 0, rests = 0;
    relay.bound = still + 3 * moved * moved * ring.curve + 1;  // one edge may be under way
    while (made < count) {
        const int direction = random.bits32() & 1 ? 1 : -1;
        const bool few = random.bits32() & 3;
        const uint64_t run = 1 + random.bits32() % (few ? 40 : 60000);
        double next = double(relay.cycles) + each * random.share();
        for (uint64_t n = 0; n < run; n++, next += each) {
            while (double(relay.cycles) < next) relay.cycle();
            relay.position += direction, relay.show(), made++;
        }
        if (random.bits32() % 4) continue;
        relay.wait(2 * ROUND + 64);
        rests++;
        relay.wrong += std::fabs(double(relay.counted) - relay.right(relay.position)) > still;
    }
    relay.bound = 0;
    const unsigned flags = relay.flags();
    const uint64_t wrong = relay.wrong + relay.double_edges + (flags & ~BEHIND ? 1 : 0);
    std::printf("%llu edges %llu wrong %llu rests %llu clk %u flags\n", (unsigned long long)made,
                (unsigned long long)wrong, (unsigned long long)rests,
                (unsigned long long)relay.cycles, flags);
    return 0;
}

}  // namespace

double sc_time_stamp() { return 0; }

int main(int count, char** words) {
    const std::string kind = count > 1 ? words[1] : "";
    if (count < 3)
        return std::fprintf(stderr,
                            "usage: relay_run accuracy POINTS SEED | latency SEED | "
                            "edges PER_SECOND COUNT SEED\n"),
               2;
    const uint64_t seed = std::strtoull(words[count - 1], nullptr, 10);
    Random random{seed * 0x9E3779B97F4A7C15ULL + 1};
    for (int n = 0; n < 8; n++) random();
    const Ring ring(random);
    const auto relay = std::make_unique<Relay>(ring);
    if (kind == "accuracy" && count == 4) return accuracy(*relay, ring, std::atoi(words[2]));
    if (kind == "latency" && count == 3) return latency(*relay, random);
    if (kind == "edges" && count == 5)
        return edges(*relay, ring, random, std::atof(words[2]),
                     std::strtoull(words[3], nullptr, 10));
    return std::fprintf(stderr, "relay_run: there is no mode %s\n", kind.c_str()), 2;
}
