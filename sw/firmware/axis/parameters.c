// SPDX-License-Identifier: Apache-2.0
// parameters -- the parameters of the axes, and the registers that follow from them.
//
// bus.toml names the register of most parameters; the functions apply_… compute the others.
#include "axis/parameters.h"

#include "core/hardware.h"
#include "made/bus_protocol.h"

#define PULSES_AND_DIRECTION 3u  // mode of the decoder
#define STEP_CYCLES_MASK ACTUATOR_STEP_PULSE_HIGH_MASK
#define COEFFICIENTS 5u  // of a filter
#define MOST_SAMPLES AXIS_SENSING_DEGLITCH_MASK
#define FILTERS 2u  // with parameters
#define LONGEST_DAC_HALF_PERIOD (ACTUATOR_DAC_HALF_PERIOD_MASK >> ACTUATOR_DAC_HALF_PERIOD_SHIFT)

#define LIMITS(name, id, low, high, value) [id] = {low, high, value},

static const struct {
    int64_t low, high, value;
} table[BUS_PARAMETER_COUNT + 1] = {BUS_PARAMETERS(LIMITS)};

#define NEED(parameter, feature)                              \
    {BUS_PARAMETER_##parameter, AXIS_BUILT_##feature##_SHIFT, \
     AXIS_BUILT_##feature##_MASK >> AXIS_BUILT_##feature##_SHIFT},

static const struct {
    uint8_t id, shift, mask;  // of the field of axis.built
} needs[] = {BUS_PARAMETER_NEEDS(NEED)};

static int64_t parameters[HARDWARE_AXES][BUS_PARAMETER_COUNT + 1];
static struct planner_limits limits[HARDWARE_AXES];  // of a move

static uint32_t saturate(uint64_t value, uint32_t mask) {
    return value > mask ? mask : (uint32_t)value;
}

void parameters_set_baud(uint32_t baud) {
    bus_write(BUS_BIT_TIME, saturate((16 * (uint64_t)node_read(NODE_CLK_HZ) + baud / 2) / baud,
                                     BUS_BIT_TIME_MASK));
}

void parameters_start_node(void) {
    uint32_t clk_hz = node_read(NODE_CLK_HZ);
    parameters_set_baud(BAUD);
    node_write(NODE_SAMPLE_PERIOD,
               saturate(clk_hz / SAMPLE_HZ < SAMPLE_CYCLES ? SAMPLE_CYCLES : clk_hz / SAMPLE_HZ,
                        NODE_SAMPLE_PERIOD_MASK));
    node_write(NODE_TICK_PERIOD, saturate(clk_hz / PLANNER_TICK_HZ, NODE_TICK_PERIOD_MASK));
}

uint32_t parameters_sample_hz(void) {
    return node_read(NODE_CLK_HZ) / node_read(NODE_SAMPLE_PERIOD);
}

static void apply_motion(unsigned axis) {
    if (!HARDWARE_DRIVES) return;
    const int64_t* p = parameters[axis];
    uint32_t slope, curve;
    limits[axis] =
        planner_limits((uint32_t)p[BUS_PARAMETER_VELOCITY], (uint32_t)p[BUS_PARAMETER_ACCELERATION],
                       (uint32_t)p[BUS_PARAMETER_JERK]);
    if (p[BUS_PARAMETER_PROFILE] == TRAPEZOID) limits[axis].jerk = PLANNER_ANY_JERK;
    planner_feed_override(&limits[axis], &slope, &curve);
    axis_write(axis, AXIS_STOP_DECELERATION,
               saturate(limits[axis].acceleration >> 8, AXIS_STOP_DECELERATION_MASK));
    axis_write(axis, AXIS_STOP_JERK, limits[axis].jerk == PLANNER_ANY_JERK ? 0 : limits[axis].jerk);
    axis_write(axis, AXIS_FEED_OVERRIDE_SLOPE, slope);
    axis_write(axis, AXIS_FEED_OVERRIDE_CURVE, curve);
}

static uint64_t cycles_of(int64_t nanoseconds) {
    return (uint64_t)nanoseconds * node_read(NODE_CLK_HZ) / 1000000000u;
}

// The deglitcher counts samples: one in each cycle, or one in skip + 1 cycles. A time that is
// longer than it can count takes samples further apart.
static void apply_sensing(unsigned axis) {
    const int64_t* p = parameters[axis];
    uint64_t cycles = cycles_of(p[BUS_PARAMETER_DEGLITCH]);
    uint32_t skip = saturate(cycles_of(p[BUS_PARAMETER_FILTER_SKIP]), 0xFFFF);
    uint32_t least = (uint32_t)(cycles + MOST_SAMPLES - 1u) / MOST_SAMPLES;
    if (skip + 1u < least) skip = least - 1u;
    uint64_t samples = (cycles + skip) / (skip + 1u);
    feedback_write(
        axis, FEEDBACK_EDGE_FILTER,
        FIELD_PUT(FEEDBACK_EDGE_FILTER_SKIP, skip) |
            FIELD_PUT(FEEDBACK_EDGE_FILTER_TOLERATED, p[BUS_PARAMETER_FILTER_TOLERATED]));
    axis_write(axis, AXIS_SENSING,
               FIELD_PUT(AXIS_SENSING_DEGLITCH, samples) |
                   FIELD_PUT(AXIS_SENSING_OUTLIER_STEP, p[BUS_PARAMETER_OUTLIER_STEP]) |
                   FIELD_PUT(AXIS_SENSING_OUTLIER_HOLD, p[BUS_PARAMETER_OUTLIER_HOLD]));
}

static void apply_source(unsigned axis) {
    int64_t source = parameters[axis][BUS_PARAMETER_POSITION_SOURCE];
    feedback_write(axis, FEEDBACK_POSITION_SOURCE,
                   FIELD_PUT(FEEDBACK_POSITION_SOURCE_COUNTS, source != PHASES) |
                       FIELD_PUT(FEEDBACK_POSITION_SOURCE_STEPS, source == OWN_STEPS));
    feedback_write(axis, FEEDBACK_DECODER_MODE,
                   source == OWN_STEPS ? PULSES_AND_DIRECTION
                                       : (uint32_t)parameters[axis][BUS_PARAMETER_DECODER_MODE]);
}

// Gates the index by A and B. The four gates follow each other on the way up, where A leads. The
// user owns the other fields of the register.
static void apply_index(unsigned axis) {
    uint32_t gate = (uint32_t)parameters[axis][BUS_PARAMETER_INDEX_GATE], state = gate - 1u,
             other = feedback_read(axis, FEEDBACK_INDEX) &
                     ~(FEEDBACK_INDEX_GATE_MASK_MASK | FEEDBACK_INDEX_GATE_MASK);
    if (gate)
        other |= FEEDBACK_INDEX_GATE_MASK_MASK | FIELD_PUT(FEEDBACK_INDEX_GATE, state ^ state >> 1);
    feedback_write(axis, FEEDBACK_INDEX, other);
}

static uint32_t step_cycles(unsigned axis, uint8_t id) {
    return saturate(cycles_of(parameters[axis][id]) + 1u, STEP_CYCLES_MASK);
}

static void apply_steps(unsigned axis) {
    const int64_t* p = parameters[axis];
    actuator_write(
        axis, ACTUATOR_STEP_PULSE,
        FIELD_PUT(ACTUATOR_STEP_PULSE_HIGH, step_cycles(axis, BUS_PARAMETER_STEP_HIGH)) |
            FIELD_PUT(ACTUATOR_STEP_PULSE_LOW, step_cycles(axis, BUS_PARAMETER_STEP_LOW)));
    actuator_write(
        axis, ACTUATOR_STEP_DIRECTION,
        FIELD_PUT(ACTUATOR_STEP_DIRECTION_SETUP, step_cycles(axis, BUS_PARAMETER_STEP_SETUP)) |
            FIELD_PUT(ACTUATOR_STEP_DIRECTION_HOLD, step_cycles(axis, BUS_PARAMETER_STEP_HOLD)));
    actuator_write(
        axis, ACTUATOR_STEP_OUTPUT,
        FIELD_PUT(ACTUATOR_STEP_OUTPUT_MODE, p[BUS_PARAMETER_STEP_OUTPUT]) |
            FIELD_PUT(ACTUATOR_STEP_OUTPUT_STEP_LOW, p[BUS_PARAMETER_STEP_INVERT]) |
            FIELD_PUT(ACTUATOR_STEP_OUTPUT_DIRECTION_LOW, p[BUS_PARAMETER_STEP_INVERT] >> 1));
    actuator_write(axis, ACTUATOR_STEP_TRIM, 1u << p[BUS_PARAMETER_STEP_TRIM]);
    actuator_write_wide(axis, ACTUATOR_STEP_RATIO, (uint64_t)p[BUS_PARAMETER_STEPS_PER_PERIOD]);
}

// Cycles of half a period of the DAC clock, rounded up.
static uint32_t dac_half_period(int64_t clock) {
    uint32_t halves = 2u * (uint32_t)clock;
    return (node_read(NODE_CLK_HZ) + halves - 1u) / halves;
}

static void apply_dac(unsigned axis) {
    uint32_t half_period = dac_half_period(parameters[axis][BUS_PARAMETER_DAC_CLOCK]);
    actuator_write(
        axis, ACTUATOR_DAC,
        FIELD_PUT(ACTUATOR_DAC_HALF_PERIOD, half_period) | FIELD_PUT(ACTUATOR_DAC_REFRESH, 0xFFFF));
}

static void apply_pwm(unsigned axis) {
    uint32_t frequency = (uint32_t)parameters[axis][BUS_PARAMETER_PWM_FREQUENCY];
    actuator_write(axis, ACTUATOR_PWM_PERIOD,
                   saturate(node_read(NODE_CLK_HZ) / frequency, ACTUATOR_PWM_PERIOD_MASK));
}

static void apply_watchdog(unsigned axis) {
    bus_write(BUS_WATCHDOG_TIME, (uint32_t)parameters[axis][BUS_PARAMETER_WATCHDOG_TIME]);
}

void parameters_refresh(void) { apply_watchdog(0); }

static void write_filter(unsigned axis, uint32_t filter, uint32_t number, uint32_t value) {
    axis_write(axis, AXIS_FILTER_ADDRESS, filter * 8 + number);
    axis_write(axis, AXIS_FILTER_VALUE, value);
}

// The last value of a filter is whether it filters: not while its coefficients change.
static void apply_filters(unsigned axis) {
    const int64_t* p = parameters[axis];
    for (uint32_t filter = 0; filter < FILTERS; filter++) {
        write_filter(axis, filter, COEFFICIENTS, 0);
        for (uint32_t n = 0; n < COEFFICIENTS; n++)
            write_filter(axis, filter, n,
                         (uint32_t)p[BUS_PARAMETER_FILTER_1_B0 + filter * COEFFICIENTS + n]);
        write_filter(axis, filter, COEFFICIENTS, (uint32_t)p[BUS_PARAMETER_FILTERS] >> filter & 1u);
    }
}

#define NUMBER(number, function) APPLY_##number,
#define FUNCTION(number, function) [APPLY_##number] = apply_##function,
#define APPLIED(parameter, number) {BUS_PARAMETER_##parameter, APPLY_##number},
#define TARGET(parameter, block, register, field) \
    {block##_BASE + block##_##register, block##_##field##_SHIFT, BUS_PARAMETER_##parameter},

enum { BUS_PARAMETER_FUNCTIONS(NUMBER) };

static void (*const functions[])(unsigned axis) = {BUS_PARAMETER_FUNCTIONS(FUNCTION)};

static const struct {
    uint8_t id, function;
} applied[] = {BUS_PARAMETERS_APPLIED(APPLIED)};

// The fields of one register are neighbours; those without a parameter are 0.
static const struct {
    uint16_t address;  // of axis 0
    uint8_t shift, id;
} targets[] = {BUS_PARAMETER_REGISTERS(TARGET)};

#define TARGETS (sizeof targets / sizeof *targets)

_Static_assert(FEEDBACK_STRIDE == AXIS_STRIDE && ACTUATOR_STRIDE == AXIS_STRIDE,
               "the blocks of an axis have the same stride");

// Writes the register whose fields begin in this row. Returns the row of the next register.
static unsigned write_target(unsigned axis, unsigned row) {
    uint32_t address = targets[row].address, value = 0;
    for (; row < TARGETS && targets[row].address == address; row++)
        value |= (uint32_t)parameters[axis][targets[row].id] << targets[row].shift;
    register_write(address + axis * AXIS_STRIDE, value);
    return row;
}

// Writes the registers that follow from this parameter.
static void apply(unsigned axis, uint8_t id) {
    for (unsigned row = 0; row < sizeof applied / sizeof *applied; row++)
        if (applied[row].id == id) {
            functions[applied[row].function](axis);
            return;
        }
    for (unsigned row = 0, first = 0; row < TARGETS; row++) {
        if (targets[row].address != targets[first].address) first = row;
        if (targets[row].id == id) write_target(axis, first);
    }
}

// Writes each register once.
static void apply_all(unsigned axis) {
    for (unsigned n = 0; n < sizeof functions / sizeof *functions; n++) functions[n](axis);
    for (unsigned row = 0; row < TARGETS;) row = write_target(axis, row);
}

void parameters_start(unsigned axis) {
    for (uint8_t id = 1; id <= BUS_PARAMETER_COUNT; id++) parameters[axis][id] = table[id].value;
    if (!hardware_built(axis, AXIS_BUILT_SINE_MASK))
        parameters[axis][BUS_PARAMETER_POSITION_SOURCE] = COUNTS;
    apply_all(axis);
}

// Whether the axis was built with what this value of a parameter requests.
static bool is_built(unsigned axis, uint8_t id, int64_t value) {
    if (id == BUS_PARAMETER_POSITION_SOURCE)
        return value == COUNTS || hardware_built(axis, value == PHASES ? AXIS_BUILT_SINE_MASK
                                                                       : AXIS_BUILT_STEPPER_MASK);
    if (id == BUS_PARAMETER_DRIVE)
        return hardware_built(axis, 1u << (AXIS_BUILT_BRIDGE_SHIFT + (unsigned)value));
    if (value == 0 || value == table[id].value) return true;
    for (unsigned n = 0; n < sizeof needs / sizeof *needs; n++)
        if (needs[n].id == id)
            return hardware_built(axis, (uint32_t)needs[n].mask << needs[n].shift);
    return true;
}

static bool home_method_exists(int64_t method) {
    return method == 1 || method == 2 || method == 17 || method == 18 || method == 33 ||
           method == 34 || method == 35 || method == 37 || method == -1 || method == -2;
}

uint8_t parameters_check(unsigned axis, uint8_t id, int64_t value) {
    if (id < 1 || id > BUS_PARAMETER_COUNT) return BUS_CAUSE_UNKNOWN_PARAMETER;
    if (id == BUS_PARAMETER_HOME_METHOD && !home_method_exists(value))
        return BUS_CAUSE_OUT_OF_RANGE;
    if (value < table[id].low || value > table[id].high) return BUS_CAUSE_OUT_OF_RANGE;
    if (id == BUS_PARAMETER_DAC_CLOCK && dac_half_period(value) > LONGEST_DAC_HALF_PERIOD)
        return BUS_CAUSE_OUT_OF_RANGE;
    return is_built(axis, id, value) ? BUS_CAUSE_OK : BUS_CAUSE_NOT_BUILT;
}

void parameters_set(unsigned axis, uint8_t id, int64_t value) {
    parameters[axis][id] = value;
    if (id == BUS_PARAMETER_WATCHDOG_TIME)  // all axes share one bus
        for (unsigned other = 0; other < HARDWARE_AXES; other++) parameters[other][id] = value;
    apply(axis, id);
}

int64_t parameters_default(uint8_t id) { return table[id].value; }

int64_t parameters_get(unsigned axis, uint8_t id) { return parameters[axis][id]; }

struct planner_limits parameters_limits(unsigned axis, uint8_t velocity_id) {
    struct planner_limits made = limits[axis];
    if (velocity_id != BUS_PARAMETER_VELOCITY)
        made.velocity = planner_velocity((uint64_t)parameters[axis][velocity_id] << 16);
    return made;
}

// A velocity below the first step becomes the velocity of all steps.
struct planner_stepped_profile parameters_stepped_profile(unsigned axis, uint8_t velocity_id) {
    const int64_t* p = parameters[axis];
    uint64_t top = planner_velocity((uint64_t)p[velocity_id] << 16),
             first = planner_velocity((uint64_t)p[BUS_PARAMETER_STEPPED_FIRST]);
    struct planner_stepped_profile made = {.first = first < top ? first : top,
                                           .top = top,
                                           .ticks = (uint32_t)p[BUS_PARAMETER_STEPPED_TIME]};
    for (unsigned n = 0; n < 3; n++)
        made.rise[n] = planner_velocity((uint64_t)p[BUS_PARAMETER_STEPPED_RISE_1 + n]);
    planner_stepped_borders(&made, (uint32_t)p[BUS_PARAMETER_STEPPED_BORDER_2],
                            (uint32_t)p[BUS_PARAMETER_STEPPED_BORDER_3]);
    return made;
}
