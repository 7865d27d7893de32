// SPDX-License-Identifier: Apache-2.0
// job -- cuts all stations of the program, one after the other, with nobody touching it.
//
// Whatever is done to the work is in the journal before and after it. So after a loss of power it is known whether a cut had begun, and
// if it is not known how it ended, a person is asked: no station is ever cut twice unless a person said so. The table turns only while
// the machine rests. A sub-node that counts its stations itself (peer_mode printed) is never told twice to go to the same one.
//
// tables/job_states.py makes the picture in docs/job.md of the table of transitions.
#include "job.h"

#include <stddef.h>

#include "line.h"
#include "line_protocol.h"
#include "machine.h"
#include "panel.h"
#include "peer.h"
#include "settings.h"
#include "store.h"

#define PRINTED 1                       // a peer_mode
#define SUB 1                           // a peer_role

enum event {                            // a person's actions, then what happens
    START = LINE_JOB_ACTION_START, PAUSE = LINE_JOB_ACTION_PAUSE, RESUME = LINE_JOB_ACTION_RESUME, STOP = LINE_JOB_ACTION_STOP,
    AGAIN = LINE_JOB_ACTION_AGAIN, NEXT = LINE_JOB_ACTION_NEXT, ACTIONS,
    LOADED = ACTIONS, JOB_OPEN, CUT_OPEN, ALL_CUT, RECORDED, NOT_RECORDED, INDEXED, NOT_INDEXED, ALARM, TO_PAUSE, MACHINE_RESTS, CUT, NOT_CUT,
};

#define STATE(name) name = LINE_JOB_STATE_##name
enum state { STATE(LOADING), STATE(IDLE), STATE(FINISHED), STATE(STARTING), STATE(INDEXING), STATE(ARRIVED), STATE(BEGINNING), STATE(CUTTING),
             STATE(FOLLOWING), STATE(ENDED), STATE(LEAVING), STATE(FINISHING), STATE(PAUSED), STATE(UNSURE), STATE(STOPPING), UNDER_WAY };

static uint8_t state, cause;
static uint16_t station;
static uint32_t program;                // by its identity
static bool pausing;
static uint8_t to_note, note_refused;   // a line of the journal that waits for the store, and how the store took the last one
static bool ordered;                    // the table was told to go to a station, and did not say that it is there
static uint8_t order_refused;

static void at_first(void)        { program = store_identity(); station = 0; pausing = ordered = false; cause = LINE_CAUSE_OK; }
static void at_next(void)         { station++; }
static void say_store(void)       { cause = note_refused != LINE_CAUSE_OK ? note_refused : store_cause(); }
static void say_table(void)       { cause = order_refused != LINE_CAUSE_OK ? order_refused : peer_cause(); }
static void say_machine(void)     { cause = machine_cause(); }
static void say_alarm(void)       { cause = LINE_CAUSE_MACHINE_ALARM; }
static void say_pause(void)       { cause = LINE_CAUSE_PAUSED_BY_PERSON; }
static void say_power(void)       { cause = LINE_CAUSE_POWER_LOST; }
static void go_on(void)           { pausing = false; cause = LINE_CAUSE_OK; }
static void reset_and_go_on(void) { peer_reset_fault(); go_on(); }
static void leave_all(void)       { peer_stop(); machine_leave(); go_on(); }

