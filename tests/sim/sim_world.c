/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/sim/sim_private.h"

#include "common/base/mem.h"

#include <math.h>

static void plan_job(struct sim_world *w, struct sim_job *j)
{
	struct plan *p = &j->plan;
	*p = (struct plan){.kind = PLAN_CHAINS,
			   .groups = 1 + sim_uniform_below(w, 4),
			   .parts = 1 + sim_uniform_below(w, 3),
			   .epoch = 100,
			   .rounds = 1 + sim_uniform_below(w, 12)};
	p->chains = p->groups * p->parts;
	p->bootstrap = 1000 * (uint64_t)p->chains;
	j->error_scale = 1;
	j->lease_seconds = 0.1 + 40 * sim_uniform(w) * sim_uniform(w) * sim_uniform(w);
	j->priority = (int)sim_uniform_below(w, 3) - 1;
	j->mixed = sim_chance(w, 0.3);
	j->cancel_at = sim_chance(w, 0.15) ? 600 * sim_uniform(w) : -1;
	if (sim_chance(w, 0.3)) {
		p->target_error = 0.25 + 0.5 * sim_uniform(w);
		if (sim_chance(w, 0.5))
			p->rounds = UINT64_MAX;
	}
	if (sim_chance(w, 0.2))
		p->seconds = j->lease_seconds * 20 * sim_uniform(w);
}

/* Makes at least two workers honest and of one fingerprint, since a job could not end otherwise, and one or two
 * liars. */
static void choose_liars(struct sim_world *w)
{
	for (uint32_t i = 0; i < w->worker_count; i++) {
		if (w->has_liars || w->verify < 1 || i < 2)
			w->workers[i].fingerprint = "A";
		if (w->has_liars && i < 2 && (i == 0 || sim_chance(w, 0.5)))
			w->workers[i].lie_rate = sim_chance(w, 0.5) ? 1 : sim_uniform(w);
	}
}

static void make_world(struct sim_world *w)
{
	w->calm_from = 2000;
	w->tick_at = INFINITY;
	w->next_peer = 1;
	w->drop_rate = sim_chance(w, 0.5) ? 0.1 * sim_uniform(w) : 0;
	w->repeat_rate = sim_chance(w, 0.5) ? 0.3 * sim_uniform(w) : 0;
	w->max_delay = sim_chance(w, 0.5) ? 10 * sim_uniform(w) : 0.1;
	w->failure_rate = sim_chance(w, 0.3) ? 0.3 * sim_uniform(w) : 0;
	w->worker_count = 1 + sim_uniform_below(w, WORKERS);
	w->job_count = 1 + sim_uniform_below(w, JOBS);
	w->verify = sim_chance(w, 0.4) ? sim_chance(w, 0.5) ? 1 : sim_uniform(w) : 0;
	w->has_liars = w->verify >= 1 && sim_chance(w, 0.6);
	uint32_t min_workers = w->has_liars ? 4 : w->verify > 0 ? 2 : 1;
	if (w->worker_count < min_workers)
		w->worker_count = min_workers;
	for (uint32_t i = 0; i < w->worker_count; i++) {
		struct sim_worker *k = &w->workers[i];
		k->threads = 1 + sim_uniform_below(w, 4);
		k->speed = sim_chance(w, 0.2) ? 12 : 0.5 + sim_uniform(w);
		k->fingerprint = sim_chance(w, 0.2) ? "B" : "A";
		k->failure_rate = w->failure_rate;
		k->invalid_rate = sim_chance(w, 0.1) ? 0.5 : 0;
		k->is_hoarding = i >= min_workers && sim_mix(w->seed * WORKERS + i) % 5 == 0;
		sim_push_message(w, (struct sim_message){.kind = START,
							 .time = i ? 300 * sim_uniform(w) * sim_uniform(w) : 0,
							 .worker = i});
	}
	for (uint32_t i = 0; i < w->job_count; i++) {
		plan_job(w, &w->jobs[i]);
		w->jobs[i].verify = w->verify;
		w->jobs[i].mixed = w->jobs[i].mixed && w->verify == 0;
		sim_push_message(
			w, (struct sim_message){.kind = SUBMIT, .time = i ? 300 * sim_uniform(w) : 0, .worker = i});
	}
	if (w->verify > 0)
		choose_liars(w);
	sim_push_message(w, (struct sim_message){.kind = CALM, .time = w->calm_from});
	for (uint32_t i = sim_chance(w, 0.5) ? 1 + sim_uniform_below(w, 4) : 0; i > 0; i--)
		sim_push_message(w,
				 (struct sim_message){.kind = RESTART, .time = 600 * sim_uniform(w) * sim_uniform(w)});
	w->orders_remaining = sim_chance(w, 0.5) ? 1 + sim_uniform_below(w, 16) : 0;
	for (uint32_t i = 0; i < w->orders_remaining; i++)
		sim_push_message(w, (struct sim_message){.kind = ORDER, .time = 900 * sim_uniform(w) * sim_uniform(w)});
}

