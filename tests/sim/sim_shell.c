/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The simulation's shell: carries out the core's actions on simulated workers, disks and clocks, as coordinator/jobs
 * does in the real program. After each event it checks the invariants: no lease is held by more than two workers or
 * given to a worker that must not have one, no round or sum of a job differs from that of an undisturbed run, and a
 * waiting job states a reason.
 */
#include "tests/sim/sim_private.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static struct sim_worker *find_worker(struct sim_world *w, uint64_t peer, uint32_t *index)
{
	for (*index = 0; *index < w->worker_count; ++*index)
		if (w->workers[*index].peer == peer)
			return &w->workers[*index];
	return NULL;
}

static uint32_t slot_index(const struct sim_job *j, struct lease_key k)
{
	return k.group * j->plan.parts + k.part;
}

static void check_holders(struct sim_world *w, struct lease_key key)
{
	int holders = 0;
	struct lease_status s;
	for (uint64_t p = farm_next_peer(w->farm, 0); p; p = farm_next_peer(w->farm, p))
		for (uint32_t i = 0; farm_lease_status(w->farm, p, i, &s); i++)
			holders += !s.is_overdue && sim_same_key(s.key, key);
	if (holders > 2)
		sim_report_violation(w, "%d workers hold one lease", holders);
}

static void send_lease(struct sim_world *w, const struct action *a)
{
	struct sim_job *j = sim_job_by_id(w, a->job);
	struct peer_status p;
	uint32_t slot = j ? slot_index(j, a->key) : 0, index;
	if (!j || j->ended || !farm_peer_status(w->farm, a->peer, &p)) {
		sim_report_violation(w, "a lease of an ended job or to an unknown worker");
		return;
	}
	if (j->held[HOLD_STORAGE] || j->held[HOLD_USER])
		sim_report_violation(w, "a lease of a job that is held");
	if (p.state != PEER_ACTIVE)
		sim_report_violation(w, "a lease for a worker that is silent or quarantined");
	if (!j->mixed && *j->fingerprint && strcmp(j->fingerprint, p.fingerprint) != 0)
		sim_report_violation(w, "a lease of j%" PRIu64 " for a worker of fingerprint %s", a->job,
				     p.fingerprint);
	if (a->key.kind == LEASE_RENDER &&
	    (!j->prepared || a->key.epoch != j->next[slot] || a->key.epoch > j->rounds + 1))
		sim_report_violation(w, "epoch %" PRIu64 " was handed out too early or too late", a->key.epoch);
	check_holders(w, a->key);
	if (find_worker(w, a->peer, &index) && w->has_liars && j->answered_by[slot] >> index & 1)
		sim_report_violation(w, "w%u gets a lease of which its answer is noted", index);
	if (find_worker(w, a->peer, &index))
		sim_post_message(w, (struct sim_message){.kind = LEASE,
							 .worker = index,
							 .peer = a->peer,
							 .key = a->key,
							 .value = j->state[slot]});
}

static void merge_result(struct sim_world *w, const struct action *a, uint64_t value)
{
	struct sim_job *j = sim_job_by_id(w, a->job);
	struct peer_status p;
	w->result.merged++;
	if (!j || j->ended || !farm_peer_status(w->farm, a->peer, &p)) {
		sim_report_violation(w, "a batch of an ended job or of an unknown worker is merged");
		return;
	}
	if (!j->mixed && *j->fingerprint && strcmp(j->fingerprint, p.fingerprint) != 0)
		sim_report_violation(w, "batches of two fingerprints are merged");
	snprintf(j->fingerprint, sizeof j->fingerprint, "%s", p.fingerprint);
	uint32_t slot = slot_index(j, a->key);
	if (value != sim_correct_result(a->key, j->state[slot]))
		sim_report_violation(w, "a wrong result is merged, verified: %d", (int)a->is_verified);
	if (a->is_verified != (j->verify >= 1) && (j->verify >= 1 || j->verify <= 0))
		sim_report_violation(w, "verified with a share of %g: %d", j->verify, (int)a->is_verified);
	j->answered_by[slot] = 0;
	if (a->key.kind == LEASE_BOOTSTRAP) {
		if (j->bootstrap_slots & 1u << slot)
			sim_report_violation(w, "a bootstrap batch is merged twice");
		j->bootstrap_slots |= 1u << slot;
		j->state[slot] = value;
		return;
	}
	if (a->key.epoch != j->next[slot] || !j->prepared)
		sim_report_violation(w, "epoch %" PRIu64 " is merged where %" PRIu64 " is next", a->key.epoch,
				     j->next[slot]);
	if (a->key.epoch > j->rounds + 1 || a->key.epoch >= ROUNDS) {
		sim_report_violation(w, "more than two rounds are open");
		return;
	}
	j->next[slot]++;
	j->state[slot] = value;
	j->round_sum[a->key.epoch] += value;
	uint64_t min_next = UINT64_MAX;
	for (uint32_t i = 0; i < j->plan.groups * j->plan.parts; i++)
		min_next = j->next[i] < min_next ? j->next[i] : min_next;
	j->rounds = min_next;
}

