// SPDX-License-Identifier: Apache-2.0
// panel -- key-pad and character display of a station: what the job does, in words, and by key its
// station list and its actions. Either device may be absent.
//
//      7  8  9  START   PAUSE  RESUME  STOP
//      4  5  6  AGAIN   NEXT   UP      DOWN       UP, DOWN: browse through the stations
//      1  2  3  DIVIDE  LIST   LIMIT   SPEED      DIVIDE: a turn into equal parts
//      0  .     ENTER   CLEAR                     LIST: stations angle by angle
//
// An empty entry ends a list. LIMIT is the longest cut, in s; SPEED is the speed of the table, in
// percent. The other keys have no function.
#include "station/panel/panel.h"

#include <stddef.h>
#include <stdint.h>

#include "core/clock.h"
#include "station/devices/display.h"
#include "station/job/job.h"
#include "station/devices/keypad.h"
#include "made/bus_protocol.h"
#include "station/table/peer.h"
#include "station/settings.h"
#include "station/storage/station_list.h"

#define NOTICE_MS 3000u
#define REFRESH_MS 100u
#define ENTRY 11u       // characters
#define DEGREE 360000u  // in 0.01 arcsec
#define TURN_MS 2048u   // cause and fault are shown alternately, each for this long
#define DECIMALS 5u     // of a shown angle

enum mode {
    SHOW,
    DIVIDE,
    LIST,
    LIMIT,
    SPEED,
    LAST_ENTRY = SPEED,
    DIVIDING,
    SAVING
};  // what is shown, and what an entry is for
enum key {
    NONE,
    UP = 128,
    DOWN,
    TO_DIVIDE,
    TO_LIST,
    TO_LIMIT,
    TO_SPEED,
    ENTER,
    CLEAR,
    ACTION
};  // lower ones: the character; from ACTION on: a bus_job_action

#define OF(action) (ACTION + BUS_JOB_ACTION_##action)
static const uint8_t layout[KEYPAD_KEYS] = {
    '7',     '8',       '9',      OF(START), OF(PAUSE), OF(RESUME), OF(STOP), '4', '5',
    '6',     OF(AGAIN), OF(NEXT), UP,        DOWN,      '1',        '2',      '3', TO_DIVIDE,
    TO_LIST, TO_LIMIT,  TO_SPEED, '0',       '.',       ENTER,      CLEAR,
};

static const char* const titles[] = {"",
                                     "stations in a turn",
                                     "angle, degrees",
                                     "longest cut, s",
                                     "table speed, percent",
                                     "writing",
                                     "writing"};
static const char* const action_keys[] = {"START", "PAUSE", "RESUME", "STOP", "AGAIN", "NEXT"};

#define WORDS(code, words) [code] = words,
static const char* const cause_words[] = {BUS_CAUSE_WORDS(WORDS)};
static const char* const fault_words[] = {BUS_FAULT_WORDS(WORDS)};
static const char* const state_words[] = {BUS_JOB_STATE_WORDS(WORDS)};

static uint8_t mode, notice;  // notice: a cause, shown for a while
static char entry[ENTRY + 1];
static uint8_t entered;
static uint16_t browsed;  // station that is shown; STATION_LIST_MAX: that of the job
static uint16_t parts;    // that a turn is being divided into
static uint32_t noticed_ms, shown_ms;
static uint8_t line;   // that is composed next
static bool composed;  // and is shown in the next call
static char text[DISPLAY_COLUMNS + 1];
static const char* remaining_words;  // that did not fit the line before

// ---- text

static unsigned put(char* row, unsigned at, const char* text) {
    while (*text && at < DISPLAY_COLUMNS) row[at++] = *text++;
    return at;
}

// A number with at least `digits` digits, the last one left of `end`.
static void put_number(char* row, unsigned end, uint32_t number, unsigned digits) {
    for (unsigned n = 0; n < digits || number; n++) {
        row[--end] = (char)('0' + number % 10u);
        number /= 10u;
    }
}

static void put_angle(char* row, unsigned end, uint32_t angle) {
    uint32_t part = (uint32_t)((uint64_t)(angle % DEGREE) * 100000u / DEGREE);
    put_number(row, end, part, DECIMALS);
    row[end - DECIMALS - 1] = '.';
    put_number(row, end - DECIMALS - 1, angle / DEGREE, 1);
}

// As many words as fit; returns the remaining ones, a null pointer after the last word.
static const char* put_words(char* row, const char* text) {
    unsigned column = 0;
    for (;;) {
        unsigned length = 0;
        while (text[length] && text[length] != ' ') length++;
        if (column && column + 1 + length > DISPLAY_COLUMNS) return text;
        if (column) column++;
        for (unsigned n = 0; n < length && column < DISPLAY_COLUMNS; n++) row[column++] = text[n];
        text += length;
        if (*text != ' ') return NULL;
        text++;
    }
}

