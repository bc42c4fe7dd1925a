#include "tests/sim/sim_world.h"

#include "common/base/mem.h"
#include "coordinator/core/farm.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

enum { WORKERS = 8, JOBS = 5, SLOTS = 12, ROUNDS = 512, QUEUE = 64, MESSAGES = 1 << 14, STEPS_MOST = 400000 };

enum message_kind { TO_CORE, TICK, SUBMIT, LEASE, REVOKE, FINISH, BEAT, CRASH, START, CALM, RESTART };

struct message {
	double time;
	uint64_t order;
	enum message_kind kind;
	uint32_t worker;
	uint64_t peer;
	struct event ev;    /* TO_CORE */
	struct lease_key key;
	uint64_t value;     /* chain state: in for LEASE, out for a batch */
};

struct work {
	struct lease_key key;
	uint64_t state;
};

struct worker {
	uint64_t peer; /* 0: down */
	uint32_t threads, busy, queued, want;
	double speed, frozen_until;
	double fault_rate, failure_rate, lie_rate;
	const char *fingerprint;
	struct work queue[QUEUE];
};

struct sim_job {
	struct plan plan;
	uint64_t id;
	int priority;
	bool mixed, submitted, over, prepared;
	double verify;
	uint32_t answered[SLOTS]; /* whose answers are noted, by worker */
	double cancel_at, lease_time, error_scale;
	uint64_t next[SLOTS], state[SLOTS], boot;
	uint64_t round_sum[ROUNDS];
	uint64_t rounds; /* complete, counted here */
	double completed; /* s after its first lease: the last complete round */
	char fingerprint[2]; /* of those whose work is merged */
	double progress;
};

struct world {
	uint64_t seed, draws, order, next_peer;
	int trace;
	double now, calm, tick_at;
	double drop, repeat, delay, failure;
	double verify; /* of every job */
	bool liars; /* then every result is verified, and all are of one fingerprint */
	struct farm *farm;
	struct farm_config config;
	struct message *heap;
	size_t heap_count;
	uint32_t worker_count, job_count;
	struct worker workers[WORKERS];
	struct sim_job jobs[JOBS];
	struct sim_result result;
	char wrong[256];
};

static uint64_t mix(uint64_t x)
{
	x += UINT64_C(0x9e3779b97f4a7c15);
	x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
	x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
	return x ^ (x >> 31);
}

static double uniform(struct world *w)
{
	return (double)(mix(w->seed * UINT64_C(0x100000001b3) + w->draws++) >> 11) * 0x1p-53;
}

static uint32_t below(struct world *w, uint32_t n)
{
	return (uint32_t)(uniform(w) * n);
}

static bool chance(struct world *w, double p)
{
	return uniform(w) < p;
}

__attribute__((format(printf, 2, 3))) static void wrong(struct world *w, const char *format, ...)
{
	if (*w->wrong)
		return;
	va_list ap;
	va_start(ap, format);
	vsnprintf(w->wrong, sizeof w->wrong, format, ap);
	va_end(ap);
}

/* ---- what happens when */

static bool earlier(const struct message *a, const struct message *b)
{
	return a->time < b->time || (!(b->time < a->time) && a->order < b->order);
}

static void push(struct world *w, struct message m)
{
	if (w->heap_count == MESSAGES) {
		wrong(w, "too many messages under way");
		return;
	}
	m.order = w->order++;
	size_t i = w->heap_count++;
	for (; i > 0 && earlier(&m, &w->heap[(i - 1) / 2]); i = (i - 1) / 2)
		w->heap[i] = w->heap[(i - 1) / 2];
	w->heap[i] = m;
}

static struct message pop(struct world *w)
{
	struct message first = w->heap[0], last = w->heap[--w->heap_count];
	size_t i = 0;
	for (;;) {
		size_t k = 2 * i + 1;
		if (k >= w->heap_count)
			break;
		if (k + 1 < w->heap_count && earlier(&w->heap[k + 1], &w->heap[k]))
			k++;
		if (!earlier(&w->heap[k], &last))
			break;
		w->heap[i] = w->heap[k];
		i = k;
	}
	w->heap[i] = last;
	return first;
}

