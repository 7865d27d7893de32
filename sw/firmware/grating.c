// SPDX-License-Identifier: Apache-2.0
// grating -- serves the learner of each axis: bursts from learner_recorder, values into signal_correction and harmonic_correction.
//
// A burst is begun while the axis moves fast enough to cover LEARNER_PERIODS within LONGEST_MS, and begun again when the speed has
// changed twofold since. It is read a few words a poll, and worked on a few pieces a poll, at most about WORK_MS.
// New values are written beside those in force, and one strobe exchanges both the correction and the table.
#include "grating.h"

#include "axis.h"
#include "clock.h"
#include "hardware.h"
#include "line_protocol.h"
#include "parameters.h"

#define WORK_MS 1u                              // words, pieces and points of a poll
#define PIECES 32u                              // of them at most
#define LONGEST_MS 1000u                        // of a burst
#define LARGEST_EVERY 65535u
#define USER_STROBES (GRATING_STROBES_ARM_INDEX_MASK | GRATING_STROBES_CAPTURE_NOW_MASK | GRATING_STROBES_CAPTURE_NEXT_MASK | \
                      GRATING_STROBES_CAPTURE_CLEAR_MASK | GRATING_STROBES_COMPARE_ARM_MASK | GRATING_STROBES_COMPARE_DISARM_MASK)

_Static_assert((int)LINE_LEARNER_REASON_LEARNING == LEARNER_LEARNING && (int)LINE_LEARNER_REASON_FROZEN == LEARNER_FROZEN &&
               (int)LINE_LEARNER_REASON_STANDSTILL == LEARNER_STANDSTILL &&
               (int)LINE_LEARNER_REASON_PARTIAL_CIRCLE == LEARNER_PARTIAL_CIRCLE &&
               (int)LINE_LEARNER_REASON_AMPLITUDE == LEARNER_AMPLITUDE && (int)LINE_LEARNER_REASON_DISTORTED == LEARNER_DISTORTED &&
               (int)LINE_LEARNER_REASON_TOO_FAST == LEARNER_TOO_FAST && (int)LINE_LEARNER_REASON_UNSTEADY == LEARNER_UNSTEADY &&
               (int)LINE_LEARNER_REASON_ONE_SPEED == LEARNER_ONE_SPEED && (int)LINE_LEARNER_REASON_VIBRATION == LEARNER_VIBRATION &&
               LEARNER_REASONS == 10, "the reasons of line.toml are those of the learner");

struct grating {
    struct learner learner;
    struct learner_values waiting;              // set by the host, not yet in force
    bool recording;
    bool phases;                                // of the burst
    bool moving;                                // fast enough to record
    uint16_t every;
    uint16_t point;                             // of the table, the next one to be written
};

static struct grating gratings[HARDWARE_AXES];
static uint32_t work_clk;

static void restart(struct grating *g)          // whatever was under way for the learner
{
    g->recording = false;
    g->point = 0;
}

// The setting of the recorder at the present speed; 0: too slow.
static uint32_t every_now(unsigned n, bool phases)
{
    int32_t velocity = (int32_t)axis_read(n, AXIS_VELOCITY);
    uint64_t size = velocity < 0 ? -(uint64_t)velocity : (uint64_t)velocity;
    uint64_t speed = size * PLANNER_TICK_HZ;                                    // 2^-16 period/s
    if (speed * LONGEST_MS < ((uint64_t)LEARNER_PERIODS << 16) * 1000u) return 0;
    uint32_t kept = phases ? LEARNER_PHASES : LEARNER_BURST;
    uint64_t every = ((uint64_t)parameters_sample_hz() * LEARNER_PERIODS << 16) / (speed * kept);
    return every < 1 ? 1 : every > LARGEST_EVERY ? LARGEST_EVERY : (uint32_t)every;
}

static bool near(uint32_t every, uint32_t wanted)      // within 2/3 … 2: enough periods, and samples enough of each
{
    return 3u * every >= 2u * wanted && every <= 2u * wanted;
}

static void record(unsigned n)
{
    struct grating *g = &gratings[n];
    const struct learner_pass *pass = &g->learner.pass;
    g->phases = g->learner.need == LEARNER_NEEDS_PHASES;
    uint32_t every = every_now(n, g->phases);
    g->moving = g->recording = every != 0;
    if (!g->moving) return;
    if (g->phases && pass->spectra && near(pass->every, every)) every = pass->every;        // spectra of one pass are compared
    g->every = (uint16_t)every;
    grating_write(n, GRATING_RECORDER, FIELD_PUT(GRATING_RECORDER_EVERY, every) | FIELD_PUT(GRATING_RECORDER_PHASES, g->phases));
    grating_write(n, GRATING_STROBES, GRATING_STROBES_RECORD_MASK);
}

