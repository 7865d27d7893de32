// SPDX-License-Identifier: Apache-2.0
// store -- the program of stations, the journal of the job and what the node keeps of its values,
// in an EEPROM 24AA128, whole after a power cut at any moment.
//
// A page that is being written when the power goes may hold anything afterwards. So there are two
// copies of the program and of the values, each with a generation and a CRC-32, and a new one goes
// over the older; and each line of the journal has a page of its own, used in turn. What was
// written is read back before it counts. While a page is being written the device does not
// acknowledge: reading it back is tried until it does. Program and values both have the settings;
// those of the newer one are in force.
#include "station/storage/store.h"

#include <stddef.h>

#include "core/clock.h"
#include "station/devices/i2c.h"
#include "station/storage/saved_values.h"
#include "made/bus_protocol.h"
#include "station/settings.h"

#define DEVICE 0x50u
#define PAGE 64u
#define PART 32u  // bytes read at a time
#define COPY_BYTES 2048u
#define JOURNAL 4096u  // after the two copies
#define JOURNAL_PAGES 64u
#define VALUES_AT 8192u  // two copies of the values, to the end of the device
#define VALUES_BYTES 4096u
#define VALUE ((unsigned)sizeof(struct saved_value))
#define CHECKED 16u  // bytes of a CRC-32 done in one call
#define HEAD_BYTES ((unsigned)offsetof(struct station_list, angle))
#define CRC_BYTES 4u
#define RECORD_CHECKED 12u    // bytes of a record before its CRC-32
#define WRITE_TIMEOUT_MS 50u  // a write takes 5 ms
#define RETRY_MS 1000u        // a device that is not there is looked for retry_transfer
#define VALUES_PER_CALL 8u    // values in one call
#define TRIES 3u              // to write a page

enum task {
    IDLE_TASK,
    READ_VALUES,
    RESTORE_VALUES,
    LOAD,
    CHECK_LOADED,
    READ_JOURNAL,
    SEAL,
    GATHER,
    WRITE_NEXT,
    WRITE,
    VERIFY,
    DEAD
};
enum kind { RECORD, STATION_LIST, VALUES };

_Static_assert(VALUE == CHECKED && PAGE % VALUE == 0,
               "a value is checked in one call and lies within a page");
_Static_assert(VALUE*(VALUE_STORE_MAX + 2u) <= VALUES_BYTES,
               "all values fit a copy, with head and end");

static struct station_list {  // as in the EEPROM, where a CRC-32 follows the last station
    uint32_t generation;      // each saved one has one more; 0: there is none
    uint16_t settings;        // so many
    uint16_t stations;
    int32_t setting[BUS_SETTING_COUNT];    // those of the station when it was saved
    uint32_t angle[STATION_LIST_MAX + 1];  // 0.01 arcsec, ascending; one more for the CRC-32
} station_lists[2];                        // by copy
static struct journal_record last, candidate;
static uint8_t newest;  // copy in force
static bool blank[2], damaged, drafting;
static uint8_t task, cause;
static struct value_store_status values_status;  // as taken
static uint32_t values_generation[2];            // by copy; 0: it is not whole
static uint8_t values_copy;                      // that is read or written
static bool values_blank, starting;              // starting: values are taken
static unsigned gathered;                        // of saved_values_next
static uint8_t kind;                             // of what is written
static uint16_t at;            // byte of the program or of the values, or page of the journal
static uint16_t page_address;  // of the page that is written, with so many bytes of out
static uint8_t filled;
static bool final;  // it is the last one
static uint32_t crc, since_ms;
static uint8_t tries;
static unsigned blank_pages;  // of the journal, in turn
static uint8_t out[2 + PAGE], in[PAGE];
static struct i2c_transfer transfer;