double sim_error_after(const struct sim_job *j, uint64_t rounds)
{
	return j->error_scale / sqrt((double)rounds);
}

uint64_t sim_undisturbed_rounds(const struct sim_job *j)
{
	if (j->plan.target_error > 0)
		for (uint64_t r = 1; r < j->plan.rounds;
		     r += r < 4 ? 1 : r / 4) /* the ladder of evaluations, written independently */
			if (sim_error_after(j, r) <= j->plan.target_error)
				return r;
	return j->plan.rounds;
}

static uint64_t undisturbed_sum(const struct sim_job *j, uint64_t rounds)
{
	uint64_t sum = 0;
	for (uint32_t i = 0; i < j->plan.groups * j->plan.parts; i++) {
		struct lease_key k = {j->id, LEASE_BOOTSTRAP, i / j->plan.parts, i % j->plan.parts, 0};
		uint64_t state = sim_correct_result(k, 0);
		k.kind = LEASE_RENDER;
		for (k.epoch = 0; k.epoch < rounds; k.epoch++) {
			state = sim_correct_result(k, state);
			sum += state;
		}
	}
	return sum;
}

/* A job whose time has run out is evaluated once more, and may then end by its error after any number of rounds. */
static bool is_ended_by_time(enum job_end end, const struct sim_job *j)
{
	bool over = j->plan.seconds > 0 && j->elapsed_seconds >= j->plan.seconds;
	return end == END_TIME || (end == END_ERROR && over && sim_error_after(j, j->rounds) <= j->plan.target_error);
}

static void on_job_ended(struct sim_world *w, const struct action *a, struct sim_job *j)
{
	if (j->ended)
		sim_report_violation(w, "j%" PRIu64 " ended twice", a->job);
	j->ended = true;
	j->done = a->state == JOB_DONE;
	j->elapsed_seconds = farm_job_elapsed(w->farm, a->job, w->now);
	w->result.done += a->state == JOB_DONE;
	w->result.failed += a->state == JOB_FAILED;
	w->result.cancelled += a->state == JOB_CANCELLED;
	struct job_status s;
	if (!farm_job_status(w->farm, a->job, w->now, &s)) {
		sim_report_violation(w, "an ended job is forgotten");
		return;
	}
	w->result.duplicates += s.counts.duplicates;
	w->result.timeouts += s.counts.timeouts;
	w->result.repeats += s.counts.repeats;
	w->result.refused += s.counts.refused;
	w->result.verified += s.counts.verified;
	w->result.mismatched += s.counts.mismatched;
	if (a->state != JOB_DONE)
		return;
	if (s.rounds != j->rounds)
		sim_report_violation(w, "the core counts %" PRIu64 " rounds, the canvas %" PRIu64, s.rounds, j->rounds);
	if (!is_ended_by_time(a->end, j) && j->rounds != sim_undisturbed_rounds(j))
		sim_report_violation(w, "ended after %" PRIu64 " rounds, undisturbed %" PRIu64, j->rounds,
				     sim_undisturbed_rounds(j));
	uint64_t sum = 0;
	for (uint64_t r = 0; r < j->rounds; r++)
		sum += j->round_sum[r];
	if (sum != undisturbed_sum(j, j->rounds))
		sim_report_violation(w, "j%" PRIu64 " has another sum than undisturbed", a->job);
}

static void evaluate_error(struct sim_world *w, const struct action *a, const struct sim_job *j)
{
	if (a->rounds != j->rounds)
		sim_report_violation(w, "asked for the error after %" PRIu64 " rounds of %" PRIu64, a->rounds,
				     j->rounds);
	struct event ev = {
		.kind = EVENT_ERROR_ESTIMATED,
		.error_estimated = {.job = a->job, .rounds = a->rounds, .rel_error = sim_error_after(j, a->rounds)}};
	sim_push_message(w, (struct sim_message){.kind = TO_CORE, .time = w->now + 3 * sim_uniform(w), .ev = ev});
}

static void prepare_job(struct sim_world *w, const struct action *a, struct sim_job *j)
{
	if (j->bootstrap_slots != (1u << (j->plan.groups * j->plan.parts)) - 1)
		sim_report_violation(w, "the bootstrap is not complete");
	j->prepared = true;
	struct event ev = {.kind = EVENT_PREPARED, .prepared = {.job = a->job, .ok = true}};
	sim_push_message(w, (struct sim_message){.kind = TO_CORE, .time = w->now + 3 * sim_uniform(w), .ev = ev});
}

