// SPDX-License-Identifier: Apache-2.0
// relay_serve -- the Verilated relay behind a ring, moved and asked by lines of standard input.
//
//   relay_serve COUNTS POSITION    the ring has so many counts per turn and is there at power-up
//
// `words W W ...` goes over the UART, and the line that comes back holds the words of the answer.
// `go POSITION CYCLES` turns the ring with so many cycles per count and lets it rest; what comes
// back is the count of the output, and the pins `correcting` and `fault`.
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>

#include "experiments/relay_pins.h"

double sc_time_stamp() { return 0; }

int main(int count, char** words) {
    if (count != 3) return std::fprintf(stderr, "usage: relay_serve COUNTS POSITION\n"), 2;
    const auto relay =
        std::make_unique<moire::RelayPins>(std::atoll(words[1]), std::atoll(words[2]));
    char line[4096];
    while (std::fgets(line, sizeof line, stdin)) {
        std::istringstream in(line);
        std::string kind;
        in >> kind;
        if (kind == "words") {
            std::vector<unsigned> sent;
            for (unsigned one; in >> one;) sent.push_back(one);
            for (unsigned heard : relay->exchange(sent)) std::printf("%u ", heard);
        } else if (kind == "go") {
            int64_t goal = 0;
            int cycles = 1;
            in >> goal >> cycles;
            while (relay->position != goal)
                relay->position += goal > relay->position ? 1 : -1, relay->show(),
                    relay->wait(cycles);
            relay->wait(2 * moire::RelayPins::ROUND + 64);
            std::printf("%lld %d %d", (long long)relay->counted, int(relay->pins.correcting),
                        int(relay->pins.fault));
        }
        std::printf("\n"), std::fflush(stdout);
    }
}
