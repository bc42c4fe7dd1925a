/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Jobs and leases of the worker daemon. Everything here runs on the event loop's thread; leases are rendered and scenes
 * built in the thread pool, which calls back on the loop's thread.
 *
 * Happy path: handle_grant queues a lease and finds or creates the cache of its job. The cache asks for the job's
 * description (handle_job_info), fetches missing files (handle_blob_chunk) and builds the scene (on_built); then its
 * leases start. A rendered lease is sent (on_rendered) and kept until the coordinator acknowledges it (handle_ack),
 * also across connections.
 *
 * Failures: if files of a job cannot be fetched or its scene cannot be built, all its waiting leases fail with a
 * sentence. A lease that is revoked, or whose job has ended, is dropped; if a thread works on it, it is dropped when
 * the thread returns it. A message that makes no sense closes the connection. If too many results wait to be
 * acknowledged, no more leases are requested.
 *
 * After SIGKILL has ended a rendering process, which the system sends when memory is short, or an allocation has failed
 * while several scenes were in memory, leases of only one job at a time are accepted for a while (scene_limit_admit).
 * Otherwise two jobs whose scenes do not fit into memory together would end each other again and again.
 */
#include "worker/daemon/lease_queue.h"

#include "common/base/log.h"
#include "worker/daemon/fetch.h"
#include "worker/daemon/lease_list.h"
#include "worker/daemon/outgoing.h"
#include "worker/daemon/scene_limit.h"
#include "worker/daemon/crash_record.h"

/* ---- scenes ---- */

/* Fails a job's waiting leases. The next scene_limit_drop_unused drops the job. */
static void fail_job_cache(struct agent *a, struct job_cache *cache, const struct error *e)
{
	cache->state = JOB_CACHE_FAILED;
	lease_list_fail(a, cache, e);
}

static void on_rendered(struct lease_task *l);
static void start_lease(struct agent *a, struct lease_task *l)
{
	l->owner = a;
	l->on_finished = on_rendered;
	job_cache_note_other_worlds(l->job_cache, a->job_caches, false);
	lease_task_start(l, a->thread_pool);
}

/* Returns no_memory, which means that this machine is at fault, not the job: the client that submitted the scene
 * had enough memory, and other workers may have. */
static bool note_memory_failure(const struct job_cache *cache, bool no_memory)
{
	if (no_memory)
		job_cache_note_memory_failure(cache);
	return no_memory;
}

static void on_built(struct job_cache *cache)
{
	struct agent *a = cache->owner;
	if (cache->state == JOB_CACHE_FAILED) {
		cache->is_worker_at_fault |= note_memory_failure(cache, cache->is_out_of_memory);
		fail_job_cache(a, cache, &cache->error);
	} else {
		log_event(LOG_WORLD_BUILT, "job=j%llu seconds=%.3f embree_bytes=%zu", log_u64_arg(cache->job),
			  cache->build_seconds, world_embree_bytes(cache->world));
		for (struct lease_task *l = a->leases; l; l = l->next)
			if (l->job_cache == cache && l->state == LEASE_WAITING)
				start_lease(a, l);
	}
	scene_limit_drop_unused(a);
	a->leave_if_idle(a);
}

static void on_file_read(struct job_cache *cache);

/* Requests the next missing chunk of a job's files, unless another job has done so. If no file is missing, builds the
 * scene. Does nothing in a worker that is leaving, which has returned all leases that have not begun. */
static void fetch_or_build(struct agent *a, struct job_cache *cache)
{
	struct error e;
	int rc = 0;
	if (cache->state != JOB_CACHE_FETCHING || a->is_leaving)
		return;
	cache->owner = a;
	cache->reading.stop_requested = &a->has_left;
	cache->reading.on_done = on_file_read;
	enum job_cache_files files = job_cache_check_files(cache, &a->loop);
	if (files == JOB_CACHE_FILE_MISSING) {
		rc = fetch_request(a, &cache->wanted_file, &e);
	} else if (files == JOB_CACHE_FILES_COMPLETE && !scene_limit_must_wait(a, cache)) {
		cache->on_built = on_built;
		for (const struct lease_task *l = a->leases; l; l = l->next)
			if (l->job_cache == cache)
				cache->waiting_lease = l->grant.key;
		job_cache_note_other_worlds(cache, a->job_caches, true);
		rc = job_cache_build(cache, a->thread_pool, &e);
	}
	if (rc) {
		cache->is_worker_at_fault = rc == -ENOMEM;
		fail_job_cache(a, cache, &e);
	}
}

