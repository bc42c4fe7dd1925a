/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/farm.h"

#include "common/base/mem.h"
#include "coordinator/core/state.h"

#include <assert.h>
#include <math.h>

enum { KNOWN_PER_PEER = 4 };

void farm_config_init(struct farm_config *c)
{
	*c = (struct farm_config){
		.first_job = 1,
		.max_jobs = FARM_JOBS,
		.max_ended = 1000,
		.max_peers = 4096,
		.max_peer_leases = 256,
		.max_slots = 1 << 16,
		.max_faults = 3,
		.silent_after = 30,
		.forget_after = 300,
		.first_timeout = 600,
		.first_copy = 30,
		.idle_timeout = 120,
		.min_timeout = 60,
		.first_pause = 10,
	};
}

static int check(const struct farm_config *c, struct error *e)
{
	if (c->first_job == 0 || c->max_jobs == 0 || c->max_ended == 0 || c->max_peers == 0 ||
	    c->max_peer_leases == 0 || c->max_faults == 0)
		return error_set(e, EINVAL, "a farm without jobs, workers or leases");
	if (!(c->silent_after > 0 && c->forget_after >= c->silent_after && c->first_timeout > 0 && c->min_timeout > 0 &&
	      c->first_copy > 0 && c->idle_timeout > 0 && c->first_pause > 0))
		return error_set(e, EINVAL, "the farm's times are not in order");
	return 0;
}

int farm_new(struct farm **out, const struct farm_config *c, struct error *e)
{
	int rc = check(c, e);
	if (rc < 0)
		return rc;
	struct farm *f = mem_alloc(1, sizeof *f);
	if (!f)
		return error_set(e, ENOMEM, "no memory for the farm");
	f->config = *c;
	f->next_job = c->first_job;
	f->live_limit = c->max_jobs;
	f->check_at = f->schedule_at = INFINITY;
	f->now = -INFINITY;
	list_init(&f->classes);
	list_init(&f->owners);
	f->jobs = mem_alloc((size_t)c->max_jobs + c->max_ended + 1, sizeof(struct job *));
	f->live = mem_alloc(c->max_jobs, sizeof(struct job *));
	f->peers = mem_alloc(c->max_peers, sizeof(struct peer *));
	f->known_limit = KNOWN_PER_PEER * c->max_peers;
	f->known = mem_alloc(f->known_limit, sizeof(struct identity *));
	if (!f->jobs || !f->live || !f->peers || !f->known || update_reserve(f, 0) < 0) {
		farm_free(f);
		return error_set(e, ENOMEM, "no memory for the farm");
	}
	*out = f;
	return 0;
}

void farm_free(struct farm *f)
{
	if (!f)
		return;
	while (f->peer_count)
		peer_leave(f, f->peers[f->peer_count - 1]);
	for (uint32_t i = 0; i < f->job_count; i++) {
		if (f->jobs[i]->class)
			peer_class_drop(f->jobs[i]->class);
		job_free(f->jobs[i]);
	}
	worker_registry_free(f);
	mem_free(f->jobs);
	mem_free(f->live);
	mem_free(f->peers);
	mem_free(f->actions);
	mem_free(f);
}

/* The first job whose id is not below `id`. */
static uint32_t job_place_of(const struct farm *f, uint64_t id)
{
	uint32_t low = 0, high = f->job_count;
	while (low < high) {
		uint32_t mid = low + (high - low) / 2;
		if (f->jobs[mid]->id < id)
			low = mid + 1;
		else
			high = mid;
	}
	return low;
}

static uint32_t peer_place_of(const struct farm *f, uint64_t id)
{
	uint32_t low = 0, high = f->peer_count;
	while (low < high) {
		uint32_t mid = low + (high - low) / 2;
		if (f->peers[mid]->id < id)
			low = mid + 1;
		else
			high = mid;
	}
	return low;
}

struct job *farm_find_job(const struct farm *f, uint64_t id)
{
	uint32_t i = job_place_of(f, id);
	return i < f->job_count && f->jobs[i]->id == id ? f->jobs[i] : NULL;
}

