// SPDX-License-Identifier: Apache-2.0
// Nodes (the RTL, Verilated), each with a machine at each axis, and a host on one bus; and their
// C interface.
//
// All nodes share one clock. In a cycle every node takes its pins and sees the rising edge, then
// the machines and the bus take the outputs of the nodes and set the pins for the next edge. One
// translation unit with the Verilated code, so that all of it inlines.
#include <algorithm>
#include <cstdlib>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "nodes/bus.h"
#include "devices/serial_flash.h"
#include "machines/machine.h"
#include "nodes/node_pins.h"
#include "nodes/peer_line.h"
#include "verilated_node.h"  // made by build.py: the Verilated sources, CLK_HZ, AXES, rising_edge

namespace twin {

constexpr int RESET_CLK = 16;
constexpr bool HAS_FLASH = SERIAL_CORE || CODE_WORDS > 0;
constexpr uint32_t ALL_AXES = (1u << AXES) - 1;
static_assert(AXES <= DrivePins::MOST_AXES);

using Firmware = std::vector<uint32_t>;

// The context of a node, with the seeds of the environment: CROSSINGS for its synchronisers, which
// read it at their start, and POWER_UP for the state of its flip-flops and memories.
inline VerilatedContext* context_of(unsigned address) {
    auto* context = new VerilatedContext;
    if (const char* seed = std::getenv("CROSSINGS")) {
        const std::string argument = std::string("+crossings=") + seed + std::to_string(address);
        const char* arguments[] = {"twin", argument.c_str()};
        context->commandArgs(2, arguments);
    }
    if (const char* seed = std::getenv("POWER_UP"); seed && *seed) {
        context->randReset(2);
        context->randSeed(int(std::strtol(seed, nullptr, 10) * 16 + int(address) + 1));
    }
    return context;
}

class Core {  // a Verilated node and its clock
 public:
    Core(unsigned address, const Firmware& firmware)
        : context_(context_of(address)), model_(new Vnode(context_.get())), pins(*model_->rootp) {
        pins.clk = 0;
        pins.address = address;
        pins.rs485_rx = 1;
        pins.estop_open = 0;
        pins.encoder_a = pins.encoder_b = pins.encoder_z = pins.probe = pins.adc_sin =
            pins.adc_cos = 0;
        pins.limit_low_open = pins.limit_high_open = 0;
        pins.drive_fault_n = ALL_AXES;
        pins.sensor_rx = pins.peer_rx = pins.link_rx = pins.link_cs_n = 1;
        set_peripheral_pins(pins, PERIPHERAL_SENSE_IDLE);
        pins.rst = 1;
        model_->eval();
        const auto in_memory = SERIAL_CORE ? 0 : std::min<size_t>(firmware.size(), MEMORY_WORDS);
        const auto behind = firmware.begin() + std::ptrdiff_t(in_memory);
        if (HAS_FLASH) flash_.emplace(Firmware(behind, firmware.end()));
#ifdef NODE_MEMORY  // a netlist has its firmware since synthesis
        std::copy(firmware.begin(), behind, &pins.NODE_MEMORY[0]);
#endif
        for (int n = 0; n < RESET_CLK; n++)
            for (const int level : {1, 0}) {
                pins.clk = level;
                model_->eval();
            }
        pins.rst = 0;
    }
    ~Core() { model_->final(); }
    uint64_t digest() const {  // of all registers and memories, FNV-1a
        const auto* all = reinterpret_cast<const uint8_t*>(&pins);
        uint64_t sum = 0xCBF29CE484222325;
        for (const Register& one : REGISTERS)
            for (size_t n = 0; n < one.size * one.words; n++)
                sum = (sum ^ all[one.offset + n]) * 0x100000001B3;
        return sum;
    }
    void clk() {  // not in reset
        rising_edge(pins, rest_);
        if (HAS_FLASH)
            pins.flash_miso = flash_->clk(pins.flash_cs_n, pins.flash_sclk, pins.flash_mosi);
    }
    // Flips a bit of a register; false if it is logic after all, which has its level again.
    bool flip(const Register& where, unsigned word, unsigned bit) {
        const bool before = bit_of(pins, where, word, bit);
        twin::flip(pins, where, word, bit);
        Vnode___024root___eval_settle(&pins);
        rest_.forget();
        return bit_of(pins, where, word, bit) != before;
    }