static void fetch_or_build_all(struct agent *a)
{
	for (struct job_cache *cache = a->job_caches; cache; cache = cache->next)
		fetch_or_build(a, cache);
}

static void on_file_read(struct job_cache *cache)
{
	struct agent *a = cache->owner;
	if (a->has_left)
		return;
	if (!cache->has_ended)
		fetch_or_build(a, cache);
	scene_limit_drop_unused(a);
	a->leave_if_idle(a);
}

/* ---- leases ---- */

static void on_rendered(struct lease_task *l)
{
	struct agent *a = l->owner;
	l->state = LEASE_RENDERED;
	if (l->is_unwanted) {
		lease_list_drop(a, l);
	} else if (l->rc || l->outcome == LEASE_STOPPED) {
		if (l->rc == -EILSEQ)
			send_bad_states(a, &l->grant, l->error.text);
		else
			send_lease_failed(a, &l->grant.key, l->rc ? l->error.text : "",
					  note_memory_failure(l->job_cache, l->rc == -ENOMEM));
		lease_list_drop(a, l);
	} else {
		send_result(a, l);
	}
	lease_list_update_backlog(a);
	scene_limit_drop_unused(a);
	fetch_or_build_all(a); /* a scene may have waited for this thread to stop */
	scene_limit_drop_unused(a);
	a->leave_if_idle(a);
}

static int find_or_begin_job(struct agent *a, struct job_cache **cache, uint64_t job, struct error *e)
{
	int rc = scene_limit_admit(a, job, e);
	*cache = rc ? NULL : job_cache_find(a->job_caches, job);
	if (rc || *cache)
		return rc;
	rc = job_cache_new(cache, job, a->cache.blobs, e);
	if (rc)
		return rc;
	(*cache)->next = a->job_caches;
	a->job_caches = *cache;
	send_job_get(a, job);
	return 0;
}

static void handle_grant(struct agent *a, const Farm__LeaseGrant *m, const unsigned char *payload, size_t size)
{
	struct grant g;
	struct error e;
	if (grant_unpack(&g, m, payload, size, &e)) {
		conn_close(a->conn, e.text);
		return;
	}
	struct job_cache *cache;
	struct lease_task *l = lease_list_find(a, &g.key);
	/* If the epoch before was computed again, this is another lease. */
	if (l && !blob_hash_equal(&l->grant.digest, &g.digest)) {
		lease_list_forget(a, l);
		l = NULL;
	}
	if (l) { /* granted on an earlier connection, and in work or rendered */
		if (l->state == LEASE_RENDERED)
			send_result(a, l);
		grant_fini(&g);
		return;
	}
	if (lease_list_is_flooded(a)) {
		grant_fini(&g);
		conn_close(a->conn, "the coordinator grants more leases than were requested");
		return;
	}
	if (a->is_leaving || lease_list_is_full(a)) {
		send_lease_failed(a, &g.key, "", false);
		grant_fini(&g);
		return;
	}
	int rc = find_or_begin_job(a, &cache, g.key.job, &e);
	if (!rc)
		rc = lease_task_new(&l, &g, cache, &e);
	if (rc) {
		if (rc == -EAGAIN)
			send_lease_deferred(a, &g.key, e.text);
		else
			send_lease_failed(a, &g.key, e.text, true);
		grant_fini(&g);
		return;
	}
	cache->last_used = ++a->use_counter;
	struct lease_task **end = &a->leases; /* appended, so that rounds complete in order */
	while (*end)
		end = &(*end)->next;
	*end = l;
	if (cache->state == JOB_CACHE_READY)
		start_lease(a, l);
	scene_limit_drop_unused(a);
}

static void handle_ack(struct agent *a, const Farm__LeaseAck *m)
{
	struct lease_key k;
	struct error e;
	if (lease_key_from_wire(m->key, &k, &e)) {
		conn_close(a->conn, e.text);
		return;
	}
	struct lease_task *l = lease_list_find(a, &k);
	if (m->verdict == FARM__VERDICT__VERDICT_REFUSED)
		log_event(LOG_BATCH_REFUSED, "job=j%llu " LEASE_FORMAT " text=%s", log_u64_arg(k.job), LEASE_VALUES(&k),
			  log_quote(m->text).text);
	else if (m->verdict != FARM__VERDICT__VERDICT_NOTED)
		log_event(LOG_BATCH_ACKNOWLEDGED, "job=j%llu " LEASE_FORMAT " repeat=%d", log_u64_arg(k.job),
			  LEASE_VALUES(&k), m->verdict == FARM__VERDICT__VERDICT_REPEATED);
	if (l && l->state == LEASE_RENDERED) {
		lease_list_drop(a, l);
		lease_list_update_backlog(a);
		scene_limit_drop_unused(a);
	}
}

