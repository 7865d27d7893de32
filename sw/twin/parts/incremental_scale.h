// SPDX-License-Identifier: Apache-2.0
// Incremental scale: A/B, one edge a count, A leads on the way up; and its index or reference mark
// Z.
//
// On the way down, each edge is lower by its hysteresis. A duty error makes the high levels of A
// and B longer than half a period, a phase error shifts the edges of B; both are the same in each
// period. The scatter of an edge is drawn again each time the scale has passed it.
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
        hysteresis_ = p.scale_hysteresis * count_;
        scatter_ = p.scale_edge_scatter * count_;
        index_hysteresis_ = p.scale_index_hysteresis;
        index_scatter_ = p.scale_index_scatter;
        low_.at = p.scale_index_position;
        high_.at = p.scale_index_position + p.scale_index_width;
        const double duty = p.scale_duty_error / 180 * count_,
                     phase = p.scale_phase_error / 90 * count_;
        shift_[0] = phase + duty;  // of the edge where B falls, on the way up
        shift_[1] = -duty;         // A rises
        shift_[2] = phase - duty;  // B rises
        shift_[3] = duty;          // A falls
    }
    void move(double position, RandomSource& random) {
        const int64_t before = counts_;
        if (std::fabs(position - double(counts_) * count_) > 3 * count_)  // it was placed there
            counts_ = int64_t(std::floor(position / count_));
        while (position >= upper()) {
            counts_++;
            lower_scatter_ = upper_scatter_;
            upper_scatter_ = drawn(scatter_, random);
        }
        while (position < lower()) {
            counts_--;
            upper_scatter_ = lower_scatter_;
            lower_scatter_ = drawn(scatter_, random);
        }
        changes_ += counts_ != before;
        pass(low_, position, random);
        pass(high_, position, random);
    }
    unsigned levels() const {
        const unsigned quarter = unsigned(counts_) & 3;
        return ((quarter ^ quarter >> 1) & 1) * ENCODER_A | (quarter >> 1) * ENCODER_B |
               (low_.passed && !high_.passed) * ENCODER_Z;
    }
    double distance_to_change(double position, double velocity) const {  // along the motion, m
        double distance = velocity > 0 ? upper() - position : position - lower();
        for (const IndexEdge& mark : {low_, high_})
            if (mark.passed == (velocity < 0))
                distance = std::fmin(distance,
                                     velocity > 0 ? edge(mark) - position : position - edge(mark));
        return std::fmax(distance, 0);
    }
    // the cycle in which a body that moves on like this changes a level
    uint64_t next_change(uint64_t now, double position, double velocity, double clk_hz) const {
        const double clk =
            velocity ? distance_to_change(position, velocity) / std::fabs(velocity) * clk_hz : 1e18;
        return clk < 1e15 ? now + 1 + uint64_t(clk) : NEVER;
    }
    int64_t counts() const { return counts_; }     // edges passed on the way up, less those down
    uint64_t changes() const { return changes_; }  // of the counts, in both directions

 private:
    struct IndexEdge {
        double at = 0, scatter = 0;
        bool passed = false, drawn = true;  // the scale is above it; it was not passed since drawn
    };
    static double drawn(double scatter, RandomSource& random) {
        return scatter ? random.uniform(-scatter, scatter) : 0;
    }
    double edge(int64_t count) const { return double(count) * count_ + shift_[count & 3]; }
    double upper() const { return edge(counts_ + 1) + upper_scatter_; }
    double lower() const { return edge(counts_) + lower_scatter_ - hysteresis_; }
    double edge(const IndexEdge& mark) const {
        return mark.at + mark.scatter - (mark.passed ? index_hysteresis_ : 0);
    }
    void pass(IndexEdge& mark, double position, RandomSource& random) {
        const bool passed = position >= edge(mark);
        if (passed != mark.passed) {
            mark.passed = passed;
            mark.drawn = false;
        } else if (!mark.drawn &&
                   std::fabs(position - mark.at) > 2 * index_scatter_ + index_hysteresis_) {
            mark.scatter = drawn(index_scatter_, random);
            mark.drawn = true;
        }
    }

    double count_ = 1, hysteresis_ = 0, scatter_ = 0, index_hysteresis_ = 0, index_scatter_ = 0;
    double shift_[4] = {}, lower_scatter_ = 0, upper_scatter_ = 0;
    IndexEdge low_, high_;
    int64_t counts_ = 0;
    uint64_t changes_ = 0;
};

}  // namespace twin