static const struct transition { uint8_t from, event, to; void (*act)(void); } transitions[] = {
    {LOADING,   ALL_CUT,       FINISHING, NULL},
    {LOADING,   CUT_OPEN,      UNSURE,    say_power},
    {LOADING,   JOB_OPEN,      PAUSED,    say_power},
    {LOADING,   LOADED,        IDLE,      NULL},
    {IDLE,      START,         STARTING,  at_first},
    {FINISHED,  START,         STARTING,  at_first},
    {STARTING,  RECORDED,      INDEXING,  NULL},
    {STARTING,  NOT_RECORDED,  IDLE,      say_store},
    {INDEXING,  INDEXED,       ARRIVED,   NULL},
    {INDEXING,  NOT_INDEXED,   PAUSED,    say_table},
    {ARRIVED,   NOT_RECORDED,  PAUSED,    say_store},
    {ARRIVED,   TO_PAUSE,      PAUSED,    say_pause},
    {ARRIVED,   ALARM,         PAUSED,    say_alarm},
    {ARRIVED,   RECORDED,      BEGINNING, NULL},
    {BEGINNING, RECORDED,      CUTTING,   NULL},
    {BEGINNING, NOT_RECORDED,  PAUSED,    say_store},
    {CUTTING,   CUT,           ENDED,     NULL},
    {CUTTING,   NOT_CUT,       UNSURE,    say_machine},
    {FOLLOWING, CUT,           ENDED,     NULL},
    {FOLLOWING, NOT_CUT,       UNSURE,    say_machine},
    {ENDED,     RECORDED,      LEAVING,   at_next},
    {ENDED,     NOT_RECORDED,  UNSURE,    say_store},
    {LEAVING,   ALL_CUT,       FINISHING, NULL},
    {LEAVING,   TO_PAUSE,      PAUSED,    say_pause},
    {LEAVING,   MACHINE_RESTS, INDEXING,  NULL},
    {FINISHING, RECORDED,      FINISHED,  NULL},
    {FINISHING, NOT_RECORDED,  FINISHED,  say_store},
    {PAUSED,    RESUME,        INDEXING,  reset_and_go_on},
    {UNSURE,    RESUME,        FOLLOWING, go_on},
    {UNSURE,    AGAIN,         INDEXING,  go_on},
    {UNSURE,    NEXT,          ENDED,     go_on},
    {UNDER_WAY, STOP,          STOPPING,  leave_all},
    {STOPPING,  RECORDED,      IDLE,      NULL},
    {STOPPING,  NOT_RECORDED,  IDLE,      say_store},
};
#define TRANSITIONS (sizeof transitions / sizeof *transitions)

static uint8_t first_row[UNDER_WAY + 1];        // of each state; its rows follow each other

static bool loaded(void)
{
    return store_state() == STORE_READY;
}

// By the journal, which may be of another program.
static bool open_until(enum store_step most)
{
    const struct store_record *last = store_record();
    return loaded() && last->program == store_identity() && last->station < store_stations() &&
           last->step >= STORE_STARTED && last->step <= most;
}

static bool sub_node_counts(void)
{
    return settings_get(LINE_SETTING_PEER_MODE) == PRINTED;
}

// By the journal, and without a new order.
static bool table_is_there(void)
{
    const struct store_record *last = store_record();
    return sub_node_counts() && last->station == station && (last->step == STORE_INDEXED || last->step == STORE_CUT_BEGUN);
}

static void order_table(void)
{
    order_refused = LINE_CAUSE_OK;
    if (table_is_there()) return;
    order_refused = peer_index(station, store_angle(station));
    ordered = order_refused == LINE_CAUSE_OK;
}

// What a state begins with.
static void enter(uint8_t to)
{
    state = to;
    switch (to) {
    case STARTING: to_note = STORE_STARTED; break;
    case INDEXING: order_table(); break;
    case ARRIVED: to_note = STORE_INDEXED; ordered = false; break;
    case BEGINNING: to_note = STORE_CUT_BEGUN; break;
    case CUTTING: machine_begin(); break;
    case FOLLOWING: machine_follow(); break;
    case ENDED: to_note = STORE_CUT_DONE; break;
    case FINISHING: to_note = STORE_FINISHED; break;
    case STOPPING: to_note = STORE_STOPPED; break;
    case PAUSED: pausing = false; break;
    default: break;
    }
}

static bool noted(void)
{
    return to_note == STORE_NOTHING && store_state() != STORE_WRITING;
}

static bool kept(void)
{
    return note_refused == LINE_CAUSE_OK && store_cause() == LINE_CAUSE_OK;
}

static bool happened(uint8_t event)
{
    switch (event) {
    case LOADED: return loaded();
    case JOB_OPEN: return open_until(STORE_CUT_DONE);
    case CUT_OPEN: return open_until(STORE_CUT_DONE) && store_record()->step == STORE_CUT_BEGUN;
    case ALL_CUT: return loaded() && station > 0 && station == store_stations();
    case RECORDED: return noted() && kept();
    case NOT_RECORDED: return noted() && !kept();
    case INDEXED: return table_is_there() || (ordered && peer_state() == LINE_PEER_PHASE_INDEXED);
    case NOT_INDEXED: return order_refused != LINE_CAUSE_OK || peer_state() == LINE_PEER_PHASE_FAILED || peer_state() == LINE_PEER_PHASE_SILENT;
    case ALARM: return noted() && machine_alarms();
    case TO_PAUSE: return noted() && pausing;
    case MACHINE_RESTS: return machine_rests();
    case CUT: return machine_state() == MACHINE_CUT;
    case NOT_CUT: return machine_state() == MACHINE_FAILED;
    default: return false;                                      // an action: job_do
    }
}