static void handle_revoke(struct agent *a, const Farm__LeaseRevoke *m)
{
	struct lease_key k;
	struct error e;
	struct lease_task *l = lease_key_from_wire(m->key, &k, &e) ? NULL : lease_list_find(a, &k);
	if (l && l->state != LEASE_RENDERED) /* a result is kept: the coordinator will acknowledge it */
		lease_list_forget(a, l);
	scene_limit_drop_unused(a);
}

static void handle_job_end(struct agent *a, uint64_t job)
{
	struct job_cache *cache = job_cache_find(a->job_caches, job);
	if (!cache)
		return;
	for (struct lease_task *l = a->leases, *next; l; l = next) {
		next = l->next;
		if (l->job_cache == cache && !l->is_unwanted)
			lease_list_forget(a, l);
	}
	cache->has_ended = true;
	lease_list_update_backlog(a);
	scene_limit_drop_unused(a);
}

/* The coordinator has started with an empty spool and given the number to another job: results of the old job are
 * useless. All its leases are returned. Some may have been granted for the new job in the meantime; the coordinator
 * ignores the return of the others. */
static void drop_old_job(struct agent *a, struct job_cache *cache)
{
	log_event(LOG_JOB_NOTE, "job=j%llu text=\"the coordinator has another job with this number\"",
		  log_u64_arg(cache->job));
	for (struct lease_task *l = a->leases, *next; l; l = next) {
		next = l->next;
		if (l->job_cache != cache || l->is_unwanted)
			continue;
		send_lease_failed(a, &l->grant.key, "", false);
		lease_list_forget(a, l);
	}
	lease_list_update_backlog(a);
	cache->has_ended = true;
	cache->job = 0;
	scene_limit_drop_unused(a);
}

static void handle_job_info(struct agent *a, struct envelope *env)
{
	struct job_cache *cache = job_cache_find(a->job_caches, env->message->job_info->job);
	struct error e;
	if (!cache)
		return;
	if (!job_cache_matches(cache, env->message->job_info)) {
		drop_old_job(a, cache);
		return;
	}
	cache->is_confirmed = true;
	if (cache->state == JOB_CACHE_REQUESTED && job_cache_set_info(cache, env, &e))
		fail_job_cache(a, cache, &e);
	fetch_or_build(a, cache);
	for (struct lease_task *l = a->leases; l; l = l->next) /* the job still runs: send results of it */
		if (l->job_cache == cache && l->state == LEASE_RENDERED)
			send_result(a, l);
	scene_limit_drop_unused(a);
}

/* Stores a chunk for the first job that wants the file. If the file cannot be stored, that job fails, which releases
 * the files that it held, and the other jobs that want the file request it again. */
static void handle_blob_chunk(struct agent *a, const Farm__BlobChunk *c, const unsigned char *payload, size_t size)
{
	struct error e;
	struct fetch *f = fetch_match_chunk(a, c);
	if (!f) {
		conn_close(a->conn, "the coordinator sends a chunk of a file that was not requested");
		return;
	}
	const struct blob_hash hash = f->hash;
	struct job_cache *first = scene_limit_find_waiting(a, &hash);
	enum fetch_outcome outcome = FETCH_MORE;
	if (first && !f->writer && cache_restore_folder(&a->cache, &e))
		outcome = FETCH_NOT_STORED;
	else if (first)
		outcome = fetch_store_chunk(f, a->cache.blobs, c, payload, size, &e);
	if (outcome != FETCH_MORE)
		fetch_drop(a, f);
	if (outcome == FETCH_FAILED || outcome == FETCH_NOT_STORED) {
		first->is_worker_at_fault = outcome == FETCH_NOT_STORED;
		fail_job_cache(a, first, &e);
		scene_limit_drop_unused(a);
	}
	fetch_or_build_all(a);
	if (outcome == FETCH_COMPLETE)
		blob_release(a->cache.blobs, &hash);
	scene_limit_drop_unused(a);
}

