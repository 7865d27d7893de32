// SPDX-License-Identifier: Apache-2.0
// A PS/2 keyboard: makes the clock of both directions (12.5 kHz), waits while the host holds it,
// begins a byte again that the host cut short, takes the host's commands and answers them. It types
// the given bytes at the given times.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <initializer_list>
#include <vector>

namespace twin {

inline unsigned ps2_frame(
    uint8_t byte, bool damaged = false) {  // 11 bits from bit 0: start, data, odd parity, stop
    return unsigned(byte) << 1 | unsigned(__builtin_parity(byte) == damaged) << 9 | 1u << 10;
}

class Ps2Keyboard {
 public:
    static constexpr uint64_t NEVER = ~uint64_t(0);

    void configure(double clk_hz, double self_test_s) {
        us_ = clk_hz / 1e6;
        self_test_ = uint64_t(self_test_s * clk_hz);
    }
    void type(const uint8_t* bytes, int count,
              uint64_t now);  // behind what waits, not before `now`
    size_t waiting() const { return typed_.size(); }
    // takes the levels of the lines at cycle `now`, called when they change and at the requested
    // time; returns when to be called again
    uint64_t step(uint64_t now, bool clock, bool data);

    bool clock_low = false, data_low = false;  // pulls
    bool dead = false;                         // fault: unplugged
    unsigned lights = 0;                       // scroll, num, caps lock from bit 0
    std::vector<uint8_t> commands;             // of the host, arguments with them
    uint64_t aborts = 0, sent = 0, damaged_commands = 0;

 private:
    static constexpr double HALF = 40, FREE = 50,
                            ANSWER = 500;  // us: half a bit, quiet before a byte, before an answer
    enum Mode { IDLES, SENDS, RECEIVES };
    enum Phase { BEFORE, LOW, AFTER };  // of a clock pulse
    struct Due {
        uint64_t at;
        uint8_t byte;
    };

    uint64_t us(double n) const { return uint64_t(n * us_) + 1; }
    uint64_t idle(uint64_t now, bool clock, bool data);
    uint64_t begin(uint64_t now, Mode mode);
    uint64_t stop();
    void set_bit();
    void command(uint64_t now, uint8_t byte, bool good);
    void answer(uint64_t now, std::initializer_list<uint8_t> bytes);

    double us_ = 1;
    uint64_t self_test_ = 0, at_ = 0, free_since_ = NEVER;
    Mode mode_ = IDLES;
    Phase phase_ = BEFORE;
    int bit_ = 0;
    unsigned frame_ = 0;
    std::deque<Due> typed_, answers_;
    uint8_t last_ = 0, awaits_ = 0;  // command whose argument comes next
    bool answering_ = false, enabled_ = true;
};

}  // namespace twin
