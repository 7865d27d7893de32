// SPDX-License-Identifier: Apache-2.0
// job -- cuts all stations of the program, one after the other, with nobody touching it.
//
// Whatever is done to the work is in the journal before and after it. So after a loss of power it
// is known whether a cut had begun, and if it is not known how it ended, a person is asked: no
// station is ever cut twice unless a person said so. The table turns only while the machine rests.
// A sub-node that counts its stations itself (peer_mode printed) is never reported twice to go to
// the same one.
//
// tables/job_states.py makes the picture in docs/job.md of the table of transitions.
#include "station/job/job.h"

#include <stddef.h>

#include "bus/bus.h"
#include "made/bus_protocol.h"
#include "station/job/edm.h"
#include "station/devices/display.h"
#include "station/devices/keypad.h"
#include "station/table/peer.h"
#include "station/settings.h"
#include "station/storage/journal.h"
#include "station/storage/station_list.h"
#include "station/storage/value_store.h"

#define LEGACY 1  // a peer_mode
#define SUB 1     // a peer_role

enum event {  // a person's actions, then what happens
    START = BUS_JOB_ACTION_START,
    PAUSE = BUS_JOB_ACTION_PAUSE,
    RESUME = BUS_JOB_ACTION_RESUME,
    STOP = BUS_JOB_ACTION_STOP,
    AGAIN = BUS_JOB_ACTION_AGAIN,
    NEXT = BUS_JOB_ACTION_NEXT,
    ACTIONS,
    LOADED = ACTIONS,
    JOB_OPEN,
    CUT_OPEN,
    ALL_CUT,
    RECORDED,
    NOT_RECORDED,
    TURNED,
    NOT_TURNED,
    ALARM,
    TO_PAUSE,
    EDM_RESTS,
    CUT,
    NOT_CUT,
};

#define STATE(name) name = BUS_JOB_STATE_##name
enum state {
    STATE(LOADING),
    STATE(IDLE),
    STATE(FINISHED),
    STATE(STARTING),
    STATE(TURNING),
    STATE(ARRIVED),
    STATE(BEGINNING),
    STATE(CUTTING),
    STATE(FOLLOWING),
    STATE(ENDED),
    STATE(LEAVING),
    STATE(FINISHING),
    STATE(PAUSED),
    STATE(UNSURE),
    STATE(STOPPING),
    UNDER_WAY
};

static uint8_t state, cause;
static uint16_t station;
static uint32_t list_identity;  // by its identity
static bool pausing;
static uint8_t to_note, note_refused;  // a line of the journal that waits for the store, and how
                                       // the store took the last one
static bool ordered;  // the table was reported to go to a station, and did not say that it is there
static uint8_t order_refused;

static void at_first(void) {
    list_identity = station_list_identity();
    station = 0;
    pausing = ordered = false;
    cause = BUS_CAUSE_OK;
}
static void at_next(void) { station++; }
static void say_store(void) { cause = note_refused != BUS_CAUSE_OK ? note_refused : store_cause(); }
static void say_table(void) {
    cause = order_refused != BUS_CAUSE_OK ? order_refused : peer_cause();
}
static void say_edm(void) { cause = edm_cause(); }
static void say_alarm(void) { cause = BUS_CAUSE_EDM_ALARM; }
static void say_pause(void) { cause = BUS_CAUSE_PAUSED_BY_OPERATOR; }
static void say_power(void) { cause = BUS_CAUSE_POWER_LOST; }
static void go_on(void) {
    pausing = false;
    cause = BUS_CAUSE_OK;
}
static void reset_and_go_on(void) {
    peer_reset_fault();
    go_on();
}
static void leave_all(void) {
    peer_stop();
    edm_leave();
    go_on();
}

