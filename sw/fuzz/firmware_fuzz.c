// SPDX-License-Identifier: Apache-2.0
// firmware_fuzz -- coverage-guided fuzzing of the whole firmware on this computer, with random
// words on the bus, registers and times.
//
//     firmware_fuzz SECONDS SEED    prints `runs edges corpus`; a sanitizer or the time limit ends
//                                   it with the input on standard error
//     firmware_fuzz INPUT           plays that input again
//
// An input is a script: what the bus receives, what registers hold, how time passes. The compiler
// calls trace_pc at every edge; an input that reaches a new edge, or one a new order of magnitude
// of times, joins the corpus that the next inputs are made of.
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include "core/hardware.h"
#include "made/bus_protocol.h"

#define EDGES 65536u
#define LONGEST 512u
#define CORPUS 4096u
#define MAP_WORDS 2048u  // the register map, up to 0x2000
#define QUEUE 256u
#define AXES 2u
#define CLK_HZ 4000000u
#define SEGMENTS 16u    // in the queue of a profile player
#define RUN_SECONDS 30  // processor time of one input: more is a hang

void firmware_start(void);
void firmware_poll(void);

struct input {
    uint16_t length;
    uint8_t bytes[LONGEST];
};

static uint8_t seen[EDGES], hits[EDGES];
static uintptr_t previous;
static struct input corpus[CORPUS], trial;
static unsigned corpus_size;
static uint64_t random_state;
static uint32_t map[MAP_WORDS], clk;
static struct queue {
    uint16_t words[QUEUE];
    unsigned put, taken;
} bus_words, peer_bytes;

void __sanitizer_cov_trace_pc(void);
void __sanitizer_cov_trace_pc(void) {
    uintptr_t here = (uintptr_t)__builtin_return_address(0);
    unsigned edge = (unsigned)((here ^ previous) * 0x9E3779B1u >> 7) % EDGES;
    if (hits[edge] < 255) hits[edge]++;
    previous = here >> 1;
}

// ------------------------------------------------------------------ the hardware

static bool is_axis_register(uint32_t offset, uint32_t which) {
    return offset >= AXIS_BASE && offset < AXIS_BASE + AXES * AXIS_STRIDE &&
           (offset - AXIS_BASE) % AXIS_STRIDE == which;
}

static void put(struct queue* queue, unsigned word) {
    if (queue->put - queue->taken < QUEUE) queue->words[queue->put++ % QUEUE] = (uint16_t)word;
}

static uint32_t take(struct queue* queue, uint32_t present) {
    return queue->taken < queue->put ? queue->words[queue->taken++ % QUEUE] | present : 0;
}

// Anything that a register can hold; what the hardware guarantees of one is true here, too.
uint32_t register_read(uint32_t offset) {
    uint32_t held = map[offset / 4 % MAP_WORDS];
    if (is_axis_register(offset, AXIS_STATE) && FIELD_GET(held, AXIS_STATE_QUEUE_FREE) > SEGMENTS)
        held = (held & ~AXIS_STATE_QUEUE_FREE_MASK) | FIELD_PUT(AXIS_STATE_QUEUE_FREE, SEGMENTS);
    switch (offset) {
    case NODE_MAP_CRC: return MAP_CRC;
    case NODE_CLK_HZ: return CLK_HZ;
    case NODE_BUILD: return AXES | 1u << 4 | 64u << 8;
    case NODE_TIME_STAMP_LOW: return clk += 10;
    case BUS_BASE + BUS_RECEIVE: return take(&bus_words, BUS_RECEIVE_PRESENT_MASK);
    case BUS_BASE + BUS_CRC: return 0;  // so that every CRC-32 of zeros is right
    case PERIPHERALS_BASE + PERIPHERALS_BUILT: return ~0u;
    case PERIPHERALS_BASE + PERIPHERALS_PEER_RECEIVE:
        return take(&peer_bytes, PERIPHERALS_PEER_RECEIVE_PRESENT_MASK);
    default: return held;
    }
}

void register_write(uint32_t offset, uint32_t value) { map[offset / 4 % MAP_WORDS] = value; }

static void receive(unsigned word) { put(&bus_words, word); }

