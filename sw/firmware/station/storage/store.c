// SPDX-License-Identifier: Apache-2.0
// store -- the EEPROM 24AA128 of a station as a block device: it reads bytes, and writes pages that
// it reads back, for one client at a time.
//
// While a page is being written the device does not acknowledge its address. So a transfer that
// fails is repeated until WRITE_TIMEOUT_MS have passed; then the EEPROM counts as missing, and
// after RETRY_MS all clients load again.
#include "station/storage/store.h"

#include "core/clock.h"
#include "made/bus_protocol.h"
#include "station/devices/i2c.h"

#define DEVICE 0x50u
#define ADDRESS_BYTES 2u
#define WRITE_TIMEOUT_MS 50u  // a write takes 5 ms
#define RETRY_MS 1000u        // from one attempt to find a missing EEPROM to the next
#define TRIES 3u              // to write a page

enum task { IDLE, STEP, READ, WRITE, VERIFY, MISSING };

uint8_t store_bytes[STORE_PAGE];

static const struct store_client* client;  // that loads or writes
static unsigned clients_loaded;
static uint8_t task, cause, load_cause;
static bool loading, powering_up;
static uint32_t since_ms;  // when the transfer was first tried
static uint16_t page_address;
static uint8_t filled, tries;  // bytes of the page that is written, and attempts to write it
static uint8_t out[ADDRESS_BYTES + STORE_PAGE];
static struct i2c_transfer transfer;

static void begin_task(enum task next) {
    task = (uint8_t)next;
    since_ms = clock_ms();
}

static void begin_transfer(unsigned address, unsigned write_count, unsigned read_count) {
    out[0] = (uint8_t)(address >> 8);
    out[1] = (uint8_t)address;
    transfer = (struct i2c_transfer){.address = DEVICE,
                                     .write = out,
                                     .write_count = (uint8_t)(ADDRESS_BYTES + write_count),
                                     .read = store_bytes,
                                     .read_count = (uint8_t)read_count};
    i2c_begin(I2C_STORE, &transfer);
}

static void finish(uint8_t with) {
    if (loading || !client->cause)
        cause = with;
    else
        *client->cause = with;
    loading = powering_up = false;
    begin_task(with == BUS_CAUSE_EEPROM_MISSING ? MISSING : IDLE);
}

static void load_next(void) {
    client = store_clients[clients_loaded++];
    client->load();
}

static void load(void) {
    for (unsigned n = 0; n < STORE_CLIENTS; n++) store_clients[n]->reset();
    clients_loaded = 0;
    load_cause = BUS_CAUSE_OK;
    loading = true;
    load_next();
}

static void write_page(void) {
    begin_task(WRITE);
    begin_transfer(page_address, filled, 0);
}

static void verify(void) {
    for (unsigned n = 0; n < filled; n++) {
        if (store_bytes[n] == out[ADDRESS_BYTES + n]) continue;
        if (++tries == TRIES) return finish(BUS_CAUSE_EEPROM_FAILED);
        if (!client->rewrite) return write_page();
        filled = 0;
        return client->rewrite();
    }
    tries = filled = 0;
    client->written();
}

static void retry_transfer(void) {
    if (clock_ms() - since_ms > WRITE_TIMEOUT_MS) return finish(BUS_CAUSE_EEPROM_MISSING);
    i2c_begin(I2C_STORE, &transfer);
}

void store_start(unsigned axes) {
    (void)axes;
    cause = BUS_CAUSE_OK;
    powering_up = true;
    load();
}

void store_work(void) {
    enum i2c_outcome outcome = i2c_outcome(I2C_STORE);
    if (task == IDLE || outcome == I2C_BUSY) return;
    if (task == MISSING) {
        if (clock_ms() - since_ms > RETRY_MS) load();
        return;
    }
    if (task == STEP) return client->step();
    if (outcome != I2C_OK) return retry_transfer();
    if (task == READ) return client->read();
    if (task == VERIFY) return verify();
    begin_task(VERIFY);
    begin_transfer(page_address, 0, filled);
}

enum store_state store_state(void) {
    if (task == MISSING) return STORE_MISSING;
    return task == IDLE ? STORE_READY : loading ? STORE_LOADING : STORE_WRITING;
}

bool store_busy(void) { return task != IDLE && task != MISSING; }

bool store_powering_up(void) { return powering_up; }

uint8_t store_cause(void) { return cause; }

uint8_t store_may_write(void) {
    return task == IDLE      ? BUS_CAUSE_OK
           : task == MISSING ? BUS_CAUSE_EEPROM_MISSING
                             : BUS_CAUSE_EEPROM_BUSY;
}

void store_read(unsigned address, unsigned count) {
    begin_task(READ);
    begin_transfer(address, 0, count);
}

bool store_blank(unsigned count) {
    while (count--)
        if (store_bytes[count] != 0xFF) return false;
    return true;
}

void store_step(void) { begin_task(STEP); }

void store_loaded(uint8_t with) {
    if (with != BUS_CAUSE_OK) load_cause = with;
    if (clients_loaded < STORE_CLIENTS)
        load_next();
    else
        finish(load_cause);
}

void store_begin(const struct store_client* next) {
    client = next;
    tries = filled = 0;
}

void store_put(const void* bytes, unsigned count) {
    __builtin_memcpy(&out[ADDRESS_BYTES + filled], bytes, count);
    filled = (uint8_t)(filled + count);
}

unsigned store_filled(void) { return filled; }

void store_write(unsigned address) {
    page_address = (uint16_t)address;
    write_page();
}

void store_end(uint8_t with) { finish(with); }
