// SPDX-License-Identifier: Apache-2.0
// The 16-bit bipolar DAC that a node drives: data in at rising sclk while cs_n is low, MSB
// first; rising cs_n loads the last 16 bits. Offset binary: 32768 = 0 V. AD5542A class.
#pragma once
#include <cstdint>

#include "machines/machine.h"

namespace twin {

class DacInput {
 public:
    static constexpr unsigned BITS = 16, ZERO = 1u << (BITS - 1);

    void drive_changed(unsigned before, unsigned after) {
        const unsigned rising = ~before & after, falling = before & ~after;
        if (falling & DAC_CS_N) clocks_ = 0;
        if ((rising & DAC_SCLK) && !(before & DAC_CS_N)) {
            shift_ = uint16_t(shift_ << 1 | ((after & DAC_SDI) != 0));
            clocks_++;
        }
        if (rising & DAC_CS_N) {
            code = shift_;
            frames++;
            bad_frames += clocks_ != BITS;
        }
    }
    double share() const { return (double(code) - ZERO) / ZERO; }  // of the reference, -1..1

    unsigned code = ZERO;                 // held by its reset until the first frame
    uint64_t frames = 0, bad_frames = 0;  // bad: not of 16 cycles

 private:
    uint16_t shift_ = ZERO;
    unsigned clocks_ = 0;
};

}  // namespace twin
