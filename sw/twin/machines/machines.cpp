// SPDX-License-Identifier: Apache-2.0
// The machines by their names.
#include <cstring>

#include "machines/linear_motor.h"
#include "machines/spindle.h"
#include "machines/stage.h"
#include "machines/stepper_stage.h"
#include "machines/worm_table.h"

namespace twin {

namespace {

class Unconnected : public Machine {  // nothing at the pins
 public:
    Unconnected(const UnconnectedParameters& parameters, uint64_t, uint64_t, double clk_hz)
        : Machine(clk_hz, parameters.time_step), p_(parameters) {}
    const char* faults() const override { return ""; }
    void set_position(double) override {}
    void push(double) override {}
    const char* state_names() const override { return "time_s"; }
    void state(uint64_t now, double* out) const override { *out = double(now) / clk_hz(); }

 protected:
    unsigned pins() const override { return SENSOR_RX; }
    void move(uint64_t) override {}
    uint64_t sense(uint64_t) override { return NEVER; }
    double* parameter(const char* name) override { return find_parameter(p_, name); }
    void configure() override {}

 private:
    UnconnectedParameters p_;
};

class LoopbackPlug : public Machine {  // wires from outputs to inputs; the switches are closed
 public:
    LoopbackPlug(const LoopbackPlugParameters& parameters, uint64_t, uint64_t, double clk_hz)
        : Machine(clk_hz, parameters.time_step), p_(parameters) {}
    const char* faults() const override {
        return "limit_low limit_high drive_fault encoder_cut a_stuck b_stuck z_stuck";
    }
    void set_position(double) override {}
    void push(double) override {}
    const char* state_names() const override { return "time_s a? b? z?"; }
    void state(uint64_t now, double* out) const override {
        out[0] = double(now) / clk_hz();
        out[1] = flag(ENCODER_A);
        out[2] = flag(ENCODER_B);
        out[3] = flag(ENCODER_Z);
    }

 protected:
    unsigned pins() const override {
        return SENSOR_RX | bool(drive() & STEP) * ENCODER_A |
               bool(drive() & DIRECTION) * ENCODER_B | bool(drive() & DRIVE_ENABLE) * ENCODER_Z;
    }
    void move(uint64_t) override {}
    uint64_t sense(uint64_t) override { return NEVER; }
    double* parameter(const char* name) override { return find_parameter(p_, name); }
    void configure() override {}

 private:
    LoopbackPlugParameters p_;
};

template <class M, class P>
std::unique_ptr<Machine> make(const double* values, uint64_t seed, uint64_t stream, double clk_hz) {
    P parameters;
    std::memcpy(&parameters, values, sizeof parameters);
    return std::make_unique<M>(parameters, seed, stream, clk_hz);
}

struct Kind {
    const char* name;
    size_t parameter_bytes;
    std::unique_ptr<Machine> (*make)(const double*, uint64_t, uint64_t, double);
};
const Kind KINDS[] = {
    {"stage", sizeof(StageParameters), make<Stage, StageParameters>},
    {"stepper_stage", sizeof(StepperStageParameters), make<StepperStage, StepperStageParameters>},
    {"linear_motor", sizeof(LinearMotorParameters), make<LinearMotor, LinearMotorParameters>},
    {"spindle", sizeof(SpindleParameters), make<Spindle, SpindleParameters>},
    {"worm_table", sizeof(WormTableParameters), make<WormTable, WormTableParameters>},
    {"loopback_plug", sizeof(LoopbackPlugParameters), make<LoopbackPlug, LoopbackPlugParameters>},
    {"unconnected", sizeof(UnconnectedParameters), make<Unconnected, UnconnectedParameters>},
};

const Kind* find(const char* name) {
    for (const Kind& kind : KINDS)
        if (!std::strcmp(kind.name, name)) return &kind;
    return nullptr;
}

}  // namespace

std::unique_ptr<Machine> make_machine(const char* kind, const double* parameters, uint64_t seed,
                                      uint64_t stream, double clk_hz) {
    const Kind* found = find(kind);
    return found ? found->make(parameters, seed, stream, clk_hz) : nullptr;
}

int machine_parameter_count(const char* kind) {
    const Kind* found = find(kind);
    return found ? int(found->parameter_bytes / sizeof(double)) : -1;
}

}  // namespace twin