static bool is_calm(const struct world *w)
{
	return w->now >= w->calm;
}

/* Over the network: late, twice or never while there is trouble. */
static void post(struct world *w, struct message m)
{
	bool calm = is_calm(w);
	if (!calm && chance(w, w->drop))
		return;
	int copies = !calm && chance(w, w->repeat) ? 2 : 1;
	for (int i = 0; i < copies; i++) {
		m.time = w->now + 0.001 + (calm ? 0.01 : w->delay * uniform(w) * uniform(w));
		if (!calm && chance(w, 0.01))
			m.time += 200 * uniform(w);
		push(w, m);
	}
}

/* ---- the workers */

static uint64_t result_of(struct lease_key k, uint64_t state)
{
	return mix(mix(state ^ (k.job << 32)) ^ ((uint64_t)k.kind << 60) ^ ((uint64_t)k.group << 40) ^
		   ((uint64_t)k.part << 20) ^ k.epoch);
}

static struct sim_job *job_by_id(struct world *w, uint64_t id)
{
	for (uint32_t i = 0; i < w->job_count; i++)
		if (w->jobs[i].submitted && w->jobs[i].id == id)
			return &w->jobs[i];
	return NULL;
}

static void tell_core(struct world *w, const struct worker *k, struct event ev, uint64_t value)
{
	ev.peer = k->peer;
	post(w, (struct message){ .kind = TO_CORE, .peer = k->peer, .ev = ev, .value = value });
}

static void work_on(struct world *w, uint32_t index)
{
	struct worker *k = &w->workers[index];
	while (k->busy < k->threads && k->queued > 0) {
		struct work work = k->queue[0];
		k->queued--;
		memmove(&k->queue[0], &k->queue[1], k->queued * sizeof k->queue[0]);
		k->busy++;
		const struct sim_job *j = job_by_id(w, work.key.job);
		double seconds = j->lease_time * k->speed * (0.8 + 0.4 * uniform(w));
		push(w, (struct message){ .kind = FINISH, .time = fmax(w->now, k->frozen_until) + seconds, .worker = index,
					  .peer = k->peer, .key = work.key, .value = work.state });
	}
}

static void finish(struct world *w, const struct message *m)
{
	struct worker *k = &w->workers[m->worker];
	if (k->peer != m->peer)
		return;
	if (k->frozen_until > w->now) {
		struct message later = *m;
		later.time = k->frozen_until;
		push(w, later);
		return;
	}
	k->busy--;
	struct event ev = { .kind = EVENT_BATCH, .lease = { .key = m->key, .valid = true }, .text = "trouble" };
	if (!is_calm(w) && chance(w, k->failure_rate))
		ev.kind = EVENT_LEASE_FAILED;
	else if (!is_calm(w) && chance(w, k->fault_rate))
		ev.lease.valid = false;
	else if (!is_calm(w) && chance(w, 0.01))
		ev.kind = EVENT_LEASE_RETURNED;
	uint64_t value = result_of(m->key, m->value);
	if (!is_calm(w) && k->lie_rate > 0 && chance(w, k->lie_rate))
		value ^= 1 + mix(w->draws); /* no two lies are alike */
	tell_core(w, k, ev, value);
	work_on(w, m->worker);
}

/* An answer that nobody asked for, perhaps of an epoch that is not open, and right should it come when it is. */
static void volunteer(struct world *w, const struct worker *k)
{
	const struct sim_job *j = &w->jobs[below(w, w->job_count)];
	if (!j->prepared)
		return;
	struct lease_key key = { .job = j->id, .kind = LEASE_RENDER, .group = below(w, j->plan.groups),
				 .part = below(w, j->plan.parts) };
	uint32_t slot = key.group * j->plan.parts + key.part;
	key.epoch = j->next[slot];
	uint64_t value = result_of(key, j->state[slot]);
	for (uint32_t later = below(w, 3); later > 0; later--) {
		key.epoch++;
		value = result_of(key, value);
	}
	struct event ev = { .kind = EVENT_BATCH, .lease = { .key = key, .valid = true } };
	tell_core(w, k, ev, value);
}