 private:
    std::unique_ptr<VerilatedContext> context_;
    std::unique_ptr<Vnode> model_;
    Rest rest_;
    std::optional<SerialFlash> flash_;

 public:
    Vnode___024root& pins;
};

// A touch probe at the pins probe_0 of all axes of a node. It touches where the sum of slope times
// position, of all axes, is below `offset`.
struct TouchProbe {
    double slopes[AXES];
    double offset;
    bool touches(const std::vector<std::unique_ptr<Machine>>& machines, uint64_t now) const {
        double height = -offset;
        for (size_t n = 0; n < AXES; n++)
            if (slopes[n] != 0) height += slopes[n] * machines[n]->position(now);
        return height < 0;
    }
    static constexpr unsigned pins() {
        unsigned found = 0;
        for (int n = 0; n < AXES; n++) found |= 1u << 2 * n;
        return found;
    }
};

class Node {
 public:
    Node(unsigned address, const Firmware& firmware, const char* const* kinds,
         const double* const* parameters, uint64_t seed)
        : address_(address), firmware_(firmware), core_(std::in_place, address, firmware) {
        for (int n = 0; n < AXES; n++)
            machines.push_back(make_machine(kinds[n], parameters[n], seed,
                                            uint64_t(address) << 16 | unsigned(n) << 8, CLK_HZ));
    }
    void step(uint64_t now, bool rs485_rx) {
        bool changed = false;
        if (core_) {
            auto& pins = core_->pins;
            pins.rs485_rx = rs485_rx;
            if (probe) pins.probe = probe->touches(machines, now) ? TouchProbe::pins() : 0;
            core_->clk();
            if (drives_.take(pins) || now >= event_at_) {
                event_at_ = NEVER;
                for (int n = 0; n < AXES; n++) {
                    Machine& machine = *machines[size_t(n)];
                    changed |= machine.clk(now, drives_.of(n));
                    event_at_ = std::min(event_at_, machine.event_at());
                }
                if (changed) sense();
            }
            if (devices && devices->clk(now, peripheral_drive_of(pins)))
                set_peripheral_pins(pins, devices->levels());
            line_drives = pins.rs485_driver_enable;
            line_level = pins.rs485_tx;
        } else {  // no power: the node drives nothing, the machines continue
            for (auto& machine : machines) machine->clk(now, DRIVE_IDLE);
            if (devices) devices->clk(now, PERIPHERAL_DRIVE_IDLE);
        }
    }
    void look() { event_at_ = 0; }  // at each machine in the next cycle: one may have been changed
    bool peer_tx() const { return !core_ || core_->pins.peer_tx; }
    bool link_tx() const { return !core_ || core_->pins.link_tx; }
    void hear_link(bool level) {
        if (core_) core_->pins.link_rx = level;
    }
    void hear_peer(bool level) {
        if (core_) core_->pins.peer_rx = level;
    }
    bool flip(const Register& where, unsigned word, unsigned bit) {
        return core_ && core_->flip(where, word, bit);
    }
    uint64_t digest() const { return core_ ? core_->digest() : 0; }
    void press_estop(bool pressed) {
        estop_ = pressed;
        if (core_) core_->pins.estop_open = pressed;
    }
    void power(uint64_t now, bool on) {  // on again, it starts from its image as it did at first
        if (on == core_.has_value()) return;
        if (on) {
            core_.emplace(address_, firmware_);
            core_->pins.estop_open = estop_;
            sense();
            if (devices) {
                devices->power_on(now);
                set_peripheral_pins(core_->pins, devices->levels());
            }
        } else {
            core_.reset();
            line_drives = false;
            line_level = true;
            if (devices) devices->power_cut(now);
        }
    }

