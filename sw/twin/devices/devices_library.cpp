// SPDX-License-Identifier: Apache-2.0
// C interface to the devices of a node: in the twin, and without a node, with pins driven from
// here.
#include <algorithm>

#include "nodes/peer_line.h"
#include "devices/devices.h"

using namespace twin;

namespace {

class DevicesBench {  // without a node
 public:
    DevicesBench(const DevicesParameters& parameters, unsigned fitted, uint64_t seed, double clk_hz)
        : devices(parameters, fitted, seed, 1, clk_hz) {}
    void run(uint64_t clk) {  // pins as they are, straight from one event to the next
        const uint64_t end = now + clk;
        if (clk) devices.clk(++now, drive);
        while (now < end) {
            now = std::min(end, std::max(now + 1, devices.event_at()));
            devices.clk(now, drive);
        }
    }

    void cable() {  // a cycle with the keyboard connected to the machine's port, without a node
        const Ps2Keyboard& keyboard = devices.keyboard;
        const Ps2Computer& computer = devices.computer;
        drive = PERIPHERAL_DRIVE_IDLE | KEYBOARD_CLOCK_LOW * computer.clock_low |
                KEYBOARD_DATA_LOW * computer.data_low | EDM_CLOCK_LOW * keyboard.clock_low |
                EDM_DATA_LOW * keyboard.data_low;
        devices.clk(++now, drive);
    }

    Devices devices;
    uint64_t now = 0;
    unsigned drive = PERIPHERAL_DRIVE_IDLE;
};

template <class T, class Out>
int take(std::vector<T>& from, Out* out, int most) {
    const int count = int(std::min<size_t>(from.size(), size_t(most)));
    std::copy_n(from.begin(), count, out);
    from.erase(from.begin(), from.begin() + count);
    return count;
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

int devices_parameters() { return int(sizeof(DevicesParameters) / sizeof(double)); }
const char* devices_state_names() { return Devices::state_names(); }
const char* devices_faults() { return Devices::faults(); }
void devices_state(Devices* s, uint64_t now, double* out) { s->state(now, out); }
int devices_set(Devices* s, const char* name, double value) { return s->set(name, value); }
int devices_get(Devices* s, const char* name, double* value) { return s->get(name, *value); }
int devices_fault(Devices* s, const char* name, int on) { return s->fault(name, on); }
uint8_t* devices_eeprom(Devices* s) { return s->eeprom.memory.data(); }
void devices_key(Devices* s, int key, int down) { s->keypad.key(key, down); }
void devices_text(Devices* s, uint8_t* out) { s->display.glass.text(out); }
void devices_segments(Devices* s, uint8_t* out) { s->digits.segments(out); }
void devices_type(Devices* s, const uint8_t* bytes, int count, uint64_t at) {
    s->keyboard.type(bytes, count, at);
    s->wake();
}
int devices_commands(Devices* s, uint8_t* out, int most) {
    return take(s->keyboard.commands, out, most);
}
void devices_order(Devices* s, const uint8_t* bytes, int count) {
    s->computer.order(bytes, count);
    s->wake();
}
int devices_received(Devices* s, uint8_t* bytes, uint64_t* at, int most) {
    auto& received = s->computer.received;
    const int count = int(std::min<size_t>(received.size(), size_t(most)));
    for (int n = 0; n < count; n++) {
        bytes[n] = received[size_t(n)].byte;
        at[n] = received[size_t(n)].at;
    }
    received.erase(received.begin(), received.begin() + count);
    return count;
}
int devices_cuts(Devices* s) { return int(s->edm.cuts.size()); }
void devices_cut(Devices* s, int n, uint64_t* clk, double* angle,
                 int* complete) {  // start and end; end ~0: it goes on
    const EdmCut& cut = s->edm.cuts[size_t(n)];
    clk[0] = cut.start;
    clk[1] = cut.end;
    angle[0] = cut.angle_start;
    angle[1] = cut.angle_end;
    *complete = cut.complete;
}

void* devices_bench_new(const DevicesParameters* parameters, unsigned fitted, uint64_t seed,
                        double clk_hz) {
    return new DevicesBench(*parameters, fitted, seed, clk_hz);
}
void devices_bench_delete(DevicesBench* bench) { delete bench; }
void* devices_bench_of(DevicesBench* bench) { return &bench->devices; }
uint64_t devices_bench_now(DevicesBench* bench) { return bench->now; }
unsigned devices_bench_levels(DevicesBench* bench) { return bench->devices.levels(); }
void devices_bench_pins(DevicesBench* bench, unsigned values, unsigned which) {
    bench->drive = (bench->drive & ~which) | (values & which);
}
void devices_bench_run(DevicesBench* bench, uint64_t clk) { bench->run(clk); }
void devices_bench_watch(DevicesBench* bench, uint64_t clk,
                         uint16_t* levels) {  // the same, with the levels after each cycle
    for (uint64_t n = 0; n < clk; n++) {
        bench->run(1);
        levels[n] = uint16_t(bench->devices.levels());
    }
}
void devices_bench_cable(DevicesBench* bench, uint64_t clk, uint16_t* levels) {
    for (uint64_t n = 0; n < clk; n++) {
        bench->cable();
        levels[n] = uint16_t(bench->devices.levels());
    }
}
void devices_bench_power_cut(DevicesBench* bench) {
    bench->drive = PERIPHERAL_DRIVE_IDLE;
    bench->devices.power_cut(bench->now);
}
void devices_bench_power_on(DevicesBench* bench) { bench->devices.power_on(bench->now); }

void* peer_line_new(uint64_t seed, double clk_hz, double baud) {
    return new PeerLine(seed, 1, clk_hz, baud);
}
void peer_line_delete(PeerLine* line) { delete line; }
void peer_line_levels(PeerLine* line, uint64_t from, uint64_t clk, const uint8_t* tx,
                      uint8_t* rx) {  // n cycles, the first is `from`
    for (uint64_t n = 0; n < clk; n++) rx[n] = line->step(from + n, tx[n]);
}
void peer_line_put(PeerLine* line, const uint8_t* bytes, int count, uint64_t now) {
    line->put(bytes, count, now);
}
void peer_line_garbage(PeerLine* line, double rate, uint64_t now) { line->garbage(rate, now); }
void peer_line_cut(PeerLine* line, int cut) { line->cut = cut; }
int peer_line_received(PeerLine* line, uint8_t* out, int most) {
    return take(line->received, out, most);
}
void peer_line_counts(PeerLine* line, uint64_t* out) {  // framing errors, bytes of garbage
    out[0] = line->framing_errors;
    out[1] = line->garbage_bytes;
}

}  // extern "C"
#pragma GCC visibility pop