static void beat(struct world *w, const struct message *m)
{
	struct worker *k = &w->workers[m->worker];
	if (k->peer != m->peer)
		return;
	if (k->frozen_until <= w->now) {
		k->want = is_calm(w) || !chance(w, 0.02) ? k->threads + (k->threads > 1) : 0;
		tell_core(w, k, (struct event){ .kind = EVENT_REQUEST, .want = k->want }, 0);
		if (!is_calm(w) && chance(w, 0.05))
			volunteer(w, k);
	}
	struct message next = *m;
	next.time = w->now + 7;
	push(w, next);
}

static void step(struct world *w, struct event *ev, uint64_t value);

static void start(struct world *w, uint32_t index)
{
	struct worker *k = &w->workers[index];
	if (k->peer)
		return;
	k->peer = w->next_peer++;
	k->busy = k->queued = 0;
	k->frozen_until = 0;
	char name[16];
	snprintf(name, sizeof name, "w%u", index);
	struct event ev = { .kind = EVENT_JOINED,
			    .join = { .peer = k->peer, .name = name, .fingerprint = k->fingerprint, .threads = k->threads } };
	step(w, &ev, 0);
	push(w, (struct message){ .kind = BEAT, .time = w->now + uniform(w), .worker = index, .peer = k->peer });
	if (!is_calm(w))
		push(w, (struct message){ .kind = CRASH, .time = w->now - 150 * log(1 - uniform(w)), .worker = index,
					  .peer = k->peer });
}

/* Dies with or without a word, or stands still for a while. */
static void crash(struct world *w, const struct message *m)
{
	struct worker *k = &w->workers[m->worker];
	if (k->peer != m->peer || is_calm(w))
		return;
	w->result.crashes++;
	if (chance(w, 0.3)) {
		k->frozen_until = w->now + 200 * uniform(w);
		push(w, (struct message){ .kind = CRASH, .time = w->now + 300 * uniform(w), .worker = m->worker, .peer = k->peer });
		return;
	}
	if (chance(w, 0.7))
		tell_core(w, k, (struct event){ .kind = EVENT_LEFT }, 0);
	k->peer = 0;
	push(w, (struct message){ .kind = START, .time = w->now + 60 * uniform(w), .worker = m->worker });
}

static void forget_answers(struct world *w)
{
	for (uint32_t i = 0; i < w->job_count; i++)
		memset(w->jobs[i].answered, 0, sizeof w->jobs[i].answered);
}

static void calm_down(struct world *w)
{
	if (w->liars) /* who is forgiven may answer again */
		forget_answers(w);
	for (uint32_t i = 0; i < w->worker_count; i++) {
		struct worker *k = &w->workers[i];
		char name[16];
		snprintf(name, sizeof name, "w%u", i);
		struct event forgive = { .kind = EVENT_FORGIVE, .text = name };
		step(w, &forgive, 0);
		if (k->peer) {
			struct event ev = { .kind = EVENT_LEFT, .peer = k->peer };
			k->peer = 0;
			step(w, &ev, 0);
		}
		start(w, i);
	}
}

static void receive_lease(struct world *w, const struct message *m)
{
	struct worker *k = &w->workers[m->worker];
	if (k->peer != m->peer || k->queued == QUEUE)
		return;
	k->queue[k->queued++] = (struct work){ m->key, m->value };
	work_on(w, m->worker);
}

static bool same_key(struct lease_key a, struct lease_key b)
{
	return a.job == b.job && a.kind == b.kind && a.group == b.group && a.part == b.part && a.epoch == b.epoch;
}

static void receive_revoke(struct world *w, const struct message *m)
{
	struct worker *k = &w->workers[m->worker];
	for (uint32_t i = 0; k->peer == m->peer && i < k->queued; i++) {
		if (!same_key(k->queue[i].key, m->key))
			continue;
		k->queued--;
		memmove(&k->queue[i], &k->queue[i + 1], (k->queued - i) * sizeof k->queue[0]);
		return;
	}
}

/* ---- the shell around the core */

