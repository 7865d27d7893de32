// SPDX-License-Identifier: Apache-2.0
// value_store -- the parameters and settings of a node in the EEPROM, in two copies; they come into
// force at power-up.
//
// A copy is a row of entries of 16 bytes: a head with generation and build, the values that are not
// at their defaults, an end with the CRC-32. Both copies are checked before the newer one is
// restored. When a missing EEPROM comes back later, its values are checked but not restored.
#include "station/storage/value_store.h"

#include "made/bus_protocol.h"
#include "station/storage/record_copies.h"
#include "station/storage/saved_values.h"

#define AT 8192u  // address of the first copy; the second one reaches to the end of the device
#define COPY_BYTES 4096u
#define ENTRY ((unsigned)sizeof(struct saved_value))
#define VALUES_PER_CALL 8u  // values that one call looks at

enum phase { CHECK, RESTORE, GATHER };

_Static_assert(ENTRY == CRC_STEP && STORE_PAGE % ENTRY == 0,
               "an entry is checked in one call and lies within a page");
_Static_assert(ENTRY*(VALUE_STORE_MAX + 2u) <= COPY_BYTES,
               "all values fit a copy, with head and end");

static struct record_copies copies;
static struct value_store_status status;
static uint8_t phase;
static uint8_t copy;  // that is read or written
static uint16_t at;   // byte of the copy
static uint32_t crc;
static unsigned cursor;         // of saved_values_next
static bool final;              // the page that is written is the last one
static struct saved_value got;  // the value that was read last
static uint16_t got_number;     // its number from 1 on; 0: none
static uint8_t got_cause;       // how its reading ended

static unsigned address(void) { return AT + copy * COPY_BYTES + at; }

// ---- loading: both copies are checked, then the newer one is restored

static void reset(void) {
    record_copies_reset(&copies, 1);
    got_number = 0;
    if (store_powering_up())
        status = (struct value_store_status){.cause = BUS_CAUSE_SAVED_NOT_READ};
    status.damaged = false;
}

// Reads a page at a time; its other entries follow without a transfer.
static void read_entry(void) {
    if (at % STORE_PAGE)
        store_step();
    else
        store_read(address(), STORE_PAGE);
}

static void read_copy(enum phase next, unsigned which) {
    phase = (uint8_t)next;
    copy = (uint8_t)which;
    at = 0;
    crc = UINT32_MAX;
    read_entry();
}

static void load(void) { read_copy(CHECK, 0); }

static void end_load(void) { store_loaded(BUS_CAUSE_OK); }

static void restore_entry(const struct saved_value* entry) {
    if (entry->owner == SAVED_END) {
        if (status.values == 0 && status.cause == BUS_CAUSE_OK)
            status.cause = BUS_CAUSE_NOTHING_SAVED;
        return end_load();
    }
    if (entry->owner != SAVED_HEAD) {
        status.values++;
        if (!saved_values_restore(entry)) status.cause = BUS_CAUSE_SAVED_REFUSED;
    } else if ((uint32_t)((uint64_t)entry->value >> 32) != saved_values_build()) {
        status.cause = BUS_CAUSE_SAVED_OTHER_BUILD;
        return end_load();
    }
    at = (uint16_t)(at + ENTRY);
    read_entry();
}

static void choose(void) {
    record_copies_choose(&copies);
    status.generation = copies.generation[copies.newest];
    status.damaged = copies.damaged;
    if (!store_powering_up() && status.generation) return end_load();
    status.cause = status.generation ? BUS_CAUSE_OK
                   : status.damaged  ? BUS_CAUSE_SAVED_DAMAGED
                                     : BUS_CAUSE_NOTHING_SAVED;
    status.generation ? read_copy(RESTORE, copies.newest) : end_load();
}

static void end_check(bool whole) {
    if (!whole) copies.generation[copy] = 0;
    copy ? choose() : read_copy(CHECK, 1);
}

static void check_entry(const struct saved_value* entry) {
    if (at == 0) {
        copies.blank[copy] = store_blank(ENTRY);
        copies.generation[copy] = (uint32_t)entry->value;
        if (entry->owner != SAVED_HEAD) return end_check(false);
    }
    if (entry->owner == SAVED_END) return end_check((uint32_t)entry->value == ~crc);
    crc = crc32_continue(crc, entry, ENTRY);
    at = (uint16_t)(at + ENTRY);
    if (at == COPY_BYTES) return end_check(false);
    read_entry();
}

static void take_entry(void) {
    struct saved_value entry;
    __builtin_memcpy(&entry, &store_bytes[at % STORE_PAGE], ENTRY);
    phase == CHECK ? check_entry(&entry) : restore_entry(&entry);
}

// ---- writing

static bool next_value(struct saved_value* value) {
    for (unsigned n = 0; n < VALUES_PER_CALL; n++)
        if (saved_values_next(&cursor, value)) return true;
    return false;
}

// Puts the head, or the next value that is not at its default, into the page.
static void gather(void) {
    struct saved_value entry = {(int64_t)((uint64_t)saved_values_build() << 32 | status.generation),
                                SAVED_HEAD, 0};
    if ((at || store_filled()) && !next_value(&entry)) return;
    final = entry.owner == SAVED_END;
    if (final)
        entry.value = ~crc;
    else
        crc = crc32_continue(crc, &entry, ENTRY);
    store_put(&entry, ENTRY);
    if (entry.owner <= SAVED_NODE) status.values++;
    if (final || store_filled() == STORE_PAGE) store_write(address());
}

static void written(void) {
    at = (uint16_t)(at + STORE_PAGE);
    if (!final) return store_step();
    record_copies_saved(&copies, status.generation);
    status.damaged = false;
    store_end(status.values == 0 ? BUS_CAUSE_NOTHING_SAVED : BUS_CAUSE_OK);
}

static void step(void) { phase == GATHER ? gather() : take_entry(); }

const struct store_client value_store_client = {
    .reset = reset,
    .load = load,
    .read = take_entry,
    .step = step,
    .written = written,
    .cause = &status.cause,
};

const struct value_store_status* value_store_status(void) { return &status; }

uint8_t value_store_save(bool nothing) {
    uint8_t refused = store_may_write();
    if (refused != BUS_CAUSE_OK) return refused;
    store_begin(&value_store_client);
    copy = !copies.newest;
    copies.generation[copy] = 0;
    status.generation = record_copies_next_generation();
    status.values = 0;
    got_number = 0;
    phase = GATHER;
    at = 0;
    crc = UINT32_MAX;
    cursor = nothing ? SAVED_NOTHING : 0;
    store_step();
    return BUS_CAUSE_OK;
}

// ---- reading one value

static void take_value(void) {
    __builtin_memcpy(&got, store_bytes, ENTRY);
    store_end(BUS_CAUSE_OK);
}

static const struct store_client reader = {.read = take_value, .cause = &got_cause};

uint8_t value_store_get(unsigned number, struct saved_value* value) {
    if (number >= status.values) return BUS_CAUSE_OUT_OF_RANGE;
    uint8_t refused = store_may_write();
    if (refused != BUS_CAUSE_OK) return refused;
    if (got_number == number + 1) {
        *value = got;
        return BUS_CAUSE_OK;
    }
    got_number = (uint16_t)(number + 1);
    store_begin(&reader);
    store_read(AT + copies.newest * COPY_BYTES + got_number * ENTRY, ENTRY);
    return BUS_CAUSE_EEPROM_BUSY;
}
