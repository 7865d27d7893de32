// SPDX-License-Identifier: Apache-2.0
// store -- the program of stations, the journal of the job and what the node keeps of its values, in an EEPROM 24AA128, whole after a
// power cut at any moment.
//
// A page that is being written when the power goes may hold anything afterwards. So there are two copies of the program and of the
// values, each with a generation and a CRC-32, and a new one goes over the older; and each line of the journal has a page of its own,
// used in turn. What was written is read back before it counts. While a page is being written the device does not acknowledge: reading
// it back is tried until it does. Program and values both have the settings; those of the newer one are in force.
#include "store.h"

#include <stddef.h>

#include "clock.h"
#include "i2c.h"
#include "keep.h"
#include "line_protocol.h"
#include "settings.h"

#define DEVICE 0x50u
#define PAGE 64u
#define PART 32u                        // bytes read at a time
#define COPY_BYTES 2048u
#define JOURNAL 4096u                   // after the two copies
#define JOURNAL_PAGES 64u
#define KEPT 8192u                      // two copies of the values, to the end of the device
#define KEPT_BYTES 4096u
#define VALUE ((unsigned)sizeof(struct keep_value))
#define CHECKED 16u                     // bytes of a CRC-32 done in one call
#define HEAD_BYTES ((unsigned)offsetof(struct store_program, angle))
#define CRC_BYTES 4u
#define RECORD_CHECKED 12u              // bytes of a record before its CRC-32
#define PATIENCE_MS 50u                 // a write takes 5 ms
#define RETRY_MS 1000u                  // a device that is not there is looked for again
#define LOOKED_AT 8u                    // values in one call
#define TRIES 3u                        // to write a page

enum task { REST, READ_KEPT, TAKE_KEPT, LOAD, CHECK_LOADED, READ_JOURNAL, SEAL, GATHER, WRITE_NEXT, WRITE, VERIFY, DEAD };
enum kind { RECORD, PROGRAM, VALUES };

_Static_assert(VALUE == CHECKED && PAGE % VALUE == 0, "a value is checked in one call and lies within a page");
_Static_assert(VALUE * (STORE_VALUES + 2u) <= KEPT_BYTES, "all values fit a copy, with head and end");

static struct store_program {                   // as in the EEPROM, where a CRC-32 follows the last station
    uint32_t generation;                        // each saved one has one more; 0: there is none
    uint16_t settings;                          // so many
    uint16_t stations;
    int32_t setting[LINE_SETTING_COUNT];        // those of the station when it was saved
    uint32_t angle[STORE_STATIONS + 1];         // 0.01 arcsec, ascending; one more for the CRC-32
} programs[2];                                  // by copy
static struct store_record last, candidate;
static uint8_t newest;                          // copy in force
static bool blank[2], torn, drafting;
static uint8_t task, cause;
static struct store_kept kept;                  // as taken
static uint32_t kept_generation[2];             // by copy; 0: it is not whole
static uint8_t kept_copy;                       // that is read or written
static bool kept_blank, starting;               // starting: values are taken
static unsigned gathered;                       // of keep_next
static uint8_t kind;                            // of what is written
static uint16_t at;                             // byte of the program or of the values, or page of the journal
static uint16_t place;                          // of the page that is written, with so many bytes of out
static uint8_t filled;
static bool final;                              // it is the last one
static uint32_t crc, since_ms;
static uint8_t tries;
static unsigned blank_pages;                    // of the journal, in turn
static uint8_t out[2 + PAGE], in[PAGE];
static struct i2c_transfer transfer;

