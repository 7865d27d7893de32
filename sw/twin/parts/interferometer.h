// SPDX-License-Identifier: Apache-2.0
// Grating interferometer of one axis, from the position of the table to the pins of the node: sine
// and cosine through two converters that sample together, and the comparators' quadrature levels
// with their spikes.
//
//   phase  = 2 pi (position + scale error - grating_offset) / period
//   sine   = sin(phase) and cosine = cos(phase), with their errors
//   levels: A = cosine > 0, B = sine > 0, with hysteresis and noise of the comparators
//
// Of the errors, the harmonics +-2 ... +-8 are added to exp(i phase) first, then gain, phase error
// and offset; these may change with time and along the travel (signal_drift.h). At a rising edge of
// A, B = 0 means forward (S0).
//
// A receiver of limited bandwidth delays and weakens the signals while the table moves. The
// converter of the cosine samples later than that of the sine (skew). A converter bends its words
// (integral nonlinearity: an S with its zeros at the ends and in the middle), and the edges of the
// bridge couple into them.
//
// The frame is that of the AD7356 class. The falling edge of cs_n samples and puts out the first
// leading zero; each falling edge of sclk puts out the next bit: the second leading zero, then the
// word in straight binary, MSB first, then zeros.
#pragma once
#include <cstdint>

#include "parameters.h"
#include "parts/random_source.h"
#include "parts/scale_error.h"
#include "parts/signal_drift.h"

namespace twin {

struct Motion {                     // of the table against the reading head
    double position, velocity = 0;  // m, m/s
    double time = 0;                // s from power-up
};

class Interferometer {
 public:
    Interferometer(const StageParameters& parameters, uint64_t seed, uint64_t stream,
                   double clk_hz);

    // levels in cycle `now`; returns the cycle of the next change of a spike
    uint64_t advance(uint64_t now, const Motion& table);
    // conversion of both channels; coupled: what the bridge adds to both words, LSB
    void sample(const Motion& table, double coupled = 0);
    void chip_select(const Motion& table, double coupled = 0) {  // falling edge of cs_n
        sample(table, coupled);
        shift_sin_ = code_sin << first_bit_;
        shift_cos_ = code_cos << first_bit_;
    }
    void next_bit() {  // falling edge of sclk
        shift_sin_ <<= 1;
        shift_cos_ <<= 1;
    }
    unsigned sdata_sin() const { return shift_sin_ >> 31; }
    unsigned sdata_cos() const { return shift_cos_ >> 31; }
    // of full scale, without noise
    void analogue(const Motion& table, double& sine, double& cosine) const;

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
    uint32_t convert(double value, double coupled);

    const StageParameters& p;
    static constexpr int HIGHEST = 8;
    double plus_[HIGHEST + 1] = {}, minus_[HIGHEST + 1] = {};  // harmonics
    int highest_ = 0;                                          // of them that is not zero
    uint64_t seed_, stream_;
    ScaleError scale_error_;
    SignalDrift drift_;
    double clk_hz_;
    int first_bit_ = 0;  // of the word, in the 32 bits that are shifted out
    RandomSource random_, comparator_noise_;
    Spikes spikes_a_, spikes_b_;
    bool clean_a_ = false, clean_b_ = false;
    uint32_t shift_sin_ = 0, shift_cos_ = 0;
};

}  // namespace twin
