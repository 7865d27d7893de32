// SPDX-License-Identifier: Apache-2.0
// The channel of a plain card for step and direction: a step generator and a counter at the pins of
// a machine, as HostMot2 has them.
//
// The generator adds a rate to an accumulator in each cycle; each whole step that the accumulator
// has passed is a pulse. A pulse comes later where the driver needs time for its direction. The
// counter decodes A and B, one count an edge, keeps the cycle of its last change, and latches the
// count at a rising edge of Z.
#pragma once
#include <algorithm>
#include <cstdint>

#include "machines/machine.h"

namespace twin {

struct StepCard {             // in the order of machine.py
    int64_t accumulator = 0;  // steps, Q31.32
    int64_t emitted = 0;      // pulses, by direction
    int64_t count = 0;        // edges of A and B, by direction
    int64_t latched = 0;      // the count at the last rising edge of Z while armed
    uint64_t changed_at = 0;  // cycle of the last change of the count
    uint64_t ready_at = 0;    // cycle from which the driver takes the next change
    uint64_t errors = 0;      // changes of A and B at once: a count was lost
    int32_t rate = 0;         // steps per cycle, 2^-32
    uint32_t high = 1;        // length of a pulse, and of the pause after it and a new direction
    uint32_t armed = 0;       // 1: latch at the next rising edge of Z
    uint32_t enabled = 0;     // level of the pin that enables the driver
};

constexpr int STEP_BITS = 32;

// Cycles until the accumulator has passed a step more, or one less.
inline uint64_t until_step(int64_t accumulator, int32_t rate) {
    const int64_t one = int64_t(1) << STEP_BITS, within = accumulator & (one - 1);
    if (rate == 0) return NEVER;
    return rate > 0 ? uint64_t((one - within + rate - 1) / rate)
                    : uint64_t(within / -int64_t(rate) + 1);
}

inline int quarter_of(unsigned levels) {
    const int a = (levels & ENCODER_A) != 0, b = (levels & ENCODER_B) != 0;
    return b << 1 | (a ^ b);
}

// Runs a machine for some cycles with the card at its pins, straight from one event to the next.
// `drive` holds the levels of the pins.
inline void run_card(StepCard& card, Machine& machine, uint64_t& now, uint64_t clk,
                     unsigned& drive) {
    const uint64_t end = now + clk;
    unsigned levels = machine.levels();
    uint64_t low_at = drive & STEP ? card.ready_at - card.high : NEVER;
    drive = (drive & ~DRIVE_ENABLE) | card.enabled * DRIVE_ENABLE;
    while (now < end) {
        const int64_t owed = (card.accumulator >> STEP_BITS) - card.emitted;
        const uint64_t step = until_step(card.accumulator, card.rate);
        uint64_t next = std::min({end, low_at, std::max(now + 1, machine.event_at())});
        if (step != NEVER) next = std::min(next, now + step);
        if (owed) next = std::min(next, std::max(now + 1, card.ready_at));
        card.accumulator += int64_t(next - now) * card.rate;
        now = next;
        if (now >= low_at) {
            drive &= ~unsigned(STEP);
            low_at = NEVER;
        }
        const int64_t due = (card.accumulator >> STEP_BITS) - card.emitted;
        if (due && now >= card.ready_at) {
            const unsigned direction = due > 0 ? unsigned(DIRECTION) : 0;
            if ((drive & DIRECTION) != direction) {
                drive = (drive & ~unsigned(DIRECTION)) | direction;
                card.ready_at = now + card.high;
            } else {
                drive |= STEP;
                card.emitted += due > 0 ? 1 : -1;
                low_at = now + card.high;
                card.ready_at = low_at + card.high;
            }
        }
        machine.clk(now, drive);
        const unsigned after = machine.levels();
        const int moved = (quarter_of(after) - quarter_of(levels)) & 3;
        if (moved) {
            card.count += moved == 1 ? 1 : moved == 3 ? -1 : 0;
            card.errors += moved == 2;
            card.changed_at = now;
        }
        if (card.armed && after & ~levels & ENCODER_Z) {
            card.latched = card.count;
            card.armed = 0;
        }
        levels = after;
    }
}

}  // namespace twin