struct peer *farm_find_peer(const struct farm *f, uint64_t id)
{
	uint32_t i = peer_place_of(f, id);
	return i < f->peer_count && f->peers[i]->id == id ? f->peers[i] : NULL;
}

uint64_t farm_next_peer(const struct farm *f, uint64_t after)
{
	uint32_t i = after == UINT64_MAX ? f->peer_count : peer_place_of(f, after + 1);
	return i < f->peer_count ? f->peers[i]->id : 0;
}

static struct event_join complete(const struct event_join *e)
{
	struct event_join j = *e;
	j.certificate = e->certificate ? e->certificate : "";
	j.home = e->home ? e->home : "";
	return j;
}

static void joined(struct farm *f, const struct event *ev)
{
	const struct event_join join = complete(&ev->join);
	const char *refused = "";
	assert(join.peer && !farm_find_peer(f, join.peer));
	if (worker_registry_replace(f, &join, &refused) && peer_join(f, &join, &refused))
		return;
	struct action *a = update_add(f, ACTION_REJECTED);
	a->peer = ev->join.peer;
	a->text = refused;
}

static void aside(struct farm *f, const struct event *ev)
{
	const struct event_join join = complete(&ev->join);
	worker_registry_restore_quarantined(f, &join, ev->text);
}

static void left(struct farm *f, const struct event *ev)
{
	struct peer *p = farm_find_peer(f, ev->peer);
	if (p)
		peer_lose(f, p);
}

static void requested(struct farm *f, const struct event *ev)
{
	struct peer *p = farm_find_peer(f, ev->peer);
	if (!p)
		return;
	p->want = ev->want < p->lease_limit ? ev->want : p->lease_limit;
	if (list_is_empty(&p->waiting) || !peer_has_wish(p))
		peer_requeue(f, p);
}

static void broken(struct farm *f, const struct event *ev)
{
	struct job *j = farm_find_job(f, ev->job);
	if (j && job_is_live(j))
		rounds_end(f, j, END_FAILED, ev->text ? ev->text : "");
}

static void ticked(struct farm *f, const struct event *ev)
{
	(void)f;
	(void)ev;
}

static void (*const on_event[])(struct farm *, const struct event *) = {
	[EVENT_TICK] = ticked,
	[EVENT_JOINED] = joined,
	[EVENT_LEFT] = left,
	[EVENT_HEARD] = ticked,
	[EVENT_REQUEST] = requested,
	[EVENT_BATCH] = answer_batch,
	[EVENT_STORED] = answer_stored,
	[EVENT_DELIVERED] = answer_delivered,
	[EVENT_LEASE_FAILED] = answer_failed,
	[EVENT_LEASE_RETURNED] = answer_returned,
	[EVENT_SUBMIT] = rounds_submit,
	[EVENT_CANCEL] = rounds_cancel,
	[EVENT_PREPARED] = rounds_prepared,
	[EVENT_ERROR_KNOWN] = rounds_error_known,
	[EVENT_IMAGE_KNOWN] = rounds_image_known,
	[EVENT_RESTORE] = restore_job,
	[EVENT_HOLD] = orders_hold,
	[EVENT_PRIORITY] = orders_priority,
	[EVENT_EXTEND] = orders_extend,
	[EVENT_ASIDE] = aside,
	[EVENT_JOB_BROKEN] = broken,
};

void farm_step(struct farm *f, const struct event *ev, struct update *u)
{
	if (ev->time > f->now)
		f->now = ev->time;
	f->action_count = 0;
	struct peer *p = ev->peer ? farm_find_peer(f, ev->peer) : NULL;
	if (p)
		peer_heard(f, p);
	schedule_expire(f, f->now - ev->unread);
	on_event[ev->kind](f, ev);
	schedule(f);
	u->actions = f->actions;
	u->count = f->action_count;
	u->wake = fmin(f->check_at, f->schedule_at);
}
