// SPDX-License-Identifier: Apache-2.0
// index -- turn the table of axis 0 to an absolute angle of its sensor (S4).
//
//   reading ─► going_below ─► coming_up ─► reading ─► closing_in ─► reading …      ended: no more than index_tolerance is left
//                   ▲ below the target by index_allowance │                        each closing_in goes index_share of what is left
//                   └─────────── above the target ◄───────┘
//
// The worm always pushes the table up: a way up that is shorter than index_take_up begins farther below. The long ways are at the
// speed of a move of the axis, closing_in at its home_creep. What the steps say is held against the sensor at each reading.
#include "index.h"

#include "axis.h"
#include "clock.h"
#include "hardware.h"
#include "line.h"
#include "line_protocol.h"
#include "sensor.h"
#include "settings.h"

#define AXIS 0u
#define TURN ((int64_t)SENSOR_TURN)
#define ABOUT_ZERO (TURN / 360)         // so far below angle 0 the table stands at angle 0
#define FOLLOWED 4                      // a table that sticks goes less than a quarter of its steps

enum way { DIRECT, SHORTER, ALWAYS_UP };

struct place {                          // of the table, at rest
    uint32_t angle;                     // by the sensor
    int64_t steps;                      // by the steps, 2^-16 period
    uint32_t changes;                   // of the sensor until then
};

static struct index {
    uint8_t phase;                      // line_index_phase
    uint8_t ended;                      // line_cause
    uint8_t tries, overshoots;
    uint8_t orders;                     // of the axis; when they change somebody else drives it
    bool begun;                         // the first reading has been taken
    bool measuring;                     // the table has settled
    bool closing;                       // from `near` on
    uint32_t target;
    uint32_t since_ms;                  // the table rests
    int64_t up;                         // way that follows going_below
    struct place first, near, now;      // where it began, where closing in began, where it is
} index;

static int64_t setting(uint8_t id)
{
    return settings_get(id);
}

// The shorter way round, from -TURN/2 up to below TURN/2.
static int64_t round_way(int64_t way)
{
    while (way >= TURN / 2) way -= TURN;
    while (way < -TURN / 2) way += TURN;
    return way;
}

static int64_t apart(uint32_t to, uint32_t from)
{
    return round_way((int64_t)to - from);
}

static int64_t size(int64_t way)
{
    return way < 0 ? -way : way;
}

static int64_t steps_of(int64_t way)
{
    int64_t part = size(way) * setting(LINE_SETTING_PERIODS_PER_TURN), whole = part / TURN;
    int64_t steps = (whole << 16) + ((part - whole * TURN) << 16) / TURN;
    return way < 0 ? -steps : steps;
}

static int64_t way_of(int64_t steps)
{
    int64_t periods = size(steps) >> 16, part = size(steps) & 0xFFFF, per_turn = setting(LINE_SETTING_PERIODS_PER_TURN);
    int64_t turns = periods / per_turn, way = turns * TURN + ((periods - turns * per_turn) * TURN + (part * TURN >> 16)) / per_turn;
    return steps < 0 ? -way : way;
}

static void finish(uint8_t cause)
{
    index.phase = LINE_INDEX_PHASE_IDLE;
    index.ended = cause;
}

static void read_angle(void)
{
    index.phase = LINE_INDEX_PHASE_READING;
    index.measuring = false;
    index.since_ms = clock_ms();
}

static void go(uint8_t phase, int64_t way, uint8_t velocity_id)
{
    uint8_t cause = axis_go(AXIS, steps_of(way), velocity_id);
    if (cause == LINE_CAUSE_OK)
        index.phase = phase;
    else
        finish(cause);
}

static void come_up(void)
{
    go(LINE_INDEX_PHASE_COMING_UP, index.up, LINE_PARAMETER_VELOCITY);
}

// To below the target, so far away, with the worm pushing up.
static void approach(int64_t way)
{
    int64_t take_up = setting(LINE_SETTING_INDEX_TAKE_UP), down;
    index.closing = false;
    index.up = way - setting(LINE_SETTING_INDEX_ALLOWANCE);
    down = take_up - index.up;
    if (down <= 0) {
        come_up();
        return;
    }
    index.up = take_up;
    go(LINE_INDEX_PHASE_GOING_BELOW, -down, LINE_PARAMETER_VELOCITY);
}

static int64_t long_way(void)
{
    int64_t from = index.now.angle, to = index.target, way = to - from;
    switch (setting(LINE_SETTING_INDEX_WAY)) {
    case DIRECT: return from > TURN - ABOUT_ZERO ? way + TURN : way;
    case SHORTER: return round_way(way);
    default: return way < 0 ? way + TURN : way;
    }
}

// Why the tries bring nothing.
static uint8_t why_not(void)
{
    int64_t way = way_of(index.now.steps - index.near.steps), turned = apart(index.now.angle, index.near.angle);
    if (index.now.changes == index.near.changes) return LINE_CAUSE_SENSOR_STUCK;
    if (way < FOLLOWED * setting(LINE_SETTING_INDEX_TOLERANCE)) return LINE_CAUSE_NOT_CONVERGED;
    if (turned * FOLLOWED <= -way) return LINE_CAUSE_WRONG_SIGN;
    return turned * FOLLOWED < way ? LINE_CAUSE_STICTION : LINE_CAUSE_NOT_CONVERGED;
}

