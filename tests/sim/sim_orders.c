/* SPDX-License-Identifier: Apache-2.0 */
/* Restarts of the coordinator and orders for jobs: they are held, released, given another priority, and extended
 * while they run or after they have ended. */
#include "tests/sim/sim_private.h"

#include <math.h>
#include <string.h>

static void hold_job(struct sim_world *w, struct sim_job *j, enum job_hold hold, bool on)
{
	struct event ev = {.kind = EVENT_HOLD, .job = j->id, .hold = hold, .text = on ? "held" : ""};
	if (j->ended)
		return;
	j->held[hold] = on; /* set before the step, which may hand out leases at once */
	sim_step(w, &ev, 0);
}

void sim_restore_job(struct sim_world *w, struct sim_job *j, double elapsed)
{
	static const struct forecast_history no_looks;
	uint32_t slots = j->plan.groups * j->plan.parts;
	uint64_t next[SLOTS];
	bool is_render = j->bootstrap_slots == (1u << slots) - 1;
	for (uint32_t i = 0; i < slots; i++)
		next[i] = is_render ? j->next[i] : j->bootstrap_slots >> i & 1;
	j->prepared = is_render;
	j->last_progress = 0; /* the new coordinator does not remember earlier evaluations of the error */
	struct event ev = {.kind = EVENT_RESTORE,
			   .restore = {.job = j->id,
				       .submit = {.plan = &j->plan,
						  .name = "sim",
						  .priority = j->priority,
						  .is_mixed = j->mixed,
						  .verify_fraction = j->verify},
				       .fingerprint = j->mixed ? "" : j->fingerprint,
				       .kind = is_render ? LEASE_RENDER : LEASE_BOOTSTRAP,
				       .next_epochs = next,
				       .elapsed = elapsed,
				       .first_round_at = elapsed,
				       .last_round_end = j->completed_seconds,
				       .looks = &no_looks}};
	bool held = j->held[HOLD_USER]; /* a hold for want of storage is not remembered: there may be room by now */
	memset(j->held, 0, sizeof j->held);
	sim_step(w, &ev, 0);
	if (held)
		hold_job(w, j, HOLD_USER, true);
}

/* Replaces the coordinator by one that remembers only merged results. Messages still under way to the old one reach
 * the new one, from peers that it does not know. */
void sim_restart_coordinator(struct sim_world *w)
{
	double elapsed[JOBS];
	struct farm *old = w->farm;
	struct error e;
	w->result.restarts++;
	sim_forget_answers(w);
	for (uint32_t i = 0; i < w->job_count; i++)
		elapsed[i] = w->jobs[i].submitted ? farm_job_elapsed(old, w->jobs[i].id, w->now) : NAN;
	for (uint32_t i = 0; i < w->job_count; i++)
		if (w->jobs[i].submitted && w->jobs[i].id >= w->config.first_job_id)
			w->config.first_job_id = w->jobs[i].id + 1;
	if (farm_new(&w->farm, &w->config, &e) < 0) {
		sim_report_violation(w, "no memory for another farm");
		return;
	}
	farm_free(old);
	w->tick_at = INFINITY;
	for (uint64_t id = 1; id < w->config.first_job_id; id++)
		for (uint32_t i = 0; i < w->job_count; i++)
			if (w->jobs[i].submitted && !w->jobs[i].ended && w->jobs[i].id == id)
				sim_restore_job(w, &w->jobs[i], elapsed[i]);
	for (uint32_t i = 0; i < w->worker_count; i++) {
		if (w->workers[i].peer)
			sim_push_message(w, (struct sim_message){
						    .kind = START, .time = w->now + 20 * sim_uniform(w), .worker = i});
		w->workers[i].peer = 0;
	}
}

/* ---- orders */

void sim_release_all_jobs(struct sim_world *w)
{
	for (uint32_t i = 0; i < w->job_count; i++)
		for (int hold = 0; hold < JOB_HOLD_COUNT; hold++)
			if (w->jobs[i].submitted)
				hold_job(w, &w->jobs[i], (enum job_hold)hold, false);
}

static void set_priority(struct sim_world *w, struct sim_job *j)
{
	struct event ev = {.kind = EVENT_SET_PRIORITY, .job = j->id, .priority = (int)sim_uniform_below(w, 5) - 2};
	if (j->ended)
		return;
	j->priority = ev.priority;
	sim_step(w, &ev, 0);
}

/* Moves each bound that the job has further away, so that none of them is met. */
static void extend_bounds(struct sim_world *w, struct sim_job *j)
{
	struct plan *p = &j->plan;
	if (p->rounds != UINT64_MAX)
		p->rounds += 1 + sim_uniform_below(w, 6);
	if (p->seconds > 0)
		p->seconds = fmax(p->seconds, j->ended ? j->elapsed_seconds : 0) +
			     j->lease_seconds * 10 * sim_uniform(w) + 1e-3;
	if (p->target_error > 0 && j->rounds > 0)
		p->target_error = 0.9 * fmin(p->target_error, sim_error_after(j, j->rounds));
	j->last_progress = 0;
}

static void extend_sim_job(struct sim_world *w, struct sim_job *j)
{
	if ((j->ended && !j->done) || j->plan.rounds > 40)
		return;
	w->result.extended++;
	extend_bounds(w, j);
	if (j->ended) {
		j->ended = j->done = false;
		memset(j->held, 0, sizeof j->held);
		memset(j->answered_by, 0, sizeof j->answered_by);
		sim_restore_job(w, j, j->elapsed_seconds);
	} else {
		struct event ev = {.kind = EVENT_EXTEND, .job = j->id, .plan = &j->plan};
		sim_step(w, &ev, 0);
	}
}

void sim_give_order(struct sim_world *w)
{
	struct sim_job *j = &w->jobs[sim_uniform_below(w, w->job_count)];
	w->orders_remaining--;
	if (!j->submitted)
		return;
	switch (sim_uniform_below(w, 4)) {
	case 0:
		hold_job(w, j, sim_chance(w, 0.5) ? HOLD_USER : HOLD_STORAGE, true);
		break;
	case 1:
		hold_job(w, j, sim_chance(w, 0.5) ? HOLD_USER : HOLD_STORAGE, false);
		break;
	case 2:
		set_priority(w, j);
		break;
	default:
		extend_sim_job(w, j);
		break;
	}
}
