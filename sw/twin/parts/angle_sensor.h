// SPDX-License-Identifier: Apache-2.0
// Absolute angle sensor (time grating, S4) that sends frames by itself over a serial line, 8 data
// bits, no parity, one stop bit:
//
//   A5 · sequence · angle · CRC-16
//
// The angle has four bytes, low first, 2^32 a turn. The CRC-16 covers the six bytes before it, low
// byte first, with the polynomial 0x1021 and the start 0xFFFF. The angle was measured `latency`
// before the first start bit. A share of the frames is left out, and another share has one damaged
// byte; the sequence numbers of both are counted.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "machines/machine.h"
#include "parts/random_source.h"

namespace twin {

class AngleSensor {
 public:
    static constexpr int BYTES = 8, CELLS = 10;

    AngleSensor(uint64_t seed, uint64_t stream)
        : random_(seed, stream), phase_(2 * M_PI * random_.uniform()) {}

    template <class P>
    void configure(const P& p, double clk_hz) {
        period_ = uint64_t(clk_hz / p.sensor_rate);
        latency_ = uint64_t(p.sensor_latency * clk_hz);
        bit_ = clk_hz / p.sensor_baud;
        error_ = p.sensor_error;
        noise_ = p.sensor_noise;
        waves_ = p.sensor_error_waves;
        dropped_share_ = p.sensor_dropped;
        corrupt_share_ = p.sensor_corrupt;
    }
    double reading(double angle) {  // rad
        return angle + ARC_SECOND * (error_ * std::sin(waves_ * angle + phase_) +
                                     noise_ * random_.uniform(-1, 1));
    }
    // the line in cycle `now`; returns the cycle of what comes next
    uint64_t advance(uint64_t now, double angle) {
        if (now >= sample_at_) {
            sample(angle);
            frame_at_ = now + latency_;
            sample_at_ =
                now + std::max<uint64_t>(period_, latency_ + uint64_t(BYTES * CELLS * bit_) + 1);
        }
        if (!sends_ || now < frame_at_)
            return sends_ ? std::min(sample_at_, frame_at_) : sample_at_;
        const int cell = int(double(now - frame_at_) / bit_);
        if (cell >= BYTES * CELLS) {
            rx = true;
            sends_ = false;
            return sample_at_;
        }
        const int bit = cell % CELLS;
        rx = bit == 0           ? false
             : bit == CELLS - 1 ? true
                                : bytes_[size_t(cell / CELLS)] >> (bit - 1) & 1;
        return frame_at_ + uint64_t(std::ceil((cell + 1) * bit_));
    }

    bool rx = true;
    bool stuck = false;                             // fault: sends the same angle for ever
    uint64_t frames = 0, dropped = 0, corrupt = 0;  // frames: all, with those

 private:
    static constexpr double ARC_SECOND = M_PI / 180 / 3600;

    void sample(double angle) {
        if (!stuck) {
            const double turns = reading(angle) / (2 * M_PI);
            word_ = uint32_t(int64_t(std::floor((turns - std::floor(turns)) * 0x1p32 + 0.5)));
        }
        bytes_ = {0xA5,
                  uint8_t(frames++),
                  uint8_t(word_),
                  uint8_t(word_ >> 8),
                  uint8_t(word_ >> 16),
                  uint8_t(word_ >> 24)};
        uint16_t crc = 0xFFFF;
        for (int n = 0; n < BYTES - 2; n++) {
            crc ^= uint16_t(bytes_[size_t(n)] << 8);
            for (int bit = 0; bit < 8; bit++)
                crc = uint16_t(crc << 1 ^ (crc & 0x8000 ? 0x1021 : 0));
        }
        bytes_[BYTES - 2] = uint8_t(crc);
        bytes_[BYTES - 1] = uint8_t(crc >> 8);
        const double chance = random_.uniform();
        sends_ = chance >= dropped_share_;
        dropped += !sends_;
        if (sends_ && chance < dropped_share_ + corrupt_share_) {
            bytes_[random_.bits() % BYTES] ^= uint8_t(1 + random_.bits() % 255);
            corrupt++;
        }
    }

    RandomSource random_;
    double phase_, bit_ = 1, error_ = 0, noise_ = 0, waves_ = 0, dropped_share_ = 0,
                   corrupt_share_ = 0;
    uint64_t period_ = 1, latency_ = 0, sample_at_ = 0, frame_at_ = 0;
    std::array<uint8_t, BYTES> bytes_{};
    uint32_t word_ = 0;
    bool sends_ = false;
};

}  // namespace twin
