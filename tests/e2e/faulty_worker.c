/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A worker with faults: the objects of hslt-worker, and its build id, so that the coordinator takes it for one. The
 * linker puts the __wrap_ functions below between the daemon and the functions of their names (--wrap, in the
 * Makefile). HSLT_FAULTS lists what it does wrong, separated by commas:
 *
 *   lie=N     one of N results has one wrong bit
 *   large=N   one of N results has a pixel of 1e30
 *   spoil=N   one of N results has spoiled chain states
 *   repeat    every result is sent twice
 *   crash=N   the N-th lease of a process raises SIGSEGV
 *   hang=N    the N-th lease of a process never ends
 *   slow=N    every lease takes N times as long
 *
 * Leases are counted as their threads begin them. Of N results the first, the (N+1)-th and so on are wrong.
 */
#include "common/base/clock.h"
#include "common/base/liveness.h"
#include "common/base/mem.h"
#include "common/net/conn.h"
#include "common/wire/batch_wire.h"
#include "worker/render/render.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int __real_render_lease(const struct world *w, const struct plan *p, const struct lease_key *k,
			const struct lease_input *in, const atomic_bool *stop, enum lease_outcome *end,
			struct batch *out, struct error *e);
int __wrap_render_lease(const struct world *w, const struct plan *p, const struct lease_key *k,
			const struct lease_input *in, const atomic_bool *stop, enum lease_outcome *end,
			struct batch *out, struct error *e);
int __real_batch_pack(const struct batch *b, const struct plan *p, unsigned char **frame, size_t *size,
		      struct error *e);
int __wrap_batch_pack(const struct batch *b, const struct plan *p, unsigned char **frame, size_t *size,
		      struct error *e);
void __real_conn_send_frame(struct conn *c, unsigned char *frame, size_t size);
void __wrap_conn_send_frame(struct conn *c, unsigned char *frame, size_t size);

enum fault { LIE, LARGE, SPOIL, REPEAT, CRASH, HANG, SLOW, FAULTS };

static const char *const fault_names[FAULTS] = {"lie", "large", "spoil", "repeat", "crash", "hang", "slow"};
static unsigned long fault_intervals[FAULTS]; /* 0: not this fault */
static atomic_ulong leases_begun;
static _Thread_local unsigned long lease_number; /* of this thread, counted from 1 */

static void exit_with_usage(const char *wrong)
{
	fprintf(stderr,
		"faulty_worker: HSLT_FAULTS: '%s' is none of lie=N large=N spoil=N repeat crash=N hang=N slow=N\n",
		wrong);
	_exit(2);
}

static void read_fault(const char *text)
{
	const char *equals = strchr(text, '=');
	size_t length = equals ? (size_t)(equals - text) : strlen(text);
	char *end = NULL;
	for (int i = 0; i < FAULTS; i++) {
		if (strlen(fault_names[i]) != length || strncmp(fault_names[i], text, length) != 0 ||
		    !equals != (i == REPEAT))
			continue;
		fault_intervals[i] = equals ? strtoul(equals + 1, &end, 10) : 1;
		if (fault_intervals[i] && (!end || !*end))
			return;
	}
	exit_with_usage(text);
}

/* Runs before main, which reads the options of hslt-worker. */
__attribute__((constructor)) static void read_faults(void)
{
	const char *list = getenv("HSLT_FAULTS");
	char text[256];
	if (!list || !*list || strlen(list) >= sizeof text)
		exit_with_usage(list ? list : "");
	memcpy(text, list, strlen(list) + 1);
	for (char *rest = text, *item; (item = strsep(&rest, ","));)
		read_fault(item);
}

static bool is_due(enum fault f)
{
	return fault_intervals[f] && (lease_number - 1) % fault_intervals[f] == 0;
}

static void sleep_until_stopped(double seconds, const atomic_bool *stop)
{
	for (double deadline = clock_seconds() + seconds; clock_seconds() < deadline && !atomic_load(stop);
	     liveness_tick())
		usleep(1000);
}

