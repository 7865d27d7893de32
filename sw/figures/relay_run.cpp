// SPDX-License-Identifier: Apache-2.0
// relay_run -- drive the Verilated relay with the edges of a ring, and hold what comes out against
// the corrected position.
//
//   relay_run accuracy POINTS SEED     at rest, all orders on: largest error of the correction
//   against double precision relay_run latency SEED             clk from an edge in to the edge
//   out, longest relay_run edges PER_SECOND COUNT SEED    edges of a clock of their own, with
//   reversals: clks with a wrong count relay_run serve COUNTS PLACE       a ring of so many counts
//   a turn that rests there at power-up, moved by lines of the standard
//                                      input: `words W W ...` goes over the UART and gives the
//                                      words of the answer; `go PLACE CLK` turns the ring, CLK a
//                                      count, lets it rest, and gives the count of the output and
//                                      the flag pins
//
// In the first three the set goes in over the UART, byte for byte, as a host sends it. At rest the
// output is right if it is within half a count and the hysteresis of the position that the set
// means for the ring; in motion, in every clk and for the place of LATENCY clk before, one edge on
// its way and the lag that harmonic_map states are allowed besides.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "Vtop.h"
#include "verilated.h"

namespace {

constexpr int K = 16, BIT = 16, LATENCY = 10, STEPS = 22, COUNTS = 32768,
              ROUND = (STEPS + 2) * K + 35;
constexpr double CLK_HZ = 48e6, PI = 3.14159265358979323846, ARCSEC = 1296000.0 / COUNTS,
                 HYSTERESIS = 0.25;
constexpr unsigned BEHIND =
    16;  // the flag of a relay that makes up a jump, as it does when the correction begins

struct Random {  // xorshift64*
    uint64_t state;
    uint32_t operator()() {
        state ^= state >> 12, state ^= state << 25, state ^= state >> 27;
        return uint32_t((state * 2685821657736338717ULL) >> 32);
    }
    double below(double top) { return top * (*this)() / 4294967296.0; }
};

uint32_t crc32(const std::vector<uint8_t>& row) {
    uint32_t crc = ~0u;
    for (uint8_t byte : row) {
        crc ^= byte;
        for (int n = 0; n < 8; n++) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
    }
    return ~crc;
}

void word(std::vector<uint8_t>& row, uint32_t value) {
    for (int n = 0; n < 32; n += 8) row.push_back(uint8_t(value >> n));
}

struct Ring {  // the terms, as the words that are written mean them
    int32_t amplitude[K];
    uint32_t phase[K];
    double gain = 1, curve = 0;
    explicit Ring(
        Random& random) {  // the paper's ring: 134.59 arcsec at its peak, and small higher orders
        for (int n = 0; n < STEPS; n++) gain *= std::sqrt(1 + std::pow(4.0, -n));
        for (int k = 1; k <= K; k++) {
            const double arcsec = k == 1 ? 105 : k == 2 ? 40 : k == 3 ? 12 : 6 + random.below(2);
            amplitude[k - 1] = int32_t(std::lround(arcsec / ARCSEC * 65536 / gain));
            phase[k - 1] = random();
            curve += k * k * arcsec / ARCSEC;
        }
        curve *= std::pow(2 * PI / COUNTS, 2);
    }
    double correction(double place) const {
        double sum = 0;
        for (int k = 1; k <= K; k++)
            sum += amplitude[k - 1] / 65536.0 * gain *
                   std::sin(2 * PI * (k * place / COUNTS + phase[k - 1] / 4294967296.0));
        return sum;
    }
    std::vector<uint8_t> image() const {
        const uint64_t angle = (uint64_t(1) << 48) / COUNTS;
        std::vector<uint8_t> row;
        word(row, 0x4D4F4900 + K), word(row, COUNTS), word(row, uint32_t(angle)),
            word(row, uint32_t(angle >> 32) | 1 << 16);
        word(row, uint32_t(std::llround(2 * PI / COUNTS * std::pow(2.0, 40)))),
            word(row, uint32_t(HYSTERESIS * 65536));
        for (int n = 0; n < K; n++) word(row, uint32_t(amplitude[n])), word(row, phase[n]);
        word(row, crc32(row));
        return row;
    }
};

struct Relay {
    VerilatedContext context;
    Vtop pins{&context};
    const int64_t counts;    // per turn
    int64_t place, counted;  // of the ring and of the output, counts from the index
    unsigned levels = 0;
    uint64_t clks = 0, double_edges = 0, last_edge = 0;
    bool watch = false;
    int64_t places[LATENCY + 1] = {};  // of the clk before, in a ring
    std::vector<double> corrections;   // by place
    double bound = 0;  // counts that the output may be off in motion; 0: nobody looks
    uint64_t wrong = 0;
    uint8_t sequence = 0;

