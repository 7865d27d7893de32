// SPDX-License-Identifier: Apache-2.0
// C interface to a machine: to that of an axis of the twin, and to one without a node, whose pins
// are driven from here.
#include <algorithm>

#include "machines/rotary_ring.h"
#include "machines/stage.h"
#include "machines/step_card.h"

using namespace twin;

namespace {

class Bench {  // a machine without a node
 public:
    Bench(const char* kind, uint64_t seed, double clk_hz, const double* parameters)
        : machine(make_machine(kind, parameters, seed, 1, clk_hz)), clk_hz(clk_hz) {}
    void pins(unsigned values, unsigned which) { drive_ = (drive_ & ~which) | (values & which); }
    void run(uint64_t clk) {  // pins as they are, straight from one event to the next
        const uint64_t end = now + clk;
        if (clk) machine->clk(++now, drive_);
        while (now < end) {
            now = std::min(end, std::max(now + 1, machine->event_at()));
            machine->clk(now, drive_);
        }
    }

    void run(uint64_t clk, StepCard& card) { run_card(card, *machine, now, clk, drive_); }

    std::unique_ptr<Machine> machine;
    double clk_hz;
    uint64_t now = 0;
    uint32_t phase = 0;  // cycle within the PWM period

 private:
    unsigned drive_ = DRIVE_IDLE;
};

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

int machine_parameters(const char* kind) {
    return machine_parameter_count(kind);
}  // -1: there is no such machine
const char* machine_state_names(Machine* m) { return m->state_names(); }
const char* machine_faults(Machine* m) { return m->faults(); }
void machine_state(Machine* m, uint64_t now, double* out) { m->state(now, out); }
int machine_set(Machine* m, const char* name, double value) { return m->set(name, value); }
int machine_get(Machine* m, const char* name, double* value) { return m->get(name, *value); }
int machine_fault(Machine* m, const char* name, int on, int level) {
    return m->fault(name, on, level);
}
void machine_set_position(Machine* m, double position) { m->set_position(position); }
void machine_push(Machine* m, double force) { m->push(force); }
void machine_trace(Machine* m, uint64_t every_clk) { m->trace(every_clk); }
int machine_trace_size(Machine* m) { return int(m->rows.size()); }
void machine_trace_take(Machine* m, double* out) {
    std::copy(m->rows.begin(), m->rows.end(), out);
    m->rows.clear();
}

void* bench_new(const char* kind, uint64_t seed, double clk_hz, const double* parameters) {
    return new Bench(kind, seed, clk_hz, parameters);
}
void bench_delete(Bench* bench) { delete bench; }
void* bench_machine(Bench* bench) { return bench->machine.get(); }
uint64_t bench_now(Bench* bench) { return bench->now; }
unsigned bench_levels(Bench* bench) { return bench->machine->levels(); }
void bench_pins(Bench* bench, unsigned values, unsigned which) { bench->pins(values, which); }
void bench_run(Bench* bench, uint64_t clk) { bench->run(clk); }
void bench_watch(Bench* bench, uint64_t clk,
                 uint16_t* levels) {  // the same, with the levels after each cycle
    for (uint64_t n = 0; n < clk; n++) {
        bench->run(1);
        levels[n] = uint16_t(bench->machine->levels());
    }
}
// Run n cycles: `on` of every `period` cycles driven (negative: in reverse), braking or coasting in
// the remainder.
void bench_bridge(Bench* bench, uint64_t clk, uint32_t period, int32_t on, int brakes) {
    const uint32_t length = uint32_t(on < 0 ? -on : on);
    while (clk) {
        const bool driven = bench->phase < length;
        const unsigned a = driven ? on > 0 : brakes, b = driven ? on < 0 : brakes;
        bench->pins(a * BRIDGE_A | b * BRIDGE_B | DRIVE_ENABLE, BRIDGE_A | BRIDGE_B | DRIVE_ENABLE);
        const uint64_t now = std::min<uint64_t>(clk, (driven ? length : period) - bench->phase);
        bench->run(now);
        bench->phase = uint32_t((bench->phase + now) % period);
        clk -= now;
    }
}
// `count` pulses (negative: down), one every `period` cycles, high for `high`, the direction
// `setup` cycles before the first.
void bench_steps(Bench* bench, int64_t count, uint32_t period, uint32_t high, uint32_t setup) {
    bench->pins((count > 0) * DIRECTION, DIRECTION);
    bench->run(setup);
    for (int64_t n = std::abs(count); n; n--) {
        bench->pins(STEP, STEP);
        bench->run(high);
        bench->pins(0, STEP);
        bench->run(period - high);
    }
}
void bench_card(Bench* bench, uint64_t clk, StepCard* card) { bench->run(clk, *card); }
// One frame to the DAC: `bits` of the word, MSB first, two cycles a bit.
void bench_frame(Bench* bench, uint32_t word, int bits) {
    bench->pins(0, DAC_CS_N);
    for (int n = bits - 1; n >= 0; n--) {
        bench->pins((word >> n & 1) * DAC_SDI, DAC_SDI | DAC_SCLK);
        bench->run(1);
        bench->pins(DAC_SCLK, DAC_SCLK);
        bench->run(1);
    }
    bench->pins(0, DAC_SCLK);
    bench->run(1);
    bench->pins(DAC_CS_N, DAC_CS_N);
    bench->run(1);
}

// functions of the stage only
static Stage& stage_of(Bench* bench) { return static_cast<Stage&>(*bench->machine); }
void stage_hold(Bench* bench, int rotor, int table) {
    stage_of(bench).plant.drivetrain.jammed = rotor;
    stage_of(bench).plant.drivetrain.clamped = table;
}
// of a table at a position, with a velocity, at a time after power-up
void stage_analogue(Bench* bench, double position, double velocity, double seconds, double* out) {
    stage_of(bench).interferometer.analogue({position, velocity, seconds}, out[0], out[1]);
}
void stage_convert(Bench* bench, double position, double velocity, double seconds, uint32_t* out) {
    Interferometer& interferometer = stage_of(bench).interferometer;
    interferometer.sample({position, velocity, seconds});
    out[0] = interferometer.code_sin;
    out[1] = interferometer.code_cos;
}
// The bits of one frame before each of `count` falling edges of sclk, sine in bit 0,
// cosine in bit 1.
void stage_frame(Bench* bench, double position, int count, uint8_t* bits) {
    Interferometer& interferometer = stage_of(bench).interferometer;
    interferometer.chip_select({position});
    for (int n = 0; n < count; n++) {
        bits[n] = uint8_t(interferometer.sdata_sin() | interferometer.sdata_cos() << 1);
        interferometer.next_bit();
    }
}
// Levels (a in bit 0, b in bit 1) over n cycles with the table moved at a constant speed from the
// present cycle on.
void stage_levels(Bench* bench, uint64_t clk, double from, double speed, uint8_t* out) {
    for (uint64_t n = 0; n < clk; n++) {
        stage_of(bench).levels_at(++bench->now, {from + speed * double(n) / bench->clk_hz, speed});
        out[n] = uint8_t(bench->machine->levels() & (ENCODER_A | ENCODER_B));
    }
}

// Friction alone at a constant speed for n steps; returns the force.
double friction_slide(double coulomb, double breakaway, double stribeck, double viscous,
                      double presliding, double damping, double speed, double dt, int n) {
    Friction friction{coulomb, breakaway, stribeck, viscous, presliding, damping};
    double force = 0;
    for (int k = 0; k < n; k++) force = friction.force(speed, dt);
    return force;
}

// the ring
void* ring_new(const RotaryRingParameters* parameters, uint64_t seed) {
    return new RotaryRing(*parameters, seed);
}
void ring_delete(RotaryRing* ring) { delete ring; }
void ring_orders(RotaryRing* ring, double* amplitude, double* phase) {  // rad, from order 0
    std::copy(ring->amplitude.begin(), ring->amplitude.end(), amplitude);
    std::copy(ring->phase.begin(), ring->phase.end(), phase);
}
void ring_measured(RotaryRing* ring, int64_t count, const double* angle, const double* seconds,
                   double* out) {
    for (int64_t n = 0; n < count; n++) out[n] = ring->measured(angle[n], seconds[n]);
}
void ring_levels(RotaryRing* ring, int64_t count, const double* angle, const double* seconds,
                 uint8_t* out) {
    for (int64_t n = 0; n < count; n++)
        out[n] = uint8_t(ring->levels(ring->measured(angle[n], seconds[n])));
}

}  // extern "C"
#pragma GCC visibility pop