static const struct transition {
    uint8_t from, event, to;
    void (*act)(void);
} transitions[] = {
    {LOADING, ALL_CUT, FINISHING, NULL},
    {LOADING, CUT_OPEN, UNSURE, say_power},
    {LOADING, JOB_OPEN, PAUSED, say_power},
    {LOADING, LOADED, IDLE, NULL},
    {IDLE, START, STARTING, at_first},
    {FINISHED, START, STARTING, at_first},
    {STARTING, RECORDED, TURNING, NULL},
    {STARTING, NOT_RECORDED, IDLE, say_store},
    {TURNING, TURNED, ARRIVED, NULL},
    {TURNING, NOT_TURNED, PAUSED, say_table},
    {ARRIVED, NOT_RECORDED, PAUSED, say_store},
    {ARRIVED, TO_PAUSE, PAUSED, say_pause},
    {ARRIVED, ALARM, PAUSED, say_alarm},
    {ARRIVED, RECORDED, BEGINNING, NULL},
    {BEGINNING, RECORDED, CUTTING, NULL},
    {BEGINNING, NOT_RECORDED, PAUSED, say_store},
    {CUTTING, CUT, ENDED, NULL},
    {CUTTING, NOT_CUT, UNSURE, say_edm},
    {FOLLOWING, CUT, ENDED, NULL},
    {FOLLOWING, NOT_CUT, UNSURE, say_edm},
    {ENDED, RECORDED, LEAVING, at_next},
    {ENDED, NOT_RECORDED, UNSURE, say_store},
    {LEAVING, ALL_CUT, FINISHING, NULL},
    {LEAVING, TO_PAUSE, PAUSED, say_pause},
    {LEAVING, EDM_RESTS, TURNING, NULL},
    {FINISHING, RECORDED, FINISHED, NULL},
    {FINISHING, NOT_RECORDED, FINISHED, say_store},
    {PAUSED, RESUME, TURNING, reset_and_go_on},
    {UNSURE, RESUME, FOLLOWING, go_on},
    {UNSURE, AGAIN, TURNING, go_on},
    {UNSURE, NEXT, ENDED, go_on},
    {UNDER_WAY, STOP, STOPPING, leave_all},
    {STOPPING, RECORDED, IDLE, NULL},
    {STOPPING, NOT_RECORDED, IDLE, say_store},
};
#define TRANSITIONS (sizeof transitions / sizeof *transitions)

static uint8_t first_row[UNDER_WAY + 1];  // of each state; its rows follow each other

static bool loaded(void) { return store_state() == STORE_READY; }

// By the journal, which may be of another program.
static bool open_until(enum journal_step most) {
    const struct journal_record* last = journal_last();
    return loaded() && last->list == station_list_identity() &&
           last->station < station_list_count() && last->step >= JOURNAL_STARTED &&
           last->step <= most;
}

static bool sub_node_counts(void) { return settings_get(BUS_SETTING_PEER_MODE) == LEGACY; }

// By the journal, and without a new order.
static bool table_is_there(void) {
    const struct journal_record* last = journal_last();
    return sub_node_counts() && last->station == station &&
           (last->step == JOURNAL_TURNED || last->step == JOURNAL_CUT_BEGUN);
}

static void order_table(void) {
    order_refused = BUS_CAUSE_OK;
    if (table_is_there()) return;
    order_refused = peer_turn_to(station, station_list_angle(station));
    ordered = order_refused == BUS_CAUSE_OK;
}

// What a state begins with.
static void enter(uint8_t to) {
    state = to;
    switch (to) {
    case STARTING: to_note = JOURNAL_STARTED; break;
    case TURNING: order_table(); break;
    case ARRIVED:
        to_note = JOURNAL_TURNED;
        ordered = false;
        break;
    case BEGINNING: to_note = JOURNAL_CUT_BEGUN; break;
    case CUTTING: edm_begin(); break;
    case FOLLOWING: edm_follow(); break;
    case ENDED: to_note = JOURNAL_CUT_DONE; break;
    case FINISHING: to_note = JOURNAL_FINISHED; break;
    case STOPPING: to_note = JOURNAL_STOPPED; break;
    case PAUSED: pausing = false; break;
    default: break;
    }
}

static bool noted(void) { return to_note == JOURNAL_NOTHING && store_state() != STORE_WRITING; }

static bool journal_written(void) {
    return note_refused == BUS_CAUSE_OK && store_cause() == BUS_CAUSE_OK;
}

static bool happened(uint8_t event) {
    switch (event) {
    case LOADED: return loaded();
    case JOB_OPEN: return open_until(JOURNAL_CUT_DONE);
    case CUT_OPEN: return open_until(JOURNAL_CUT_DONE) && journal_last()->step == JOURNAL_CUT_BEGUN;
    case ALL_CUT: return loaded() && station > 0 && station == station_list_count();
    case RECORDED: return noted() && journal_written();
    case NOT_RECORDED: return noted() && !journal_written();
    case TURNED: return table_is_there() || (ordered && peer_state() == BUS_PEER_PHASE_TURNED);
    case NOT_TURNED:
        return order_refused != BUS_CAUSE_OK || peer_state() == BUS_PEER_PHASE_FAILED ||
               peer_state() == BUS_PEER_PHASE_SILENT;
    case ALARM: return noted() && edm_alarms();
    case TO_PAUSE: return noted() && pausing;
    case EDM_RESTS: return edm_rests();
    case CUT: return edm_state() == EDM_CUT;
    case NOT_CUT: return edm_state() == EDM_FAILED;
    default: return false;  // an action: job_do
    }
}