static struct worker *worker_of(struct world *w, uint64_t peer, uint32_t *index)
{
	for (*index = 0; *index < w->worker_count; ++*index)
		if (w->workers[*index].peer == peer)
			return &w->workers[*index];
	return NULL;
}

static uint32_t slot_of(const struct sim_job *j, struct lease_key k)
{
	return k.group * j->plan.parts + k.part;
}

static void check_holders(struct world *w, struct lease_key key)
{
	int holders = 0;
	struct lease_status s;
	for (uint64_t p = farm_next_peer(w->farm, 0); p; p = farm_next_peer(w->farm, p))
		for (uint32_t i = 0; farm_lease(w->farm, p, i, &s); i++)
			holders += !s.overdue && same_key(s.key, key);
	if (holders > 2)
		wrong(w, "%d workers hold one lease", holders);
}

static void send_lease(struct world *w, const struct action *a)
{
	struct sim_job *j = job_by_id(w, a->job);
	struct peer_status p;
	uint32_t slot = j ? slot_of(j, a->key) : 0, index;
	if (!j || j->over || !farm_peer(w->farm, a->peer, &p)) {
		wrong(w, "a lease of an ended job or to an unknown worker");
		return;
	}
	if (p.state != PEER_ACTIVE)
		wrong(w, "a lease for a worker that is silent or set aside");
	if (!j->mixed && *j->fingerprint && strcmp(j->fingerprint, p.fingerprint) != 0)
		wrong(w, "a lease of j%" PRIu64 " for a worker of fingerprint %s", a->job, p.fingerprint);
	if (a->key.kind == LEASE_RENDER && (!j->prepared || a->key.epoch != j->next[slot] || a->key.epoch > j->rounds + 1))
		wrong(w, "epoch %" PRIu64 " was handed out too early or too late", a->key.epoch);
	check_holders(w, a->key);
	if (worker_of(w, a->peer, &index) && w->liars && j->answered[slot] >> index & 1)
		wrong(w, "w%u gets a lease of which its answer is noted", index);
	if (worker_of(w, a->peer, &index))
		post(w, (struct message){ .kind = LEASE, .worker = index, .peer = a->peer, .key = a->key, .value = j->state[slot] });
}

static void merge(struct world *w, const struct action *a, uint64_t value)
{
	struct sim_job *j = job_by_id(w, a->job);
	struct peer_status p;
	w->result.merged++;
	if (!j || j->over || !farm_peer(w->farm, a->peer, &p)) {
		wrong(w, "a batch of an ended job or of an unknown worker is merged");
		return;
	}
	if (!j->mixed && *j->fingerprint && strcmp(j->fingerprint, p.fingerprint) != 0)
		wrong(w, "batches of two fingerprints are merged");
	snprintf(j->fingerprint, sizeof j->fingerprint, "%s", p.fingerprint);
	uint32_t slot = slot_of(j, a->key);
	if (value != result_of(a->key, j->state[slot]))
		wrong(w, "a wrong result is merged, verified: %d", (int)a->verified);
	if (a->verified != (j->verify >= 1) && (j->verify >= 1 || j->verify <= 0))
		wrong(w, "verified with a share of %g: %d", j->verify, (int)a->verified);
	j->answered[slot] = 0;
	if (a->key.kind == LEASE_BOOTSTRAP) {
		if (j->boot & 1u << slot)
			wrong(w, "a bootstrap batch is merged twice");
		j->boot |= 1u << slot;
		j->state[slot] = value;
		return;
	}
	if (a->key.epoch != j->next[slot] || !j->prepared)
		wrong(w, "epoch %" PRIu64 " is merged where %" PRIu64 " is next", a->key.epoch, j->next[slot]);
	if (a->key.epoch > j->rounds + 1 || a->key.epoch >= ROUNDS) {
		wrong(w, "more than two rounds are open");
		return;
	}
	j->next[slot]++;
	j->state[slot] = value;
	j->round_sum[a->key.epoch] += value;
	uint64_t least = UINT64_MAX;
	for (uint32_t i = 0; i < j->plan.groups * j->plan.parts; i++)
		least = j->next[i] < least ? j->next[i] : least;
	j->rounds = least;
}

