/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/core/farm.h"

#include "common/base/mem.h"
#include "coordinator/core/answer.h"
#include "coordinator/core/connection.h"
#include "coordinator/core/identity_index.h"
#include "coordinator/core/job.h"
#include "coordinator/core/orders.h"
#include "coordinator/core/restore.h"
#include "coordinator/core/rounds.h"
#include "coordinator/core/schedule.h"
#include "coordinator/core/worker_registry.h"

#include <assert.h>
#include <math.h>

enum { REGISTRY_ENTRIES_PER_PEER = 4 };

int farm_new(struct farm **out, const struct farm_config *c, struct error *e)
{
	int rc = farm_config_check(c, e);
	if (rc < 0)
		return rc;
	struct farm *f = mem_alloc(1, sizeof *f);
	if (!f)
		return error_set(e, ENOMEM, "no memory for the farm");
	f->config = *c;
	f->next_job_id = c->first_job_id;
	f->live_job_capacity = c->max_jobs;
	f->next_expiry_check_at = f->next_schedule_at = INFINITY;
	f->now = -INFINITY;
	list_init(&f->classes);
	list_init(&f->owners);
	f->jobs = mem_alloc((size_t)c->max_jobs + c->max_ended_jobs + 1, sizeof(struct job *));
	f->live_jobs = mem_alloc(c->max_jobs, sizeof(struct job *));
	f->peers = mem_alloc(c->max_peers, sizeof(struct peer *));
	f->registry_capacity = REGISTRY_ENTRIES_PER_PEER * c->max_peers;
	f->registry = mem_alloc(f->registry_capacity, sizeof(struct identity *));
	if (!f->jobs || !f->live_jobs || !f->peers || !f->registry ||
	    identity_index_init(&f->identity_index, f->registry_capacity) < 0 || update_reserve(f, 0) < 0) {
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
		connection_leave(f, f->peers[f->peer_count - 1]);
	for (uint32_t i = 0; i < f->job_count; i++) {
		if (f->jobs[i]->class)
			peer_class_release(f->jobs[i]->class);
		job_free(f->jobs[i]);
	}
	worker_registry_free(f);
	mem_free(f->jobs);
	mem_free(f->live_jobs);
	mem_free(f->peers);
	mem_free(f->actions);
	mem_free(f);
}

static struct event_join with_join_defaults(const struct event_join *e)
{
	struct event_join j = *e;
	j.certificate = e->certificate ? e->certificate : "";
	j.home = e->home ? e->home : "";
	return j;
}

static void handle_joined(struct farm *f, const struct event *ev)
{
	const struct event_join join = with_join_defaults(&ev->join);
	const char *refusal = "";
	assert(join.peer && !farm_find_peer(f, join.peer));
	if (connection_supersede_earlier(f, &join, &refusal) && connection_join(f, &join, &refusal))
		return;
	struct action *a = update_add(f, ACTION_REJECTED);
	a->peer = ev->join.peer;
	a->text = refusal;
}

static void handle_quarantined(struct farm *f, const struct event *ev)
{
	const struct event_join join = with_join_defaults(&ev->join);
	worker_registry_restore(f, &join, ev->text);
}

static void handle_left(struct farm *f, const struct event *ev)
{
	struct peer *p = farm_find_peer(f, ev->peer);
	if (p)
		connection_lose(f, p);
}

static void handle_request(struct farm *f, const struct event *ev)
{
	struct peer *p = farm_find_peer(f, ev->peer);
	if (!p)
		return;
	p->wanted_lease_count = ev->wanted_leases < p->lease_capacity ? ev->wanted_leases : p->lease_capacity;
	if (list_is_empty(&p->waiting_link) || !peer_wants_lease(p))
		peer_requeue(f, p);
}

static void handle_job_failed(struct farm *f, const struct event *ev)
{
	struct job *j = farm_find_job(f, ev->job);
	if (j && job_is_live(j))
		rounds_end_job(f, j, END_FAILED, ev->text ? ev->text : "");
}

static void ignore_event(struct farm *f, const struct event *ev)
{
	(void)f;
	(void)ev;
}

static void (*const event_handlers[])(struct farm *, const struct event *) = {
	[EVENT_TICK] = ignore_event,
	[EVENT_JOINED] = handle_joined,
	[EVENT_LEFT] = handle_left,
	[EVENT_HEARTBEAT] = ignore_event,
	[EVENT_LEASE_REQUEST] = handle_request,
	[EVENT_BATCH] = answer_batch,
	[EVENT_STORED_BATCH] = answer_stored_batch,
	[EVENT_BATCH_DELIVERED] = answer_batch_delivered,
	[EVENT_LEASE_FAILED] = answer_lease_failed,
	[EVENT_LEASE_RETURNED] = answer_lease_returned,
	[EVENT_SUBMIT] = rounds_submit,
	[EVENT_CANCEL] = rounds_cancel,
	[EVENT_PREPARED] = rounds_handle_prepared,
	[EVENT_ERROR_ESTIMATED] = rounds_handle_error_estimated,
	[EVENT_IMAGE_PUBLISHED] = rounds_handle_image_published,
	[EVENT_RESTORE] = restore_job,
	[EVENT_HOLD] = orders_hold,
	[EVENT_SET_PRIORITY] = orders_set_priority,
	[EVENT_EXTEND] = orders_extend,
	[EVENT_QUARANTINED] = handle_quarantined,
	[EVENT_JOB_FAILED] = handle_job_failed,
};

void farm_step(struct farm *f, const struct event *ev, struct update *u)
{
	if (ev->time > f->now)
		f->now = ev->time;
	f->action_count = 0;
	struct peer *p = ev->peer ? farm_find_peer(f, ev->peer) : NULL;
	if (p)
		peer_note_contact(f, p);
	schedule_expire(f, f->now - ev->unread_seconds);
	event_handlers[ev->kind](f, ev);
	schedule_leases(f);
	u->actions = f->actions;
	u->count = f->action_count;
	u->wake_time = fmin(f->next_expiry_check_at, f->next_schedule_at);
}
