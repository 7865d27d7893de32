// SPDX-License-Identifier: Apache-2.0
// station_list -- the angles that a job visits, saved in the EEPROM in two copies, with the
// settings of the station that belong to them.
//
// The values of the node hold the settings too: those of the record that was saved later are in
// force.
#include "station/storage/station_list.h"

#include <stddef.h>

#include "made/bus_protocol.h"
#include "station/settings.h"
#include "station/storage/record_copies.h"
#include "station/storage/value_store.h"

#define COPY_BYTES 2048u  // from one copy to the next; the first one is at address 0
#define PART 32u          // bytes that are read at a time
#define HEAD_BYTES ((unsigned)offsetof(struct list, angle))
#define CRC_BYTES 4u

enum phase { CHECK, SEAL, WRITE };

static struct list {      // as it is in the EEPROM, where the CRC-32 follows the last station
    uint32_t generation;  // 0: there is none
    uint16_t settings;    // how many
    uint16_t stations;
    int32_t setting[BUS_SETTING_COUNT];    // those of the station when the list was saved
    uint32_t angle[STATION_LIST_MAX + 1];  // 0.01 arcsec, ascending; one more for the CRC-32
} lists[2];                                // by copy
static struct record_copies copies;
static bool drafting;  // a new list was begun
static uint8_t phase;
static uint8_t loaded_copy;
static uint16_t at;  // byte of the copy that is read, checked or written
static uint32_t crc;

_Static_assert(sizeof(struct list) <= COPY_BYTES, "a list fits its copy");

static struct list* in_force(void) { return &lists[copies.newest]; }

static struct list* draft(void) { return &lists[!copies.newest]; }

// Bytes of a list that its CRC-32 covers.
static unsigned checked_bytes(const struct list* list) { return HEAD_BYTES + 4u * list->stations; }

static bool header_valid(const struct list* list) {
    return list->settings == BUS_SETTING_COUNT && list->stations <= STATION_LIST_MAX;
}

static void begin_phase(enum phase next) {
    phase = (uint8_t)next;
    at = 0;
    crc = UINT32_MAX;
    store_step();
}

// Continues the CRC-32 by a few bytes; true when it covers all.
static bool crc_complete(const struct list* list) {
    unsigned left = checked_bytes(list) - at, now = left < CRC_STEP ? left : CRC_STEP;
    crc = crc32_continue(crc, (const uint8_t*)list + at, now);
    at = (uint16_t)(at + now);
    return now == left;
}

// ---- loading

static void reset(void) {
    record_copies_reset(&copies, 0);
    drafting = false;
}

static void read_part(void) { store_read(loaded_copy * COPY_BYTES + at, PART); }

static void load_copy(unsigned copy) {
    loaded_copy = (uint8_t)copy;
    copies.blank[copy] = true;
    at = 0;
    read_part();
}

static void load(void) { load_copy(0); }

static void take_part(void) {
    struct list* list = &lists[loaded_copy];
    if (!store_blank(PART)) copies.blank[loaded_copy] = false;
    __builtin_memcpy((uint8_t*)list + at, store_bytes,
                     at + PART <= sizeof *list ? PART : sizeof *list - at);
    at = (uint16_t)(at + PART);
    if (header_valid(list) && at < checked_bytes(list) + CRC_BYTES) return read_part();
    begin_phase(CHECK);
}

static void choose(void) {
    record_copies_choose(&copies);
    const struct list* list = in_force();
    if (store_powering_up() && list->generation > value_store_status()->generation)
        for (uint8_t id = 1; id <= BUS_SETTING_COUNT; id++) settings_set(id, list->setting[id - 1]);
    store_loaded(list->generation                     ? BUS_CAUSE_OK
                 : copies.blank[0] && copies.blank[1] ? BUS_CAUSE_NO_JOB
                                                      : BUS_CAUSE_JOB_DAMAGED);
}

static void check(void) {
    struct list* list = &lists[loaded_copy];
    if (header_valid(list) && !crc_complete(list)) return;
    if (!header_valid(list) || list->angle[list->stations] != ~crc)
        list->generation = list->stations = 0;
    copies.generation[loaded_copy] = list->generation;
    loaded_copy ? choose() : load_copy(1);
}

// ---- writing

static void seal(void) {
    struct list* list = draft();
    if (!crc_complete(list)) return;
    list->angle[list->stations] = ~crc;
    begin_phase(WRITE);
}

static void write_part(void) {
    unsigned left = checked_bytes(draft()) + CRC_BYTES - at;
    store_put((const uint8_t*)draft() + at, left < STORE_PAGE ? left : STORE_PAGE);
    store_write(!copies.newest * COPY_BYTES + at);
}

static void written(void) {
    at = (uint16_t)(at + STORE_PAGE);
    if (at < checked_bytes(draft()) + CRC_BYTES) return store_step();
    record_copies_saved(&copies, draft()->generation);
    drafting = false;
    store_end(BUS_CAUSE_OK);
}

static void step(void) { phase == CHECK ? check() : phase == SEAL ? seal() : write_part(); }

const struct store_client station_list_client = {
    .reset = reset,
    .load = load,
    .read = take_part,
    .step = step,
    .written = written,
};

// ---- the list in force, and the new one

uint16_t station_list_count(void) { return station_list_generation() ? in_force()->stations : 0; }

uint32_t station_list_angle(unsigned station) { return in_force()->angle[station]; }

uint32_t station_list_generation(void) {
    return store_state() == STORE_LOADING ? 0 : copies.generation[copies.newest];
}

uint32_t station_list_identity(void) {
    return station_list_count() ? in_force()->angle[in_force()->stations] : 0;
}

bool station_list_damaged(void) { return copies.damaged; }

uint8_t station_list_begin(void) {
    uint8_t refused = store_may_write();
    if (refused != BUS_CAUSE_OK) return refused;
    draft()->stations = 0;
    drafting = true;
    return BUS_CAUSE_OK;
}

uint8_t station_list_add(uint32_t angle) {
    struct list* list = draft();
    uint8_t refused = store_may_write();
    unsigned n = list->stations;
    if (refused != BUS_CAUSE_OK) return refused;
    if (!drafting) return BUS_CAUSE_JOB_INCOMPLETE;
    if (n == STATION_LIST_MAX) return BUS_CAUSE_TOO_MANY_STATIONS;
    if (angle >= STATION_LIST_TURN) return BUS_CAUSE_ANGLE_OUT_OF_TURN;
    if (n > 0 && angle <= list->angle[n - 1]) return BUS_CAUSE_ANGLES_NOT_ASCENDING;
    list->angle[n] = angle;
    list->stations++;
    return BUS_CAUSE_OK;
}

uint16_t station_list_added(void) { return drafting ? draft()->stations : 0; }

uint8_t station_list_save(void) {
    struct list* list = draft();
    uint8_t refused = store_may_write();
    if (refused != BUS_CAUSE_OK) return refused;
    if (station_list_added() == 0) return BUS_CAUSE_NO_STATIONS;
    list->generation = record_copies_next_generation();
    list->settings = BUS_SETTING_COUNT;
    for (uint8_t id = 1; id <= BUS_SETTING_COUNT; id++)
        list->setting[id - 1] = (int32_t)settings_get(id);
    store_begin(&station_list_client);
    begin_phase(SEAL);
    return BUS_CAUSE_OK;
}