static double error_after(const struct sim_job *j, uint64_t rounds)
{
	return j->error_scale / sqrt((double)rounds);
}

static uint64_t undisturbed_rounds(const struct sim_job *j)
{
	if (j->plan.target_error > 0)
		for (uint64_t r = 1; r < j->plan.rounds; r += r < 4 ? 1 : r / 4) /* the ladder, written down once more */
			if (error_after(j, r) <= j->plan.target_error)
				return r;
	return j->plan.rounds;
}

static uint64_t undisturbed_sum(const struct sim_job *j, uint64_t rounds)
{
	uint64_t sum = 0;
	for (uint32_t i = 0; i < j->plan.groups * j->plan.parts; i++) {
		struct lease_key k = { j->id, LEASE_BOOTSTRAP, i / j->plan.parts, i % j->plan.parts, 0 };
		uint64_t state = result_of(k, 0);
		k.kind = LEASE_RENDER;
		for (k.epoch = 0; k.epoch < rounds; k.epoch++) {
			state = result_of(k, state);
			sum += state;
		}
	}
	return sum;
}

static void ended(struct world *w, const struct action *a, struct sim_job *j)
{
	if (j->over)
		wrong(w, "j%" PRIu64 " ended twice", a->job);
	j->over = true;
	w->result.done += a->state == JOB_DONE;
	w->result.failed += a->state == JOB_FAILED;
	w->result.cancelled += a->state == JOB_CANCELLED;
	struct job_status s;
	if (!farm_job(w->farm, a->job, w->now, &s)) {
		wrong(w, "an ended job is forgotten");
		return;
	}
	w->result.copies += s.duplicates;
	w->result.timeouts += s.timeouts;
	w->result.repeats += s.repeats;
	w->result.refused += s.refused;
	w->result.verified += s.verified;
	w->result.mismatched += s.mismatched;
	if (a->state != JOB_DONE)
		return;
	if (s.rounds != j->rounds)
		wrong(w, "the core counts %" PRIu64 " rounds, the canvas %" PRIu64, s.rounds, j->rounds);
	if (a->end != END_TIME && j->rounds != undisturbed_rounds(j))
		wrong(w, "ended after %" PRIu64 " rounds, undisturbed %" PRIu64, j->rounds, undisturbed_rounds(j));
	uint64_t sum = 0;
	for (uint64_t r = 0; r < j->rounds; r++)
		sum += j->round_sum[r];
	if (sum != undisturbed_sum(j, j->rounds))
		wrong(w, "j%" PRIu64 " has another sum than undisturbed", a->job);
}

static void evaluate(struct world *w, const struct action *a, const struct sim_job *j)
{
	if (a->rounds != j->rounds)
		wrong(w, "asked for the error after %" PRIu64 " rounds of %" PRIu64, a->rounds, j->rounds);
	struct event ev = { .kind = EVENT_ERROR_KNOWN,
			    .error_known = { .job = a->job, .rounds = a->rounds, .rel_error = error_after(j, a->rounds) } };
	push(w, (struct message){ .kind = TO_CORE, .time = w->now + 3 * uniform(w), .ev = ev });
}

static void prepare(struct world *w, const struct action *a, struct sim_job *j)
{
	if (j->boot != (1u << (j->plan.groups * j->plan.parts)) - 1)
		wrong(w, "the bootstrap is not complete");
	j->prepared = true;
	struct event ev = { .kind = EVENT_PREPARED, .prepared = { .job = a->job, .ok = true } };
	push(w, (struct message){ .kind = TO_CORE, .time = w->now + 3 * uniform(w), .ev = ev });
}

static void trace_action(const struct world *w, const struct action *a)
{
	printf("[%.3f]   action %d peer %" PRIu64 " j%" PRIu64 " kind %d g%u p%u e%" PRIu64 " rounds %" PRIu64 " ack %d state %d %s\n",
	       w->now, (int)a->kind, a->peer, a->job, (int)a->key.kind, a->key.group, a->key.part, a->key.epoch, a->rounds,
	       (int)a->ack, (int)a->state, a->text);
}