static void receive_frame(const uint8_t* body, unsigned length) {
    receive(0x21u | BUS_RECEIVE_COMMAND_MASK);
    receive(length);
    for (unsigned n = 0; n < length; n++) receive(body[n]);
    for (unsigned n = 0; n < 4; n++)
        receive(rand() % 256 | (n == 3 && length <= BUS_LONGEST_BODY ? BUS_RECEIVE_GOOD_MASK : 0));
    receive(0x11u | BUS_RECEIVE_COMMAND_MASK);
}

// ------------------------------------------------------------------ an input, played

enum { POLL, WORD, FRAME, PEER, REGISTER, TIME, KINDS };

static void play(const struct input* input) {
    unsigned at = 0;
#define NEXT (at < input->length ? input->bytes[at++] : 0u)
    memset(map, 0, sizeof map);
    clk = 0;
    bus_words = peer_bytes = (struct queue){0};
    srand(1);
    firmware_start();
    while (at < input->length) {
        switch (NEXT % KINDS) {
        case POLL:
            for (unsigned n = NEXT % 32u; n; n--) firmware_poll();
            break;
        case WORD: {
            unsigned low = NEXT;
            receive(low | (NEXT & 3u) << 8);
            break;
        }
        case FRAME: {
            unsigned length = NEXT % (2u * BUS_LONGEST_BODY);  // the hardware refuses long ones
            if (length > input->length - at) length = input->length - at;
            receive_frame(&input->bytes[at], length);
            at += length;
            for (unsigned n = 0; n < 16; n++) firmware_poll();
            break;
        }
        case PEER:
            for (unsigned n = NEXT; n && at < input->length; n--) put(&peer_bytes, NEXT);
            for (unsigned n = 0; n < 16; n++) firmware_poll();
            break;
        case REGISTER: {
            unsigned word = NEXT, value = 0;
            word = (word | NEXT << 8) % MAP_WORDS;
            for (unsigned n = 0; n < 4; n++) value = value << 8 | NEXT;
            map[word] = value;
            break;
        }
        default:  // up to 1.3 s
            clk += NEXT * (CLK_HZ / 200u);
            firmware_poll();
            break;
        }
    }
    for (unsigned n = 0; n < 8; n++) firmware_poll();
#undef NEXT
}

static void print_input(void)  // that was being played
{
    fprintf(stderr, "input:");
    for (unsigned n = 0; n < trial.length; n++) fprintf(stderr, " %02x", trial.bytes[n]);
    fprintf(stderr, "\n");
}

static void die(int number)  // by a sanitizer, with abort_on_error=1, or by the timer
{
    if (number == SIGPROF) fprintf(stderr, "an input took longer than %d s\n", RUN_SECONDS);
    print_input();
    _exit(1);
}

// ------------------------------------------------------------------ inputs

static uint32_t draw(uint32_t below) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((random_state >> 33) % below);
}

#define OPERATION(name, code, request, ...) {code, request},
static const uint8_t operations[][2] = {BUS_OPERATIONS(OPERATION)};

static void insert(struct input* input, const uint8_t* bytes, unsigned length) {
    unsigned at = draw(input->length + 1u);
    if (input->length + length > LONGEST) return;
    memmove(&input->bytes[at + length], &input->bytes[at], input->length - at);
    memcpy(&input->bytes[at], bytes, length);
    input->length = (uint16_t)(input->length + length);
}

static unsigned request(uint8_t* body)  // of the right length; its values are anything
{
    const uint8_t* operation = operations[draw(sizeof operations / sizeof *operations)];
    unsigned length = operation[1];
    body[0] = (uint8_t)draw(256);
    body[1] = operation[0];
    for (unsigned n = 2; n < length; n++)
        body[n] = (uint8_t)(draw(3) ? draw(4) - (draw(4) == 0) : draw(256));
    return length;
}

static void insert_request(struct input* input) {
    uint8_t bytes[2 + BUS_LONGEST_BODY] = {FRAME};
    bytes[1] = (uint8_t)request(&bytes[2]);
    insert(input, bytes, 2u + bytes[1]);
}

