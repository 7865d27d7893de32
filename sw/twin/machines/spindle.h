// SPDX-License-Identifier: Apache-2.0
// A spindle that runs by a drive of its own, with an encoder: A/B, and Z for one count in each
// turn.
//
//   d speed/dt = (demanded - speed) / settle
//   d angle/dt = speed (1 + unevenness cos(order angle))
#pragma once
#include "machines/machine.h"
#include "parameters.h"

namespace twin {

class Spindle : public Machine {
 public:
    Spindle(const SpindleParameters& parameters, uint64_t seed, uint64_t stream, double clk_hz);

    const char* faults() const override { return "encoder_cut a_stuck b_stuck z_stuck"; }
    void set_position(double where) override { angle_ = where; }
    void push(double) override {}
    const char* state_names() const override { return "time_s turns speed_rev_s a? b? z? counts#"; }
    void state(uint64_t now, double* out) const override;

 protected:
    unsigned pins() const override;
    void move(uint64_t now) override;
    uint64_t sense(uint64_t now) override;
    double* parameter(const char* name) override { return find_parameter(p_, name); }
    void configure() override {}

 private:
    double position(uint64_t now) const final { return angle_ + rate_ * since(now); }
    double counts_per_turn() const { return 4 * p_.encoder_lines; }

    SpindleParameters p_;
    double angle_ = 0, speed_ = 0, rate_ = 0;  // rev, rev/s
    int64_t counts_ = 0;
};

}  // namespace twin