static void act(struct world *w, const struct action *a, uint64_t value)
{
	struct sim_job *j = job_by_id(w, a->job);
	uint32_t index;
	if (w->trace)
		trace_action(w, a);
	switch (a->kind) {
	case ACTION_SEND_LEASE: send_lease(w, a); break;
	case ACTION_REVOKE:
		if (worker_of(w, a->peer, &index))
			post(w, (struct message){ .kind = REVOKE, .worker = index, .peer = a->peer, .key = a->key });
		break;
	case ACTION_MERGE: merge(w, a, value); break;
	case ACTION_ACK:
		if (a->ack == ACK_NOTED && worker_of(w, a->peer, &index))
			j->answered[slot_of(j, a->key)] |= 1u << index;
		break;
	case ACTION_WRONG: w->result.lies++; break;
	case ACTION_ASIDE: w->result.aside++; break;
	case ACTION_BOOTSTRAP_DONE: prepare(w, a, j); break;
	case ACTION_EVALUATE_ERROR: evaluate(w, a, j); break;
	case ACTION_ROUND_DONE:
		j->completed = farm_elapsed(w->farm, a->job, w->now);
		if (a->rounds != j->rounds)
			wrong(w, "round %" PRIu64 " said to be complete, %" PRIu64 " are", a->rounds, j->rounds);
		break;
	case ACTION_JOB_CHANGED:
		if (job_state_is_end(a->state))
			ended(w, a, j);
		break;
	case ACTION_CLOSE_PEER:
		if (worker_of(w, a->peer, &index)) {
			w->workers[index].peer = 0;
			push(w, (struct message){ .kind = START, .time = w->now + 1, .worker = index });
		}
		break;
	default: break;
	}
}

static void check_progress(struct world *w)
{
	for (uint32_t i = 0; i < w->job_count; i++) {
		struct sim_job *j = &w->jobs[i];
		struct job_status s;
		if (!j->submitted || !farm_job(w->farm, j->id, w->now, &s))
			continue;
		if (!(s.progress >= j->progress && s.progress <= 1))
			wrong(w, "progress of j%" PRIu64 " goes from %g to %g", j->id, j->progress, s.progress);
		j->progress = s.progress;
	}
}

static void step(struct world *w, struct event *ev, uint64_t value)
{
	struct update u;
	ev->time = w->now;
	if (ev->kind == EVENT_BATCH)
		memcpy(&ev->lease.digest, &value, sizeof value);
	if (w->trace)
		printf("[%.3f] event %d peer %" PRIu64 "\n", w->now, (int)ev->kind, ev->peer);
	farm_step(w->farm, ev, &u);
	w->result.steps++;
	if (ev->kind == EVENT_SUBMIT && u.count && u.actions[0].kind == ACTION_SUBMITTED) {
		w->jobs[ev->tag].id = u.actions[0].job;
		w->jobs[ev->tag].submitted = true;
	}
	for (size_t i = 0; i < u.count && !*w->wrong; i++)
		act(w, &u.actions[i], value);
	check_progress(w);
	if (u.wake < w->tick_at || w->tick_at <= w->now) {
		w->tick_at = u.wake;
		if (isfinite(u.wake))
			push(w, (struct message){ .kind = TICK, .time = fmax(u.wake, w->now) });
	}
}

/* ---- the coordinator dies and comes back */

static void restore(struct world *w, struct sim_job *j, double elapsed)
{
	static const struct forecast_history no_looks;
	uint32_t slots = j->plan.groups * j->plan.parts;
	uint64_t next[SLOTS];
	bool render = j->boot == (1u << slots) - 1;
	for (uint32_t i = 0; i < slots; i++)
		next[i] = render ? j->next[i] : j->boot >> i & 1;
	j->prepared = render;
	j->progress = 0; /* looks at the error are not remembered here */
	struct event ev = { .kind = EVENT_RESTORE,
			    .restore = { .job = j->id,
					 .submit = { .plan = &j->plan, .name = "sim", .priority = j->priority, .mixed = j->mixed, .verify = j->verify },
					 .fingerprint = j->mixed ? "" : j->fingerprint,
					 .kind = render ? LEASE_RENDER : LEASE_BOOTSTRAP,
					 .next = next,
					 .elapsed = elapsed,
					 .opened = elapsed,
					 .completed = j->completed,
					 .looks = &no_looks } };
	step(w, &ev, 0);
}

