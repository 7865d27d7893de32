// SPDX-License-Identifier: Apache-2.0
#include "devices/ps2_keyboard.h"

#include <algorithm>

namespace twin {

void Ps2Keyboard::type(const uint8_t* bytes, int count, uint64_t now) {
    if (enabled_ && !dead)
        for (int n = 0; n < count; n++) typed_.push_back({now, bytes[n]});
}

uint64_t Ps2Keyboard::step(uint64_t now, bool clock, bool data) {
    if (dead) {
        typed_.clear();
        answers_.clear();
        return stop();
    }
    if (mode_ == IDLES) return idle(now, clock, data);
    if (now < at_) return at_;
    const bool held = !clock && phase_ != LOW;
    switch (phase_) {
    case BEFORE:
    case AFTER:
        if (held && (phase_ == BEFORE ||
                     bit_ < 10)) {  // once the last bit has its clock, the byte is the host's
            aborts++;
            return stop();
        }
        if (phase_ == BEFORE) {
            clock_low = true;
            phase_ = LOW;
            return at_ = now + us(HALF);
        }
        break;
    case LOW:
        clock_low = false;
        phase_ = AFTER;
        return at_ = now + us(HALF / 2);
    }
    if (mode_ == RECEIVES)
        frame_ |= unsigned(data) << bit_;  // the host has set it while the clock was low
    if (++bit_ < 11) {
        set_bit();
        phase_ = BEFORE;
        return at_ = now + us(HALF / 2);
    }
    const bool received = mode_ == RECEIVES;
    stop();
    if (received) {
        const uint8_t byte = uint8_t(frame_);
        command(now, byte, (frame_ & 0x3FF) == ps2_frame(byte) >> 1);
    } else {
        auto& from = answering_ ? answers_ : typed_;
        last_ = from.front().byte;
        from.pop_front();
        sent++;
    }
    return now + 1;
}

uint64_t Ps2Keyboard::idle(uint64_t now, bool clock, bool data) {
    if (!clock) {
        free_since_ = NEVER;
        return NEVER;
    }
    free_since_ = std::min(free_since_, now);
    const uint64_t free = free_since_ + us(FREE);
    if (!data) return now < free ? free : begin(now, RECEIVES);
    answering_ = !answers_.empty();
    const auto& from = answering_ ? answers_ : typed_;
    if (from.empty()) return NEVER;
    const uint64_t due = std::max(free, from.front().at);
    return now < due ? due : begin(now, SENDS);
}

uint64_t Ps2Keyboard::begin(uint64_t now, Mode mode) {
    mode_ = mode;
    phase_ = BEFORE;
    bit_ = 0;
    frame_ = mode == SENDS ? ps2_frame((answering_ ? answers_ : typed_).front().byte) : 0;
    set_bit();
    return at_ = now + us(HALF / 2);
}

void Ps2Keyboard::set_bit() {
    if (mode_ == SENDS)
        data_low = !(frame_ >> bit_ & 1);
    else
        data_low = bit_ == 10 && (frame_ >> 9 & 1);  // the acknowledge of a stop bit
}

uint64_t Ps2Keyboard::stop() {
    mode_ = IDLES;
    clock_low = data_low = false;
    free_since_ = NEVER;
    return dead ? NEVER : 0;
}

void Ps2Keyboard::command(uint64_t now, uint8_t byte, bool good) {
    answers_.clear();
    if (!good) {
        damaged_commands++;
        return answer(now, {0xFE});
    }
    if (byte == 0xFE) return answer(now, {last_});
    commands.push_back(byte);
    if (awaits_ && byte < 0x80) {  // an argument
        if (awaits_ == 0xED) lights = byte & 7;
        awaits_ = 0;
        return answer(now, {0xFA});
    }
    awaits_ = 0;
    switch (byte) {
    case 0xED:
    case 0xF0:
    case 0xF3: awaits_ = byte; return answer(now, {0xFA});
    case 0xEE: return answer(now, {0xEE});
    case 0xF2: return answer(now, {0xFA, 0xAB, 0x83});
    case 0xF4:
    case 0xF5:
    case 0xF6:
        enabled_ = byte != 0xF5;
        if (!enabled_) typed_.clear();
        return answer(now, {0xFA});
    case 0xFF:
        answer(now, {0xFA});
        answers_.push_back({now + self_test_, 0xAA});
        typed_.clear();
        lights = 0;
        enabled_ = true;
        return;
    default: return answer(now, {0xFE});
    }
}

void Ps2Keyboard::answer(uint64_t now, std::initializer_list<uint8_t> bytes) {
    for (const uint8_t byte : bytes) answers_.push_back({now + us(ANSWER), byte});
}

}  // namespace twin
