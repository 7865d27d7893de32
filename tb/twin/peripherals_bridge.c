// SPDX-License-Identifier: Apache-2.0
// A program for the soft core that makes the registers of the peripherals accessible at its peer
// port: a byte with the number of a register, bit 7 set for a write, then its four bytes, low
// first; a read is answered with them. Only the node with address 1 answers.
#include "made/registers.h"

enum { WRITE = 0x80, BIT_TIME = 333 };  // 115200 baud at 2.4 MHz

static uint8_t receive(void) {
    uint32_t word;
    do word = peripherals_read(PERIPHERALS_PEER_RECEIVE);
    while (!(word & PERIPHERALS_PEER_RECEIVE_PRESENT_MASK));
    return (uint8_t)word;
}

int main(void) {
    peripherals_write(PERIPHERALS_PEER_BIT_TIME, BIT_TIME);
    while (FIELD_GET(node_read(NODE_BUILD), NODE_BUILD_ADDRESS) != 1);
    for (;;) {
        const uint8_t request = receive();
        const uint32_t offset = (request & ~WRITE) * 4u;
        uint32_t value = 0;
        if (request & WRITE) {
            for (int bit = 0; bit < 32; bit += 8) value |= (uint32_t)receive() << bit;
            peripherals_write(offset, value);
        } else {
            value = peripherals_read(offset);
            for (int bit = 0; bit < 32; bit += 8)
                peripherals_write(PERIPHERALS_PEER_TRANSMIT, value >> bit & 0xFF);
        }
    }
}
