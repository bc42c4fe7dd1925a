#include "tests/sim/sim_private.h"

#include <math.h>

void sim_restore(struct world *w, struct sim_job *j, double elapsed)
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
	sim_step(w, &ev, 0);
}

/* Only what is merged is remembered. What was under way to the old one comes to the new one, from peers that it does not know. */
void sim_restart(struct world *w)
{
	double elapsed[JOBS];
	struct farm *old = w->farm;
	struct error e;
	w->result.restarts++;
	sim_forget_answers(w);
	for (uint32_t i = 0; i < w->job_count; i++)
		elapsed[i] = w->jobs[i].submitted ? farm_elapsed(old, w->jobs[i].id, w->now) : NAN;
	for (uint32_t i = 0; i < w->job_count; i++)
		if (w->jobs[i].submitted && w->jobs[i].id >= w->config.first_job)
			w->config.first_job = w->jobs[i].id + 1;
	if (farm_new(&w->farm, &w->config, &e) < 0) {
		sim_wrong(w, "no memory for another farm");
		return;
	}
	farm_free(old);
	w->tick_at = INFINITY;
	for (uint64_t id = 1; id < w->config.first_job; id++)
		for (uint32_t i = 0; i < w->job_count; i++)
			if (w->jobs[i].submitted && !w->jobs[i].over && w->jobs[i].id == id)
				sim_restore(w, &w->jobs[i], elapsed[i]);
	for (uint32_t i = 0; i < w->worker_count; i++) {
		if (w->workers[i].peer)
			sim_push(w, (struct message){ .kind = START, .time = w->now + 20 * sim_uniform(w), .worker = i });
		w->workers[i].peer = 0;
	}
}