static uint8_t shown_cause(void) {
    if (notice != BUS_CAUSE_OK && clock_ms() - noticed_ms > NOTICE_MS) notice = BUS_CAUSE_OK;
    return notice != BUS_CAUSE_OK ? notice : mode == SHOW ? job_cause() : BUS_CAUSE_OK;
}

// Why the job waits; a fault of the sub-node alternates with its own words.
static const char* words_of(uint8_t shown) {
    unsigned faults = peer_faults(), fault = 0;
    if (shown == BUS_CAUSE_OK) return NULL;
    if (!faults || shown != job_cause() || clock_ms() % (2u * TURN_MS) < TURN_MS)
        return cause_words[shown];
    while (!(faults >> fault & 1u)) fault++;
    return fault_words[fault];
}

static void put_station(char* row, unsigned station) {
    unsigned stations = station_list_count();
    if (stations == 0) return;
    put_number(row, DISPLAY_COLUMNS, stations, 3);
    row[DISPLAY_COLUMNS - 4] = '/';
    put_number(row, DISPLAY_COLUMNS - 4, station < stations ? station + 1u : stations, 3);
}

static void put_hints(char* row) {
    uint8_t answers = job_answers();
    unsigned at = 0;
    for (unsigned action = 0; action < sizeof action_keys / sizeof *action_keys; action++) {
        if (!(answers >> action & 1u)) continue;
        if (at) at++;
        at = put(row, at, action_keys[action]);
    }
}

static void put_title(char* row) {
    bool browsing = browsed < station_list_count();
    if (mode == SHOW) {
        put(row, 0, browsing ? "station" : state_words[job_state()]);
        put_station(row, browsing ? browsed : job_station());
    } else {
        put(row, 0, titles[mode]);
        if (mode == LIST) put_number(row, DISPLAY_COLUMNS, station_list_added() + 1u, 3);
    }
}

static void put_station_angle(char* row) {
    unsigned stations = station_list_count(),
             station = browsed < stations ? browsed : job_station();
    if (station < stations) put_angle(row, DISPLAY_COLUMNS, station_list_angle(station));
}

static void put_entry(char* row) {
    unsigned at = put(row, 0, entry);
    if (mode <= LAST_ENTRY) put(row, at, "_");
}

// Composes a line, from the first to the last; words continue over several lines.
static void compose(unsigned n) {
    for (unsigned column = 0; column < DISPLAY_COLUMNS; column++) text[column] = ' ';
    if (n == 0) {
        remaining_words = words_of(shown_cause());
        put_title(text);
    } else if (n == 1 && mode != SHOW) {
        put_entry(text);
    } else if (remaining_words) {
        remaining_words = put_words(text, remaining_words);
    } else if (mode == SHOW) {
        if (n == 1) put_station_angle(text);
        if (n == DISPLAY_LINES - 1) put_hints(text);
    }
}

// ---- keys

static void show_notice(uint8_t cause) {
    notice = cause;
    noticed_ms = clock_ms();
}

static void clear_entry(void) {
    entered = 0;
    entry[0] = 0;
}

static void go(enum mode to) {
    mode = (uint8_t)to;
    clear_entry();
}

// The entry in units of 1 / scale; returns false if it is no number or above INT32_MAX.
static bool value_of_entry(uint32_t scale, uint32_t* value) {
    uint64_t number = 0, decimals = 1;
    bool point = false;
    for (unsigned n = 0; n < entered; n++) {
        if (entry[n] == '.') {
            if (point || scale == 1) return false;
            point = true;
            continue;
        }
        number = number * 10u + (uint64_t)(entry[n] - '0');
        if (point) decimals *= 10u;
    }
    number = (number * scale + decimals / 2) / decimals;
    *value = (uint32_t)number;
    return entered > point && number <= INT32_MAX;
}

static void save(void) {
    uint8_t cause = job_save_list();
    show_notice(cause);
    go(cause == BUS_CAUSE_OK ? SAVING : SHOW);
}

// Begins a new station list.
static void begin(enum mode to) {
    uint8_t cause = job_begin_list();
    show_notice(cause);
    if (cause == BUS_CAUSE_OK) go(to);
}

static void entered_list(void) {
    uint32_t angle;
    if (entered == 0) return save();
    show_notice(value_of_entry(DEGREE, &angle) ? station_list_add(angle) : BUS_CAUSE_OUT_OF_RANGE);
    clear_entry();
}

