// SPDX-License-Identifier: Apache-2.0
// Incremental scale: A/B, one edge a count, A leads on the way up; and its index or reference mark
// Z.
#pragma once
#include <cmath>
#include <cstdint>

#include "machines/machine.h"
#include "parts/random_source.h"

namespace twin {

class IncrementalScale {
 public:
    template <class P>
    void configure(const P& p) {
        count_ = p.scale_count;
        hysteresis_ = p.scale_hysteresis * p.scale_count;
        index_ = p.scale_index_position;
        width_ = p.scale_index_width;
        scatter_ = p.scale_index_scatter;
    }
    void move(double position, RandomSource& random) {
        const int64_t counts_before = counts_;
        if (position >= double(counts_ + 1) * count_)
            counts_ = int64_t(std::floor(position / count_));
        else if (position < double(counts_) * count_ - hysteresis_)
            counts_ = int64_t(std::floor((position + hysteresis_) / count_));
        changes_ += counts_ != counts_before;
        const bool before = z_;
        z_ = position >= index_ + rise_ && position < index_ + width_ + rise_;
        if (before && !z_) rise_ = random.uniform(-scatter_, scatter_);
    }
    unsigned levels() const {
        const unsigned quarter = unsigned(counts_) & 3;
        return ((quarter ^ quarter >> 1) & 1) * ENCODER_A | (quarter >> 1) * ENCODER_B |
               z_ * ENCODER_Z;
    }
    double distance_to_change(double position, double velocity) const {  // along the motion, m
        double distance = velocity > 0 ? double(counts_ + 1) * count_ - position
                                       : position - double(counts_) * count_ + hysteresis_;
        for (const double edge : {index_ + rise_, index_ + width_ + rise_}) {
            const double ahead = velocity > 0 ? edge - position : position - edge;
            if (ahead > 0 && ahead < distance) distance = ahead;
        }
        return std::fmax(distance, 0);
    }
    // the cycle in which a body that moves on like this changes a level
    uint64_t next_change(uint64_t now, double position, double velocity, double clk_hz) const {
        const double clk =
            velocity ? distance_to_change(position, velocity) / std::fabs(velocity) * clk_hz : 1e18;
        return clk < 1e15 ? now + 1 + uint64_t(clk) : NEVER;
    }
    int64_t counts() const { return counts_; }  // floor of position / count, but for the hysteresis
    uint64_t changes() const { return changes_; }  // of the counts, in both directions

 private:
    double count_ = 1, hysteresis_ = 0, index_ = 0, width_ = 0, scatter_ = 0, rise_ = 0;
    int64_t counts_ = 0;
    uint64_t changes_ = 0;
    bool z_ = false;
};

}  // namespace twin
