// SPDX-License-Identifier: Apache-2.0
// A machine as one axis of a node sees it: pins in, pins out, advanced cycle by cycle. An idle
// machine costs nothing: it is called when a pin that drives it or another machine of its node
// changes, at the time that it or another requested, and at the beginning of each run.
#pragma once
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace twin {

constexpr uint64_t NEVER = ~uint64_t(0);

enum Drive : unsigned {  // pins that the node drives
    ADC_CS_N = 1 << 0,
    ADC_SCLK = 1 << 1,
    BRIDGE_A = 1 << 2,
    BRIDGE_B = 1 << 3,
    DRIVE_ENABLE = 1 << 4,
    STEP = 1 << 5,
    DIRECTION = 1 << 6,
    DAC_CS_N = 1 << 7,
    DAC_SCLK = 1 << 8,
    DAC_SDI = 1 << 9,
};
constexpr unsigned DRIVE_PINS = 10;

enum Sense : unsigned {  // pins that the machine drives
    ENCODER_A = 1 << 0,
    ENCODER_B = 1 << 1,
    ENCODER_Z = 1 << 2,
    ADC_SIN = 1 << 3,
    ADC_COS = 1 << 4,
    LIMIT_LOW_OPEN = 1 << 5,
    LIMIT_HIGH_OPEN = 1 << 6,
    DRIVE_FAULT = 1 << 7,
    SENSOR_RX = 1 << 8,  // serial frames of an absolute sensor; 1: idle, or no sensor
};
constexpr unsigned SENSE_PINS = 9;
constexpr unsigned DRIVE_IDLE = ADC_CS_N | ADC_SCLK | DAC_CS_N;

class Machine {
 public:
    Machine(double clk_hz, double time_step);
    virtual ~Machine() = default;

    // the node's pins after cycle `now`; true when levels have changed
    bool clk(uint64_t now, unsigned drive) {
        if (drive == drive_ && now < event_at_) return false;
        advance(now, drive);
        const unsigned before = std::exchange(seen_, levels());
        return seen_ != before;
    }
    uint64_t event_at() const { return event_at_; }
    unsigned levels() const { return (pins() & ~forced_) | forced_high_; }  // Sense

    bool set(const char* name, double value);  // false: there is no such parameter
    bool get(const char* name, double& value);
    bool fault(const char* name, bool on, bool level);  // false: there is no such fault
    virtual const char* faults() const = 0;             // their names
    virtual void set_position(
        double position) = 0;             // move it there by hand: at rest, without tension
    virtual void push(double force) = 0;  // from outside, from now on
    virtual double position(uint64_t) const {
        return NAN;
    }  // m or rad, true; NAN: it has no position

    // names of the values of state(), the first time_s; a last ? marks a truth value, # a whole
    // number
    virtual const char* state_names() const = 0;
    virtual void state(uint64_t now, double* out) const = 0;
    int state_count() const { return state_count_; }
    void trace(uint64_t every_clk);  // record states from now on, 0 ends it
    std::vector<double> rows;        // what was recorded

 protected:
    virtual unsigned pins() const = 0;  // Sense, without faults of the wires
    virtual void drive_changed(uint64_t, unsigned /*before*/, unsigned /*after*/) {}
    virtual void move(uint64_t now) = 0;  // by one time step, that ends now
    virtual uint64_t sense(
        uint64_t now) = 0;  // update the pins; returns the cycle of the next update at the latest
    virtual double* parameter(const char* name) = 0;  // nullptr: there is none
    virtual void configure() = 0;  // take over changed parameters, keep the state
    virtual bool own_fault(const char*, bool) { return false; }

    double clk_hz() const { return clk_hz_; }
    double time_step() const { return double(step_clk_) / clk_hz_; }
    uint64_t step_clk() const { return step_clk_; }
    unsigned drive() const { return drive_; }
    double since(uint64_t now) const {
        return double(now - last_step_) / clk_hz_;
    }  // s, from the last time step
    bool flag(unsigned level) const { return levels() & level; }

 private:
    void advance(uint64_t now, unsigned drive);

    double clk_hz_;
    uint64_t step_clk_, last_step_ = 0, event_at_ = 0;
    unsigned drive_ = DRIVE_IDLE;
    unsigned seen_ = ~0u;                                     // levels after the last call
    unsigned forced_ = 0, forced_high_ = 0;                   // levels that faults hold
    std::vector<std::pair<unsigned, unsigned>> wire_faults_;  // pins, of them high
    uint64_t trace_every_ = 0, trace_count_ = 0;
    int state_count_ = 0;
};

// `kind` is the name of a parameter table; nullptr: there is no such machine
std::unique_ptr<Machine> make_machine(const char* kind, const double* parameters, uint64_t seed,
                                      uint64_t stream, double clk_hz);
int machine_parameter_count(const char* kind);

}  // namespace twin