/* Only what is merged is remembered. What was under way to the old one comes to the new one, from peers that it does not know. */
static void restart(struct world *w)
{
	double elapsed[JOBS];
	struct farm *old = w->farm;
	struct error e;
	w->result.restarts++;
	forget_answers(w);
	for (uint32_t i = 0; i < w->job_count; i++)
		elapsed[i] = w->jobs[i].submitted ? farm_elapsed(old, w->jobs[i].id, w->now) : NAN;
	for (uint32_t i = 0; i < w->job_count; i++)
		if (w->jobs[i].submitted && w->jobs[i].id >= w->config.first_job)
			w->config.first_job = w->jobs[i].id + 1;
	if (farm_new(&w->farm, &w->config, &e) < 0) {
		wrong(w, "no memory for another farm");
		return;
	}
	farm_free(old);
	w->tick_at = INFINITY;
	for (uint64_t id = 1; id < w->config.first_job; id++)
		for (uint32_t i = 0; i < w->job_count; i++)
			if (w->jobs[i].submitted && !w->jobs[i].over && w->jobs[i].id == id)
				restore(w, &w->jobs[i], elapsed[i]);
	for (uint32_t i = 0; i < w->worker_count; i++) {
		if (w->workers[i].peer)
			push(w, (struct message){ .kind = START, .time = w->now + 20 * uniform(w), .worker = i });
		w->workers[i].peer = 0;
	}
}

/* ---- the seed's world */

static void plan_job(struct world *w, struct sim_job *j)
{
	struct plan *p = &j->plan;
	*p = (struct plan){ .kind = PLAN_CHAINS, .groups = 1 + below(w, 4), .parts = 1 + below(w, 3), .epoch = 100,
			    .rounds = 1 + below(w, 12) };
	p->chains = p->groups * p->parts;
	p->bootstrap = 1000 * (uint64_t)p->chains;
	j->error_scale = 1;
	j->lease_time = 0.1 + 40 * uniform(w) * uniform(w) * uniform(w);
	j->priority = (int)below(w, 3) - 1;
	j->mixed = chance(w, 0.3);
	j->cancel_at = chance(w, 0.15) ? 600 * uniform(w) : -1;
	if (chance(w, 0.3)) {
		p->target_error = 0.25 + 0.5 * uniform(w);
		if (chance(w, 0.5))
			p->rounds = UINT64_MAX;
	}
	if (chance(w, 0.2))
		p->seconds = j->lease_time * 20 * uniform(w);
}

/* Two honest workers of one fingerprint at least, or a job could not end; one or two that are not. */
static void distrust(struct world *w)
{
	for (uint32_t i = 0; i < w->worker_count; i++) {
		if (w->liars || w->verify < 1 || i < 2)
			w->workers[i].fingerprint = "A";
		if (w->liars && i < 2 && (i == 0 || chance(w, 0.5)))
			w->workers[i].lie_rate = chance(w, 0.5) ? 1 : uniform(w);
	}
}