    double wanted(int64_t at) const {
        return double(at) - corrections[size_t((at % COUNTS + COUNTS) % COUNTS)];
    }
    void show() {
        const unsigned b = place >> 1 & 1, a = b ^ (place & 1);
        pins.encoder_a = a, pins.encoder_b = b, pins.encoder_z = place % counts == 0;
    }
    void clk() {
        pins.clk = 1, pins.eval();
        pins.clk = 0, pins.eval();
        clks++;
        const unsigned now = pins.relay_b << 1 | (pins.relay_a ^ pins.relay_b),
                       turned = (now - levels) & 3;
        if (watch && turned) {
            counted += turned == 1 ? 1 : turned == 3 ? -1 : 0, double_edges += turned == 2;
            last_edge = clks;
        }
        levels = now;
        places[clks % (LATENCY + 1)] = place;
        if (bound > 0)
            wrong +=
                std::fabs(double(counted) - wanted(places[(clks + 1) % (LATENCY + 1)])) > bound;
    }
    void wait(int count) {
        while (count--) clk();
    }
    std::vector<unsigned> exchange(
        const std::vector<unsigned>& words) {  // 9-bit words; those of the answer
        std::vector<unsigned> answer;
        for (unsigned sent : words)
            for (int bit = 0; bit < 11; bit++)
                pins.rs485_rx = bit == 0 ? 0 : bit < 10 ? sent >> (bit - 1) & 1 : 1, wait(BIT);
        for (int silent = 0; silent < 1000 && !pins.rs485_driver_enable; silent++) clk();
        while (pins.rs485_driver_enable) {
            if (pins.rs485_tx) {
                clk();
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
    std::vector<uint8_t> ask(uint8_t kind, const uint8_t* more = nullptr,
                             size_t size = 0) {  // the answer from flags on
        std::vector<uint8_t> row{0x21, uint8_t(size + 2), ++sequence, kind};
        row.insert(row.end(), more, more + size);
        word(row, crc32(row));
        std::vector<unsigned> words(row.begin(), row.end());
        words[0] |= 0x100;
        const auto answer = exchange(words);
        if (answer.size() != 23) std::fprintf(stderr, "relay_run: no answer\n"), std::exit(1);
        return {answer.begin() + 4, answer.end() - 4};
    }
    double correction() {
        const auto told = ask(0);
        int32_t value;
        std::memcpy(&value, told.data() + 11, 4);
        return value / 65536.0;
    }
    unsigned flags() { return ask(0)[0]; }
    Relay(int64_t counts, int64_t place) : counts(counts), place(place), counted(place) {
        pins.rs485_rx = pins.flash_sdi = 1, pins.rst = 1, show(), wait(4), pins.rst = 0;
        wait(2 * (2048 + 66 * (4 * (7 + 2 * K) + 5)) + 1000);  // both copies of an empty flash
        watch = true;
    }
    explicit Relay(const Ring& ring) : Relay(COUNTS, -8) {
        for (int at = 0; at < COUNTS; at++) corrections.push_back(ring.correction(at));
        const auto image = ring.image();
        for (size_t begin = 0; begin < image.size(); begin += 62)
            ask(begin ? 3 : 2, image.data() + begin, std::min<size_t>(62, image.size() - begin));
        while (place < 8) place++, show(), wait(8);
        wait(3 * ROUND);
        if (!pins.correcting)
            std::fprintf(stderr, "relay_run: the set was not taken, or the index not met\n"),
                std::exit(1);
    }
};

int accuracy(Relay& relay, const Ring& ring, int points) {
    double worst = 0;
    for (int point = 0; point < points; point++) {
        const int64_t goal = int64_t(COUNTS) * (point + 1) / points;
        while (relay.place < goal) relay.place++, relay.show(), relay.wait(1);
        relay.wait(2 * ROUND + 16);
        worst =
            std::max(worst, std::fabs(relay.correction() - ring.correction(double(relay.place))));
    }
    return std::printf("%.6f arcsec %d points\n", worst * ARCSEC, points), 0;
}

int latency(Relay& relay, Random& random) {
    uint64_t longest = 0;
    for (int n = 0; n < 20000; n++) {
        const int64_t before = relay.counted;
        const uint64_t begin = relay.clks;
        relay.place++, relay.show(), relay.wait(16 + int(random() % 64));
        if (relay.counted - before == 1)
            longest = std::max(longest,
                               relay.last_edge - begin);  // none or two where the correction rounds
    }
    return std::printf("%llu clk\n", (unsigned long long)longest), 0;
}

int edges(Relay& relay, const Ring& ring, Random& random, double per_second, uint64_t count) {
    const double each = CLK_HZ / per_second, moved = ROUND / each,
                 still = 0.5 + HYSTERESIS + 0.001;  // each: clk
    uint64_t made = 0, rests = 0;
    relay.bound = still + 3 * moved * moved * ring.curve + 1;  // one edge may be on its way
    while (made < count) {
        const int way = random() & 1 ? 1 : -1;
        const uint64_t run = 1 + (random() & 3 ? random() % 40 : random() % 60000);
        double next = double(relay.clks) + random.below(each);
        for (uint64_t n = 0; n < run; n++, next += each) {
            while (double(relay.clks) < next) relay.clk();
            relay.place += way, relay.show(), made++;
        }
        if (random() % 4) continue;
        relay.wait(2 * ROUND + 64);
        rests++,
            relay.wrong += std::fabs(double(relay.counted) - relay.wanted(relay.place)) > still;
    }
    relay.bound = 0;
    const unsigned flags = relay.flags();
    const uint64_t wrong = relay.wrong + relay.double_edges + (flags & ~BEHIND ? 1 : 0);
    return std::printf("%llu edges %llu wrong %llu rests %llu clk %u flags\n",
                       (unsigned long long)made, (unsigned long long)wrong,
                       (unsigned long long)rests, (unsigned long long)relay.clks, flags),
           0;
}

int serve(Relay& relay) {
    char line[4096];
    while (std::fgets(line, sizeof line, stdin)) {
        std::istringstream in(line);
        std::string kind;
        in >> kind;
        if (kind == "words") {
            std::vector<unsigned> words;
            for (unsigned one; in >> one;) words.push_back(one);
            for (unsigned heard : relay.exchange(words)) std::printf("%u ", heard);
        } else if (kind == "go") {
            int64_t goal = 0;
            int each = 1;
            in >> goal >> each;
            while (relay.place != goal)
                relay.place += goal > relay.place ? 1 : -1, relay.show(), relay.wait(each);
            relay.wait(2 * ROUND + 64);
            std::printf("%lld %d %d", (long long)relay.counted, int(relay.pins.correcting),
                        int(relay.pins.fault));
        }
        std::printf("\n"), std::fflush(stdout);
    }
    return 0;
}

}  // namespace

double sc_time_stamp() { return 0; }

int main(int count, char** words) {
    const std::string kind = count > 1 ? words[1] : "";
    if (count < 3)
        return std::fprintf(stderr,
                            "usage: relay_run accuracy POINTS SEED | latency SEED | edges "
                            "PER_SECOND COUNT SEED | serve COUNTS PLACE\n"),
               2;
    if (kind == "serve" && count == 4)
        return serve(*std::make_unique<Relay>(std::atoll(words[2]), std::atoll(words[3])));
    Random random{std::strtoull(words[count - 1], nullptr, 10) * 0x9E3779B97F4A7C15ULL + 1};
    for (int n = 0; n < 8; n++) random();
    const Ring ring(random);
    auto relay = std::make_unique<Relay>(ring);
    if (kind == "accuracy" && count == 4) return accuracy(*relay, ring, std::atoi(words[2]));
    if (kind == "latency" && count == 3) return latency(*relay, random);
    if (kind == "edges" && count == 5)
        return edges(*relay, ring, random, std::atof(words[2]),
                     std::strtoull(words[3], nullptr, 10));
    return std::fprintf(stderr, "relay_run: what is %s?\n", kind.c_str()), 2;
}
