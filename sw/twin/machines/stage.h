// SPDX-License-Identifier: Apache-2.0
// The stage of S0: plant, optionally with a piezo on its table; interferometer and ADC; the floor
// under it, which shakes the table and the platform on the piezo.
#pragma once
#include <array>

#include "parts/dac_input.h"
#include "parts/floor.h"
#include "parts/interferometer.h"
#include "machines/machine.h"
#include "parts/piezo.h"
#include "machines/plant.h"

namespace twin {

class Stage : public Machine {
 public:
    Stage(const StageParameters& parameters, uint64_t seed, uint64_t stream, double clk_hz);

    const char* faults() const override {
        return "limit_low limit_high drive_fault motor_jam encoder_cut a_stuck b_stuck "
               "converter_stuck";
    }
    void set_position(double where) override { plant.set_position(where); }
    void push(double newton) override { pushed_ = newton; }
    // position and velocity of what is measured: the table, with the piezo on it; nut: from the
    // motor's angle; screw: on the table; codes: last conversion, straight binary
    const char* state_names() const override {
        return "time_s position_m velocity_m_s nut_m motor_rad_s current_a voltage_v screw_n "
               "limit_low? limit_high? a? b? enabled? "
               "code_sin# code_cos# piezo_m dac_code# dac_bad_frames#";
    }
    void state(uint64_t now, double* out) const override;
    double position(uint64_t now) const final {
        return plant.drivetrain.position + piezo.position + velocity() * since(now);
    }
    double velocity() const { return plant.drivetrain.velocity + piezo.velocity; }
    Motion table(uint64_t now) const { return {position(now), velocity(), double(now) / clk_hz()}; }
    uint64_t levels_at(uint64_t now, const Motion& motion) {
        return interferometer.advance(now, motion);
    }

 protected:
    unsigned pins() const override {
        return interferometer.a * ENCODER_A | interferometer.b * ENCODER_B |
               interferometer.sdata_sin() * ADC_SIN | interferometer.sdata_cos() * ADC_COS |
               plant.switches.low_pressed * LIMIT_LOW_OPEN |
               plant.switches.high_pressed * LIMIT_HIGH_OPEN | SENSOR_RX;
    }
    void drive_changed(uint64_t now, unsigned before, unsigned after) override;
    void move(uint64_t now) override;
    uint64_t sense(uint64_t now) override;
    double* parameter(const char* name) override { return find_parameter(p_, name); }
    void configure() override;
    bool own_fault(const char* name, bool on) override;

 private:
    static constexpr uint64_t LEVELS_PER_STEP = 4;  // while the table moves

    void spend(uint64_t until,
               unsigned drive) {  // the cycles up to here went to this state of the bridge
        spent_[drive & DRIVE_ENABLE ? (drive & BRIDGE_A ? 1 : 0) | (drive & BRIDGE_B ? 2 : 0)
                                    : 0] += uint32_t(until - spent_until_);
        spent_until_ = until;
    }

    StageParameters p_;

 public:
    Plant plant;
    Interferometer interferometer;
    DacInput dac;
    Piezo piezo;

 private:
    double coupled(uint64_t now) const;  // LSB, from the last edge of the bridge to the converters

    Floor floor_;
    double pushed_ = 0, coupling_ = 0;  // N; LSB at the last edge of the bridge
    uint64_t bridge_edge_ = 0;          // cycle of that edge
    uint64_t spent_until_ = 0;
    std::array<uint32_t, 4> spent_{};  // cycles in: coast, forward, reverse, brake
};

}  // namespace twin