// COBS of a request and its CRC-32, zeros around it
static void insert_peer_frame(struct input* input) {
    uint8_t bytes[4 + BUS_LONGEST_BODY + 5] = {PEER}, content[BUS_LONGEST_BODY + 4] = {0};
    unsigned length = request(content) + 4u, code = 3;
    for (unsigned n = 0; n < length; n++) {
        bytes[4 + n] = content[n];
        if (content[n]) continue;
        bytes[code] = (uint8_t)(4 + n - code);
        code = 4 + n;
    }
    bytes[code] = (uint8_t)(4 + length - code);
    bytes[1] = (uint8_t)(length + 3u);
    insert(input, bytes, 5u + length);
}

static void mutate(struct input* input) {
    uint8_t some[8];
    unsigned at = input->length ? draw(input->length) : 0, length;
    for (unsigned n = 0; n < sizeof some; n++) some[n] = (uint8_t)draw(256);
    switch (draw(9)) {
    case 0:
        if (input->length) input->bytes[at] ^= (uint8_t)(1u << draw(8));
        break;
    case 1:
        if (input->length) input->bytes[at] = some[0];
        break;
    case 2:
        if (input->length) input->bytes[at] = (uint8_t)(draw(2) ? 0xFF : 0x80 >> draw(8));
        break;
    case 3: insert(input, some, 1u + draw(sizeof some)); break;
    case 4:
        length = draw(input->length - at + 1u);
        memmove(&input->bytes[at], &input->bytes[at + length], input->length - at - length);
        input->length = (uint16_t)(input->length - length);
        break;
    case 5: {  // a piece of another input
        const struct input* other = &corpus[draw(corpus_size)];
        unsigned from = draw(other->length + 1u);
        length = draw(other->length - from + 1u);
        insert(input, &other->bytes[from], length < 64 ? length : 64);
        break;
    }
    case 6:
        some[0] = draw(2) ? TIME : POLL;
        insert(input, some, 3);
        break;
    case 7: insert_peer_frame(input); break;
    default: insert_request(input); break;
    }
}

static bool new_ground(void) {
    bool found = false;
    for (unsigned n = 0; n < EDGES; n++) {
        if (!hits[n]) continue;
        uint8_t magnitude = (uint8_t)(1u << (31 - __builtin_clz(hits[n])));
        found = found || !(seen[n] & magnitude);
        seen[n] |= magnitude;
    }
    return found;
}

static void parse(const char* text)  // bytes in hexadecimal, with spaces or without
{
    int taken_here;
    for (unsigned byte; trial.length < LONGEST && sscanf(text, "%2x%n", &byte, &taken_here) == 1;
         text += taken_here)
        trial.bytes[trial.length++] = (uint8_t)byte;
}

// Other programs may keep this one from running: only its own time counts.
static void limit_time(int seconds) {
    struct itimerval timer = {.it_value = {.tv_sec = seconds}};
    setitimer(ITIMER_PROF, &timer, NULL);
}

int main(int count, char** words) {
    signal(SIGABRT, die);
    signal(SIGPROF, die);
    if (count == 2) {
        parse(words[1]);
        limit_time(RUN_SECONDS);
        play(&trial);
        return 0;
    }
    if (count != 3) return 2;
    double seconds = atof(words[1]);
    random_state = strtoull(words[2], NULL, 10) * 0x9E3779B97F4A7C15u + 1u;
    unsigned long runs = 0, edges = 0;
    struct timespec began, now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &began);
    corpus_size = 1;  // the empty input
    do {
        trial = corpus[draw(corpus_size)];
        for (unsigned n = 1u + draw(8); n; n--) mutate(&trial);
        memset(hits, 0, sizeof hits);
        previous = 0;
        limit_time(RUN_SECONDS);
        play(&trial);
        limit_time(0);
        runs++;
        if (new_ground()) corpus[corpus_size < CORPUS ? corpus_size++ : draw(CORPUS)] = trial;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    } while ((double)(now.tv_sec - began.tv_sec) + 1e-9 * (double)(now.tv_nsec - began.tv_nsec) <
             seconds);
    for (unsigned n = 0; n < EDGES; n++) edges += seen[n] != 0;
    printf("%lu %lu %u\n", runs, edges, corpus_size);
    return 0;
}
