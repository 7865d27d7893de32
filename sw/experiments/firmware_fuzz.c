// SPDX-License-Identifier: Apache-2.0
// firmware_fuzz -- coverage-guided fuzzing of the whole firmware on this computer: words of the line, registers and time as they come.
//
//     firmware_fuzz SECONDS SEED      prints `runs edges corpus`; a sanitizer or the time limit ends it with the input on standard error
//
// An input is a script: what the line receives, what registers hold, how time goes on. The compiler calls trace_pc at every edge; an
// input that reaches a new edge, or one a new order of magnitude of times, joins the corpus that the next inputs are made of.
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "hardware.h"
#include "line_protocol.h"

#define EDGES 65536u
#define LONGEST 512u
#define CORPUS 4096u
#define MAP_WORDS 2048u                 // the register map, up to 0x2000
#define QUEUE 256u
#define AXES 2u
#define CLK 4000000u
#define RUN_SECONDS 30                  // of one input: more is a hang

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
static uint16_t queue[QUEUE];
static unsigned queued, taken;

void __sanitizer_cov_trace_pc(void);
void __sanitizer_cov_trace_pc(void)
{
    uintptr_t here = (uintptr_t)__builtin_return_address(0);
    unsigned edge = (unsigned)((here ^ previous) * 0x9E3779B1u >> 7) % EDGES;
    if (hits[edge] < 255) hits[edge]++;
    previous = here >> 1;
}

// ------------------------------------------------------------------ the hardware

uint32_t register_read(uint32_t offset)
{
    switch (offset) {
    case NODE_MAP_CRC: return MAP_CRC;
    case NODE_CLK_HZ: return CLK;
    case NODE_BUILD: return AXES | 1u << 4 | 64u << 8;
    case NODE_TIME_STAMP_LOW: return clk += 10;
    case LINE_BASE + LINE_RECEIVE: return taken < queued ? queue[taken++ % QUEUE] | LINE_RECEIVE_PRESENT_MASK : 0;
    default: return map[offset / 4 % MAP_WORDS];
    }
}

void register_write(uint32_t offset, uint32_t value)
{
    map[offset / 4 % MAP_WORDS] = value;
}

static void receive(unsigned word)
{
    if (queued - taken < QUEUE) queue[queued++ % QUEUE] = (uint16_t)word;
}

static void receive_frame(const uint8_t *body, unsigned length)
{
    receive(0x21u | LINE_RECEIVE_COMMAND_MASK);
    receive(length);
    for (unsigned n = 0; n < length; n++) receive(body[n]);
    for (unsigned n = 0; n < 4; n++) receive(rand() % 256 | (n == 3 && length <= LINE_LONGEST_BODY ? LINE_RECEIVE_GOOD_MASK : 0));
    receive(0x11u | LINE_RECEIVE_COMMAND_MASK);
}

// ------------------------------------------------------------------ an input, played

enum { POLL, WORD, FRAME, REGISTER, TIME, KINDS };

static void play(const struct input *input)
{
    unsigned at = 0;
#define NEXT (at < input->length ? input->bytes[at++] : 0u)
    memset(map, 0, sizeof map);
    clk = queued = taken = 0;
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
            unsigned length = NEXT % (2u * LINE_LONGEST_BODY);    // the hardware marks none that is too long as good
            if (length > input->length - at) length = input->length - at;
            receive_frame(&input->bytes[at], length);
            at += length;
            for (unsigned n = 0; n < 16; n++) firmware_poll();
            break;
        }
        case REGISTER: {
            unsigned place = NEXT, value = 0;
            place = (place | NEXT << 8) % MAP_WORDS;
            for (unsigned n = 0; n < 4; n++) value = value << 8 | NEXT;
            map[place] = value;
            break;
        }
        default:                                                // up to 1.3 s
            clk += NEXT * (CLK / 200u);
            firmware_poll();
            break;
        }
    }
    for (unsigned n = 0; n < 8; n++) firmware_poll();
#undef NEXT
}

static void tell(void)                                          // the input that was being played
{
    fprintf(stderr, "input:");
    for (unsigned n = 0; n < trial.length; n++) fprintf(stderr, " %02x", trial.bytes[n]);
    fprintf(stderr, "\n");
}