static void trace_action(const struct sim_world *w, const struct action *a)
{
	printf("[%.3f]   action %d peer %" PRIu64 " j%" PRIu64 " kind %d g%u p%u e%" PRIu64 " rounds %" PRIu64
	       " ack %d state %d %s\n",
	       w->now, (int)a->kind, a->peer, a->job, (int)a->key.kind, a->key.group, a->key.part, a->key.epoch,
	       a->rounds, (int)a->ack, (int)a->state, a->text);
}

static void perform_action(struct sim_world *w, const struct action *a, uint64_t value)
{
	struct sim_job *j = sim_job_by_id(w, a->job);
	uint32_t index;
	if (w->trace)
		trace_action(w, a);
	switch (a->kind) {
	case ACTION_SEND_LEASE:
		send_lease(w, a);
		break;
	case ACTION_REVOKE_LEASE:
		if (find_worker(w, a->peer, &index))
			sim_post_message(w, (struct sim_message){
						    .kind = REVOKE, .worker = index, .peer = a->peer, .key = a->key});
		break;
	case ACTION_MERGE_BATCH:
		merge_result(w, a, value);
		break;
	case ACTION_ACKNOWLEDGE:
		if (a->ack == ACK_NOTED && find_worker(w, a->peer, &index))
			j->answered_by[slot_index(j, a->key)] |= 1u << index;
		break;
	case ACTION_RESTART_CHAINS:
		break;
	case ACTION_WRONG_RESULT:
		w->result.lies++;
		break;
	case ACTION_QUARANTINE:
		w->result.quarantined++;
		break;
	case ACTION_BOOTSTRAP_DONE:
		prepare_job(w, a, j);
		break;
	case ACTION_ESTIMATE_ERROR:
		evaluate_error(w, a, j);
		break;
	case ACTION_ROUND_DONE:
		j->completed_seconds = farm_job_elapsed(w->farm, a->job, w->now);
		if (a->rounds != j->rounds)
			sim_report_violation(w, "round %" PRIu64 " said to be complete, %" PRIu64 " are", a->rounds,
					     j->rounds);
		break;
	case ACTION_JOB_CHANGED:
		if (job_state_is_end(a->state))
			on_job_ended(w, a, j);
		break;
	case ACTION_CLOSE_PEER:
		if (find_worker(w, a->peer, &index)) {
			w->workers[index].peer = 0;
			sim_push_message(w, (struct sim_message){.kind = START, .time = w->now + 1, .worker = index});
		}
		break;
	default:
		break;
	}
}

static bool is_held(const struct sim_job *j)
{
	for (int i = 0; i < JOB_HOLD_COUNT; i++)
		if (j->held[i])
			return true;
	return false;
}

static void check_progress(struct sim_world *w)
{
	for (uint32_t i = 0; i < w->job_count; i++) {
		struct sim_job *j = &w->jobs[i];
		struct job_status s;
		if (!j->submitted || !farm_job_status(w->farm, j->id, w->now, &s))
			continue;
		if (s.priority != j->priority || (s.state == JOB_HELD) != (!j->ended && is_held(j)))
			sim_report_violation(w, "j%" PRIu64 " has priority %d, or is %s", j->id, s.priority,
					     job_state_name(s.state));
		if (s.workers > s.leases || !(s.share >= 0 && s.share <= s.machines))
			sim_report_violation(w, "%u leases at %u workers, %g machines of %u due", s.leases, s.workers,
					     s.share, s.machines);
		if (!job_state_is_end(s.state) && !s.leases && (!*s.waiting || !*s.owners_waiting))
			sim_report_violation(w, "j%" PRIu64 " waits, and nobody says why", j->id);
		if (!(s.progress >= j->last_progress && s.progress <= 1))
			sim_report_violation(w, "progress of j%" PRIu64 " goes from %g to %g", j->id, j->last_progress,
					     s.progress);
		j->last_progress = s.progress;
	}
}

void sim_step(struct sim_world *w, struct event *ev, uint64_t value)
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
	for (size_t i = 0; i < u.count && !*w->violation; i++)
		perform_action(w, &u.actions[i], value);
	check_progress(w);
	if (u.wake_time < w->tick_at || w->tick_at <= w->now) {
		w->tick_at = u.wake_time;
		if (isfinite(u.wake_time))
			sim_push_message(w, (struct sim_message){.kind = TICK, .time = fmax(u.wake_time, w->now)});
	}
}