static bool under_way(void)
{
    return (state >= STARTING && state <= LEAVING) || state == PAUSED || state == UNSURE;
}

static const struct transition *row_of(uint8_t from, uint8_t event)
{
    for (unsigned n = first_row[from]; n < TRANSITIONS && transitions[n].from == from; n++)
        if (transitions[n].event == event) return &transitions[n];
    return NULL;
}

static const struct transition *transition_of(uint8_t event)
{
    const struct transition *row = row_of(state, event);
    return row || !under_way() ? row : row_of(UNDER_WAY, event);
}

static void take(const struct transition *t)
{
    if (t->act) t->act();
    enter(t->to);
}

static void write_note(void)
{
    if (to_note == STORE_NOTHING || store_state() == STORE_WRITING || store_state() == STORE_LOADING) return;
    note_refused = store_note(station, to_note);
    to_note = STORE_NOTHING;
}

void job_start(unsigned axes)
{
    (void)axes;
    to_note = STORE_NOTHING;
    note_refused = order_refused = LINE_CAUSE_OK;
    at_first();
    for (unsigned n = TRANSITIONS; n-- > 0;) first_row[transitions[n].from] = (uint8_t)n;
    ordered = true;                     // perhaps, before the power went
    enter(LOADING);
}

void job_work(void)
{
    if (state == LOADING && open_until(STORE_CUT_DONE)) {
        program = store_identity();
        station = (uint16_t)(store_record()->station + (store_record()->step == STORE_CUT_DONE));
    }
    write_note();
    for (unsigned n = first_row[state]; n < TRANSITIONS && transitions[n].from == state; n++)
        if (happened(transitions[n].event)) return take(&transitions[n]);
}

uint8_t job_state(void)
{
    return state;
}

static uint8_t kept_trouble(void)       // why the values of this node are not in force
{
    uint8_t told = store_kept()->cause;
    return told >= LINE_CAUSE_KEPT_DAMAGED && told <= LINE_CAUSE_KEPT_NOT_TAKEN ? told : LINE_CAUSE_OK;
}

uint8_t job_cause(void)
{
    if (state == LOADING && store_state() == STORE_DEAD) return LINE_CAUSE_STORE_MISSING;
    if (state != IDLE || cause != LINE_CAUSE_OK) return cause;
    if (store_stations() == 0) return store_cause();
    return kept_trouble();
}

uint16_t job_station(void)
{
    return station;
}

// Why an action that the table has is refused.
static uint8_t refusal(uint8_t action)
{
    if (action == STOP || action == PAUSE) return LINE_CAUSE_OK;
    if (store_state() == STORE_DEAD) return LINE_CAUSE_STORE_MISSING;
    if (store_state() != STORE_READY) return LINE_CAUSE_STORE_BUSY;
    if (settings_get(LINE_SETTING_PEER_ROLE) == SUB) return LINE_CAUSE_PEER_OFF;        // its journal is its count of stations
    if (action != START && program != store_identity()) return LINE_CAUSE_PROGRAM_CHANGED;
    if (action == NEXT) return LINE_CAUSE_OK;
    if (action == RESUME && state == UNSURE) return machine_cuts() ? LINE_CAUSE_OK : LINE_CAUSE_NOT_NOW;
    if (action != START && sub_node_counts() && ordered && !table_is_there()) return LINE_CAUSE_TABLE_UNKNOWN;
    if (store_stations() == 0) return store_cause();
    if (!machine_built()) return LINE_CAUSE_NOT_BUILT;
    if (machine_alarms()) return LINE_CAUSE_MACHINE_ALARM;
    return machine_rests() ? LINE_CAUSE_OK : LINE_CAUSE_MACHINE_BUSY;
}

static bool known(uint8_t action)
{
    return action == PAUSE ? state >= STARTING && state <= LEAVING && !pausing : transition_of(action) != NULL;
}

uint8_t job_answers(void)
{
    uint8_t answers = 0;
    for (uint8_t action = 0; action < ACTIONS; action++)
        if (known(action) && refusal(action) == LINE_CAUSE_OK) answers |= (uint8_t)(1u << action);
    return answers;
}