static uint32_t crc32(uint32_t state, const uint8_t *bytes, unsigned count)
{
    static const uint32_t of_nibble[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
                                           0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c, 0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    while (count--) {
        state ^= *bytes++;
        state = state >> 4 ^ of_nibble[state & 15];
        state = state >> 4 ^ of_nibble[state & 15];
    }
    return state;
}

static bool never_written(unsigned count)       // so many bytes that came
{
    while (count--)
        if (in[count] != 0xFF) return false;
    return true;
}

static uint8_t *bytes_of(unsigned which)
{
    return (uint8_t *)&programs[which];
}

// Bytes of a program that its CRC-32 is about.
static unsigned program_bytes(const struct store_program *program)
{
    return HEAD_BYTES + 4u * program->stations;
}

static uint16_t record_place(uint32_t sequence)
{
    return (uint16_t)(JOURNAL + sequence % JOURNAL_PAGES * PAGE);
}

static void transfer_begin(unsigned from, unsigned write_count, unsigned read_count)
{
    out[0] = (uint8_t)(from >> 8);
    out[1] = (uint8_t)from;
    transfer = (struct i2c_transfer){.address = DEVICE, .write = out, .write_count = (uint8_t)(2 + write_count),
                                     .read = in, .read_count = (uint8_t)read_count};
    i2c_begin(I2C_STORE, &transfer);
}

static void go(enum task to)
{
    task = (uint8_t)to;
    since_ms = clock_ms();
}

static void end(uint8_t with)
{
    if (kind == VALUES) kept.cause = with;
    else cause = with;
    starting = false;
    go(with == LINE_CAUSE_STORE_MISSING ? DEAD : REST);
}

// ---- what is kept of the values: both copies are checked, then the newer one is taken

static void read_value(void)            // a page at a time
{
    if (at % PAGE == 0) transfer_begin(KEPT + kept_copy * KEPT_BYTES + at, 0, PAGE);
}

static void read_kept(enum task with, unsigned copy)
{
    kept_copy = (uint8_t)copy;
    at = 0;
    crc = UINT32_MAX;
    go(with);
    read_value();
}

static void load_begin(unsigned which);

static void end_kept(void)
{
    starting = false;
    load_begin(0);
}

static void take_value(const struct keep_value *value)
{
    if (value->of == KEEP_END) {
        if (kept.values == 0 && kept.cause == LINE_CAUSE_OK) kept.cause = LINE_CAUSE_NOTHING_KEPT;
        return end_kept();
    }
    if (value->of != KEEP_HEAD) {
        kept.values++;
        if (!keep_take(value)) kept.cause = LINE_CAUSE_KEPT_REFUSED;
    } else if ((uint32_t)((uint64_t)value->value >> 32) != keep_build()) {
        kept.cause = LINE_CAUSE_KEPT_OTHER;
        return end_kept();
    }
    at = (uint16_t)(at + VALUE);
    go(TAKE_KEPT);
    read_value();
}

static void choose_kept(void)
{
    bool none = !kept_generation[0] && !kept_generation[1];
    kept_copy = kept_generation[1] > kept_generation[0];
    kept.generation = kept_generation[kept_copy];
    if (!starting && !none) return end_kept();
    kept.cause = !none ? LINE_CAUSE_OK : kept.torn ? LINE_CAUSE_KEPT_DAMAGED : LINE_CAUSE_NOTHING_KEPT;
    none ? end_kept() : read_kept(TAKE_KEPT, kept_copy);
}

static void checked_copy(bool whole)
{
    if (!whole) kept_generation[kept_copy] = 0;
    kept.torn = kept.torn || (!whole && !kept_blank);
    kept_copy ? choose_kept() : read_kept(READ_KEPT, 1);
}

static void check_value(const struct keep_value *value)
{
    if (at == 0) {
        kept_blank = never_written(VALUE);
        kept_generation[kept_copy] = (uint32_t)value->value;
        if (value->of != KEEP_HEAD) return checked_copy(false);
    }
    if (value->of == KEEP_END) return checked_copy((uint32_t)value->value == ~crc);
    crc = crc32(crc, (const uint8_t *)value, VALUE);
    at = (uint16_t)(at + VALUE);
    if (at == KEPT_BYTES) return checked_copy(false);
    go(READ_KEPT);
    read_value();
}

static void value_read(void)
{
    struct keep_value value;
    __builtin_memcpy(&value, &in[at % PAGE], VALUE);
    task == READ_KEPT ? check_value(&value) : take_value(&value);
}

// ---- loading: both copies, then the journal

static bool laid_out(const struct store_program *program)
{
    return program->settings == LINE_SETTING_COUNT && program->stations <= STORE_STATIONS;
}

static void load_part(void)
{
    transfer_begin(newest * COPY_BYTES + at, 0, PART);
}

static void load_begin(unsigned which)          // `newest` is the copy being loaded until both are there
{
    newest = (uint8_t)which;
    blank[which] = true;
    at = 0;
    go(LOAD);
    load_part();
}

static void loaded_part(void)
{
    struct store_program *program = &programs[newest];
    blank[newest] = blank[newest] && never_written(PART);
    __builtin_memcpy(bytes_of(newest) + at, in, at + PART <= sizeof *program ? PART : sizeof *program - at);
    at = (uint16_t)(at + PART);
    go(LOAD);
    if (laid_out(program) && at < program_bytes(program) + CRC_BYTES) return load_part();
    at = 0;
    crc = UINT32_MAX;
    go(CHECK_LOADED);
}

static void choose(void)
{
    bool both_blank = blank[0] && blank[1];
    torn = (programs[0].generation == 0 && !blank[0]) || (programs[1].generation == 0 && !blank[1]);
    newest = programs[1].generation > programs[0].generation;
    if (programs[newest].generation > kept.generation)
        for (uint8_t id = 1; id <= LINE_SETTING_COUNT; id++) settings_set(id, programs[newest].setting[id - 1]);
    cause = programs[newest].generation ? LINE_CAUSE_OK : both_blank ? LINE_CAUSE_NO_PROGRAM : LINE_CAUSE_PROGRAM_TORN;
    last = (struct store_record){0};
    at = 0;
    go(READ_JOURNAL);
    transfer_begin(record_place(at), 0, sizeof candidate);
}

// The CRC-32 goes on by a few bytes; true when all are in it.
static bool crc_step(const struct store_program *program, unsigned which)
{
    unsigned left = program_bytes(program) - at, now = left < CHECKED ? left : CHECKED;
    crc = crc32(crc, bytes_of(which) + at, now);
    at = (uint16_t)(at + now);
    return now == left;
}

static void check_loaded(void)
{
    struct store_program *program = &programs[newest];
    if (laid_out(program) && !crc_step(program, newest)) return;
    if (!laid_out(program) || program->angle[program->stations] != ~crc)
        program->generation = program->stations = 0;
    newest ? choose() : load_begin(1);
}

// A line passes over fewer than TRIES worn pages, so behind so many blank ones there is none.
static void journal_read(void)
{
    blank_pages = at && never_written(sizeof candidate) ? blank_pages + 1u : 0;
    __builtin_memcpy(&candidate, in, sizeof candidate);
    if (candidate.sequence > last.sequence && candidate.sequence % JOURNAL_PAGES == at && ~crc32(UINT32_MAX, in, RECORD_CHECKED) == candidate.crc)
        last = candidate;
    go(READ_JOURNAL);
    if (++at == JOURNAL_PAGES || blank_pages == TRIES) return end(cause);
    transfer_begin(record_place(at), 0, sizeof candidate);
}

// ---- writing: page by page, each is read back

static void write_page(void)
{
    go(WRITE);
    transfer_begin(place, filled, 0);
}

static void write_part(unsigned to, const void *from, unsigned bytes)
{
    place = (uint16_t)to;
    filled = (uint8_t)bytes;
    __builtin_memcpy(&out[2], from, bytes);
    write_page();
}

static void write_record(void)
{
    candidate.crc = ~crc32(UINT32_MAX, (const uint8_t *)&candidate, RECORD_CHECKED);
    final = true;
    write_part(record_place(candidate.sequence), &candidate, sizeof candidate);
}

static void write_program(void)
{
    unsigned left = program_bytes(&programs[!newest]) + CRC_BYTES - at;
    final = left <= PAGE;
    write_part(!newest * COPY_BYTES + at, bytes_of(!newest) + at, final ? left : PAGE);
}

static void seal(void)
{
    struct store_program *program = &programs[!newest];
    if (!crc_step(program, !newest)) return;
    program->angle[program->stations] = ~crc;
    at = 0;
    go(WRITE_NEXT);
}

static bool next_value(struct keep_value *value)
{
    for (unsigned n = 0; n < LOOKED_AT; n++)
        if (keep_next(&gathered, value)) return true;
    return false;
}

// One value more for the page; those at their defaults are left out.
static void gather(void)
{
    struct keep_value value = {(int64_t)((uint64_t)keep_build() << 32 | kept.generation), KEEP_HEAD, 0};
    if ((at || filled) && !next_value(&value)) return;
    if (value.of == KEEP_END) value.value = ~crc;
    else crc = crc32(crc, (const uint8_t *)&value, VALUE);
    __builtin_memcpy(&out[2 + filled], &value, VALUE);
    filled = (uint8_t)(filled + VALUE);
    kept.values = (uint16_t)(kept.values + (value.of <= KEEP_NODE));
    place = (uint16_t)(KEPT + kept_copy * KEPT_BYTES + at);
    final = value.of == KEEP_END;
    if (final || filled == PAGE) write_page();
}

static void verify(void)
{
    for (unsigned n = 0; n < filled; n++) {
        if (in[n] == out[2 + n]) continue;
        if (++tries == TRIES) return end(LINE_CAUSE_STORE_FAILED);
        if (kind != RECORD) return write_page();
        candidate.sequence++;                   // on the next page
        return write_record();
    }
    tries = 0;
    at = (uint16_t)(at + filled);
    filled = 0;
    if (!final) return go(kind == PROGRAM ? WRITE_NEXT : GATHER);
    if (kind == RECORD) {
        last = candidate;
    } else if (kind == PROGRAM) {
        newest = !newest;
        torn = drafting = false;
    } else {
        kept_generation[kept_copy] = kept.generation;
        kept.torn = false;
    }
    end(kind == VALUES && kept.values == 0 ? LINE_CAUSE_NOTHING_KEPT : LINE_CAUSE_OK);
}

// ---- the rest

// A transfer that failed is done again until patience ends.
static void again(void)
{
    if (clock_ms() - since_ms > PATIENCE_MS) return end(LINE_CAUSE_STORE_MISSING);
    i2c_begin(I2C_STORE, &transfer);
}

static void load(void)
{
    for (unsigned which = 0; which < 2; which++) programs[which].generation = programs[which].stations = 0;
    last = (struct store_record){0};
    torn = drafting = kept.torn = false;
    kind = PROGRAM;
    read_kept(READ_KEPT, 0);
}

void store_start(unsigned axes)
{
    (void)axes;
    cause = LINE_CAUSE_OK;
    kept = (struct store_kept){.cause = LINE_CAUSE_KEPT_NOT_TAKEN};
    starting = true;
    load();
}

void store_work(void)
{
    enum i2c_outcome outcome = i2c_outcome(I2C_STORE);
    if (task == REST || outcome == I2C_BUSY) return;
    if (task == DEAD) {
        if (clock_ms() - since_ms > RETRY_MS) load();
        return;
    }
    if (task == CHECK_LOADED) return check_loaded();
    if (task == SEAL) return seal();
    if (task == GATHER) return gather();
    if (task == WRITE_NEXT) return write_program();
    if (outcome != I2C_OK) return again();
    switch (task) {
    case READ_KEPT:
    case TAKE_KEPT: return value_read();
    case LOAD: return loaded_part();
    case READ_JOURNAL: return journal_read();
    case WRITE: go(VERIFY); return transfer_begin(place, 0, filled);
    default: return verify();
    }
}

enum store_state store_state(void)
{
    if (task == DEAD) return STORE_DEAD;
    return task == REST ? STORE_READY : task <= READ_JOURNAL ? STORE_LOADING : STORE_WRITING;
}

uint8_t store_cause(void)
{
    return cause;
}

bool store_torn(void)
{
    return torn;
}

uint16_t store_stations(void)
{
    return store_state() == STORE_LOADING ? 0 : programs[newest].stations;
}

uint32_t store_angle(unsigned station)
{
    return programs[newest].angle[station];
}

uint32_t store_generation(void)
{
    return store_state() == STORE_LOADING ? 0 : programs[newest].generation;
}

uint32_t store_identity(void)
{
    return store_stations() ? programs[newest].angle[programs[newest].stations] : 0;
}

const struct store_record *store_record(void)
{
    return &last;
}

static uint8_t may_write(void)
{
    return task == REST ? LINE_CAUSE_OK : task == DEAD ? LINE_CAUSE_STORE_MISSING : LINE_CAUSE_STORE_BUSY;
}

uint8_t store_begin(void)
{
    uint8_t refused = may_write();
    if (refused != LINE_CAUSE_OK) return refused;
    programs[!newest].stations = 0;
    drafting = true;
    return LINE_CAUSE_OK;
}

uint8_t store_add(uint32_t angle)
{
    struct store_program *program = &programs[!newest];
    uint8_t refused = may_write();
    unsigned n = program->stations;
    if (refused != LINE_CAUSE_OK) return refused;
    if (!drafting) return LINE_CAUSE_PROGRAM_INCOMPLETE;
    if (n == STORE_STATIONS) return LINE_CAUSE_TOO_MANY_STATIONS;
    if (angle >= STORE_TURN) return LINE_CAUSE_ANGLE_OUT_OF_TURN;
    if (n > 0 && angle <= program->angle[n - 1]) return LINE_CAUSE_ANGLES_NOT_ASCENDING;
    program->angle[n] = angle;
    program->stations++;
    return LINE_CAUSE_OK;
}

uint16_t store_added(void)
{
    return drafting ? programs[!newest].stations : 0;
}

static void write_begin(enum kind what)
{
    kind = (uint8_t)what;
    tries = 0;
    at = 0;
    filled = 0;
    crc = UINT32_MAX;
}

static uint32_t next_generation(void)
{
    uint32_t program = programs[newest].generation;
    return 1u + (program > kept.generation ? program : kept.generation);
}

uint8_t store_save(void)
{
    struct store_program *program = &programs[!newest];
    uint8_t refused = may_write();
    if (refused != LINE_CAUSE_OK) return refused;
    if (store_added() == 0) return LINE_CAUSE_NO_STATIONS;
    program->generation = next_generation();
    program->settings = LINE_SETTING_COUNT;
    for (uint8_t id = 1; id <= LINE_SETTING_COUNT; id++) program->setting[id - 1] = (int32_t)settings_get(id);
    write_begin(PROGRAM);
    go(SEAL);
    return LINE_CAUSE_OK;
}

uint8_t store_note(uint16_t station, enum store_step step)
{
    uint8_t refused = may_write();
    if (refused != LINE_CAUSE_OK) return refused;
    candidate = (struct store_record){.sequence = last.sequence + 1, .program = store_identity(),
                                      .station = station, .step = (uint16_t)step};
    write_begin(RECORD);
    write_record();
    return LINE_CAUSE_OK;
}

const struct store_kept *store_kept(void)
{
    return &kept;
}

uint8_t store_keep(bool nothing)
{
    uint8_t refused = may_write();
    if (refused != LINE_CAUSE_OK) return refused;
    write_begin(VALUES);
    kept_copy = kept_generation[0] > kept_generation[1];
    kept_generation[kept_copy] = 0;
    kept.generation = next_generation();
    kept.values = 0;
    gathered = nothing ? KEEP_NOTHING : 0;
    go(GATHER);
    return LINE_CAUSE_OK;
}
