/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Snapshots of the farm for the status socket.
 *
 * snapshot_take copies numbers and texts: jobs as views, workers and their leases as the core and their sessions have
 * them. What is rare or short (TLS, quarantined workers) is made into JSON at once.
 *
 * Failures: only of memory. Without room for the snapshot or its workers, snapshot_take returns NULL, and readers get
 * the next snapshot. Without room for the jobs or the JSON, the snapshot is made without these.
 */
#include "coordinator/status/snapshot.h"

#include "common/base/clock.h"
#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/jobs/recovery.h"
#include "coordinator/status/lines.h"

struct shown_worker {
	struct peer_status peer; /* its name and fingerprint are in the arrays that follow */
	char name[128], fingerprint[256];
	char certificate[sizeof((struct tls_peer *)0)->name]; /* name in the certificate; "": none */
	int64_t until;
	char warning[192]; /* about the certificate; "": none */
	uint32_t leases;
};

struct snapshot {
	double wall, now; /* s of the wall clock, and of jobs_now */
	struct job_view *jobs;
	size_t job_count;
	uint64_t ended_others;
	struct list workers; /* struct shown_worker */
	/* struct lease_status: those of the first worker, then those of the second one, and so on. */
	struct list leases;
	json_t *quarantined, *tls;
	uint64_t garbled;
	double reading; /* fraction read of the jobs of an earlier run; -1: all have been read */
};

/* The following functions run in the loop's thread. */

/* Copies the state of a worker's certificate, and a warning if it must be renewed. */
static void take_certificate(const struct peers *s, struct shown_worker *w)
{
	const struct session *p = s->tls ? peers_find(s, w->peer.id) : NULL;
	if (!p || !*p->who.name)
		return;
	text_copy(w->certificate, sizeof w->certificate, p->who.name);
	w->until = p->who.until;
	if (!tls_expiry(&p->who, time(NULL), w->warning, sizeof w->warning))
		w->warning[0] = 0;
}

static bool take_workers(struct snapshot *n, const struct peers *s)
{
	const struct farm *f = s->jobs->farm;
	for (uint64_t id = 0; (id = farm_next_peer(f, id));) {
		struct lease_status l, *lease;
		struct shown_worker *w = list_push(&n->workers);
		if (!w)
			return false;
		*w = (struct shown_worker){.leases = 0};
		farm_peer(f, id, &w->peer);
		text_copy(w->name, sizeof w->name, w->peer.name);
		text_copy(w->fingerprint, sizeof w->fingerprint, w->peer.fingerprint);
		take_certificate(s, w);
		for (; farm_lease(f, id, w->leases, &l); w->leases++) {
			if (!(lease = list_push(&n->leases)))
				return false;
			*lease = l;
		}
	}
	return true;
}

static void take_jobs(struct snapshot *n, struct jobs *jobs)
{
	uint64_t ended = ledger_ended_count(jobs->ledger), shown = 0;
	n->job_count = jobs_views(jobs, LINES_ENDED, &n->jobs);
	for (size_t i = 0; i < n->job_count; i++)
		shown += record_is_ended(&n->jobs[i].record);
	n->ended_others = ended > shown ? ended - shown : 0;
}

/* Lists quarantined workers, connected or not. */
static json_t *quarantined_json(const struct peers *s)
{
	json_t *list = json_array();
	struct worker_status w;
	for (uint64_t who = 0;
	     (who = farm_next_quarantined(s->jobs->farm, who)) && farm_worker(s->jobs->farm, who, &w);)
		json_array_append_new(list, view_quarantined_to_json(&w));
	return list;
}

static json_t *tls_json(const struct peers *s)
{
	char text[384];
	json_t *tls = json_pack("{s:s s:I s:I}", "certificate", tls_self(s->tls)->name, "certificateUntil",
				(json_int_t)tls_self(s->tls)->until, "authorityUntil",
				(json_int_t)tls_authority_until(s->tls));
	if (tls_warning(s->tls, time(NULL), text, sizeof text))
		json_object_set_new(tls, "warning", json_string(text));
	return tls;
}

struct snapshot *snapshot_take(const struct peers *s)
{
	struct snapshot *n = mem_alloc(1, sizeof *n);
	if (!n)
		return NULL;
	*n = (struct snapshot){.wall = clock_wall_seconds(),
			       .now = jobs_now(s->jobs),
			       .workers.size = sizeof(struct shown_worker),
			       .leases.size = sizeof(struct lease_status),
			       .garbled = s->garbled,
			       .reading = recovery_is_on(s->jobs) ? recovery_share(s->jobs) : -1};
	if (!take_workers(n, s)) {
		snapshot_free(n);
		return NULL;
	}
	take_jobs(n, s->jobs);
	n->quarantined = quarantined_json(s);
	n->tls = s->tls ? tls_json(s) : NULL;
	return n;
}

void snapshot_free(struct snapshot *n)
{
	if (!n)
		return;
	mem_free(n->jobs);
	list_free(&n->workers);
	list_free(&n->leases);
	json_decref(n->quarantined);
	json_decref(n->tls);
	mem_free(n);
}

/* The following functions may run in any thread. */

static json_t *worker_json(const struct shown_worker *w, double now)
{
	struct peer_status p = w->peer;
	p.name = w->name;
	p.fingerprint = w->fingerprint;
	json_t *o = view_peer_to_json(&p, now);
	if (*w->certificate) {
		json_object_set_new(o, "certificate", json_string(w->certificate));
		json_object_set_new(o, "certificateUntil", json_integer(w->until));
	}
	if (*w->warning)
		json_object_set_new(o, "warning", json_string(w->warning));
	return o;
}

static void add_workers(const struct snapshot *n, json_t *o)
{
	const struct shown_worker *w = n->workers.items;
	const struct lease_status *l = n->leases.items;
	json_t *workers = json_array(), *leases = json_array();
	for (size_t i = 0; i < n->workers.count; i++) {
		json_array_append_new(workers, worker_json(&w[i], n->now));
		for (uint32_t k = 0; k < w[i].leases; k++, l++)
			json_array_append_new(leases, view_lease_to_json(l, w[i].name, n->now));
	}
	json_object_set_new(o, "workers", workers);
	json_object_set(o, "quarantined", n->quarantined);
	json_object_set_new(o, "leases", leases);
}

static json_t *begin_object(const struct snapshot *n, const char *type)
{
	json_t *o = line_object(type);
	json_object_set_new(o, "time", json_real(n->wall));
	return o;
}

json_t *snapshot_workers_to_json(const struct snapshot *n)
{
	json_t *o = begin_object(n, "workers");
	add_workers(n, o);
	return o;
}

json_t *snapshot_to_json(const struct snapshot *n)
{
	json_t *o = begin_object(n, "snapshot"), *list = json_array();
	for (size_t i = 0; i < n->job_count; i++)
		json_array_append_new(list, view_to_json(&n->jobs[i], !record_is_ended(&n->jobs[i].record)));
	json_object_set_new(o, "jobs", list);
	json_object_set_new(o, "endedOthers", json_integer((json_int_t)n->ended_others));
	add_workers(n, o);
	if (n->tls)
		json_object_set(o, "tls", n->tls);
	json_object_set_new(o, "garbledConnections", json_integer((json_int_t)n->garbled));
	if (n->reading >= 0)
		json_object_set_new(o, "reading", json_real(n->reading));
	return o;
}
