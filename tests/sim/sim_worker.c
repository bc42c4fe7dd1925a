/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The simulated workers. As the seed determines, they compute leases at their own speed, crash, freeze, return, fail
 * leases, send wrong results and offer results without a lease. sim_correct_result defines the correct result of a
 * lease, against which sim_shell.c checks what is merged.
 */
#include "tests/sim/sim_private.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

uint64_t sim_correct_result(struct lease_key k, uint64_t state)
{
	return sim_mix(sim_mix(state ^ (k.job << 32)) ^ ((uint64_t)k.kind << 60) ^ ((uint64_t)k.group << 40) ^
		       ((uint64_t)k.part << 20) ^ k.epoch);
}

struct sim_job *sim_job_by_id(struct sim_world *w, uint64_t id)
{
	for (uint32_t i = 0; i < w->job_count; i++)
		if (w->jobs[i].submitted && w->jobs[i].id == id)
			return &w->jobs[i];
	return NULL;
}

static void post_to_core(struct sim_world *w, const struct sim_worker *k, struct event ev, uint64_t value)
{
	ev.peer = k->peer;
	sim_post_message(w, (struct sim_message){.kind = TO_CORE, .peer = k->peer, .ev = ev, .value = value});
}

static void begin_leases(struct sim_world *w, uint32_t index)
{
	struct sim_worker *k = &w->workers[index];
	if (k->is_hoarding && !sim_is_calm(w))
		return;
	while (k->busy_threads < k->threads && k->queued > 0) {
		struct sim_work work = k->queue[0];
		k->queued--;
		memmove(&k->queue[0], &k->queue[1], k->queued * sizeof k->queue[0]);
		k->busy_threads++;
		const struct sim_job *j = sim_job_by_id(w, work.key.job);
		double seconds = j->lease_seconds * k->speed * (0.8 + 0.4 * sim_uniform(w));
		sim_push_message(w, (struct sim_message){.kind = FINISH,
							 .time = fmax(w->now, k->frozen_until) + seconds,
							 .worker = index,
							 .peer = k->peer,
							 .key = work.key,
							 .value = work.state});
	}
}

void sim_finish_lease(struct sim_world *w, const struct sim_message *m)
{
	struct sim_worker *k = &w->workers[m->worker];
	if (k->peer != m->peer)
		return;
	if (k->frozen_until > w->now) {
		struct sim_message delayed = *m;
		delayed.time = k->frozen_until;
		sim_push_message(w, delayed);
		return;
	}
	k->busy_threads--;
	struct event ev = {.kind = EVENT_BATCH, .lease = {.key = m->key, .is_valid = true}, .text = "trouble"};
	if (!sim_is_calm(w) && sim_chance(w, k->failure_rate)) {
		ev.kind = EVENT_LEASE_FAILED;
		ev.lease.is_worker_at_fault = w->draw_count % 3 == 0;
		ev.lease.is_memory_full = ev.lease.is_worker_at_fault && w->draw_count % 2 == 0;
	} else if (!sim_is_calm(w) && sim_chance(w, k->invalid_rate))
		ev.lease.is_valid = false;
	else if (!sim_is_calm(w) && sim_chance(w, 0.01))
		ev.kind = EVENT_LEASE_RETURNED;
	uint64_t value = sim_correct_result(m->key, m->value);
	if (!sim_is_calm(w) && k->lie_rate > 0 && sim_chance(w, k->lie_rate))
		value ^= 1 + sim_mix(w->draw_count); /* two lies are never equal */
	post_to_core(w, k, ev, value);
	begin_leases(w, m->worker);
}

/* Sends a result without a lease, perhaps of an epoch that is not open yet; it is correct if it is still needed when
 * it arrives. */
static void send_unleased_result(struct sim_world *w, const struct sim_worker *k)
{
	const struct sim_job *j = &w->jobs[sim_uniform_below(w, w->job_count)];
	if (!j->prepared)
		return;
	struct lease_key key = {.job = j->id,
				.kind = LEASE_RENDER,
				.group = sim_uniform_below(w, j->plan.groups),
				.part = sim_uniform_below(w, j->plan.parts)};
	uint32_t slot = key.group * j->plan.parts + key.part;
	key.epoch = j->next[slot];
	uint64_t value = sim_correct_result(key, j->state[slot]);
	for (uint32_t later = sim_uniform_below(w, 3); later > 0; later--) {
		key.epoch++;
		value = sim_correct_result(key, value);
	}
	struct event ev = {.kind = EVENT_BATCH, .lease = {.key = key, .is_valid = true}};
	post_to_core(w, k, ev, value);
}

