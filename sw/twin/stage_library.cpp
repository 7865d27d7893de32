// SPDX-License-Identifier: Apache-2.0
// C interface to one stage without a node, for tests of the plant and for tuning: the pins are driven by a PWM given here.
#include "stage.h"

using namespace twin;

namespace {

struct Bench {
    Stage stage;
    double clk_hz;
    uint64_t now = 0;
    uint32_t phase = 0;                                       // clk within the PWM period
};

}  // namespace

extern "C" {

int parameter_count() { return PARAMETER_COUNT; }

void* stage_new(uint64_t seed, double clk_hz, const Parameters* parameters) { return new Bench{Stage(*parameters, seed, 1, clk_hz), clk_hz}; }
void stage_delete(Bench* bench) { delete bench; }
int stage_set(Bench* bench, const char* name, double value) { return bench->stage.set(name, value); }
void stage_place(Bench* bench, double position) { bench->stage.plant.place(position); }
void stage_push(Bench* bench, double newton) { bench->stage.plant.external_force = newton; }
void stage_hold(Bench* bench, int rotor, int table) {
    bench->stage.plant.jammed = rotor;
    bench->stage.plant.table_clamped = table;
}

// Run n clk: `on` of every `period` clk driven (negative: in reverse), the rest braking or coasting.
void stage_drive(Bench* bench, uint64_t n, uint32_t period, int32_t on, int brakes) {
    const uint32_t length = on < 0 ? -on : on;
    for (; n; n--) {
        const bool driven = bench->phase < length;
        bench->phase = bench->phase + 1 >= period ? 0 : bench->phase + 1;
        bench->now++;
        bench->stage.step(bench->now, 1, 1, driven ? on > 0 : brakes, driven ? on < 0 : brakes, 1);
    }
}

// time s, position m, velocity m/s, nut m, motor rad/s, current A, voltage V, screw force N, low, high, a, b
void stage_state(Bench* bench, double* out) {
    const Stage& s = bench->stage;
    const double state[] = {double(bench->now) / bench->clk_hz, s.position(bench->now), s.plant.velocity, s.plant.nut(), s.plant.speed,
                            s.plant.current, s.plant.voltage, s.plant.screw_force(), double(s.low_open()), double(s.high_open()),
                            double(s.interferometer.a), double(s.interferometer.b)};
    std::copy(std::begin(state), std::end(state), out);
}

void stage_analogue(Bench* bench, double position, double* out) { bench->stage.interferometer.analogue(position, out[0], out[1]); }
void stage_convert(Bench* bench, double position, uint32_t* out) {
    bench->stage.interferometer.sample(position);
    out[0] = bench->stage.interferometer.code_sin;
    out[1] = bench->stage.interferometer.code_cos;
}
// The bits of one frame as they stand before each of `count` falling edges of sclk, sine in bit 0, cosine in bit 1.
void stage_frame(Bench* bench, double position, int count, uint8_t* bits) {
    bench->stage.interferometer.chip_select(position);
    for (int n = 0; n < count; n++) {
        bits[n] = uint8_t(bench->stage.interferometer.sdata_sin() | bench->stage.interferometer.sdata_cos() << 1);
        bench->stage.interferometer.next_bit();
    }
}
void stage_fault(Bench* bench, int fault, int level) {
    bench->stage.interferometer.fault = SignalFault(fault);
    bench->stage.interferometer.stuck_level = level;
}
// Levels (a in bit 0, b in bit 1) over n clk with the table moved at a constant speed from the present clk on.
void stage_levels(Bench* bench, uint64_t n, double from, double speed, uint8_t* out) {
    for (uint64_t k = 0; k < n; k++) {
        bench->now++;
        bench->stage.interferometer.advance(bench->now, from + speed * double(k) / bench->clk_hz);
        out[k] = uint8_t(bench->stage.interferometer.a | bench->stage.interferometer.b << 1);
    }
}

// Friction alone at a constant speed for n steps; returns the force.
double friction_slide(double coulomb, double breakaway, double stribeck, double viscous, double presliding, double damping, double speed,
                      double dt, int n) {
    Friction friction{coulomb, breakaway, stribeck, viscous, presliding, damping};
    double force = 0;
    for (int k = 0; k < n; k++) force = friction.force(speed, dt);
    return force;
}

}  // extern "C"
