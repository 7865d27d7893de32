// SPDX-License-Identifier: Apache-2.0
// A Verilated design whose pins are read and set by name, with a record of the pins' changes; and,
// for a node, accesses to its registers by the soft core, whose program is a mailbox in its memory.
// One translation unit with the Verilated code, which verilated_design.h includes: Design,
// DESIGN_PINS with PIN(name, bits, input) for each port, NODE_MEMORY if there is one, HAS_ADC if
// there are converters, and MUTANTS if the design has been made with mutants.
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "verilated_design.h"

namespace {

struct Pin {
    const char* name;
    unsigned bits;
    bool input;
    uint64_t (*get)(const Design&);
    void (*set)(Design&, uint64_t);
};

const Pin PINS[] = {
#define PIN(name, width, input)                                             \
    {#name, width, input, [](const Design& d) { return uint64_t(d.name); }, \
     [](Design& d, uint64_t value) { d.name = decltype(d.name + 0)(value); }},
    DESIGN_PINS
#undef PIN
};
constexpr int PIN_COUNT = sizeof PINS / sizeof *PINS;

// A converter of two channels, which samples when it is selected: two leading zeros, then the word,
// most significant bit first.
struct Converter {
    uint64_t sin = 0, cos = 0;  // what it would convert now
    uint64_t sin_word = 0, cos_word = 0;
    int bit = 0;
    bool selected = false, clock = true;
};

struct Change {
    uint64_t cycle;
    uint32_t pin;
    uint32_t reserved;
    uint64_t value;
};

std::unique_ptr<VerilatedContext> at_power_up() {  // each flip-flop has a random value
    auto context = std::make_unique<VerilatedContext>();
    context->randReset(2), context->randSeed(1);
    return context;
}

struct Bench {
    std::unique_ptr<VerilatedContext> context = at_power_up();
    std::unique_ptr<Design> design = std::make_unique<Design>(context.get());
    uint64_t now = 0;
    std::vector<unsigned> watched;
    std::vector<uint64_t> last;
    std::vector<Change> changes;

#ifdef HAS_ADC
    static constexpr int LEADING = 2, ADC_BITS = 8;
    Converter converters[8];
    void convert() {
        auto& d = *design;
        for (int n = 0; n < AXES; n++) {
            auto& c = converters[n];
            const bool selected = !(d.adc_cs_n >> n & 1), clock = d.adc_sclk >> n & 1;
            if (selected && !c.selected) c.bit = 0, c.sin_word = c.sin, c.cos_word = c.cos;
            if (selected && c.clock && !clock) {
                const int shift = ADC_BITS - 1 + LEADING - ++c.bit;
                const bool there = shift >= 0 && shift < ADC_BITS;
                const uint64_t mask = ~(uint64_t(1) << n);
                d.adc_sin = (d.adc_sin & mask) | (there ? (c.sin_word >> shift & 1) << n : 0);
                d.adc_cos = (d.adc_cos & mask) | (there ? (c.cos_word >> shift & 1) << n : 0);
            }
            c.selected = selected, c.clock = clock;
        }
    }
#else
    void convert() {}
#endif

    void cycle() {
        auto& d = *design;
        d.clk = 1, d.eval();
        d.clk = 0, d.eval();
        now++;
        convert();
        for (size_t n = 0; n < watched.size(); n++) {
            const uint64_t value = PINS[watched[n]].get(d);
            if (value != last[n]) changes.push_back({now, watched[n], 0, value}), last[n] = value;
        }
    }
};

}  // namespace

double sc_time_stamp() { return 0; }

#pragma GCC visibility push(default)
extern "C" {

int pin_count() { return PIN_COUNT; }
const char* pin_name(int n) { return PINS[n].name; }
unsigned pin_bits(int n) { return PINS[n].bits; }

void* bench_new(int connection, int kind, int swap) {
    auto* bench = new Bench;
#ifdef MUTANTS
    auto& mutant = *bench->design->__PVT__wiring_mutant;
    mutant.connection = connection, mutant.kind = kind, mutant.swap = swap;
#else
    if (connection || kind || swap) {
        delete bench;
        return nullptr;
    }
#endif
    for (const Pin& pin : PINS)
        if (pin.input) pin.set(*bench->design, 0);
    return bench;
}
void bench_delete(Bench* bench) { delete bench; }
uint64_t bench_now(Bench* bench) { return bench->now; }
void bench_run(Bench* bench, uint64_t cycles) {
    while (cycles--) bench->cycle();
}
uint64_t bench_get(Bench* bench, int pin) {
    bench->design->eval();
    return PINS[pin].get(*bench->design);
}
void bench_set(Bench* bench, int pin, uint64_t value) { PINS[pin].set(*bench->design, value); }
// Runs until (pin & mask) == value, at most so many cycles; whether it came.
int bench_run_until(Bench* bench, int pin, uint64_t mask, uint64_t value, uint64_t cycles) {
    while ((PINS[pin].get(*bench->design) & mask) != value) {
        if (!cycles--) return 0;
        bench->cycle();
    }
    return 1;
}
void bench_watch(Bench* bench, const int* pins, int count) {
    bench->watched.assign(pins, pins + count);
    bench->last.clear(), bench->changes.clear();
    bench->design->eval();
    for (int n = 0; n < count; n++) bench->last.push_back(PINS[pins[n]].get(*bench->design));
}
int bench_changes(Bench* bench, const void** changes) {
    *changes = bench->changes.data();
    return int(bench->changes.size());
}
void bench_drop_changes(Bench* bench) { bench->changes.clear(); }

#ifdef HAS_ADC
void bench_convert(Bench* bench, int axis, uint64_t sin, uint64_t cos) {
    bench->converters[axis].sin = sin, bench->converters[axis].cos = cos;
}
#endif

#ifdef NODE_MEMORY
void bench_load(Bench* bench, const uint32_t* words, int count) {
    std::memcpy(&bench->design->rootp->NODE_MEMORY[0], words, size_t(count) * 4);
}
// One access to a register: request[0] is 1 to read and 2 to write, then address and value. Whether
// the soft core has done it within so many cycles.
int bench_access(Bench* bench, int mailbox, const uint32_t* request, uint32_t* value,
                 uint64_t cycles) {
    auto& memory = bench->design->rootp->NODE_MEMORY;
    memory[mailbox + 1] = request[1], memory[mailbox + 2] = request[2];
    memory[mailbox] = request[0];
    while (memory[mailbox]) {
        if (!cycles--) return 0;
        bench->cycle();
    }
    *value = memory[mailbox + 2];
    return 1;
}
#endif

}  // extern "C"
#pragma GCC visibility pop
