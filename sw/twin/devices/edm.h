// SPDX-License-Identifier: Apache-2.0
// The wire-EDM machine of S4, as far as an indexing table sees it: keys of its keyboard start a
// cut, two opto-couplers report its state.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "parts/random_source.h"

namespace twin {

class OptoCoupler {  // bounces for a while after each change
 public:
    static constexpr uint64_t NEVER = ~uint64_t(0);

    bool level() const { return level_; }
    bool on() const { return on_; }
    void set(uint64_t now, bool on, uint64_t bounce) {
        if (on == on_) return;
        on_ = on;
        settles_ = now + bounce;
        next_ = now;
    }
    uint64_t step(uint64_t now, RandomSource& random) {  // returns when to be called again
        if (now < next_) return next_;
        level_ = now >= settles_ ? on_ : !level_;
        next_ = now >= settles_
                    ? NEVER
                    : std::min(settles_,
                               now + 1 + uint64_t(random.uniform(0, 0.4) * double(settles_ - now)));
        return next_;
    }

 private:
    bool level_ = false, on_ = false;
    uint64_t settles_ = 0, next_ = NEVER;
};

struct EdmCut {
    static constexpr uint64_t GOES_ON = ~uint64_t(0);
    uint64_t start, end = GOES_ON;
    double angle_start, angle_end = NAN;  // of the table, true
    bool complete = false;                // no alarm ended it
};

class Edm {
 public:
    static constexpr uint64_t NEVER = ~uint64_t(0);
    static constexpr int KEYS = 6;
    static constexpr uint8_t START[KEYS] = {0x14, 0x1D, 0xF0, 0x1D,
                                            0xF0, 0x14};  // left control and W, pressed and let go

    Edm(uint64_t seed, uint64_t stream) : random_(seed, stream) {}
    template <class P>
    void configure(const P& p, double clk_hz) {
        reaction_ = uint64_t(p.edm_reaction * clk_hz) + 1;
        cut_time_ = uint64_t(p.edm_cut_time * clk_hz) + 1;
        bounce_ = uint64_t(p.edm_bounce * clk_hz);
    }
    void key(uint64_t now, uint8_t code) {
        matched_ = code == START[matched_] ? matched_ + 1 : code == START[0] ? 1 : 0;
        if (matched_ < KEYS) return;
        matched_ = 0;
        starts++;
        if (deaf || alarm || cutting.on() || start_at_ != NEVER)
            ignored++;
        else
            start_at_ = now + reaction_;
    }
    template <class Angle>
    uint64_t step(uint64_t now, Angle angle) {  // returns when to be called again
        if (alarm != alarming.on()) {
            alarming.set(now, alarm, bounce_);
            if (alarm) {
                start_at_ = NEVER;
                if (cutting.on()) end(now, angle(), false);
            }
        }
        if (now >= start_at_) {
            start_at_ = NEVER;
            EdmCut cut{};
            cut.start = now;
            cut.angle_start = angle();
            cuts.push_back(cut);
            cutting.set(now, true, bounce_);
        }
        const bool ends = cutting.on() && !endless;
        const uint64_t end_at = ends ? cuts.back().start + cut_time_ : NEVER;
        if (now >= end_at) end(now, angle(), true);
        return std::min({start_at_, now >= end_at ? NEVER : end_at, cutting.step(now, random_),
                         alarming.step(now, random_)});
    }

    std::vector<EdmCut> cuts;
    OptoCoupler cutting, alarming;
    bool alarm = false, endless = false, deaf = false;  // faults
    uint64_t starts = 0, ignored = 0;  // start sequences; of them while cutting, in alarm or deaf

 private:
    void end(uint64_t now, double angle, bool complete) {
        EdmCut& cut = cuts.back();
        cut.end = now;
        cut.angle_end = angle;
        cut.complete = complete;
        cutting.set(now, false, bounce_);
    }

    RandomSource random_;
    uint64_t reaction_ = 1, cut_time_ = 1, bounce_ = 0, start_at_ = NEVER;
    int matched_ = 0;
};

}  // namespace twin