int __wrap_render_lease(const struct world *w, const struct plan *p, const struct lease_key *k,
			const struct lease_input *in, const atomic_bool *stop, enum lease_outcome *end,
			struct batch *out, struct error *e)
{
	lease_number = atomic_fetch_add(&leases_begun, 1) + 1;
	if (lease_number == fault_intervals[CRASH])
		raise(SIGSEGV);
	while (lease_number == fault_intervals[HANG])
		pause();
	double start = clock_seconds();
	int result = __real_render_lease(w, p, k, in, stop, end, out, e);
	if (fault_intervals[SLOW])
		sleep_until_stopped((double)(fault_intervals[SLOW] - 1) * (clock_seconds() - start), stop);
	return result;
}

static float *first_value(const struct batch *b)
{
	return b->tile_count ? b->tiles[0].xyz : b->weight_count ? b->weights : NULL;
}

/* Flips the last bit of one number: the smallest possible error. */
static void flip_lowest_bit(const struct batch *b)
{
	float *x = first_value(b);
	uint32_t bits;
	if (!x)
		return;
	memcpy(&bits, x, sizeof bits);
	bits ^= 1;
	memcpy(x, &bits, sizeof bits);
}

static uint64_t splitmix(uint64_t *state)
{
	uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
	z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
	return z ^ z >> 31;
}

enum damage { FLIP_BITS, WRITE_NUMBERS, WRITE_NOISE, CUT_OFF, ALL_NOISE };

/* Damages a state after its id, so that it still looks like that chain's. CUT_OFF and ALL_NOISE give no valid state of
 * any plan; the other kinds may give a valid state that is not the chain's, since in primary sample space a flipped bit
 * of a random number mostly gives another random number. */
static void damage_state(struct chain_state *s, enum damage kind, uint64_t *random)
{
	enum { ID_BYTES = 8, CHANGES = 8 };
	static const double numbers[] = {NAN, INFINITY, -INFINITY, 1e308, -1e308, 5e-324, 1e-310, -0.0};
	uint64_t body_size = s->size - ID_BYTES;
	for (int i = 0; i < CHANGES; i++) {
		uint8_t *byte = s->bytes + ID_BYTES + splitmix(random) % body_size;
		if (kind == FLIP_BITS)
			*byte ^= (uint8_t)(1u << splitmix(random) % 8);
		else if (kind == WRITE_NUMBERS)
			memcpy(s->bytes + ID_BYTES + splitmix(random) % (body_size / 8) * 8,
			       &numbers[splitmix(random) % 8], sizeof *numbers);
		else if (kind == WRITE_NOISE)
			*byte = (uint8_t)splitmix(random);
	}
	for (uint64_t i = 0; kind == ALL_NOISE && i < body_size; i++)
		s->bytes[ID_BYTES + i] = (uint8_t)splitmix(random);
	if (kind == CUT_OFF)
		s->size -= (uint32_t)(1 + splitmix(random) % (body_size - 1));
}

/* The first state certainly becomes invalid, so that the worker which resumes it must notice. */
static void damage_states(const struct batch *b, uint64_t random)
{
	for (uint32_t i = 0; i < b->state_count; i++) {
		uint64_t r = splitmix(&random);
		if (b->states[i].size > 2 * sizeof(double))
			damage_state(&b->states[i], (enum damage)(i == 0 ? CUT_OFF + r % 2 : r % 5), &random);
	}
}

int __wrap_batch_pack(const struct batch *b, const struct plan *p, unsigned char **frame, size_t *size, struct error *e)
{
	if (is_due(LIE))
		flip_lowest_bit(b);
	if (is_due(LARGE) && first_value(b))
		*first_value(b) = 1e30f;
	if (is_due(SPOIL))
		damage_states(b, lease_number);
	return __real_batch_pack(b, p, frame, size, e);
}

/* The worker sends only its results through this function. */
void __wrap_conn_send_frame(struct conn *c, unsigned char *frame, size_t size)
{
	unsigned char *copy = fault_intervals[REPEAT] ? mem_alloc(size, 1) : NULL;
	if (copy)
		__real_conn_send_frame(c, memcpy(copy, frame, size), size);
	__real_conn_send_frame(c, frame, size);
}
