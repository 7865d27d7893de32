// SPDX-License-Identifier: Apache-2.0
// A device on an I2C bus, as NXP's UM10204 has it: bits, acknowledges, start and stop. What the
// bytes mean is the device's own.
#pragma once
#include <cstdint>

namespace twin {

class I2cDevice {
 public:
    explicit I2cDevice(unsigned address) : address_(address) {}
    virtual ~I2cDevice() = default;

    void lines(uint64_t now, bool scl, bool sda) {  // the levels, whenever one of them has changed
        if (scl != scl_)
            scl ? rise(sda) : fall(now);
        else if (scl && sda != sda_)
            sda ? stop(now) : start(now);
        scl_ = scl;
        sda_ = sda;
    }
    bool sda_low() const { return sda_low_ && !dead; }
    void let_go() {  // without power, or just given it
        mode_ = IDLE;
        sda_low_ = false;
        scl_ = sda_ = true;
    }

    bool dead = false;  // fault: does nothing, as if it were not there

 protected:
    virtual bool addressed(uint64_t now, bool reads) = 0;  // returns the acknowledge
    virtual bool written(uint64_t now, uint8_t byte) = 0;
    virtual uint8_t read(uint64_t now) = 0;  // the next byte
    virtual void ended(uint64_t, bool /*stopped*/) {
    }  // by a stop after a whole byte written, or anything else

 private:
    enum Mode { IDLE, ADDRESS, WRITTEN, READ };

    void start(uint64_t now) {
        if (mode_ == WRITTEN) ended(now, false);
        mode_ = ADDRESS;
        count_ = 0;
        sda_low_ = false;
    }
    void stop(uint64_t now) {
        if (mode_ == WRITTEN) ended(now, count_ == 1);  // the clock of the stop itself was counted
        mode_ = IDLE;
        sda_low_ = false;
    }
    void rise(bool sda) {
        if (mode_ == IDLE) return;
        if (count_ < 8)
            byte_ = uint8_t(byte_ << 1 | sda);
        else
            acknowledged_ = !sda;
        count_++;
    }
    void fall(uint64_t now) {
        sda_low_ = false;
        if (mode_ == IDLE || dead) return;
        if (count_ == 8 && mode_ != READ) {
            reads_ = byte_ & 1;
            sda_low_ = mode_ == WRITTEN ? written(now, byte_)
                                        : byte_ >> 1 == address_ && addressed(now, reads_);
            if (!sda_low_) mode_ = IDLE;
        } else if (count_ == 9) {
            count_ = 0;
            if (mode_ == ADDRESS)
                mode_ = reads_ ? READ : WRITTEN;
            else if (mode_ == READ && !acknowledged_)
                mode_ = IDLE;
            if (mode_ == READ) sent_ = read(now);
        }
        if (mode_ == READ && count_ < 8) sda_low_ = !(sent_ >> (7 - count_) & 1);
    }

    unsigned address_;
    Mode mode_ = IDLE;
    int count_ = 0;  // rising edges of this byte
    uint8_t byte_ = 0, sent_ = 0;
    bool scl_ = true, sda_ = true, sda_low_ = false, reads_ = false, acknowledged_ = false;
};

}  // namespace twin