    std::vector<std::unique_ptr<Machine>> machines;
    std::unique_ptr<Devices> devices;
    std::optional<TouchProbe> probe;
    bool line_drives = false,
         line_level = true;  // its driver enable and level after this cycle

 private:
    void sense() {
        SensePins levels;
        for (int n = 0; n < AXES; n++) levels.add(n, machines[size_t(n)]->levels());
        levels.set(core_->pins, ALL_AXES);
    }

    unsigned address_;
    const Firmware& firmware_;
    std::optional<Core> core_;  // without power there is none
    DrivePins drives_;
    uint64_t event_at_ = 0;  // cycle in which a machine is to be called at the latest
    bool estop_ = false;
};

struct Flip {  // of a bit, after a cycle
    uint64_t at = NEVER;
    size_t node = 0, register_ = 0;
    unsigned word = 0, bit = 0;
    bool made = false;
};

struct PeerDirection {
    int from, to;
    PeerLine line;
};

struct Link {  // a host at the real-time link of a node
    int node;
    PeerLine to_node, to_host;
};

class Twin {
 public:
    Twin(uint64_t seed, int count, const uint8_t* addresses, const Firmware& firmware,
         const char* const* kinds, const double* const* parameters, double bit_clk)
        : bus(seed, CLK_HZ, bit_clk), firmware_(firmware) {
        for (int n = 0; n < count; n++)
            nodes.emplace_back(
                new Node(addresses[n], firmware_, kinds + n * AXES, parameters + n * AXES, seed));
    }
    void begin() {  // before the first of several steps
        for (auto& node : nodes) node->look();
    }
    void step() {
        now++;
        uint32_t driving = 0, levels = 0;
        for (size_t n = 0; n < nodes.size(); n++) {
            nodes[n]->step(now, bus.level_at(int(n), nodes[n]->line_drives));
            driving |= uint32_t(nodes[n]->line_drives) << n;
            levels |= uint32_t(nodes[n]->line_level) << n;
        }
        bus.step(now, driving, levels);
        for (auto& peer : peers)
            nodes[size_t(peer.to)]->hear_peer(
                peer.line.step(now, nodes[size_t(peer.from)]->peer_tx()));
        for (auto& link : links) {
            Node& node = *nodes[size_t(link.node)];
            link.to_host.step(now, node.link_tx());
            node.hear_link(link.to_node.step(now, true));
        }
        if (now == flip.at)
            flip.made = nodes[flip.node]->flip(REGISTERS[flip.register_], flip.word, flip.bit);
    }

    uint64_t now = 0;
    Flip flip;
    Bus bus;
    std::vector<std::unique_ptr<Node>> nodes;
    std::deque<PeerDirection> peers;  // at fixed addresses
    std::deque<Link> links;           // likewise

 private:
    const Firmware firmware_;
};

// One node without a machine, driven by the levels of a bus as they are: for campaigns of many
// damaged frames.
class FrameBench {
 public:
    static constexpr uint64_t START_CLK =
        2'000'000;  // the firmware starts; the first work of the calibration delays its answers
    FrameBench(unsigned address, const Firmware& firmware, double bit_clk)
        : core_(address, firmware), bit_clk_(bit_clk) {
        host_.set_bit_time(bit_clk);
        idle(START_CLK);
    }
    void idle(uint64_t clk) {
        while (clk--) step(true);
    }
    // Levels, one a cell; then waits until `enough` words are there and the driver is off again, or
    // the line was quiet for quiet_cells, or most_cells have passed. Returns the count of words.
    int exchange(const uint8_t* levels, int count, int enough, int quiet_cells, int most_cells,
                 uint16_t* words, int most_words) {
        host_.received.clear();
        double end = double(now_);
        for (int n = 0; n < count; n++) {
            end += bit_clk_;
            while (double(now_) < end) step(levels[n]);
        }
        const uint64_t quiet = uint64_t(quiet_cells * bit_clk_),
                       stop = now_ + uint64_t(most_cells * bit_clk_);
        for (uint64_t silent = 0; silent < quiet && now_ < stop;) {
            step(true);
            silent = core_.pins.rs485_driver_enable ? 0 : silent + 1;
            if (silent && host_.received.size() >= size_t(enough)) break;
        }
        const int got = int(std::min<size_t>(host_.received.size(), size_t(most_words)));
        std::copy_n(host_.received.begin(), got, words);
        return got;
    }
    uint64_t now() const { return now_; }