static bool time_left(uint32_t began, uint32_t pieces)
{
    return pieces < PIECES && node_read(NODE_TIME_STAMP_LOW) - began < work_clk;
}

static void burst_poll(unsigned n)
{
    struct grating *g = &gratings[n];
    if (!g->recording || g->phases != (g->learner.need == LEARNER_NEEDS_PHASES)) {
        record(n);
        return;
    }
    uint32_t state = grating_read(n, GRATING_RECORDER_STATE), every = every_now(n, g->phases);
    if (state & GRATING_RECORDER_STATE_FULL_MASK)
        g->recording = !learner_open(&g->learner, g->every, state & GRATING_RECORDER_STATE_SPOILED_MASK);
    else if (every == 0 || every > 2u * g->every || 2u * every < g->every)
        record(n);
}

static void words_poll(unsigned n)
{
    struct learner *learner = &gratings[n].learner;
    uint32_t began = node_read(NODE_TIME_STAMP_LOW), count = gratings[n].phases ? LEARNER_WORDS : 1;
    for (uint32_t pieces = 0; learner->need == LEARNER_NEEDS_WORDS && time_left(began, pieces); pieces++) {
        uint32_t words[LEARNER_WORDS];
        for (uint32_t i = 0; i < count; i++) words[i] = grating_read(n, GRATING_RECORDER_WORD);
        learner_take(learner, words);
    }
}

static void work_poll(unsigned n)
{
    struct learner *learner = &gratings[n].learner;
    uint32_t began = node_read(NODE_TIME_STAMP_LOW);
    for (uint32_t pieces = 0; learner->need == LEARNER_NEEDS_WORK && time_left(began, pieces); pieces++) learner_work(learner);
}

static void loading_poll(unsigned n)
{
    struct grating *g = &gratings[n];
    const struct learner_values *values = &g->learner.values;
    uint32_t began = node_read(NODE_TIME_STAMP_LOW);
    for (uint32_t pieces = 0; g->point < LEARNER_POINTS && time_left(began, pieces); pieces++, g->point++)
        grating_write(n, GRATING_HARMONIC_POINT, FIELD_PUT(GRATING_HARMONIC_POINT, learner_table_entry(values, g->point)) |
                                                 FIELD_PUT(GRATING_HARMONIC_POINT_POINT, g->point));
    if (g->point < LEARNER_POINTS) return;
    g->point = 0;
    grating_write(n, GRATING_CORRECTION_OFFSET, FIELD_PUT(GRATING_CORRECTION_OFFSET_SIN, values->sin_offset) |
                                                FIELD_PUT(GRATING_CORRECTION_OFFSET_COS, values->cos_offset));
    grating_write(n, GRATING_CORRECTION_GAIN, FIELD_PUT(GRATING_CORRECTION_GAIN, values->gain));
    grating_write(n, GRATING_CORRECTION_SHEAR, FIELD_PUT(GRATING_CORRECTION_SHEAR, values->shear));
    grating_write(n, GRATING_STROBES, GRATING_STROBES_LOAD_CORRECTION_MASK | GRATING_STROBES_SWAP_HARMONICS_MASK);
    learner_loaded(&g->learner);
}

void grating_start(unsigned n)
{
    struct grating *g = &gratings[n];
    work_clk = node_read(NODE_CLK_HZ) / 1000u * WORK_MS;
    if (work_clk == 0) work_clk = 1;
    learner_start(&g->learner);
    g->waiting = learner_identity;
    g->moving = false;
    restart(g);
    grating_write(n, GRATING_HARMONIC_ENABLE, 1);
    grating_write(n, GRATING_CAPTURE_SOURCES, 0);
    grating_write(n, GRATING_STROBES, GRATING_STROBES_CAPTURE_CLEAR_MASK | GRATING_STROBES_COMPARE_DISARM_MASK);
    grating_clear_signal_faults(n);
}

static void follow_parameter(unsigned n)
{
    struct grating *g = &gratings[n];
    bool frozen = parameters_get(n, LINE_PARAMETER_LEARNING) == 0;
    if (g->learner.frozen == frozen) return;
    learner_freeze(&g->learner, frozen);
    g->recording = false;
    g->moving = true;                           // until a look at the speed says otherwise
}

