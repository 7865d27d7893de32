// SPDX-License-Identifier: GPL-2.0-or-later
// moire.c -- HAL component: nodes of Moire on a real-time link, each cycle one packet each way.
//
//     loadrt moire node="serial:/dev/ttyUSB1:3000000" axes=3 session=4711
//     addf moire.0.read servo-thread      first
//     addf moire.0.write servo-thread     last
//
// docs/linuxcnc.md describes the pins. Another program sets the link up before; the check of the
// node is done while the component is loaded, outside the realtime thread.
#include <rtapi.h>
#include <rtapi_app.h>
#include <rtapi_string.h>
#include <hal.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "axis.h"
#include "encoder.h"
#include "node.h"
#include "probe.h"

MODULE_AUTHOR("the Moire project");
MODULE_DESCRIPTION("nodes of Moire on a real-time link");
MODULE_LICENSE("GPL");

enum { MOST_NODES = 8, MOST_NAME = HAL_NAME_LEN + 1 };

static char* node[MOST_NODES];
RTAPI_MP_ARRAY_STRING(node, MOST_NODES,
                      "udp:HOST:PORT, serial:DEVICE:BAUD or spi:DEVICE:HZ of each node");
static int axes[MOST_NODES] = {1, 1, 1, 1, 1, 1, 1, 1};
RTAPI_MP_ARRAY_INT(axes, MOST_NODES, "axes of each node");
static int session[MOST_NODES];
RTAPI_MP_ARRAY_INT(session, MOST_NODES, "session that each node was set up for");
static int simulated = 0;
RTAPI_MP_INT(simulated, "1: each packet is a servo period of a simulated node, wait for it");

static const int64_t NS_PER_MS = 1000000;
static const double NS = 1e-9, MS = 1e-3;
static const int64_t SIMULATED_NS = 60000000000;  // longest wait for a simulated node
static const int64_t CHECK_NS = 100000000;        // for a reply while the component is loaded
enum { LEVEL_LOST = 2, LEVEL_GOOD = 1, LEVEL_LIMIT = 10 };
enum { WATCHDOG_FAULT = 1 << (CAUSE_LINK_WATCHDOG - 1) };
enum { INPUTS = 2 };       // pins for touch probes of an axis
enum { LEAST_TICKS = 2 };  // from one set-point to the next

struct link {
    struct node node;
    struct node_clock clock;
    struct node_pins pins;
    struct axis axis[MOST_AXES];        // those with a drive
    struct encoder encoder[MOST_AXES];  // those without one
    struct latch latch[MOST_AXES];      // of each axis of the node
    struct digin_pins digin[INPUTS * MOST_AXES];
    struct probe probe;
    unsigned asked;      // whose latch the last request had an access for; MOST_AXES: none
    bool waiting;        // a request was sent
    bool was_reset;      // level of the pin `reset` in the last period
    bool started;        // the clock of the node is known
    bool expired;        // the fault of the watchdog was latched in the last reply
    uint32_t last_tick;  // of the last set-points
    uint8_t refused[CAUSE_COUNTS];
    uint8_t packet[PACKET_LONGEST];
    struct link_reply reply;
    uint32_t values[PACKET_MOST_VALUES];
};

static int component;
static struct link* links;

// Takes packets until the reply to the last request is there, or the time is over.
static bool receive(struct link* link) {
    struct node_pins* pins = &link->pins;
    int64_t wait =
        simulated ? SIMULATED_NS : (int64_t)(*pins->packet_read_timeout * (double)NS_PER_MS);
    int64_t deadline = carrier_now() + wait;
    size_t length;
    while ((length = carrier_receive(&link->node.carrier, link->packet, deadline))) {
        if (packet_reply(&link->node.link, link->packet, length, &link->reply)) return true;
        ++*pins->replies_damaged;
        if (simulated) return false;  // the period of the node is over
    }
    return false;
}

static void count_refused(struct link* link) {
    for (unsigned n = 0; n < CAUSE_COUNTS; n++) {
        uint8_t more = (uint8_t)(link->reply.refused[n] - link->refused[n]);
        if (link->started && more) {
            *link->pins.requests_refused += more;
            *link->pins.refused_cause = n + 1;
        }
        link->refused[n] = link->reply.refused[n];
    }
}