static bool under_way(void) {
    return (state >= STARTING && state <= LEAVING) || state == PAUSED || state == UNSURE;
}

static const struct transition* row_of(uint8_t from, uint8_t event) {
    for (unsigned n = first_row[from]; n < TRANSITIONS && transitions[n].from == from; n++)
        if (transitions[n].event == event) return &transitions[n];
    return NULL;
}

static const struct transition* transition_of(uint8_t event) {
    const struct transition* row = row_of(state, event);
    return row || !under_way() ? row : row_of(UNDER_WAY, event);
}

static void take(const struct transition* t) {
    if (t->act) t->act();
    enter(t->to);
}

static void write_note(void) {
    if (to_note == JOURNAL_NOTHING || store_busy()) return;
    note_refused = journal_write(station, to_note);
    to_note = JOURNAL_NOTHING;
}

void job_start(unsigned axes) {
    (void)axes;
    to_note = JOURNAL_NOTHING;
    note_refused = order_refused = BUS_CAUSE_OK;
    at_first();
    for (unsigned n = TRANSITIONS; n-- > 0;) first_row[transitions[n].from] = (uint8_t)n;
    ordered = true;  // perhaps, before the power went
    enter(LOADING);
}

void job_work(void) {
    if (state == LOADING && open_until(JOURNAL_CUT_DONE)) {
        list_identity = station_list_identity();
        station = (uint16_t)(journal_last()->station + (journal_last()->step == JOURNAL_CUT_DONE));
    }
    write_note();
    for (unsigned n = first_row[state]; n < TRANSITIONS && transitions[n].from == state; n++)
        if (happened(transitions[n].event)) return take(&transitions[n]);
}

uint8_t job_state(void) { return state; }

static uint8_t saved_trouble(void)  // why the values of this node are not in force
{
    uint8_t reported = value_store_status()->cause;
    return reported >= BUS_CAUSE_SAVED_DAMAGED && reported <= BUS_CAUSE_SAVED_NOT_READ
               ? reported
               : BUS_CAUSE_OK;
}

uint8_t job_cause(void) {
    if (state == LOADING && store_state() == STORE_MISSING) return BUS_CAUSE_EEPROM_MISSING;
    if (state != IDLE || cause != BUS_CAUSE_OK) return cause;
    if (station_list_count() == 0) return store_cause();
    return saved_trouble();
}

uint16_t job_station(void) { return station; }

// Why an action that the table has is refused.
static uint8_t refusal(uint8_t action) {
    if (action == STOP || action == PAUSE) return BUS_CAUSE_OK;
    if (store_state() == STORE_MISSING) return BUS_CAUSE_EEPROM_MISSING;
    if (store_state() != STORE_READY) return BUS_CAUSE_EEPROM_BUSY;
    if (settings_get(BUS_SETTING_PEER_ROLE) == SUB)
        return BUS_CAUSE_PEER_OFF;  // its journal is its count of stations
    if (action != START && list_identity != station_list_identity()) return BUS_CAUSE_JOB_CHANGED;
    if (action == NEXT) return BUS_CAUSE_OK;
    if (action == RESUME && state == UNSURE) return edm_cuts() ? BUS_CAUSE_OK : BUS_CAUSE_NOT_NOW;
    if (action != START && sub_node_counts() && ordered && !table_is_there())
        return BUS_CAUSE_TABLE_POSITION_UNKNOWN;
    if (station_list_count() == 0) return store_cause();
    if (!edm_built()) return BUS_CAUSE_NOT_BUILT;
    if (edm_alarms()) return BUS_CAUSE_EDM_ALARM;
    return edm_rests() ? BUS_CAUSE_OK : BUS_CAUSE_EDM_BUSY;
}

static bool known(uint8_t action) {
    return action == PAUSE ? state >= STARTING && state <= LEAVING && !pausing
                           : transition_of(action) != NULL;
}

uint8_t job_answers(void) {
    uint8_t answers = 0;
    for (uint8_t action = 0; action < ACTIONS; action++)
        if (known(action) && refusal(action) == BUS_CAUSE_OK) answers |= (uint8_t)(1u << action);
    return answers;
}

