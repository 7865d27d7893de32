// SPDX-License-Identifier: Apache-2.0
// The registers and memories of a Verilated node by name, and the flip of one of their bits, as a
// particle does it in a chip: between two rising edges, seen by all logic behind it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace twin {

struct Register {
    const char* name;      // as Verilator names it
    unsigned bits, words;  // a flip-flop has one word, a memory more
    size_t offset, size;   // of the first word in Verilator's class, and of each word, in bytes
};

// Flips a bit, then flips it back if called once more. Verilator keeps the low byte first.
template <class Signals>
void flip(Signals& signals, const Register& where, unsigned word, unsigned bit) {
    auto* bytes = reinterpret_cast<uint8_t*>(&signals) + where.offset + word * where.size;
    bytes[bit / 8] ^= uint8_t(1u << bit % 8);
}

template <class Signals>
bool bit_of(const Signals& signals, const Register& where, unsigned word, unsigned bit) {
    auto* bytes = reinterpret_cast<const uint8_t*>(&signals) + where.offset + word * where.size;
    return bytes[bit / 8] >> bit % 8 & 1;
}

}  // namespace twin