// The latches, before what depends on them.
static void take_captures(struct link* link, const uint32_t* words) {
    unsigned axes = link->node.axes;
    for (unsigned n = 0; n < axes; n++)
        latch_look(&link->latch[n], words[list_word(READ_FEEDBACK_CAPTURE_STATE, axes, n)]);
    if (link->asked < axes)
        latch_answer(&link->latch[link->asked], link->reply.spare,
                     position_word(words, READ_AXIS_POSITION, axes, link->asked));
}

static void take_inputs(struct link* link, const uint32_t* words) {
    for (unsigned n = 0; n < INPUTS * link->node.axes; n++) {
        uint32_t state = words[list_word(READ_AXIS_STATE, link->node.axes, n / INPUTS)];
        *link->digin[n].in = FIELD_GET(state, AXIS_STATE_PROBE) >> n % INPUTS & 1;
        *link->digin[n].in_not = !*link->digin[n].in;
    }
}

// The good reply; true if the touch probe has met an edge.
static bool take_reply(struct link* link) {
    struct node_pins* pins = &link->pins;
    struct node* of = &link->node;
    double tick_s = of->tick / of->clk_hz;
    node_take_time(of, &link->reply);
    *pins->latency = (double)(carrier_now() - of->sent_at) / (double)NS_PER_MS;
    count_refused(link);
    const uint32_t* words = link->reply.values;
    node_clock_take(&link->clock, of->time, words[READ_NODE_TICK_COUNT.fixed], of->read_time);
    *pins->lateness = link->clock.late / of->clk_hz / MS;
    *pins->pll_locked = of->locked;
    *pins->pll_phase_error = of->phase_error / of->clk_hz / MS;
    int32_t age = of->captured ? (int32_t)(of->time - of->read_time) : 0;
    *pins->capture_age = age / of->clk_hz / MS;
    *pins->drift = node_clock_drift(&link->clock);
    take_captures(link, words);
    take_inputs(link, words);
    bool ready = of->probes, expired = false;
    for (unsigned n = 0; n < of->drives; n++) {
        axis_take(&link->axis[n], words, of->axes, n, tick_s);
        ready = ready && link->axis[n].phase == FOLLOWING;
        expired = expired || link->axis[n].faults & WATCHDOG_FAULT;
    }
    if (link->started && expired && !link->expired) *pins->watchdog_has_bit = 1;
    link->expired = expired;
    for (unsigned n = of->drives; n < of->axes; n++)
        encoder_take(&link->encoder[n - of->drives], &link->latch[n], words, of->axes, n, tick_s);
    uint32_t state = words[list_word(READ_AXIS_STATE, of->axes, 0)];
    *pins->estop = FIELD_GET(state, AXIS_STATE_ESTOP);
    link->started = true;
    return probe_take(&link->probe, link->latch, of->drives, *link->digin[0].in, ready);
}

// A packet is lost or has come: io-error follows when too many are lost.
static void count(struct link* link, bool good) {
    struct node_pins* pins = &link->pins;
    *pins->packet_error = !good;
    if (!good) ++*pins->packet_error_total;
    int level = *pins->packet_error_level + (good ? -LEVEL_GOOD : LEVEL_LOST);
    *pins->packet_error_level = level < 0 ? 0 : level > LEVEL_LIMIT ? LEVEL_LIMIT : level;
    *pins->packet_error_exceeded = level >= LEVEL_LIMIT;
    if (level >= LEVEL_LIMIT && !*pins->io_error) {
        *pins->io_error = 1;
        rtapi_print_msg(RTAPI_MSG_ERR, "moire: %s\n", CAUSE_TEXTS[CAUSE_LINK_LOST]);
    }
}