// ok, or what is wrong when the table is not where its steps have brought it.
static uint8_t compare(void)
{
    int64_t limit = setting(LINE_SETTING_INDEX_DISAGREEMENT), way = way_of(index.now.steps - index.first.steps);
    int64_t turned = apart(index.now.angle, index.first.angle);
    if (size(round_way(turned - way)) <= limit) return LINE_CAUSE_OK;
    uint8_t cause = index.closing ? why_not() : LINE_CAUSE_NOT_CONVERGED;
    if (cause != LINE_CAUSE_NOT_CONVERGED) return cause;
    if (index.now.changes == index.first.changes) return LINE_CAUSE_SENSOR_STUCK;
    if (size(turned) <= limit) return LINE_CAUSE_STICTION;
    if (size(round_way(turned + way)) <= limit) return LINE_CAUSE_WRONG_SIGN;
    return LINE_CAUSE_SENSOR_DISAGREES;
}

static void decide(void)
{
    int64_t tolerance = setting(LINE_SETTING_INDEX_TOLERANCE), left;
    uint8_t cause = LINE_CAUSE_OK;
    index.now = (struct place){sensor_mean(), axis_read_position(AXIS, AXIS_TARGET), sensor_changes()};
    left = apart(index.target, index.now.angle);
    if (!index.begun)
        index.first = index.now;
    else
        cause = compare();
    if (cause != LINE_CAUSE_OK || size(left) <= tolerance) {
        finish(cause);
    } else if (!index.begun) {
        index.begun = true;
        approach(long_way());
    } else if (left < 0) {
        if (index.overshoots == setting(LINE_SETTING_INDEX_OVERSHOOTS)) {
            finish(LINE_CAUSE_NOT_CONVERGED);
            return;
        }
        index.overshoots++;
        approach(left);
    } else if (index.tries == setting(LINE_SETTING_INDEX_TRIES)) {
        finish(why_not());
    } else {
        index.tries++;
        if (!index.closing) index.near = index.now;
        index.closing = true;
        left = left * setting(LINE_SETTING_INDEX_SHARE) / 100;
        go(LINE_INDEX_PHASE_CLOSING_IN, left > 0 ? left : 1, LINE_PARAMETER_HOME_CREEP);
    }
}

static void reading(void)
{
    if (axis_state(AXIS) != LINE_STATE_HOLDING) {
        finish(axis_state(AXIS) == LINE_STATE_FAULTED ? LINE_CAUSE_ENDED_BY_FAULT : LINE_CAUSE_STOPPED);
    } else if (!index.measuring) {
        if (clock_ms() - index.since_ms < (uint32_t)setting(LINE_SETTING_INDEX_SETTLE)) return;
        sensor_measure((uint32_t)setting(LINE_SETTING_INDEX_FRAMES));
        index.measuring = true;
    } else if (sensor_measured()) {
        decide();
    }
}

void index_start(unsigned axes)
{
    (void)axes;
    index = (struct index){.phase = LINE_INDEX_PHASE_IDLE, .ended = LINE_CAUSE_NEVER};
}

void index_work(void)
{
    uint8_t ended;
    if (index.phase == LINE_INDEX_PHASE_IDLE) return;
    if (index.orders != axis_orders(AXIS)) {
        finish(axis_state(AXIS) == LINE_STATE_FAULTED ? LINE_CAUSE_ENDED_BY_FAULT : LINE_CAUSE_STOPPED);
        return;
    }
    if (sensor_dead()) {
        axis_stop(AXIS);
        finish(LINE_CAUSE_SENSOR_DEAD);
        return;
    }
    if (index.phase == LINE_INDEX_PHASE_READING) {
        reading();
        return;
    }
    ended = axis_ended(AXIS);
    if (ended == LINE_CAUSE_RUNNING) return;
    if (ended != LINE_CAUSE_OK)
        finish(ended);
    else if (index.phase == LINE_INDEX_PHASE_GOING_BELOW)
        come_up();
    else
        read_angle();
}

uint8_t index_to(uint32_t angle)
{
    uint8_t cause;
    if (!sensor_built()) return LINE_CAUSE_NOT_BUILT;
    if (angle >= SENSOR_TURN) return LINE_CAUSE_OUT_OF_RANGE;
    if (index.phase != LINE_INDEX_PHASE_IDLE) return LINE_CAUSE_BUSY;
    cause = axis_enable(AXIS, true);
    if (cause != LINE_CAUSE_OK) return cause;
    if (axis_ended(AXIS) == LINE_CAUSE_RUNNING) return LINE_CAUSE_BUSY;
    if (sensor_dead()) return LINE_CAUSE_SENSOR_DEAD;
    index = (struct index){.ended = LINE_CAUSE_RUNNING, .target = angle, .orders = axis_orders(AXIS)};
    read_angle();
    return LINE_CAUSE_OK;
}

uint8_t index_ended(void)
{
    return index.ended;
}

uint32_t index_reading(void)
{
    return index.now.angle;
}

uint8_t index_operation(uint8_t operation)
{
    if (operation == LINE_OPERATION_INDEX_TO) return index_to((uint32_t)line_field(LINE_INDEX_TO_REQUEST_ANGLE, 4));
    if (operation != LINE_OPERATION_INDEX_STATE) return LINE_CAUSE_NOT_BUILT;
    line_answer(LINE_INDEX_STATE_REPLY_PHASE, index.phase, 1);
    line_answer(LINE_INDEX_STATE_REPLY_ENDED, index.ended, 1);
    line_answer(LINE_INDEX_STATE_REPLY_TRIES, index.tries, 1);
    line_answer(LINE_INDEX_STATE_REPLY_OVERSHOOTS, index.overshoots, 1);
    line_answer(LINE_INDEX_STATE_REPLY_TARGET, index.target, 4);
    line_answer(LINE_INDEX_STATE_REPLY_READING, index.now.angle, 4);
    line_answer(LINE_INDEX_STATE_REPLY_LEFT, (uint64_t)apart(index.target, index.now.angle), 4);
    return LINE_CAUSE_OK;
}
