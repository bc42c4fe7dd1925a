/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Snapshots of the farm for the status socket.
 *
 * snapshot_new copies numbers and texts: jobs as views, workers and their leases as the core and their sessions have
 * them. What is rare or short (TLS, quarantined workers) is made into JSON at once.
 *
 * Failures: only of memory. Without room for the snapshot or its workers, snapshot_new returns NULL, and readers get
 * the next snapshot. Without room for the jobs or the JSON, the snapshot is made without these.
 */
#include "coordinator/status/snapshot.h"

#include "common/base/clock.h"
#include "common/base/list.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/jobs/listing.h"
#include "coordinator/jobs/recovery.h"
#include "coordinator/status/status_line.h"

struct worker_snapshot {
	struct peer_status peer; /* its name and fingerprint are in the arrays that follow */
	char name[128], fingerprint[256];
	char certificate[sizeof((struct tls_peer *)0)->name]; /* name in the certificate; "": none */
	int64_t certificate_until;
	char warning[192]; /* about the certificate; "": none */
	uint32_t lease_count;
};

struct snapshot {
	double wall_time, now; /* s of the wall clock, and of jobs_now */
	struct job_view *jobs;
	size_t job_count;
	uint64_t hidden_ended_count;
	struct list workers; /* struct worker_snapshot */
	/* struct lease_status: those of the first worker, then those of the second one, and so on. */
	struct list leases;
	json_t *quarantined, *tls;
	uint64_t bad_checksum_count;
	double recovery_progress; /* fraction read of the jobs of an earlier run; -1: all have been read */
};

/* The following functions run in the loop's thread. */

/* Copies the state of a worker's certificate, and a warning if it must be renewed. */
static void copy_certificate(const struct peers *s, struct worker_snapshot *w)
{
	const struct session *p = s->tls ? peers_find_session(s, w->peer.id) : NULL;
	if (!p || !*p->tls_peer.name)
		return;
	text_copy(w->certificate, sizeof w->certificate, p->tls_peer.name);
	w->certificate_until = p->tls_peer.expiry_time;
	if (!tls_describe_expiry(&p->tls_peer, time(NULL), w->warning, sizeof w->warning))
		w->warning[0] = 0;
}

static bool copy_workers(struct snapshot *n, const struct peers *s)
{
	const struct farm *f = s->jobs->farm;
	for (uint64_t id = 0; (id = farm_next_peer(f, id));) {
		struct lease_status l, *lease;
		struct worker_snapshot *w = list_push(&n->workers);
		if (!w)
			return false;
		*w = (struct worker_snapshot){.lease_count = 0};
		farm_peer_status(f, id, &w->peer);
		text_copy(w->name, sizeof w->name, w->peer.name);
		text_copy(w->fingerprint, sizeof w->fingerprint, w->peer.fingerprint);
		copy_certificate(s, w);
		for (; farm_lease_status(f, id, w->lease_count, &l); w->lease_count++) {
			if (!(lease = list_push(&n->leases)))
				return false;
			*lease = l;
		}
	}
	return true;
}

static void copy_jobs(struct snapshot *n, struct jobs *jobs)
{
	uint64_t ended = ledger_ended_count(jobs->ledger), shown = 0;
	n->job_count = jobs_list_views(jobs, LINES_ENDED_MAX, &n->jobs);
	for (size_t i = 0; i < n->job_count; i++)
		shown += record_is_ended(&n->jobs[i].record);
	n->hidden_ended_count = ended > shown ? ended - shown : 0;
}

/* Lists quarantined workers, connected or not. */
static json_t *quarantined_to_json(const struct peers *s)
{
	json_t *list = json_array();
	struct worker_status w;
	for (uint64_t worker_id = 0; (worker_id = farm_next_quarantined(s->jobs->farm, worker_id)) &&
				     farm_worker_status(s->jobs->farm, worker_id, &w);)
		json_array_append_new(list, view_quarantined_to_json(&w));
	return list;
}

static json_t *tls_to_json(const struct peers *s)
{
	char text[384];
	json_t *tls = json_pack("{s:s s:I s:I}", "certificate", tls_own_certificate(s->tls)->name, "certificateUntil",
				(json_int_t)tls_own_certificate(s->tls)->expiry_time, "authorityUntil",
				(json_int_t)tls_authority_expiry(s->tls));
	if (tls_expiry_warning(s->tls, time(NULL), text, sizeof text))
		json_object_set_new(tls, "warning", json_string(text));
	return tls;
}

struct snapshot *snapshot_new(const struct peers *s)
{
	struct snapshot *n = mem_alloc(1, sizeof *n);
	if (!n)
		return NULL;
	*n = (struct snapshot){.wall_time = clock_wall_seconds(),
			       .now = jobs_now(s->jobs),
			       .workers.item_size = sizeof(struct worker_snapshot),
			       .leases.item_size = sizeof(struct lease_status),
			       .bad_checksum_count = s->bad_checksum_count,
			       .recovery_progress = recovery_is_running(s->jobs) ? recovery_progress(s->jobs) : -1};
	if (!copy_workers(n, s)) {
		snapshot_free(n);
		return NULL;
	}
	copy_jobs(n, s->jobs);
	n->quarantined = quarantined_to_json(s);
	n->tls = s->tls ? tls_to_json(s) : NULL;
	return n;
}

void snapshot_free(struct snapshot *n)
{
	if (!n)
		return;
	mem_free(n->jobs);
	list_fini(&n->workers);
	list_fini(&n->leases);
	json_decref(n->quarantined);
	json_decref(n->tls);
	mem_free(n);
}

/* The following functions may run in any thread. */

static json_t *worker_to_json(const struct worker_snapshot *w, double now)
{
	struct peer_status p = w->peer;
	p.name = w->name;
	p.fingerprint = w->fingerprint;
	json_t *o = view_peer_to_json(&p, now);
	if (*w->certificate) {
		json_object_set_new(o, "certificate", json_string(w->certificate));
		json_object_set_new(o, "certificateUntil", json_integer(w->certificate_until));
	}
	if (*w->warning)
		json_object_set_new(o, "warning", json_string(w->warning));
	return o;
}

static void add_workers(const struct snapshot *n, json_t *o)
{
	const struct worker_snapshot *w = n->workers.items;
	const struct lease_status *l = n->leases.items;
	json_t *workers = json_array(), *leases = json_array();
	for (size_t i = 0; i < n->workers.count; i++) {
		json_array_append_new(workers, worker_to_json(&w[i], n->now));
		for (uint32_t k = 0; k < w[i].lease_count; k++, l++)
			json_array_append_new(leases, view_lease_to_json(l, w[i].name, n->now));
	}
	json_object_set_new(o, "workers", workers);
	json_object_set(o, "quarantined", n->quarantined);
	json_object_set_new(o, "leases", leases);
}

static json_t *begin_object(const struct snapshot *n, const char *type)
{
	json_t *o = line_new(type);
	json_object_set_new(o, "time", json_real(n->wall_time));
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
	json_object_set_new(o, "endedOthers", json_integer((json_int_t)n->hidden_ended_count));
	add_workers(n, o);
	if (n->tls)
		json_object_set(o, "tls", n->tls);
	json_object_set_new(o, "garbledConnections", json_integer((json_int_t)n->bad_checksum_count));
	if (n->recovery_progress >= 0)
		json_object_set_new(o, "reading", json_real(n->recovery_progress));
	return o;
}