static void decide(struct link* link, double period_s) {
    struct node_pins* pins = &link->pins;
    if (*pins->reset && !link->was_reset) *pins->io_error = *pins->watchdog_has_bit = 0;
    link->was_reset = *pins->reset;
    bool in_touch = link->started && !*pins->io_error;
    uint32_t cause = !in_touch ? CAUSE_LINK_LOST : *pins->watchdog_has_bit ? CAUSE_WATCHDOG : 0;
    uint32_t denied = cause || *pins->enable ? cause : CAUSE_NOT_ALLOWED;
    for (unsigned n = link->node.drives; n < link->node.axes && cause; n++)
        link->latch[n].phase = LATCH_OFF;  // the node may have forgotten it
    for (unsigned n = 0; n < link->node.drives; n++) {
        struct axis* axis = &link->axis[n];
        bool before = *axis->pins.fault;
        axis_decide(axis, denied, period_s);
        if (*axis->pins.fault && !before)
            rtapi_print_msg(RTAPI_MSG_ERR, "moire: axis %u: %s\n", n,
                            CAUSE_TEXTS[*axis->pins.fault_cause]);
        if (*axis->pins.fault && !cause) cause = *axis->pins.fault_cause;
    }
    *pins->fault = cause != 0;
    *pins->fault_cause = cause;
    *pins->ok = !denied && !*pins->estop;
}

static void read_node(void* arg, long period_ns) {
    struct link* link = arg;
    bool edge = false;
    if (link->waiting) {
        bool good = receive(link);
        if (good) edge = take_reply(link);
        count(link, good);
    }
    decide(link, (double)period_ns * NS);
    for (unsigned n = 0; n < link->node.drives && edge; n++)
        axis_show_edge(&link->axis[n], link->latch[n].position);
    *link->pins.probe = link->probe.level;
}

// The access of the first latch that needs one.
static struct spare_access next_access(struct link* link) {
    struct spare_access access = {0, 0};
    unsigned n = 0;
    while (n < link->node.axes && !latch_asks(&link->latch[n], n, &access)) n++;
    link->asked = n < link->node.axes ? n : MOST_AXES;
    return access;
}

// Fills the write list: the axes, then the requests, the tick and the commit.
static void fill(struct link* link, double period_s) {
    struct node* to = &link->node;
    double tick_s = to->tick / to->clk_hz;
    double delay_s = *link->pins.set_point_delay * MS;
    double moment = node_clock_tick(&link->clock, delay_s * to->clk_hz);
    double tick = floor(moment);
    double shift_s = (tick - moment) * tick_s;
    uint32_t requests = 0, commit = 0, *values = link->values;
    for (unsigned n = 0; n < to->drives; n++) {
        struct axis_request asks = axis_give(&link->axis[n], period_s, tick_s, shift_s);
        uint32_t* position = values + list_word(WRITE_AXIS_SET_POINT_POSITION, to->axes, n);
        position[0] = (uint32_t)asks.position;
        position[1] = (uint32_t)((uint64_t)asks.position >> 32);
        values[list_word(WRITE_AXIS_SET_POINT_VELOCITY, to->axes, n)] = (uint32_t)asks.velocity;
        requests |= ((uint32_t)asks.enable << NODE_AXIS_REQUESTS_ENABLE_SHIFT |
                     (uint32_t)asks.home << NODE_AXIS_REQUESTS_HOME_SHIFT |
                     (uint32_t)asks.stream << NODE_AXIS_REQUESTS_STREAM_SHIFT |
                     (uint32_t)asks.reset << NODE_AXIS_REQUESTS_RESET_FAULTS_SHIFT)
                    << n;
        commit |= (uint32_t)asks.commit << n;
    }
    uint32_t whole = (uint32_t)(int64_t)tick;
    if (!commit) link->last_tick = whole - LEAST_TICKS;
    if ((int32_t)(whole - link->last_tick) < LEAST_TICKS) commit = 0;
    if (commit) link->last_tick = whole;
    values[list_word(WRITE_NODE_AXIS_REQUESTS, to->axes, 0)] = requests;
    values[list_word(WRITE_NODE_SET_POINT_TICK, to->axes, 0)] = whole;
    values[list_word(WRITE_NODE_SET_POINT_COMMIT, to->axes, 0)] = commit;
}

static void write_node(void* arg, long period_ns) {
    struct link* link = arg;
    struct node* to = &link->node;
    double period_s = (double)period_ns * NS;
    if (link->clock.nominal == 0) node_clock_start(&link->clock, period_s, to->clk_hz, to->tick);
    node_clock_step(&link->clock);
    fill(link, period_s);
    uint32_t time = node_time(to);
    struct spare_access access = next_access(link);
    size_t length =
        packet_request(&to->link, time, link->values, access.spare, access.value, link->packet);
    to->sent_at = carrier_now();
    carrier_send(&to->carrier, link->packet, length);
    link->waiting = true;
}