 private:
    void step(bool level) {
        now_++;
        core_.pins.rs485_rx = level | core_.pins.rs485_driver_enable;
        core_.clk();
        host_.step(now_, !core_.pins.rs485_driver_enable || core_.pins.rs485_tx);
    }

    Core core_;
    HostUart host_;
    double bit_clk_;
    uint64_t now_ = 0;
};

}  // namespace twin

using namespace twin;

namespace {
Machine& machine_of(Twin* t, int axis) {
    return *t->nodes[size_t(axis / AXES)]->machines[size_t(axis % AXES)];
}
Firmware image(const uint32_t* words, int count) { return {words, words + count}; }
}  // namespace

#pragma GCC visibility push(default)
extern "C" {

int twin_axes() { return AXES; }
int twin_memory_words() { return MEMORY_WORDS + CODE_WORDS; }
void* twin_new(uint64_t seed, int nodes, const uint8_t* addresses, const uint32_t* firmware,
               int words, const char* const* kinds, const double* const* parameters,
               double bit_clk) {
    return new Twin(seed, nodes, addresses, image(firmware, words), kinds, parameters, bit_clk);
}
void twin_delete(Twin* t) { delete t; }
uint64_t twin_now(Twin* t) { return t->now; }
void twin_run(Twin* t, uint64_t clk) {
    t->begin();
    while (clk--) t->step();
}
// Runs until `words` words are there or `clk` cycles have passed; returns how many are there.
int twin_run_until_words(Twin* t, int words, uint64_t clk) {
    const auto& received = t->bus.host.received;
    t->begin();
    while (received.size() < size_t(words) && clk--) t->step();
    return int(received.size());
}
void twin_send_words(Twin* t, const uint16_t* words, int count, const uint32_t* flips,
                     int flip_count, int gap_cells) {
    t->bus.host.send_words(words, count, flips, flip_count, gap_cells);
}
void twin_send_levels(Twin* t, const uint8_t* levels, int count, double cell_clk) {
    t->bus.host.send_levels(levels, count, cell_clk);
}
int twin_receive_words(Twin* t, uint16_t* out, int most) {
    auto& received = t->bus.host.received;
    const int count = int(std::min<size_t>(received.size(), size_t(most)));
    std::copy_n(received.begin(), count, out);
    received.erase(received.begin(), received.begin() + count);
    return count;
}
void twin_host_bit_time(Twin* t, double clk) { t->bus.host.set_bit_time(clk); }
void twin_flip_reply(Twin* t, const uint32_t* cells, int count) { t->bus.flip_reply(cells, count); }
void twin_bus_spikes(Twin* t, double rate, double shortest, double longest) {
    t->bus.spikes(rate, shortest, longest, t->now);
}
void twin_cut(Twin* t, int node, int cut) {  // node -1: the host
    if (node < 0)
        t->bus.host_cut = Cut(cut);
    else
        t->bus.cut_node(node, Cut(cut));
}
// level, host drives, nodes that drive, collisions, framing errors, start glitches, edges, cycle of
// last drive, words waiting
void twin_bus_state(Twin* t, uint64_t* out) {
    uint64_t driving = 0;
    for (size_t n = 0; n < t->nodes.size(); n++) driving |= uint64_t(t->nodes[n]->line_drives) << n;
    const Bus& bus = t->bus;
    const uint64_t state[] = {bus.at_nodes,   bus.host.drives(),       driving,
                              bus.collisions, bus.host.framing_errors, bus.host.start_glitches,
                              bus.edges,      bus.last_driven,         bus.host.received.size()};
    std::copy(std::begin(state), std::end(state), out);
}
void twin_estop(Twin* t, int node, int pressed) {
    t->nodes[size_t(node)]->press_estop(pressed != 0);
}
// A touch probe at a node; slopes of its axes.
void twin_fit_probe(Twin* t, int node, const double* slopes, double offset) {
    auto& probe = t->nodes[size_t(node)]->probe.emplace();
    std::copy_n(slopes, AXES, probe.slopes);
    probe.offset = offset;
}
// The machine of an axis; machine_library.cpp has its functions.
void* twin_machine(Twin* t, int axis) { return &machine_of(t, axis); }
// The devices of a node; devices_library.cpp has their functions. The angle at each
// cut is that of a worm table.
void* twin_attach_devices(Twin* t, int node, const DevicesParameters* parameters, unsigned fitted,
                          uint64_t seed, int table) {
    auto& devices = t->nodes[size_t(node)]->devices;
    devices = std::make_unique<Devices>(*parameters, fitted, seed, 0x5EED00u + unsigned(node) * 16,
                                        CLK_HZ);
    if (table >= 0)
        devices->table_angle = [t, &machine = machine_of(t, table)] {
            return machine.position(t->now);
        };
    return devices.get();
}
// Name, bits and words of a register of the nodes, in the order of their numbers; null beyond the
// last one.
const char* twin_register(int number, int* shape) {
    if (size_t(number) >= REGISTERS.size()) return nullptr;
    const Register& one = REGISTERS[size_t(number)];
    shape[0] = int(one.bits);
    shape[1] = int(one.words);
    return one.name;
}
// A bit flips after the cycle `at`, which is still to come; one flip at a time.
void twin_flip_at(Twin* t, uint64_t at, int node, int number, int word, int bit) {
    t->flip = {at, size_t(node), size_t(number), unsigned(word), unsigned(bit), false};
}
int twin_flipped(Twin* t) { return t->flip.made; }  // 0: not yet, or the bit is no flip-flop
uint64_t twin_digest(Twin* t, int node) { return t->nodes[size_t(node)]->digest(); }
// One direction of the serial line between two nodes; its functions are peer_line_*.
void* twin_join_peers(Twin* t, int from, int to, uint64_t seed, double baud) {
    t->peers.push_back({from, to, PeerLine(seed, 0x9EE2u + unsigned(from), CLK_HZ, baud)});
    return &t->peers.back().line;
}
// A host at the real-time link of a node: the two directions, whose functions are peer_line_*.
void twin_join_link(Twin* t, int node, uint64_t seed, double baud, void** lines) {
    const auto stream = 0x11A4u + unsigned(node) * 2;
    t->links.push_back(
        {node, PeerLine(seed, stream, CLK_HZ, baud), PeerLine(seed, stream + 1, CLK_HZ, baud)});
    lines[0] = &t->links.back().to_node;
    lines[1] = &t->links.back().to_host;
}
void twin_power(Twin* t, int node, int on) { t->nodes[size_t(node)]->power(t->now, on); }

void* frame_bench_new(unsigned address, const uint32_t* firmware, int words, double bit_clk) {
    return new FrameBench(address, image(firmware, words), bit_clk);
}
void frame_bench_delete(FrameBench* bench) { delete bench; }
void frame_bench_idle(FrameBench* bench, uint64_t clk) { bench->idle(clk); }
uint64_t frame_bench_now(FrameBench* bench) { return bench->now(); }
int frame_bench_exchange(FrameBench* bench, const uint8_t* levels, int count, int enough,
                         int quiet_cells, int most_cells, uint16_t* words, int most) {
    return bench->exchange(levels, count, enough, quiet_cells, most_cells, words, most);
}

}  // extern "C"
#pragma GCC visibility pop