void sim_heartbeat(struct sim_world *w, const struct sim_message *m)
{
	struct sim_worker *k = &w->workers[m->worker];
	if (k->peer != m->peer)
		return;
	if (k->frozen_until <= w->now) {
		k->wanted = sim_is_calm(w) || !sim_chance(w, 0.02) ? k->threads + (k->threads > 1) : 0;
		if (k->is_hoarding && !sim_is_calm(w))
			k->wanted = HOARDED_THREADS;
		post_to_core(w, k, (struct event){.kind = EVENT_LEASE_REQUEST, .wanted_leases = k->wanted}, 0);
		if (!sim_is_calm(w) && sim_chance(w, 0.05))
			send_unleased_result(w, k);
	}
	struct sim_message next = *m;
	next.time = w->now + 7;
	sim_push_message(w, next);
}

void sim_start_worker(struct sim_world *w, uint32_t index)
{
	struct sim_worker *k = &w->workers[index];
	if (k->peer)
		return;
	k->peer = w->next_peer++;
	k->busy_threads = k->queued = 0;
	k->frozen_until = 0;
	char name[16];
	/* When the world becomes calm, new names tell the core that liars were replaced by honest workers. */
	snprintf(name, sizeof name, "%s%u", sim_is_calm(w) ? "calm" : "w", index);
	struct event ev = {.kind = EVENT_JOINED,
			   .join = {.peer = k->peer,
				    .name = name,
				    .fingerprint = k->fingerprint,
				    .threads = k->is_hoarding && !sim_is_calm(w) ? HOARDED_THREADS : k->threads}};
	sim_step(w, &ev, 0);
	sim_push_message(w, (struct sim_message){.kind = WORKER_HEARTBEAT,
						 .time = w->now + sim_uniform(w),
						 .worker = index,
						 .peer = k->peer});
	if (!sim_is_calm(w))
		sim_push_message(w, (struct sim_message){.kind = CRASH,
							 .time = w->now - 150 * log(1 - sim_uniform(w)),
							 .worker = index,
							 .peer = k->peer});
}

/* Lets a worker die, with or without notice, or freeze for a while. */
void sim_crash_worker(struct sim_world *w, const struct sim_message *m)
{
	struct sim_worker *k = &w->workers[m->worker];
	if (k->peer != m->peer || sim_is_calm(w))
		return;
	w->result.crashes++;
	if (sim_chance(w, 0.3)) {
		w->result.hangs++;
		k->frozen_until = w->now + 200 * sim_uniform(w);
		sim_push_message(w, (struct sim_message){.kind = CRASH,
							 .time = w->now + 300 * sim_uniform(w),
							 .worker = m->worker,
							 .peer = k->peer});
		return;
	}
	if (sim_chance(w, 0.7))
		post_to_core(w, k, (struct event){.kind = EVENT_LEFT}, 0);
	k->peer = 0;
	sim_push_message(
		w, (struct sim_message){.kind = START, .time = w->now + 60 * sim_uniform(w), .worker = m->worker});
}

void sim_forget_answers(struct sim_world *w)
{
	for (uint32_t i = 0; i < w->job_count; i++)
		memset(w->jobs[i].answered_by, 0, sizeof w->jobs[i].answered_by);
}

void sim_calm_down(struct sim_world *w)
{
	if (w->has_liars) /* a worker with another name may answer again */
		sim_forget_answers(w);
	for (uint32_t i = 0; i < w->worker_count; i++) {
		struct sim_worker *k = &w->workers[i];
		if (k->peer) {
			struct event ev = {.kind = EVENT_LEFT, .peer = k->peer};
			k->peer = 0;
			sim_step(w, &ev, 0);
		}
		sim_start_worker(w, i);
	}
}

void sim_receive_lease(struct sim_world *w, const struct sim_message *m)
{
	struct sim_worker *k = &w->workers[m->worker];
	if (k->peer != m->peer || k->queued == QUEUE_MAX)
		return;
	w->result.hoarded += k->is_hoarding && !sim_is_calm(w);
	k->queue[k->queued++] = (struct sim_work){m->key, m->value};
	begin_leases(w, m->worker);
}

bool sim_same_key(struct lease_key a, struct lease_key b)
{
	return a.job == b.job && a.kind == b.kind && a.group == b.group && a.part == b.part && a.epoch == b.epoch;
}

void sim_receive_revoke(struct sim_world *w, const struct sim_message *m)
{
	struct sim_worker *k = &w->workers[m->worker];
	for (uint32_t i = 0; k->peer == m->peer && i < k->queued; i++) {
		if (!sim_same_key(k->queue[i].key, m->key))
			continue;
		k->queued--;
		memmove(&k->queue[i], &k->queue[i + 1], (k->queued - i) * sizeof k->queue[0]);
		return;
	}
}