static void entered_parts(void) {
    uint32_t count;
    uint8_t cause = !value_of_entry(1, &count) ? BUS_CAUSE_OUT_OF_RANGE
                    : count == 0               ? BUS_CAUSE_NO_STATIONS
                    : count > STATION_LIST_MAX ? BUS_CAUSE_TOO_MANY_STATIONS
                                               : BUS_CAUSE_OK;
    clear_entry();
    show_notice(cause);
    if (cause != BUS_CAUSE_OK) return;
    parts = (uint16_t)count;
    go(DIVIDING);
}

static void entered_setting(uint8_t setting) {
    uint32_t value;
    uint8_t cause =
        value_of_entry(1, &value) ? settings_set(setting, value) : BUS_CAUSE_OUT_OF_RANGE;
    show_notice(cause);
    if (cause == BUS_CAUSE_OK)
        go(SHOW);
    else
        clear_entry();
}

static void enter_key(void) {
    switch (mode) {
    case DIVIDE: return entered_parts();
    case LIST: return entered_list();
    case LIMIT: return entered_setting(BUS_SETTING_JOB_CUT_LIMIT);
    case SPEED: return entered_setting(BUS_SETTING_JOB_SPEED);
    default: return show_notice(BUS_CAUSE_KEY_WITHOUT_FUNCTION);
    }
}

static void character_key(char character) {
    if (mode < DIVIDE || mode > LAST_ENTRY) return show_notice(BUS_CAUSE_KEY_WITHOUT_FUNCTION);
    if (entered == ENTRY) return show_notice(BUS_CAUSE_OUT_OF_RANGE);
    show_notice(BUS_CAUSE_OK);
    entry[entered++] = character;
    entry[entered] = 0;
}

// Clears the entry; without an entry, leaves the mode.
static void clear_key(void) {
    show_notice(BUS_CAUSE_OK);
    browsed = STATION_LIST_MAX;
    if (entered)
        clear_entry();
    else
        go(SHOW);
}

static void browse(bool up) {
    uint16_t stations = station_list_count();
    if (mode != SHOW || stations == 0) return show_notice(BUS_CAUSE_KEY_WITHOUT_FUNCTION);
    if (browsed >= stations)
        browsed = job_station() < stations ? job_station() : 0;
    else
        browsed = (uint16_t)((browsed + (up ? 1u : stations - 1u)) % stations);
}

static void key_pressed(uint8_t key) {
    if (mode > LAST_ENTRY) return show_notice(BUS_CAUSE_EEPROM_BUSY);
    if (key >= ACTION) {
        go(SHOW);
        browsed = STATION_LIST_MAX;
        return show_notice(job_do(key - ACTION));
    }
    switch (key) {
    case NONE: return show_notice(BUS_CAUSE_KEY_WITHOUT_FUNCTION);
    case UP: return browse(true);
    case DOWN: return browse(false);
    case TO_DIVIDE: return begin(DIVIDE);
    case TO_LIST: return begin(LIST);
    case TO_LIMIT: return go(LIMIT);
    case TO_SPEED: return go(SPEED);
    case ENTER: return enter_key();
    case CLEAR: return clear_key();
    default: return character_key((char)key);
    }
}

// ---- work

static void divide_next(void) {
    uint32_t n = station_list_added();
    if (n == parts) return save();
    uint8_t cause =
        station_list_add((uint32_t)(((uint64_t)n * STATION_LIST_TURN + parts / 2u) / parts));
    if (cause == BUS_CAUSE_OK) return;
    show_notice(cause);
    go(SHOW);
}

static void saving(void) {
    if (store_state() == STORE_WRITING) return;
    show_notice(store_cause());
    go(SHOW);
}

void panel_start(unsigned axes) {
    keypad_start(axes);
    display_start(axes);
    browsed = STATION_LIST_MAX;
    notice = BUS_CAUSE_OK;
    line = DISPLAY_LINES;
    composed = false;
    shown_ms = clock_ms();
    go(SHOW);
}

// One piece of a refresh, which goes line by line; returns false when none is under way.
static bool refreshed(void) {
    if (composed)
        display_show(line++, text);
    else if (line < DISPLAY_LINES)
        compose(line);
    else
        return false;
    composed = !composed;
    return true;
}

void panel_work(void) {
    uint8_t key = keypad_take();
    if (key != KEYPAD_NONE) return key_pressed(layout[key]);
    if (mode == DIVIDING) return divide_next();
    if (mode == SAVING) saving();
    if (refreshed()) return;
    if (clock_ms() - shown_ms >= REFRESH_MS && display_present()) {
        shown_ms = clock_ms();
        line = 0;
    }
    keypad_work();
    display_work();
}
