// SPDX-License-Identifier: Apache-2.0
#include "devices/ps2_computer.h"

#include <algorithm>

#include "devices/ps2_keyboard.h"

namespace twin {

uint64_t Ps2Computer::step(uint64_t now, bool clock, bool data) {
    const bool fall = clock_ && !clock && !clock_low;
    clock_ = clock;
    if (fall) fell(now, data);
    timers(now);
    return next();
}

void Ps2Computer::fell(uint64_t now, bool data) {
    if (mode_ == SENDS) {  // the device clocks: 8 data bits, parity, stop, acknowledge
        at_ = now + us(FRAME);
        if (bit_ < 10) {
            data_low = !(frame_ >> ++bit_ & 1);
            return;
        }
        release_lines(now);
        if (data) failed(now);
    } else if (mode_ == LISTENS) {
        if (bit_ == 0) frame_ = 0;
        frame_ |= unsigned(data) << bit_;
        at_ = now + us(FRAME);
        if (++bit_ < 11) return;
        pause_ = now + us(PAUSE);
        processes_at_ = now + us(LAST);  // once the last clock is over
        const uint8_t byte = uint8_t(frame_ >> 1);
        again_ = frame_ != ps2_frame(byte);
        damaged += again_;
        release_lines(now);
        if (!again_) take(now, byte);
    }
}

void Ps2Computer::take(uint64_t now, uint8_t byte) {
    received.push_back({now, byte});
    if (!awaits_) return keys.push_back(byte);
    if (byte == 0xFA || (byte == 0xEE && orders_.front() == 0xEE)) {
        orders_.pop_front();
        tries_ = 0;
        awaits_ = false;
        at_ = NEVER;
    } else if (byte == 0xFE) {
        failed(now);
    } else {
        keys.push_back(byte);  // it was under way
    }
}

void Ps2Computer::timers(uint64_t now) {
    const bool due = now >= at_;
    if (mode_ == INHIBITS && due) {
        release_lines(now);
        clock_low = false;
        pause_ = now + us(PAUSE);
    } else if (mode_ == ASKS && due) {
        mode_ = SENDS;
        bit_ = 0;
        data_low = true;  // the start bit
        clock_low = false;
        at_ = now + us(FIRST);
    } else if (mode_ == SENDS && due) {
        release_lines(now);
        data_low = false;
        failed(now);
    } else if (mode_ == LISTENS && due) {
        if (bit_) {  // a frame that never ended
            release_lines(now);
            damaged++;
        } else {
            failed(now);
        }
    }
    if (mode_ != LISTENS) return;
    if (now >= processes_at_) {
        processes_at_ = NEVER;
        if (again_) return send(now, 0xFE);  // before another byte comes
        if (processing_ > 0) return hold(now, us(processing_ * 1e6));
    }
    if (now >= inhibit_at_) {
        if (bit_ == 10) {  // a device cannot detect a cut at its last edge
            inhibit_at_ = now + us(HOLD);
            return;
        }
        if (inhibit_at_) {
            hold(now, us(random_.uniform(100, 2000)));
            inhibits++;
        }
        inhibit_at_ = now + uint64_t(random_.exponential(clk_hz_ / inhibits_)) + us(2000);
    } else if (may_order() && now >= pause_) {
        send(now, orders_.front());
    }
}

void Ps2Computer::hold(uint64_t now, uint64_t clk) {
    mode_ = INHIBITS;
    clock_low = true;
    at_ = now + clk;
}

void Ps2Computer::release_lines(uint64_t now) {  // for a new byte
    mode_ = LISTENS;
    bit_ = 0;
    at_ = awaits_ || again_ ? now + us(ANSWER) : NEVER;
}

void Ps2Computer::send(uint64_t now, uint8_t byte) {
    frame_ = ps2_frame(byte);
    awaits_ |= !again_;
    mode_ = ASKS;
    clock_low = true;
    at_ = now + us(HOLD);
}

void Ps2Computer::failed(uint64_t now) {  // the order will be sent again, but not for ever
    if (awaits_ && ++tries_ >= TRIES) {
        unanswered++;
        orders_.pop_front();
        tries_ = 0;
    }
    awaits_ = again_ = false;
    at_ = NEVER;
    pause_ = now + us(PAUSE);
}

uint64_t Ps2Computer::next() const {
    const uint64_t when = std::min({at_, inhibit_at_, processes_at_});
    return may_order() ? std::min(when, pause_) : when;
}

}  // namespace twin