static void die(int number)                                     // by a sanitizer, with abort_on_error=1, or by the alarm
{
    if (number == SIGALRM) fprintf(stderr, "an input took longer than %d s\n", RUN_SECONDS);
    tell();
    _exit(1);
}

// ------------------------------------------------------------------ inputs

static uint32_t draw(uint32_t below)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((random_state >> 33) % below);
}

#define OPERATION(name, code, request, reply) {code, request},
static const uint8_t operations[][2] = {LINE_OPERATIONS(OPERATION)};

static void insert(struct input *input, const uint8_t *bytes, unsigned length)
{
    unsigned at = draw(input->length + 1u);
    if (input->length + length > LONGEST) return;
    memmove(&input->bytes[at + length], &input->bytes[at], input->length - at);
    memcpy(&input->bytes[at], bytes, length);
    input->length = (uint16_t)(input->length + length);
}

static void insert_request(struct input *input)                 // of the right length; its values are anything
{
    const uint8_t *operation = operations[draw(sizeof operations / sizeof *operations)];
    uint8_t bytes[2 + LINE_LONGEST_BODY] = {FRAME, operation[1], (uint8_t)draw(256), operation[0], (uint8_t)draw(3)};
    for (unsigned n = 5; n < 2u + operation[1]; n++) bytes[n] = (uint8_t)(draw(3) ? draw(4) - 1u : draw(256));
    insert(input, bytes, 2u + operation[1]);
}

static void mutate(struct input *input)
{
    uint8_t some[8];
    unsigned at = input->length ? draw(input->length) : 0, length;
    for (unsigned n = 0; n < sizeof some; n++) some[n] = (uint8_t)draw(256);
    switch (draw(8)) {
    case 0: if (input->length) input->bytes[at] ^= (uint8_t)(1u << draw(8)); break;
    case 1: if (input->length) input->bytes[at] = some[0]; break;
    case 2: if (input->length) input->bytes[at] = (uint8_t)(draw(2) ? 0xFF : 0x80 >> draw(8)); break;
    case 3: insert(input, some, 1u + draw(sizeof some)); break;
    case 4:
        length = draw(input->length - at + 1u);
        memmove(&input->bytes[at], &input->bytes[at + length], input->length - at - length);
        input->length = (uint16_t)(input->length - length);
        break;
    case 5: {                                                   // a piece of another
        const struct input *other = &corpus[draw(corpus_size)];
        unsigned from = draw(other->length + 1u);
        length = draw(other->length - from + 1u);
        insert(input, &other->bytes[from], length < 64 ? length : 64);
        break;
    }
    case 6: some[0] = draw(2) ? TIME : POLL; insert(input, some, 3); break;
    default: insert_request(input); break;
    }
}

static bool new_ground(void)
{
    bool found = false;
    for (unsigned n = 0; n < EDGES; n++) {
        if (!hits[n]) continue;
        uint8_t magnitude = (uint8_t)(1u << (31 - __builtin_clz(hits[n])));
        found = found || !(seen[n] & magnitude);
        seen[n] |= magnitude;
    }
    return found;
}

int main(int count, char **words)
{
    if (count != 3) return 2;
    double seconds = atof(words[1]);
    random_state = strtoull(words[2], NULL, 10) * 0x9E3779B97F4A7C15u + 1u;
    unsigned long runs = 0, edges = 0;
    struct timespec began, now;
    clock_gettime(CLOCK_MONOTONIC, &began);
    signal(SIGABRT, die);
    signal(SIGALRM, die);
    corpus_size = 1;                                            // the empty input
    do {
        trial = corpus[draw(corpus_size)];
        for (unsigned n = 1u + draw(8); n; n--) mutate(&trial);
        memset(hits, 0, sizeof hits);
        previous = 0;
        alarm(RUN_SECONDS);
        play(&trial);
        alarm(0);
        runs++;
        if (new_ground()) corpus[corpus_size < CORPUS ? corpus_size++ : draw(CORPUS)] = trial;
        clock_gettime(CLOCK_MONOTONIC, &now);
    } while ((double)(now.tv_sec - began.tv_sec) + 1e-9 * (double)(now.tv_nsec - began.tv_nsec) < seconds);
    for (unsigned n = 0; n < EDGES; n++) edges += seen[n] != 0;
    printf("%lu %lu %u\n", runs, edges, corpus_size);
    return 0;
}