void grating_poll(unsigned n)
{
    struct grating *g = &gratings[n];
    follow_parameter(n);
    switch (g->learner.need) {
    case LEARNER_NEEDS_SAMPLES:
    case LEARNER_NEEDS_PHASES: burst_poll(n); break;
    case LEARNER_NEEDS_WORDS: words_poll(n); break;
    case LEARNER_NEEDS_WORK: work_poll(n); break;
    case LEARNER_NEEDS_LOADING: loading_poll(n); break;
    default: break;
    }
}

const struct learner *grating_learner(unsigned n)
{
    return &gratings[n].learner;
}

uint8_t grating_reason(unsigned n)
{
    const struct grating *g = &gratings[n];
    bool waits = g->learner.need == LEARNER_NEEDS_SAMPLES || g->learner.need == LEARNER_NEEDS_PHASES;
    if (waits && !g->moving && !g->recording && g->learner.reason < LEARNER_ONE_SPEED) return LEARNER_STANDSTILL;
    return g->learner.reason;
}

uint8_t grating_learn(unsigned n, uint8_t action)
{
    struct grating *g = &gratings[n];
    if (action > LINE_LEARNER_ACTION_FORGET) return LINE_CAUSE_OUT_OF_RANGE;
    if (action == LINE_LEARNER_ACTION_LEARN || action == LINE_LEARNER_ACTION_FREEZE)
        parameters_set(n, LINE_PARAMETER_LEARNING, action == LINE_LEARNER_ACTION_LEARN);
    follow_parameter(n);
    if (action == LINE_LEARNER_ACTION_FORGET) {
        learner_forget(&g->learner);
        restart(g);
    }
    return LINE_CAUSE_OK;
}

uint8_t grating_set_harmonic(unsigned n, uint8_t order, int32_t cosine, int32_t sine)
{
    struct learner_values values = learner_identity;
    if (order < 1 || order > LEARNER_ORDERS) return LINE_CAUSE_OUT_OF_RANGE;
    values.cosine[order - 1] = cosine;
    values.sine[order - 1] = sine;
    if (!learner_values_fit(&values)) return LINE_CAUSE_OUT_OF_RANGE;
    gratings[n].waiting.cosine[order - 1] = cosine;
    gratings[n].waiting.sine[order - 1] = sine;
    return LINE_CAUSE_OK;
}

uint8_t grating_set_correction(unsigned n, const struct learner_values *ellipse, bool apply)
{
    struct grating *g = &gratings[n];
    struct learner_values values = g->waiting;
    values.sin_offset = ellipse->sin_offset;
    values.cos_offset = ellipse->cos_offset;
    values.gain = ellipse->gain;
    values.shear = ellipse->shear;
    if (!learner_values_fit(&values)) return LINE_CAUSE_OUT_OF_RANGE;
    g->waiting = apply ? learner_identity : values;
    if (!apply) return LINE_CAUSE_OK;
    learner_restore(&g->learner, &values);
    restart(g);
    return LINE_CAUSE_OK;
}

void grating_clear_signal_faults(unsigned n)
{
    grating_write(n, GRATING_STROBES, GRATING_STROBES_CLEAR_SIGNAL_FAULTS_MASK);
}

uint8_t grating_write_register(uint32_t offset, unsigned n, uint32_t value)
{
    switch (offset) {
    case GRATING_STROBES:
        if (value & ~USER_STROBES) return LINE_CAUSE_OUT_OF_RANGE;
        break;
    case GRATING_INDEX:
    case GRATING_COUNTS_PER_REVOLUTION:
    case GRATING_INDEX_EVENTS:
    case GRATING_CAPTURE_SOURCES:
    case GRATING_CAPTURE_STATE:
    case GRATING_COMPARE_START_LOW:
    case GRATING_COMPARE_START_HIGH:
    case GRATING_COMPARE_STEP_LOW:
    case GRATING_COMPARE_STEP_HIGH:
    case GRATING_COMPARE_COUNT:
    case GRATING_COMPARE_PULSE:
    case GRATING_COMPARE_GAP:
    case GRATING_COMPARE_STATE: break;
    default: return LINE_CAUSE_NO_SUCH_REGISTER;
    }
    grating_write(n, offset, value);
    return LINE_CAUSE_OK;
}

bool grating_may_read(uint32_t offset)
{
    return offset != GRATING_RECORDER_WORD;
}
