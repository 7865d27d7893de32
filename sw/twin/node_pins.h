// SPDX-License-Identifier: Apache-2.0
// Between the pins of a Verilated node, vectors over its axes, and those of the machines, one word an axis. A pin that the node was
// not built with is left out: it stays idle for the machine.
#pragma once
#include <cstdint>

#include "machine.h"

namespace twin {

#define OPTIONAL_OUTPUT(name, idle)                                                                          \
    template <class Pins>                                                                                    \
    auto name##_of(const Pins& pins, int n, int) -> decltype(unsigned(pins.name)) { return pins.name >> n & 1; } \
    template <class Pins>                                                                                    \
    unsigned name##_of(const Pins&, int, long) { return idle; }
OPTIONAL_OUTPUT(step, 0)
OPTIONAL_OUTPUT(direction, 0)
OPTIONAL_OUTPUT(dac_cs_n, 1)
OPTIONAL_OUTPUT(dac_sclk, 0)
OPTIONAL_OUTPUT(dac_sdi, 0)
#undef OPTIONAL_OUTPUT

template <class Pins>
auto set_sensor_rx(Pins& pins, uint32_t levels, int) -> decltype(pins.sensor_rx = 0, void()) { pins.sensor_rx = levels; }
template <class Pins>
void set_sensor_rx(Pins&, uint32_t, long) {}

template <class Pins>
unsigned drive_of(const Pins& pins, int n) {                  // Drive of axis n
    return (pins.adc_cs_n >> n & 1) * ADC_CS_N | (pins.adc_sclk >> n & 1) * ADC_SCLK | (pins.bridge_a >> n & 1) * BRIDGE_A |
           (pins.bridge_b >> n & 1) * BRIDGE_B | (pins.drive_enable >> n & 1) * DRIVE_ENABLE | step_of(pins, n, 0) * STEP |
           direction_of(pins, n, 0) * DIRECTION | dac_cs_n_of(pins, n, 0) * DAC_CS_N | dac_sclk_of(pins, n, 0) * DAC_SCLK |
           dac_sdi_of(pins, n, 0) * DAC_SDI;
}

class SensePins {
public:
    void add(int n, unsigned levels) {                        // Sense of axis n
        for (unsigned bit = 0; bit < SENSE_PINS; bit++) vectors_[bit] |= (levels >> bit & 1) << n;
    }
    template <class Pins>
    void set(Pins& pins, uint32_t all) const {
        pins.encoder_a = of(ENCODER_A);
        pins.encoder_b = of(ENCODER_B);
        pins.encoder_z = of(ENCODER_Z);
        pins.adc_sin = of(ADC_SIN);
        pins.adc_cos = of(ADC_COS);
        pins.limit_low_open = of(LIMIT_LOW_OPEN);
        pins.limit_high_open = of(LIMIT_HIGH_OPEN);
        pins.drive_fault_n = ~of(DRIVE_FAULT) & all;
        set_sensor_rx(pins, of(SENSOR_RX), 0);
    }

private:
    uint32_t of(Sense pin) const { return vectors_[unsigned(__builtin_ctz(pin))]; }

    uint32_t vectors_[SENSE_PINS] = {};
};

}  // namespace twin