#define COUNT_OF(array) (sizeof(array) / sizeof *(array))

static int export_pins(const struct moire_pin* pins, size_t count, void* of, const char* start) {
    for (size_t n = 0; n < count; n++) {
        char name[MOST_NAME];
        rtapi_snprintf(name, sizeof name, "%s.%s", start, pins[n].name);
        void** place = (void**)((char*)of + pins[n].place);
        int failed = hal_pin_new(name, pins[n].type, pins[n].direction, place, component);
        if (failed) return failed;
    }
    return 0;
}

static int export_link(struct link* link, unsigned number) {
    char name[MOST_NAME];
    unsigned drives = link->node.drives, axes = link->node.axes;
    rtapi_snprintf(name, sizeof name, "moire.%u", number);
    int failed = export_pins(NODE_PINS, COUNT_OF(NODE_PINS), &link->pins, name);
    for (unsigned n = 0; n < drives && !failed; n++) {
        rtapi_snprintf(name, sizeof name, "moire.%u.axis.%u", number, n);
        failed = export_pins(AXIS_PINS, COUNT_OF(AXIS_PINS), &link->axis[n].pins, name);
    }
    for (unsigned n = drives; n < axes && !failed; n++) {
        struct encoder* encoder = &link->encoder[n - drives];
        rtapi_snprintf(name, sizeof name, "moire.%u.encoder.%u", number, n);
        failed = export_pins(ENCODER_PINS, COUNT_OF(ENCODER_PINS), &encoder->pins, name);
    }
    for (unsigned n = 0; n < INPUTS * axes && !failed; n++) {
        rtapi_snprintf(name, sizeof name, "moire.%u.digin.%u", number, n);
        failed = export_pins(DIGIN_PINS, COUNT_OF(DIGIN_PINS), &link->digin[n], name);
    }
    if (failed) return failed;
    *link->pins.packet_read_timeout = 0.2;
    *link->pins.set_point_delay = 5;
    *link->pins.enable = 1;
    rtapi_snprintf(name, sizeof name, "moire.%u.read", number);
    failed = hal_export_funct(name, read_node, link, 1, 0, component);
    rtapi_snprintf(name, sizeof name, "moire.%u.write", number);
    return failed ? failed : hal_export_funct(name, write_node, link, 1, 0, component);
}

static bool start(struct link* link, unsigned number) {
    if (axes[number] < 1 || axes[number] > MOST_AXES) {
        rtapi_print_msg(RTAPI_MSG_ERR, "moire: axes=%d: a node has 1 to %d axes\n", axes[number],
                        MOST_AXES);
        return false;
    }
    uint32_t of = (uint32_t)session[number];
    int64_t patience = simulated ? SIMULATED_NS : CHECK_NS;
    if (node_open(&link->node, node[number], (unsigned)axes[number], of, patience)) return true;
    rtapi_print_msg(RTAPI_MSG_ERR, "moire: %s: %s\n", node[number], link->node.why);
    return false;
}

int rtapi_app_main(void) {
    component = hal_init("moire");
    if (component < 0) return component;
    unsigned count = 0;
    while (count < MOST_NODES && node[count]) count++;
    links = hal_malloc((long)(count * sizeof *links));
    int failed = links && count ? 0 : -1;
    if (!count) rtapi_print_msg(RTAPI_MSG_ERR, "moire: name a node: loadrt moire node=…\n");
    if (!failed) memset(links, 0, count * sizeof *links);
    unsigned opened = 0;
    for (; opened < count && !failed; opened++)
        failed = start(&links[opened], opened) ? export_link(&links[opened], opened) : -1;
    if (!failed) return hal_ready(component);
    for (unsigned n = 0; n < opened; n++) carrier_close(&links[n].node.carrier);
    hal_exit(component);
    return -1;
}

void rtapi_app_exit(void) {
    for (unsigned n = 0; n < MOST_NODES && node[n]; n++) carrier_close(&links[n].node.carrier);
    hal_exit(component);
}