static uint32_t crc32(uint32_t state, const uint8_t* bytes, unsigned count) {
    static const uint32_t of_nibble[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac,
                                           0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
                                           0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                           0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    while (count--) {
        state ^= *bytes++;
        state = state >> 4 ^ of_nibble[state & 15];
        state = state >> 4 ^ of_nibble[state & 15];
    }
    return state;
}

static bool never_written(unsigned count)  // so many bytes that came
{
    while (count--)
        if (in[count] != 0xFF) return false;
    return true;
}

static uint8_t* bytes_of(unsigned which) { return (uint8_t*)&station_lists[which]; }

// Bytes of a program that its CRC-32 is about.
static unsigned station_list_bytes(const struct station_list* program) {
    return HEAD_BYTES + 4u * program->stations;
}

static uint16_t record_address(uint32_t sequence) {
    return (uint16_t)(JOURNAL + sequence % JOURNAL_PAGES * PAGE);
}

static void transfer_begin(unsigned from, unsigned write_count, unsigned read_count) {
    out[0] = (uint8_t)(from >> 8);
    out[1] = (uint8_t)from;
    transfer = (struct i2c_transfer){.address = DEVICE,
                                     .write = out,
                                     .write_count = (uint8_t)(2 + write_count),
                                     .read = in,
                                     .read_count = (uint8_t)read_count};
    i2c_begin(I2C_STORE, &transfer);
}

static void go(enum task to) {
    task = (uint8_t)to;
    since_ms = clock_ms();
}

static void end(uint8_t with) {
    if (kind == VALUES)
        values_status.cause = with;
    else
        cause = with;
    starting = false;
    go(with == BUS_CAUSE_EEPROM_MISSING ? DEAD : IDLE_TASK);
}

// ---- what is kept of the values: both copies are checked, then the newer one is taken

static void read_value(void)  // a page at a time
{
    if (at % PAGE == 0) transfer_begin(VALUES_AT + values_copy * VALUES_BYTES + at, 0, PAGE);
}

static void read_values(enum task with, unsigned copy) {
    values_copy = (uint8_t)copy;
    at = 0;
    crc = UINT32_MAX;
    go(with);
    read_value();
}

static void load_begin(unsigned which);

static void end_values(void) {
    starting = false;
    load_begin(0);
}

static void restore_value(const struct saved_value* value) {
    if (value->owner == SAVED_END) {
        if (values_status.values == 0 && values_status.cause == BUS_CAUSE_OK)
            values_status.cause = BUS_CAUSE_NOTHING_SAVED;
        return end_values();
    }
    if (value->owner != SAVED_HEAD) {
        values_status.values++;
        if (!saved_values_restore(value)) values_status.cause = BUS_CAUSE_SAVED_REFUSED;
    } else if ((uint32_t)((uint64_t)value->value >> 32) != saved_values_build()) {
        values_status.cause = BUS_CAUSE_SAVED_OTHER_BUILD;
        return end_values();
    }
    at = (uint16_t)(at + VALUE);
    go(RESTORE_VALUES);
    read_value();
}

static void choose_values(void) {
    bool none = !values_generation[0] && !values_generation[1];
    values_copy = values_generation[1] > values_generation[0];
    values_status.generation = values_generation[values_copy];
    if (!starting && !none) return end_values();
    values_status.cause = !none                   ? BUS_CAUSE_OK
                          : values_status.damaged ? BUS_CAUSE_SAVED_DAMAGED
                                                  : BUS_CAUSE_NOTHING_SAVED;
    none ? end_values() : read_values(RESTORE_VALUES, values_copy);
}

static void checked_copy(bool whole) {
    if (!whole) values_generation[values_copy] = 0;
    values_status.damaged = values_status.damaged || (!whole && !values_blank);
    values_copy ? choose_values() : read_values(READ_VALUES, 1);
}

static void check_value(const struct saved_value* value) {
    if (at == 0) {
        values_blank = never_written(VALUE);
        values_generation[values_copy] = (uint32_t)value->value;
        if (value->owner != SAVED_HEAD) return checked_copy(false);
    }
    if (value->owner == SAVED_END) return checked_copy((uint32_t)value->value == ~crc);
    crc = crc32(crc, (const uint8_t*)value, VALUE);
    at = (uint16_t)(at + VALUE);
    if (at == VALUES_BYTES) return checked_copy(false);
    go(READ_VALUES);
    read_value();
}

static void value_read(void) {
    struct saved_value value;
    __builtin_memcpy(&value, &in[at % PAGE], VALUE);
    task == READ_VALUES ? check_value(&value) : restore_value(&value);
}

// ---- loading: both copies, then the journal

static bool header_valid(const struct station_list* program) {
    return program->settings == BUS_SETTING_COUNT && program->stations <= STATION_LIST_MAX;
}

static void load_part(void) { transfer_begin(newest * COPY_BYTES + at, 0, PART); }

static void load_begin(unsigned which)  // `newest` is the copy being loaded until both are there
{
    newest = (uint8_t)which;
    blank[which] = true;
    at = 0;
    go(LOAD);
    load_part();
}

static void loaded_part(void) {
    struct station_list* program = &station_lists[newest];
    blank[newest] = blank[newest] && never_written(PART);
    __builtin_memcpy(bytes_of(newest) + at, in,
                     at + PART <= sizeof *program ? PART : sizeof *program - at);
    at = (uint16_t)(at + PART);
    go(LOAD);
    if (header_valid(program) && at < station_list_bytes(program) + CRC_BYTES) return load_part();
    at = 0;
    crc = UINT32_MAX;
    go(CHECK_LOADED);
}

static void choose(void) {
    bool both_blank = blank[0] && blank[1];
    damaged = (station_lists[0].generation == 0 && !blank[0]) ||
              (station_lists[1].generation == 0 && !blank[1]);
    newest = station_lists[1].generation > station_lists[0].generation;
    if (station_lists[newest].generation > values_status.generation)
        for (uint8_t id = 1; id <= BUS_SETTING_COUNT; id++)
            settings_set(id, station_lists[newest].setting[id - 1]);
    cause = station_lists[newest].generation ? BUS_CAUSE_OK
            : both_blank                     ? BUS_CAUSE_NO_JOB
                                             : BUS_CAUSE_JOB_DAMAGED;
    last = (struct journal_record){0};
    at = 0;
    go(READ_JOURNAL);
    transfer_begin(record_address(at), 0, sizeof candidate);
}

// The CRC-32 goes on by a few bytes; true when all are in it.
static bool crc_step(const struct station_list* program, unsigned which) {
    unsigned left = station_list_bytes(program) - at, now = left < CHECKED ? left : CHECKED;
    crc = crc32(crc, bytes_of(which) + at, now);
    at = (uint16_t)(at + now);
    return now == left;
}

static void check_loaded(void) {
    struct station_list* program = &station_lists[newest];
    if (header_valid(program) && !crc_step(program, newest)) return;
    if (!header_valid(program) || program->angle[program->stations] != ~crc)
        program->generation = program->stations = 0;
    newest ? choose() : load_begin(1);
}

// A line passes over fewer than TRIES worn pages, so behind so many blank ones there is none.
static void journal_read(void) {
    blank_pages = at && never_written(sizeof candidate) ? blank_pages + 1u : 0;
    __builtin_memcpy(&candidate, in, sizeof candidate);
    if (candidate.sequence > last.sequence && candidate.sequence % JOURNAL_PAGES == at &&
        ~crc32(UINT32_MAX, in, RECORD_CHECKED) == candidate.crc)
        last = candidate;
    go(READ_JOURNAL);
    if (++at == JOURNAL_PAGES || blank_pages == TRIES) return end(cause);
    transfer_begin(record_address(at), 0, sizeof candidate);
}

// ---- writing: page by page, each is read back

static void write_page(void) {
    go(WRITE);
    transfer_begin(page_address, filled, 0);
}

static void write_part(unsigned to, const void* from, unsigned bytes) {
    page_address = (uint16_t)to;
    filled = (uint8_t)bytes;
    __builtin_memcpy(&out[2], from, bytes);
    write_page();
}

static void write_record(void) {
    candidate.crc = ~crc32(UINT32_MAX, (const uint8_t*)&candidate, RECORD_CHECKED);
    final = true;
    write_part(record_address(candidate.sequence), &candidate, sizeof candidate);
}

static void write_station_list(void) {
    unsigned left = station_list_bytes(&station_lists[!newest]) + CRC_BYTES - at;
    final = left <= PAGE;
    write_part(!newest * COPY_BYTES + at, bytes_of(!newest) + at, final ? left : PAGE);
}

static void seal(void) {
    struct station_list* program = &station_lists[!newest];
    if (!crc_step(program, !newest)) return;
    program->angle[program->stations] = ~crc;
    at = 0;
    go(WRITE_NEXT);
}

static bool next_value(struct saved_value* value) {
    for (unsigned n = 0; n < VALUES_PER_CALL; n++)
        if (saved_values_next(&gathered, value)) return true;
    return false;
}

// One value more for the page; those at their defaults are left out.
static void gather(void) {
    struct saved_value value = {
        (int64_t)((uint64_t)saved_values_build() << 32 | values_status.generation), SAVED_HEAD, 0};
    if ((at || filled) && !next_value(&value)) return;
    if (value.owner == SAVED_END)
        value.value = ~crc;
    else
        crc = crc32(crc, (const uint8_t*)&value, VALUE);
    __builtin_memcpy(&out[2 + filled], &value, VALUE);
    filled = (uint8_t)(filled + VALUE);
    values_status.values = (uint16_t)(values_status.values + (value.owner <= SAVED_NODE));
    page_address = (uint16_t)(VALUES_AT + values_copy * VALUES_BYTES + at);
    final = value.owner == SAVED_END;
    if (final || filled == PAGE) write_page();
}

static void verify(void) {
    for (unsigned n = 0; n < filled; n++) {
        if (in[n] == out[2 + n]) continue;
        if (++tries == TRIES) return end(BUS_CAUSE_EEPROM_FAILED);
        if (kind != RECORD) return write_page();
        candidate.sequence++;  // on the next page
        return write_record();
    }
    tries = 0;
    at = (uint16_t)(at + filled);
    filled = 0;
    if (!final) return go(kind == STATION_LIST ? WRITE_NEXT : GATHER);
    if (kind == RECORD) {
        last = candidate;
    } else if (kind == STATION_LIST) {
        newest = !newest;
        damaged = drafting = false;
    } else {
        values_generation[values_copy] = values_status.generation;
        values_status.damaged = false;
    }
    end(kind == VALUES && values_status.values == 0 ? BUS_CAUSE_NOTHING_SAVED : BUS_CAUSE_OK);
}

// ---- the rest

// A transfer that failed is done retry_transfer until patience ends.
static void retry_transfer(void) {
    if (clock_ms() - since_ms > WRITE_TIMEOUT_MS) return end(BUS_CAUSE_EEPROM_MISSING);
    i2c_begin(I2C_STORE, &transfer);
}

static void load(void) {
    for (unsigned which = 0; which < 2; which++)
        station_lists[which].generation = station_lists[which].stations = 0;
    last = (struct journal_record){0};
    damaged = drafting = values_status.damaged = false;
    kind = STATION_LIST;
    read_values(READ_VALUES, 0);
}

void store_start(unsigned axes) {
    (void)axes;
    cause = BUS_CAUSE_OK;
    values_status = (struct value_store_status){.cause = BUS_CAUSE_SAVED_NOT_READ};
    starting = true;
    load();
}

void store_work(void) {
    enum i2c_outcome outcome = i2c_outcome(I2C_STORE);
    if (task == IDLE_TASK || outcome == I2C_BUSY) return;
    if (task == DEAD) {
        if (clock_ms() - since_ms > RETRY_MS) load();
        return;
    }
    if (task == CHECK_LOADED) return check_loaded();
    if (task == SEAL) return seal();
    if (task == GATHER) return gather();
    if (task == WRITE_NEXT) return write_station_list();
    if (outcome != I2C_OK) return retry_transfer();
    switch (task) {
    case READ_VALUES:
    case RESTORE_VALUES: return value_read();
    case LOAD: return loaded_part();
    case READ_JOURNAL: return journal_read();
    case WRITE: go(VERIFY); return transfer_begin(page_address, 0, filled);
    default: return verify();
    }
}

enum store_state store_state(void) {
    if (task == DEAD) return STORE_DEAD;
    return task == IDLE_TASK ? STORE_READY : task <= READ_JOURNAL ? STORE_LOADING : STORE_WRITING;
}

uint8_t store_cause(void) { return cause; }

bool station_list_damaged(void) { return damaged; }

uint16_t station_list_count(void) {
    return store_state() == STORE_LOADING ? 0 : station_lists[newest].stations;
}

uint32_t station_list_angle(unsigned station) { return station_lists[newest].angle[station]; }

uint32_t station_list_generation(void) {
    return store_state() == STORE_LOADING ? 0 : station_lists[newest].generation;
}

uint32_t station_list_identity(void) {
    return station_list_count() ? station_lists[newest].angle[station_lists[newest].stations] : 0;
}

const struct journal_record* journal_last(void) { return &last; }

static uint8_t may_write(void) {
    return task == IDLE_TASK ? BUS_CAUSE_OK
           : task == DEAD    ? BUS_CAUSE_EEPROM_MISSING
                             : BUS_CAUSE_EEPROM_BUSY;
}

uint8_t station_list_begin(void) {
    uint8_t refused = may_write();
    if (refused != BUS_CAUSE_OK) return refused;
    station_lists[!newest].stations = 0;
    drafting = true;
    return BUS_CAUSE_OK;
}

uint8_t station_list_add(uint32_t angle) {
    struct station_list* program = &station_lists[!newest];
    uint8_t refused = may_write();
    unsigned n = program->stations;
    if (refused != BUS_CAUSE_OK) return refused;
    if (!drafting) return BUS_CAUSE_JOB_INCOMPLETE;
    if (n == STATION_LIST_MAX) return BUS_CAUSE_TOO_MANY_STATIONS;
    if (angle >= STATION_LIST_TURN) return BUS_CAUSE_ANGLE_OUT_OF_TURN;
    if (n > 0 && angle <= program->angle[n - 1]) return BUS_CAUSE_ANGLES_NOT_ASCENDING;
    program->angle[n] = angle;
    program->stations++;
    return BUS_CAUSE_OK;
}

uint16_t station_list_added(void) { return drafting ? station_lists[!newest].stations : 0; }

static void write_begin(enum kind what) {
    kind = (uint8_t)what;
    tries = 0;
    at = 0;
    filled = 0;
    crc = UINT32_MAX;
}

static uint32_t next_generation(void) {
    uint32_t program = station_lists[newest].generation;
    return 1u + (program > values_status.generation ? program : values_status.generation);
}

uint8_t station_list_save(void) {
    struct station_list* program = &station_lists[!newest];
    uint8_t refused = may_write();
    if (refused != BUS_CAUSE_OK) return refused;
    if (station_list_added() == 0) return BUS_CAUSE_NO_STATIONS;
    program->generation = next_generation();
    program->settings = BUS_SETTING_COUNT;
    for (uint8_t id = 1; id <= BUS_SETTING_COUNT; id++)
        program->setting[id - 1] = (int32_t)settings_get(id);
    write_begin(STATION_LIST);
    go(SEAL);
    return BUS_CAUSE_OK;
}

uint8_t journal_write(uint16_t station, enum journal_step step) {
    uint8_t refused = may_write();
    if (refused != BUS_CAUSE_OK) return refused;
    candidate = (struct journal_record){.sequence = last.sequence + 1,
                                        .list = station_list_identity(),
                                        .station = station,
                                        .step = (uint16_t)step};
    write_begin(RECORD);
    write_record();
    return BUS_CAUSE_OK;
}

const struct value_store_status* value_store_status(void) { return &values_status; }

uint8_t value_store_save(bool nothing) {
    uint8_t refused = may_write();
    if (refused != BUS_CAUSE_OK) return refused;
    write_begin(VALUES);
    values_copy = values_generation[0] > values_generation[1];
    values_generation[values_copy] = 0;
    values_status.generation = next_generation();
    values_status.values = 0;
    gathered = nothing ? SAVED_NOTHING : 0;
    go(GATHER);
    return BUS_CAUSE_OK;
}