void lease_queue_handle_message(struct agent *a, struct envelope *env, const unsigned char *payload, size_t size)
{
	const Farm__Envelope *m = env->message;
	switch (m->body_case) {
	case FARM__ENVELOPE__BODY_HEARTBEAT:
		break;
	case FARM__ENVELOPE__BODY_LEASE_GRANT:
		handle_grant(a, m->lease_grant, payload, size);
		break;
	case FARM__ENVELOPE__BODY_LEASE_ACK:
		handle_ack(a, m->lease_ack);
		break;
	case FARM__ENVELOPE__BODY_LEASE_REVOKE:
		handle_revoke(a, m->lease_revoke);
		break;
	case FARM__ENVELOPE__BODY_JOB_INFO:
		handle_job_info(a, env);
		break;
	case FARM__ENVELOPE__BODY_JOB_END:
		handle_job_end(a, m->job_end->job);
		break;
	case FARM__ENVELOPE__BODY_BLOB_CHUNK:
		handle_blob_chunk(a, m->blob_chunk, payload, size);
		break;
	default:
		conn_close(a->conn, "not a message from a coordinator to a worker");
	}
	a->leave_if_idle(a);
}

/* ---- connection and leaving ---- */

/* Reports the leases of earlier processes that a signal has ended; called before any lease is requested. */
static void report_lost_leases(struct agent *a)
{
	struct lost_lease *l;
	for (unsigned i = 0; (l = crash_record_lost_lease_at(i)); i++)
		if (!l->is_reported) {
			send_lease_failed(a, &l->key, l->text, l->is_worker_at_fault);
			l->is_reported = true;
		}
}

/* On a new connection the coordinator grants open leases again. Of those that have not begun, keeps no more than it
 * would grant. */
static void drop_old_leases(struct agent *a)
{
	unsigned open = 0;
	for (struct lease_task *l = a->leases, *next; l; l = next) {
		next = l->next;
		if (l->state != LEASE_RENDERED && ++open > a->config.threads + 1 &&
		    (l->state == LEASE_WAITING || thread_pool_remove(a->thread_pool, &l->task)))
			lease_list_drop(a, l);
	}
	scene_limit_drop_unused(a);
}

void lease_queue_on_connect(struct agent *a)
{
	drop_old_leases(a);
	for (struct lease_task *l = a->leases; l; l = l->next)
		l->is_sent = false;
	report_lost_leases(a);
	fetch_reset_requests(a);
	/* Ask whether the jobs still exist. The answers resume unfinished fetches and send unsent results. */
	for (struct job_cache *cache = a->job_caches; cache; cache = cache->next) {
		cache->is_confirmed = false;
		if (!cache->has_ended)
			send_job_get(a, cache->job);
	}
	send_lease_request(a);
}

void lease_queue_return_unstarted(struct agent *a)
{
	send_lease_request(a);
	for (struct lease_task *l = a->leases, *next; l; l = next) {
		next = l->next;
		if (l->state == LEASE_RENDERED ||
		    (l->state == LEASE_QUEUED && !thread_pool_remove(a->thread_pool, &l->task)))
			continue;
		send_lease_failed(a, &l->grant.key, "", false);
		lease_list_drop(a, l);
	}
}

void lease_queue_stop_all(struct agent *a)
{
	for (struct lease_task *l = a->leases; l; l = l->next)
		atomic_store(&l->stop_requested, true);
}

/* Hanging threads and scenes being built do not count. */
bool lease_queue_is_idle(const struct agent *a)
{
	unsigned excluded = 0;
	for (const struct lease_task *l = a->leases; l; l = l->next, excluded++)
		if (!l->task.is_hung)
			return false;
	for (const struct job_cache *cache = a->job_caches; cache; cache = cache->next)
		excluded += cache->state == JOB_CACHE_BUILDING;
	return thread_pool_pending(a->thread_pool) == excluded;
}

void lease_queue_close(struct agent *a)
{
	while (a->fetches)
		fetch_drop(a, a->fetches);
	while (a->leases)
		lease_list_drop(a, a->leases);
	while (a->job_caches) {
		if (a->job_caches->state == JOB_CACHE_BUILDING) /* the thread has ended without calling back */
			a->job_caches->state = a->job_caches->world ? JOB_CACHE_READY : JOB_CACHE_FAILED;
		scene_limit_drop(a, a->job_caches);
	}
}