uint8_t job_do(uint8_t action)
{
    if (action >= ACTIONS) return LINE_CAUSE_OUT_OF_RANGE;
    if (action == START && under_way()) return LINE_CAUSE_JOB_ACTIVE;
    if (action != START && !known(action)) return LINE_CAUSE_NOT_NOW;
    uint8_t refused = refusal(action);
    if (refused != LINE_CAUSE_OK) return refused;
    if (!known(action)) return LINE_CAUSE_NOT_NOW;
    if (action == PAUSE) pausing = true;
    else take(transition_of(action));
    return LINE_CAUSE_OK;
}

static uint8_t may_change_program(void)
{
    if (peer_state() == LINE_PEER_PHASE_INDEXING) return LINE_CAUSE_BUSY;
    return state == IDLE || state == FINISHED || state == LOADING ? LINE_CAUSE_OK : LINE_CAUSE_JOB_ACTIVE;
}

uint8_t job_begin_program(void)
{
    uint8_t refused = may_change_program();
    return refused == LINE_CAUSE_OK ? store_begin() : refused;
}

uint8_t job_save_program(void)
{
    uint8_t refused = may_change_program();
    return refused == LINE_CAUSE_OK ? store_save() : refused;
}

// ---- operations of the line

static uint8_t flags(void)
{
    return (uint8_t)(LINE_JOB_FLAG_STORE * (store_state() != STORE_DEAD) | LINE_JOB_FLAG_KEYPAD * panel_has_keypad() |
                     LINE_JOB_FLAG_DISPLAY * panel_has_display() | LINE_JOB_FLAG_CUTTING * machine_cuts() |
                     LINE_JOB_FLAG_ALARM * machine_alarms() | LINE_JOB_FLAG_KEYS_WAIT * machine_keys_wait() |
                     LINE_JOB_FLAG_PAUSING * pausing | LINE_JOB_FLAG_COPY_TORN * store_torn());
}

static uint8_t tell_job(void)
{
    line_answer(LINE_JOB_REPLY_STATE, state, 1);
    line_answer(LINE_JOB_REPLY_CAUSE, job_cause(), 1);
    line_answer(LINE_JOB_REPLY_STATION, station, 2);
    line_answer(LINE_JOB_REPLY_STATIONS, store_stations(), 2);
    line_answer(LINE_JOB_REPLY_ANSWERS, job_answers(), 1);
    line_answer(LINE_JOB_REPLY_FLAGS, flags(), 1);
    line_answer(LINE_JOB_REPLY_TABLE_FAULTS, peer_faults(), 2);
    return LINE_CAUSE_OK;
}

static uint8_t tell_program(void)
{
    line_answer(LINE_JOB_PROGRAM_REPLY_WRITING, store_state() == STORE_WRITING || store_state() == STORE_LOADING, 1);
    line_answer(LINE_JOB_PROGRAM_REPLY_ENDED, store_cause(), 1);
    line_answer(LINE_JOB_PROGRAM_REPLY_GENERATION, store_generation(), 4);
    line_answer(LINE_JOB_PROGRAM_REPLY_STATIONS, store_stations(), 2);
    line_answer(LINE_JOB_PROGRAM_REPLY_JOURNAL, store_record()->sequence, 4);
    return LINE_CAUSE_OK;
}

static uint8_t tell_angle(void)
{
    uint16_t asked = (uint16_t)line_field(LINE_JOB_ANGLE_REQUEST_STATION, 2);
    if (asked >= store_stations()) return LINE_CAUSE_OUT_OF_RANGE;
    line_answer(LINE_JOB_ANGLE_REPLY_ANGLE, store_angle(asked), 4);
    return LINE_CAUSE_OK;
}

static uint8_t add_station(void)
{
    if (line_field(LINE_JOB_ADD_REQUEST_STATION, 2) != store_added()) return LINE_CAUSE_PROGRAM_INCOMPLETE;
    return store_add((uint32_t)line_field(LINE_JOB_ADD_REQUEST_ANGLE, 4));
}

uint8_t job_operation(uint8_t operation)
{
    switch (operation) {
    case LINE_OPERATION_JOB: return tell_job();
    case LINE_OPERATION_JOB_DO: return job_do((uint8_t)line_field(LINE_JOB_DO_REQUEST_ACTION, 1));
    case LINE_OPERATION_JOB_PROGRAM: return tell_program();
    case LINE_OPERATION_JOB_ANGLE: return tell_angle();
    case LINE_OPERATION_JOB_BEGIN: return job_begin_program();
    case LINE_OPERATION_JOB_ADD: return add_station();
    case LINE_OPERATION_JOB_SAVE: return job_save_program();
    default: return LINE_CAUSE_NOT_BUILT;
    }
}
