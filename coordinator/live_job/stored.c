/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Packs the stored data of a job into messages of proto/stored.proto and unpacks it again: counters, error estimates
 * ("looks") and the head of a checkpoint. The counters come from the list of a job's fields, so a new one appears
 * here without further changes.
 *
 * Unpacking fails with -EPROTO and a sentence for bytes that are no such message, a field that this version does not
 * know, or more groups or looks than fit; or with -ENOMEM. Packing cannot fail: the sizes are bounded by
 * STORED_NOTE_MAX and STORED_HEAD_MAX, which assertions check.
 *
 * The last part reads data written by version 004.
 */
#include "coordinator/live_job/stored.h"

#include "common/base/bytes.h"
#include "common/base/text.h"
#include "coordinator/store/message.h"

#include <assert.h>
#include <string.h>

_Static_assert(sizeof(struct job_counts) / sizeof(uint64_t) * 12 <= STORED_NOTE_MAX, "a number takes at most 12 bytes");

/* The body of stored_unpack_NAME: unpacks `bytes` as the message and hands it to take_NAME. */
#define UNPACK(name, message, descriptor, out)                                                                  \
	do {                                                                                                    \
		int rc;                                                                                         \
		ProtobufCMessage *m = message_unpack(&stored__##descriptor##__descriptor, bytes, size, &rc, e); \
		if (m)                                                                                          \
			rc = take_##name((const message *)m, out, e);                                           \
		message_free(m);                                                                                \
		return rc;                                                                                      \
	} while (0)

static void fill_counts(const struct job_counts *c, Stored__Counts *m)
{
	stored__counts__init(m);
#define COUNTER(member, key, wire) m->member = c->member;
	JOB_COUNTERS(COUNTER)
#undef COUNTER
}

static int take_counts(const Stored__Counts *m, struct job_counts *c, struct error *e)
{
#define COUNTER(member, key, wire) c->member = m->member;
	JOB_COUNTERS(COUNTER)
#undef COUNTER
	return message_check_fields(&m->base, e);
}

size_t stored_pack_counts(const struct job_counts *c, unsigned char bytes[STORED_NOTE_MAX])
{
	Stored__Counts m;
	fill_counts(c, &m);
	return stored__counts__pack(&m, bytes);
}

int stored_unpack_counts(const unsigned char *bytes, size_t size, struct job_counts *c, struct error *e)
{
	UNPACK(counts, Stored__Counts, counts, c);
}

static void fill_look(const struct forecast_look *l, Stored__Look *m)
{
	stored__look__init(m);
	FORECAST_COPY_LOOK(m, l);
	m->doubtful = l->is_doubtful;
}

static int take_look(const Stored__Look *m, struct forecast_look *l, struct error *e)
{
	FORECAST_COPY_LOOK(l, m);
	l->is_doubtful = m->doubtful;
	return message_check_fields(&m->base, e);
}

size_t stored_pack_look(const struct forecast_look *l, unsigned char bytes[STORED_NOTE_MAX])
{
	Stored__Look m;
	fill_look(l, &m);
	return stored__look__pack(&m, bytes);
}

int stored_unpack_look(const unsigned char *bytes, size_t size, struct forecast_look *l, struct error *e)
{
	UNPACK(look, Stored__Look, look, l);
}

/* X(member of struct checkpoint_head, member of the message) */
#define HEAD_NUMBERS(X)                                 \
	X(job, job)                                     \
	X(generation, generation)                       \
	X(worker_count, worker_count)                   \
	X(cpu_seconds, cpu_seconds)                     \
	X(bootstrap_cpu_seconds, bootstrap_cpu_seconds) \
	X(look_written, look_written)                   \
	X(times.elapsed, elapsed)                       \
	X(times.first_round_at, opened)                 \
	X(times.last_round_end, completed)              \
	X(bootstrap_result.b_pooled, b_pooled)          \
	X(bootstrap_result.overlong_share, beyond_share)

size_t stored_pack_head(const struct checkpoint_head *h, unsigned char bytes[STORED_HEAD_MAX])
{
	Stored__CheckpointHead m;
	Stored__Counts counts;
	Stored__Look look[FORECAST_LOOKS_MAX], *looks[FORECAST_LOOKS_MAX];
	double b[PLAN_GROUPS_MAX];
	stored__checkpoint_head__init(&m);
#define X(ours, theirs) m.theirs = h->ours;
	HEAD_NUMBERS(X)
#undef X
	memcpy(b, h->bootstrap_result.b, sizeof b);
	m.b = b;
	m.n_b = PLAN_GROUPS_MAX;
	m.black = h->bootstrap_result.is_black;
	for (; m.n_looks < h->looks.count; m.n_looks++) {
		fill_look(&h->looks.looks[m.n_looks], &look[m.n_looks]);
		looks[m.n_looks] = &look[m.n_looks];
	}
	m.looks = looks;
	fill_counts(&h->counts, &counts);
	m.counts = &counts;
	m.fingerprint = text_unconst(h->fingerprint);
	assert(stored__checkpoint_head__get_packed_size(&m) <= STORED_HEAD_MAX);
	return stored__checkpoint_head__pack(&m, bytes);
}

static int take_head(const Stored__CheckpointHead *m, struct checkpoint_head *h, struct error *e)
{
	int rc = message_check_fields(&m->base, e);
	if (!rc && (m->n_b > PLAN_GROUPS_MAX || m->n_looks > FORECAST_LOOKS_MAX || !m->counts ||
		    strlen(m->fingerprint) >= sizeof h->fingerprint))
		rc = error_set(e, EPROTO, "the head of a checkpoint with %zu groups and %zu error estimates", m->n_b,
			       m->n_looks);
	if (rc)
		return rc;
	*h = (struct checkpoint_head){.bootstrap_result.is_black = m->black != 0, .looks.count = (uint32_t)m->n_looks};
#define X(ours, theirs) h->ours = m->theirs;
	HEAD_NUMBERS(X)
#undef X
	if (m->n_b)
		memcpy(h->bootstrap_result.b, m->b, m->n_b * sizeof *m->b);
	for (size_t i = 0; i < m->n_looks && !rc; i++)
		rc = take_look(m->looks[i], &h->looks.looks[i], e);
	text_copy(h->fingerprint, sizeof h->fingerprint, m->fingerprint);
	return rc ? rc : take_counts(m->counts, &h->counts, e);
}

int stored_unpack_head(const unsigned char *bytes, size_t size, struct checkpoint_head *h, struct error *e)
{
	UNPACK(head, Stored__CheckpointHead, checkpoint_head, h);
}

enum { OLD_GROUPS = 64, OLD_LOOKS = 64, OLD_LOOK_SIZE = 56, OLD_COUNTS_SIZE = 64, OLD_FINGERPRINT_SIZE = 256 };
enum {
	LOOKS_OFFSET = 608,
	COUNTS_OFFSET = LOOKS_OFFSET + OLD_LOOKS * OLD_LOOK_SIZE,
	FINGERPRINT_OFFSET = COUNTS_OFFSET + OLD_COUNTS_SIZE
};

_Static_assert(FINGERPRINT_OFFSET + OLD_FINGERPRINT_SIZE == STORED_OLD_HEAD_SIZE, "what lies on disks does not change");
_Static_assert(OLD_GROUPS <= (int)PLAN_GROUPS_MAX && OLD_LOOKS <= (int)FORECAST_LOOKS_MAX,
	       "all of an old head is taken");

static struct forecast_look unpack_old_look(const unsigned char *p)
{
	return (struct forecast_look){get_double(p),	  get_double(p + 8),  get_double(p + 16), get_double(p + 24),
				      get_double(p + 32), get_double(p + 40), get64(p + 48)};
}

static struct job_counts unpack_old_counts(const unsigned char *p)
{
	return (struct job_counts){.repeats = get64(p),
				   .refused = get64(p + 8),
				   .faults = get64(p + 16),
				   .failures = get64(p + 24),
				   .timeouts = get64(p + 32),
				   .duplicates = get64(p + 40),
				   .verified = get64(p + 48),
				   .mismatched = get64(p + 56)};
}

int stored_unpack_old_look(const unsigned char *bytes, size_t size, struct forecast_look *l, struct error *e)
{
	if (size != OLD_LOOK_SIZE)
		return error_set(e, EPROTO, "a look of %zu bytes", size);
	*l = unpack_old_look(bytes);
	return 0;
}

int stored_unpack_old_counts(const unsigned char *bytes, size_t size, struct job_counts *c, struct error *e)
{
	if (size != OLD_COUNTS_SIZE)
		return error_set(e, EPROTO, "counters of %zu bytes", size);
	*c = unpack_old_counts(bytes);
	return 0;
}

void stored_unpack_old_head(const unsigned char bytes[STORED_OLD_HEAD_SIZE], uint32_t worker_count,
			    struct checkpoint_head *h)
{
	char fingerprint[OLD_FINGERPRINT_SIZE];
	uint32_t looks = get32(bytes + 600);
	*h = (struct checkpoint_head){.job = get64(bytes),
				      .generation = get64(bytes + 8),
				      .worker_count = worker_count,
				      .cpu_seconds = get_double(bytes + 16),
				      .bootstrap_cpu_seconds = get_double(bytes + 24),
				      .look_written = get_double(bytes + 32),
				      .times = {get_double(bytes + 40), get_double(bytes + 48), get_double(bytes + 56)},
				      .bootstrap_result = {.b_pooled = get_double(bytes + 576),
							   .overlong_share = get_double(bytes + 584),
							   .is_black = bytes[592] != 0},
				      .counts = unpack_old_counts(bytes + COUNTS_OFFSET)};
	copy_numbers(h->bootstrap_result.b, bytes + 64, sizeof *h->bootstrap_result.b, OLD_GROUPS);
	for (; h->looks.count < looks && h->looks.count < OLD_LOOKS; h->looks.count++)
		h->looks.looks[h->looks.count] = unpack_old_look(bytes + LOOKS_OFFSET + OLD_LOOK_SIZE * h->looks.count);
	memcpy(fingerprint, bytes + FINGERPRINT_OFFSET, sizeof fingerprint);
	fingerprint[sizeof fingerprint - 1] = 0;
	text_copy(h->fingerprint, sizeof h->fingerprint, fingerprint);
}