static void make_world(struct world *w)
{
	w->calm = 2000;
	w->tick_at = INFINITY;
	w->next_peer = 1;
	w->drop = chance(w, 0.5) ? 0.1 * uniform(w) : 0;
	w->repeat = chance(w, 0.5) ? 0.3 * uniform(w) : 0;
	w->delay = chance(w, 0.5) ? 10 * uniform(w) : 0.1;
	w->failure = chance(w, 0.3) ? 0.3 * uniform(w) : 0;
	w->worker_count = 1 + below(w, WORKERS);
	w->job_count = 1 + below(w, JOBS);
	w->verify = chance(w, 0.4) ? chance(w, 0.5) ? 1 : uniform(w) : 0;
	w->liars = w->verify >= 1 && chance(w, 0.6);
	uint32_t least = w->liars ? 4 : w->verify > 0 ? 2 : 1;
	if (w->worker_count < least)
		w->worker_count = least;
	for (uint32_t i = 0; i < w->worker_count; i++) {
		struct worker *k = &w->workers[i];
		k->threads = 1 + below(w, 4);
		k->speed = chance(w, 0.2) ? 12 : 0.5 + uniform(w);
		k->fingerprint = chance(w, 0.2) ? "B" : "A";
		k->failure_rate = w->failure;
		k->fault_rate = chance(w, 0.1) ? 0.5 : 0;
		push(w, (struct message){ .kind = START, .time = i ? 300 * uniform(w) * uniform(w) : 0, .worker = i });
	}
	for (uint32_t i = 0; i < w->job_count; i++) {
		plan_job(w, &w->jobs[i]);
		w->jobs[i].verify = w->verify;
		w->jobs[i].mixed = w->jobs[i].mixed && w->verify == 0;
		push(w, (struct message){ .kind = SUBMIT, .time = i ? 300 * uniform(w) : 0, .worker = i });
	}
	if (w->verify > 0)
		distrust(w);
	push(w, (struct message){ .kind = CALM, .time = w->calm });
	for (uint32_t i = chance(w, 0.5) ? 1 + below(w, 4) : 0; i > 0; i--)
		push(w, (struct message){ .kind = RESTART, .time = 600 * uniform(w) * uniform(w) });
}

static void submit(struct world *w, uint32_t index)
{
	struct sim_job *j = &w->jobs[index];
	struct event ev = { .kind = EVENT_SUBMIT, .tag = index,
			    .submit = { .plan = &j->plan, .name = "sim", .priority = j->priority, .mixed = j->mixed, .verify = j->verify } };
	step(w, &ev, 0);
	if (!j->submitted)
		wrong(w, "a job is refused");
	if (j->cancel_at >= 0) {
		struct event cancel = { .kind = EVENT_CANCEL, .job = j->id };
		push(w, (struct message){ .kind = TO_CORE, .time = w->now + j->cancel_at, .ev = cancel });
	}
}

static void happen(struct world *w, struct message *m)
{
	switch (m->kind) {
	case TO_CORE: step(w, &m->ev, m->value); break;
	case TICK:
		if (m->time >= w->tick_at)
			step(w, &(struct event){ .kind = EVENT_TICK }, 0);
		break;
	case SUBMIT: submit(w, m->worker); break;
	case LEASE: receive_lease(w, m); break;
	case REVOKE: receive_revoke(w, m); break;
	case FINISH: finish(w, m); break;
	case BEAT: beat(w, m); break;
	case CRASH: crash(w, m); break;
	case START: start(w, m->worker); break;
	case CALM: calm_down(w); break;
	case RESTART: restart(w); break;
	}
}

static bool all_over(const struct world *w)
{
	for (uint32_t i = 0; i < w->job_count; i++)
		if (!w->jobs[i].over)
			return false;
	return true;
}

const char *sim_run(uint64_t seed, int trace, struct sim_result *r)
{
	static struct world world;
	struct world *w = &world;
	*w = (struct world){ .seed = seed, .trace = trace };
	struct error e;
	farm_config_init(&w->config);
	w->config.max_peers = 4 * WORKERS;
	w->config.max_jobs = JOBS;
	w->heap = mem_alloc(MESSAGES, sizeof *w->heap);
	if (!w->heap || farm_new(&w->farm, &w->config, &e) < 0) {
		mem_free(w->heap);
		return "no memory for the world";
	}
	make_world(w);
	while (!*w->wrong && !all_over(w)) {
		if (!w->heap_count || w->result.steps > STEPS_MOST || w->now > 1e7) {
			wrong(w, "after %g s a job has not ended", w->now);
			break;
		}
		struct message m = pop(w);
		w->now = m.time;
		happen(w, &m);
	}
	w->result.time = w->now;
	farm_free(w->farm);
	mem_free(w->heap);
	*r = w->result;
	return *w->wrong ? w->wrong : NULL;
}
