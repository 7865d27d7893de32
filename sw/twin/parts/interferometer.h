// SPDX-License-Identifier: Apache-2.0
// Grating interferometer of one axis, from the position of the table to the pins of the node: sine
// and cosine through two converters that sample together, and the comparators' quadrature levels
// with their spikes.
//
//   phase  = 2 pi (position + scale error - grating_offset) / period
//   sine   = sin(phase) and cosine = cos(phase), with their errors
//   levels: A = cosine > 0, B = sine > 0
//
// Of the errors, the harmonics +-2 ... +-8 are added to exp(i phase) first, then gain, phase error
// and offset. At a rising edge of A, B = 0 means forward (S0).
//
// The frame is that of the AD7356 class. The falling edge of cs_n samples and puts out the first
// leading zero; each falling edge of sclk puts out the next bit: the second leading zero, then the
// word in straight binary, MSB first, then zeros.
#pragma once
#include <cstdint>

#include "parameters.h"
#include "parts/random_source.h"
#include "parts/scale_error.h"

namespace twin {

class Interferometer {
 public:
    Interferometer(const StageParameters& parameters, uint64_t seed, uint64_t stream,
                   double clk_hz);

    uint64_t advance(
        uint64_t now,
        double position);  // levels in cycle `now`; returns the cycle of the next change of a spike
    void sample(double position);        // conversion of both channels
    void chip_select(double position) {  // falling edge of cs_n
        sample(position);
        shift_sin_ = code_sin << first_bit_;
        shift_cos_ = code_cos << first_bit_;
    }
    void next_bit() {  // falling edge of sclk
        shift_sin_ <<= 1;
        shift_cos_ <<= 1;
    }
    unsigned sdata_sin() const { return shift_sin_ >> 31; }
    unsigned sdata_cos() const { return shift_cos_ >> 31; }
    void analogue(double position, double& sine,
                  double& cosine) const;  // of full scale, without noise

    void configure();  // take over changed parameters

    bool a = false, b = false;                  // levels of the comparators
    uint32_t code_sin = 0, code_cos = 0;        // last conversion, straight binary
    bool cut = false, converter_stuck = false;  // faults: no light, no conversion

 private:
    struct Spikes {
        RandomSource random;
        uint64_t start, end;
    };
    void draw(Spikes& spikes, uint64_t after);
    uint32_t convert(double value);

    const StageParameters& p;
    static constexpr int HIGHEST = 8;
    double plus_[HIGHEST + 1] = {}, minus_[HIGHEST + 1] = {};  // harmonics
    int highest_ = 0;                                          // of them that is not zero
    uint64_t seed_, stream_;
    ScaleError scale_error_;
    double clk_hz_, sin_of_error_ = 0, cos_of_error_ = 1;
    int first_bit_ = 0;  // of the word, in the 32 bits that are shifted out
    RandomSource random_;
    Spikes spikes_a_, spikes_b_;
    bool clean_a_ = false, clean_b_ = false;
    uint32_t shift_sin_ = 0, shift_cos_ = 0;
};

}  // namespace twin