static void submit_job(struct sim_world *w, uint32_t index)
{
	struct sim_job *j = &w->jobs[index];
	struct event ev = {.kind = EVENT_SUBMIT,
			   .tag = index,
			   .submit = {.plan = &j->plan,
				      .name = "sim",
				      .priority = j->priority,
				      .is_mixed = j->mixed,
				      .verify_fraction = j->verify}};
	sim_step(w, &ev, 0);
	if (!j->submitted)
		sim_report_violation(w, "a job is refused");
	if (j->cancel_at >= 0) {
		struct event cancel = {.kind = EVENT_CANCEL, .job = j->id};
		sim_push_message(w, (struct sim_message){.kind = TO_CORE, .time = w->now + j->cancel_at, .ev = cancel});
	}
}

static void deliver_message(struct sim_world *w, struct sim_message *m)
{
	switch (m->kind) {
	case TO_CORE:
		sim_step(w, &m->ev, m->value);
		break;
	case TICK:
		if (m->time >= w->tick_at)
			sim_step(w, &(struct event){.kind = EVENT_TICK}, 0);
		break;
	case SUBMIT:
		submit_job(w, m->worker);
		break;
	case LEASE:
		sim_receive_lease(w, m);
		break;
	case REVOKE:
		sim_receive_revoke(w, m);
		break;
	case FINISH:
		sim_finish_lease(w, m);
		break;
	case WORKER_HEARTBEAT:
		sim_heartbeat(w, m);
		break;
	case CRASH:
		sim_crash_worker(w, m);
		break;
	case START:
		sim_start_worker(w, m->worker);
		break;
	case CALM:
		sim_calm_down(w);
		sim_release_all_jobs(w);
		break;
	case RESTART:
		sim_restart_coordinator(w);
		break;
	case ORDER:
		sim_give_order(w);
		break;
	}
}

static bool have_all_ended(const struct sim_world *w)
{
	for (uint32_t i = 0; i < w->job_count; i++)
		if (!w->jobs[i].ended)
			return false;
	return w->orders_remaining == 0;
}

const char *sim_run(uint64_t seed, int trace, struct sim_result *r)
{
	static struct sim_world world;
	struct sim_world *w = &world;
	*w = (struct sim_world){.seed = seed, .trace = trace};
	struct error e;
	farm_config_init(&w->config);
	w->config.max_peers = 4 * WORKERS;
	w->config.max_jobs = JOBS;
	w->message_heap = mem_alloc(MESSAGES_MAX, sizeof *w->message_heap);
	if (!w->message_heap || farm_new(&w->farm, &w->config, &e) < 0) {
		mem_free(w->message_heap);
		return "no memory for the world";
	}
	make_world(w);
	while (!*w->violation && !have_all_ended(w)) {
		if (!w->heap_count || w->result.steps > SIM_STEPS_MAX || w->now > 1e7) {
			sim_report_violation(w, "after %g s a job has not ended", w->now);
			break;
		}
		struct sim_message m = sim_pop_message(w);
		w->now = m.time;
		deliver_message(w, &m);
	}
	w->result.time = w->now;
	farm_free(w->farm);
	mem_free(w->message_heap);
	*r = w->result;
	return *w->violation ? w->violation : NULL;
}