uint8_t job_do(uint8_t action) {
    if (action >= ACTIONS) return BUS_CAUSE_OUT_OF_RANGE;
    if (action == START && under_way()) return BUS_CAUSE_JOB_ACTIVE;
    if (action != START && !known(action)) return BUS_CAUSE_NOT_NOW;
    uint8_t refused = refusal(action);
    if (refused != BUS_CAUSE_OK) return refused;
    if (!known(action)) return BUS_CAUSE_NOT_NOW;
    if (action == PAUSE)
        pausing = true;
    else
        take(transition_of(action));
    return BUS_CAUSE_OK;
}

static uint8_t may_change_list(void) {
    if (peer_state() == BUS_PEER_PHASE_TURNING) return BUS_CAUSE_BUSY;
    return state == IDLE || state == FINISHED || state == LOADING ? BUS_CAUSE_OK
                                                                  : BUS_CAUSE_JOB_ACTIVE;
}

uint8_t job_begin_list(void) {
    uint8_t refused = may_change_list();
    return refused == BUS_CAUSE_OK ? station_list_begin() : refused;
}

uint8_t job_save_list(void) {
    uint8_t refused = may_change_list();
    return refused == BUS_CAUSE_OK ? station_list_save() : refused;
}

// ---- operations of the line

static uint8_t flags(void) {
    return (uint8_t)(BUS_JOB_FLAG_EEPROM * (store_state() != STORE_MISSING) |
                     BUS_JOB_FLAG_KEYPAD * keypad_present() |
                     BUS_JOB_FLAG_DISPLAY * display_present() | BUS_JOB_FLAG_CUTTING * edm_cuts() |
                     BUS_JOB_FLAG_ALARM * edm_alarms() |
                     BUS_JOB_FLAG_KEYS_PENDING * machine_keys_pending() |
                     BUS_JOB_FLAG_PAUSING * pausing |
                     BUS_JOB_FLAG_COPY_DAMAGED * station_list_damaged());
}

static uint8_t report_job(void) {
    bus_reply_field(BUS_JOB_REPLY_STATE, state, 1);
    bus_reply_field(BUS_JOB_REPLY_CAUSE, job_cause(), 1);
    bus_reply_field(BUS_JOB_REPLY_STATION, station, 2);
    bus_reply_field(BUS_JOB_REPLY_STATIONS, station_list_count(), 2);
    bus_reply_field(BUS_JOB_REPLY_ANSWERS, job_answers(), 1);
    bus_reply_field(BUS_JOB_REPLY_FLAGS, flags(), 1);
    bus_reply_field(BUS_JOB_REPLY_TABLE_FAULTS, peer_faults(), 2);
    return BUS_CAUSE_OK;
}

static uint8_t report_station_list(void) {
    bus_reply_field(BUS_JOB_STATIONS_REPLY_WRITING, store_busy(), 1);
    bus_reply_field(BUS_JOB_STATIONS_REPLY_ENDED, store_cause(), 1);
    bus_reply_field(BUS_JOB_STATIONS_REPLY_GENERATION, station_list_generation(), 4);
    bus_reply_field(BUS_JOB_STATIONS_REPLY_STATIONS, station_list_count(), 2);
    bus_reply_field(BUS_JOB_STATIONS_REPLY_JOURNAL, journal_last()->sequence, 4);
    return BUS_CAUSE_OK;
}

static uint8_t report_angle(void) {
    uint16_t asked = (uint16_t)bus_request_field(BUS_JOB_ANGLE_REQUEST_STATION, 2);
    if (asked >= station_list_count()) return BUS_CAUSE_OUT_OF_RANGE;
    bus_reply_field(BUS_JOB_ANGLE_REPLY_ANGLE, station_list_angle(asked), 4);
    return BUS_CAUSE_OK;
}

static uint8_t add_station(void) {
    if (bus_request_field(BUS_JOB_ADD_REQUEST_STATION, 2) != station_list_added())
        return BUS_CAUSE_JOB_INCOMPLETE;
    return station_list_add((uint32_t)bus_request_field(BUS_JOB_ADD_REQUEST_ANGLE, 4));
}

uint8_t job_operation(uint8_t operation) {
    switch (operation) {
    case BUS_OPERATION_JOB: return report_job();
    case BUS_OPERATION_JOB_DO:
        return job_do((uint8_t)bus_request_field(BUS_JOB_DO_REQUEST_ACTION, 1));
    case BUS_OPERATION_JOB_STATIONS: return report_station_list();
    case BUS_OPERATION_JOB_ANGLE: return report_angle();
    case BUS_OPERATION_JOB_BEGIN: return job_begin_list();
    case BUS_OPERATION_JOB_ADD: return add_station();
    case BUS_OPERATION_JOB_SAVE: return job_save_list();
    default: return BUS_CAUSE_NOT_BUILT;
    }
}
