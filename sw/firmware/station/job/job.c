// SPDX-License-Identifier: Apache-2.0
// job -- cuts all stations of the list, one after the other, without an operator.
//
// Everything that is done to the workpiece is in the journal before and after it. So after a loss
// of power it is known whether a cut had begun, and if it is not known how it ended, a person is
// asked: no station is ever cut twice unless a person said so. The table turns only while the EDM
// machine is at rest. A sub-node that counts its stations itself (peer_mode legacy) is never sent
// to the same station twice.
//
// tables/job_states.py makes the picture in docs/job.md from the table of transitions.
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

enum event {  // the actions of a person, then what happens by itself
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
    EDM_AT_REST,
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
static uint32_t list_identity;  // of the list that is being cut
static bool pausing;
static uint8_t due;              // journal step that waits to be written
static uint8_t journal_refused;  // why the last one could not be begun, or ok
static bool table_ordered;       // the table was sent to a station and has not reported arrival
static uint8_t order_refused;

static void begin_list(void) {
    list_identity = station_list_identity();
    station = 0;
    pausing = table_ordered = false;
    cause = BUS_CAUSE_OK;
}
static void next_station(void) { station++; }
static void cause_of_store(void) {
    cause = journal_refused != BUS_CAUSE_OK ? journal_refused : store_cause();
}
static void cause_of_table(void) {
    cause = order_refused != BUS_CAUSE_OK ? order_refused : peer_cause();
}
static void cause_of_edm(void) { cause = edm_cause(); }
static void cause_alarm(void) { cause = BUS_CAUSE_EDM_ALARM; }
static void cause_pause(void) { cause = BUS_CAUSE_PAUSED_BY_OPERATOR; }
static void cause_power(void) { cause = BUS_CAUSE_POWER_LOST; }
static void resume(void) {
    pausing = false;
    cause = BUS_CAUSE_OK;
}
static void reset_and_resume(void) {
    peer_reset_fault();
    resume();
}
static void stop_all(void) {
    peer_stop();
    edm_release();
    resume();
}

static const struct transition {
    uint8_t from, event, to;
    void (*act)(void);
} transitions[] = {
    {LOADING, ALL_CUT, FINISHING, NULL},
    {LOADING, CUT_OPEN, UNSURE, cause_power},
    {LOADING, JOB_OPEN, PAUSED, cause_power},
    {LOADING, LOADED, IDLE, NULL},
    {IDLE, START, STARTING, begin_list},
    {FINISHED, START, STARTING, begin_list},
    {STARTING, RECORDED, TURNING, NULL},
    {STARTING, NOT_RECORDED, IDLE, cause_of_store},
    {TURNING, TURNED, ARRIVED, NULL},
    {TURNING, NOT_TURNED, PAUSED, cause_of_table},
    {ARRIVED, NOT_RECORDED, PAUSED, cause_of_store},
    {ARRIVED, TO_PAUSE, PAUSED, cause_pause},
    {ARRIVED, ALARM, PAUSED, cause_alarm},
    {ARRIVED, RECORDED, BEGINNING, NULL},
    {BEGINNING, RECORDED, CUTTING, NULL},
    {BEGINNING, NOT_RECORDED, PAUSED, cause_of_store},
    {CUTTING, CUT, ENDED, NULL},
    {CUTTING, NOT_CUT, UNSURE, cause_of_edm},
    {FOLLOWING, CUT, ENDED, NULL},
    {FOLLOWING, NOT_CUT, UNSURE, cause_of_edm},
    {ENDED, RECORDED, LEAVING, next_station},
    {ENDED, NOT_RECORDED, UNSURE, cause_of_store},
    {LEAVING, ALL_CUT, FINISHING, NULL},
    {LEAVING, TO_PAUSE, PAUSED, cause_pause},
    {LEAVING, EDM_AT_REST, TURNING, NULL},
    {FINISHING, RECORDED, FINISHED, NULL},
    {FINISHING, NOT_RECORDED, FINISHED, cause_of_store},
    {PAUSED, RESUME, TURNING, reset_and_resume},
    {UNSURE, RESUME, FOLLOWING, resume},
    {UNSURE, AGAIN, TURNING, resume},
    {UNSURE, NEXT, ENDED, resume},
    {UNDER_WAY, STOP, STOPPING, stop_all},
    {STOPPING, RECORDED, IDLE, NULL},
    {STOPPING, NOT_RECORDED, IDLE, cause_of_store},
};
#define TRANSITIONS (sizeof transitions / sizeof *transitions)

static uint8_t first_row[UNDER_WAY + 1];  // of each state, whose rows are neighbours

static bool loaded(void) { return store_state() == STORE_READY; }

// The journal, which may be about another list, says that a job of this list had come to a step
// from JOURNAL_STARTED to `most`.
static bool open_until(enum journal_step most) {
    const struct journal_record* last = journal_last();
    return loaded() && last->list == station_list_identity() &&
           last->station < station_list_count() && last->step >= JOURNAL_STARTED &&
           last->step <= most;
}

static bool sub_node_counts(void) { return settings_get(BUS_SETTING_PEER_MODE) == LEGACY; }

// The journal says that the table has been turned to this station already.
static bool table_at_station(void) {
    const struct journal_record* last = journal_last();
    return sub_node_counts() && last->station == station &&
           (last->step == JOURNAL_TURNED || last->step == JOURNAL_CUT_BEGUN);
}

static void order_table(void) {
    order_refused = BUS_CAUSE_OK;
    if (table_at_station()) return;
    order_refused = peer_turn_to(station, station_list_angle(station));
    table_ordered = order_refused == BUS_CAUSE_OK;
}

// Begins what a state does.
static void enter(uint8_t to) {
    state = to;
    switch (to) {
    case STARTING: due = JOURNAL_STARTED; break;
    case TURNING: order_table(); break;
    case ARRIVED:
        due = JOURNAL_TURNED;
        table_ordered = false;
        break;
    case BEGINNING: due = JOURNAL_CUT_BEGUN; break;
    case CUTTING: edm_begin(); break;
    case FOLLOWING: edm_follow(); break;
    case ENDED: due = JOURNAL_CUT_DONE; break;
    case FINISHING: due = JOURNAL_FINISHED; break;
    case STOPPING: due = JOURNAL_STOPPED; break;
    case PAUSED: pausing = false; break;
    default: break;
    }
}

static bool journal_ended(void) { return due == JOURNAL_NOTHING && store_state() != STORE_WRITING; }

static bool journal_written(void) {
    return journal_refused == BUS_CAUSE_OK && store_cause() == BUS_CAUSE_OK;
}

// Whether an event has happened that needs no person.
static bool happened(uint8_t event) {
    switch (event) {
    case LOADED: return loaded();
    case JOB_OPEN: return open_until(JOURNAL_CUT_DONE);
    case CUT_OPEN: return open_until(JOURNAL_CUT_DONE) && journal_last()->step == JOURNAL_CUT_BEGUN;
    case ALL_CUT: return loaded() && station > 0 && station == station_list_count();
    case RECORDED: return journal_ended() && journal_written();
    case NOT_RECORDED: return journal_ended() && !journal_written();
    case TURNED:
        return table_at_station() || (table_ordered && peer_state() == BUS_PEER_PHASE_TURNED);
    case NOT_TURNED:
        return order_refused != BUS_CAUSE_OK || peer_state() == BUS_PEER_PHASE_FAILED ||
               peer_state() == BUS_PEER_PHASE_SILENT;
    case ALARM: return journal_ended() && edm_alarm();
    case TO_PAUSE: return journal_ended() && pausing;
    case EDM_AT_REST: return edm_at_rest();
    case CUT: return edm_state() == EDM_CUT;
    case NOT_CUT: return edm_state() == EDM_FAILED;
    default: return false;  // an action, which only job_do takes
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

static void write_journal(void) {
    if (due == JOURNAL_NOTHING || store_busy()) return;
    journal_refused = journal_write(station, due);
    due = JOURNAL_NOTHING;
}

void job_start(unsigned axes) {
    (void)axes;
    due = JOURNAL_NOTHING;
    journal_refused = order_refused = BUS_CAUSE_OK;
    begin_list();
    for (unsigned n = TRANSITIONS; n-- > 0;) first_row[transitions[n].from] = (uint8_t)n;
    table_ordered = true;  // it may have been, before the power went
    enter(LOADING);
}

void job_work(void) {
    if (state == LOADING && open_until(JOURNAL_CUT_DONE)) {
        list_identity = station_list_identity();
        station = (uint16_t)(journal_last()->station + (journal_last()->step == JOURNAL_CUT_DONE));
    }
    write_journal();
    for (unsigned n = first_row[state]; n < TRANSITIONS && transitions[n].from == state; n++)
        if (happened(transitions[n].event)) return take(&transitions[n]);
}

uint8_t job_state(void) { return state; }

// Why the saved values of this node are not in force, or ok.
static uint8_t cause_of_defaults(void) {
    uint8_t reported = value_store_status()->cause;
    return reported >= BUS_CAUSE_SAVED_DAMAGED && reported <= BUS_CAUSE_SAVED_NOT_READ
               ? reported
               : BUS_CAUSE_OK;
}

uint8_t job_cause(void) {
    if (state == LOADING && store_state() == STORE_MISSING) return BUS_CAUSE_EEPROM_MISSING;
    if (state != IDLE || cause != BUS_CAUSE_OK) return cause;
    if (station_list_count() == 0) return store_cause();
    return cause_of_defaults();
}

uint16_t job_station(void) { return station; }

// Why an action that the table of transitions allows is refused.
static uint8_t refusal(uint8_t action) {
    if (action == STOP || action == PAUSE) return BUS_CAUSE_OK;
    if (store_state() == STORE_MISSING) return BUS_CAUSE_EEPROM_MISSING;
    if (store_state() != STORE_READY) return BUS_CAUSE_EEPROM_BUSY;
    if (settings_get(BUS_SETTING_PEER_ROLE) == SUB)
        return BUS_CAUSE_PEER_OFF;  // its journal holds its count of stations
    if (action != START && list_identity != station_list_identity()) return BUS_CAUSE_JOB_CHANGED;
    if (action == NEXT) return BUS_CAUSE_OK;
    if (action == RESUME && state == UNSURE)
        return edm_cutting() ? BUS_CAUSE_OK : BUS_CAUSE_NOT_NOW;
    if (action != START && sub_node_counts() && table_ordered && !table_at_station())
        return BUS_CAUSE_TABLE_POSITION_UNKNOWN;
    if (station_list_count() == 0) return store_cause();
    if (!edm_built()) return BUS_CAUSE_NOT_BUILT;
    if (edm_alarm()) return BUS_CAUSE_EDM_ALARM;
    return edm_at_rest() ? BUS_CAUSE_OK : BUS_CAUSE_EDM_BUSY;
}

static bool accepts(uint8_t action) {
    return action == PAUSE ? state >= STARTING && state <= LEAVING && !pausing
                           : transition_of(action) != NULL;
}

uint8_t job_answers(void) {
    uint8_t answers = 0;
    for (uint8_t action = 0; action < ACTIONS; action++)
        if (accepts(action) && refusal(action) == BUS_CAUSE_OK) answers |= (uint8_t)(1u << action);
    return answers;
}

uint8_t job_do(uint8_t action) {
    if (action >= ACTIONS) return BUS_CAUSE_OUT_OF_RANGE;
    if (action == START && under_way()) return BUS_CAUSE_JOB_ACTIVE;
    if (action != START && !accepts(action)) return BUS_CAUSE_NOT_NOW;
    uint8_t refused = refusal(action);
    if (refused != BUS_CAUSE_OK) return refused;
    if (!accepts(action)) return BUS_CAUSE_NOT_NOW;
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

// ---- operations of the bus

static uint8_t flags(void) {
    unsigned flags = 0;
    if (store_state() != STORE_MISSING) flags |= BUS_JOB_FLAG_EEPROM;
    if (keypad_present()) flags |= BUS_JOB_FLAG_KEYPAD;
    if (display_present()) flags |= BUS_JOB_FLAG_DISPLAY;
    if (edm_cutting()) flags |= BUS_JOB_FLAG_CUTTING;
    if (edm_alarm()) flags |= BUS_JOB_FLAG_ALARM;
    if (edm_keys_pending()) flags |= BUS_JOB_FLAG_KEYS_PENDING;
    if (pausing) flags |= BUS_JOB_FLAG_PAUSING;
    if (station_list_damaged()) flags |= BUS_JOB_FLAG_COPY_DAMAGED;
    return (uint8_t)flags;
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
