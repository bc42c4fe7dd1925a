/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/peers/worker_requests.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "common/base/text.h"
#include "coordinator/jobs/files.h"
#include "coordinator/peers/session.h"
#include "coordinator/peers/worker_send.h"

enum {
	CHUNK_MIN = 1 << 16,
	CHUNK_MAX = 1 << 20,
	SEND_AHEAD_MAX = 1 << 22, /* another answer is made while fewer bytes than this are unsent */
	/* Shared by all connections, since thousands of workers may begin a job at once. */
	SEND_AHEAD_TOTAL_MAX = 1 << 30,
	REQUESTS_MAX = 512, /* twice what a worker can need that has leases of as many jobs as it may hold */
};

/* Returns how many bytes may be unsent when the next answer is made. Half of the limit on all unsent bytes is left to
 * other answers. */
static size_t send_ahead_bytes(const struct session *p)
{
	uint64_t half = p->peers->send_pool.max_bytes / 2,
		 total = half < SEND_AHEAD_TOTAL_MAX ? half : SEND_AHEAD_TOTAL_MAX;
	size_t share = total / (p->peers->session_count + 1);
	return share < SEND_AHEAD_MAX ? share : SEND_AHEAD_MAX;
}

static size_t chunk_size(const struct session *p)
{
	size_t n = send_ahead_bytes(p);
	return n < CHUNK_MIN ? CHUNK_MIN : n < CHUNK_MAX ? n : CHUNK_MAX;
}

static void send_job_info(struct session *p, uint64_t id)
{
	const struct live_job *job = jobs_find_live(p->jobs, id);
	if (!job) {
		worker_send_job_end(p, id);
		return;
	}
	worker_raise_payload_limit(p, job);
	const Farm__Submit *submission = live_job_submission(job);
	Farm__Plan plan;
	plan_to_wire(&job->plan, &plan);
	conn_send(p->conn,
		  ENVELOPE(JOB_INFO, job_info, .job = id, .name = submission->name, .scene = submission->scene,
			   .n_defines = submission->n_defines, .defines = submission->defines,
			   .render_width = submission->render_width, .render_height = submission->render_height,
			   .plan = &plan, .n_files = submission->n_files, .files = submission->files),
		  NULL, 0);
}

/* refusal: why the file cannot be sent; "": it can be. */
static void send_chunk(struct session *p, const struct worker_request *a, const char *refusal)
{
	struct error e;
	struct blob_hash h = a->hash;
	uint64_t size = 0;
	size_t max_bytes = chunk_size(p);
	unsigned char *bytes = mem_alloc(max_bytes, 1);
	ssize_t n = 0;
	text_copy(e.text, sizeof e.text, refusal);
	int fd = *refusal ? -1 : blob_open(p->jobs->blobs, &h, &size, &e);
	if (fd >= 0 && bytes)
		n = disk_pread(fd, bytes, max_bytes, a->job_or_offset <= size ? (off_t)a->job_or_offset : 0);
	if (fd >= 0 && (!bytes || n < 0 || a->job_or_offset > size))
		error_set(&e, EIO, "the blob cannot be read there");
	conn_send(p->conn,
		  ENVELOPE(BLOB_CHUNK, blob_chunk, .hash = {sizeof h.bytes, h.bytes}, .offset = a->job_or_offset,
			   .size = size, .error = e.text),
		  bytes, *e.text ? 0 : (size_t)n);
	if (fd >= 0)
		disk_close(fd);
	mem_free(bytes);
}

/* Answers a request. A file is checked before its first piece is sent: returns false while it is being read for that.
 */
static bool answer_request(struct session *p, const struct worker_request *a)
{
	struct error e = {""};
	if (!a->is_blob) {
		send_job_info(p, a->job_or_offset);
		return true;
	}
	if (a->job_or_offset == 0 && files_check(p->jobs, &a->hash, &e) == -EINPROGRESS)
		return false;
	send_chunk(p, a, e.text);
	return true;
}

void worker_requests_handle(struct session *p, const struct worker_request *a)
{
	if (STAILQ_EMPTY(&p->requests) && conn_unsent_bytes(p->conn) <= send_ahead_bytes(p) && answer_request(p, a))
		return;
	struct worker_request *last = p->request_count < REQUESTS_MAX ? mem_alloc(1, sizeof *last) : NULL;
	if (!last) {
		session_fault(p, "%u chunks and jobs were requested and not read: no worker needs so many",
			      p->request_count);
		return;
	}
	*last = *a;
	STAILQ_INSERT_TAIL(&p->requests, last, next);
	p->request_count++;
}

static void drop_first(struct session *p)
{
	struct worker_request *a = STAILQ_FIRST(&p->requests);
	STAILQ_REMOVE_HEAD(&p->requests, next);
	p->request_count--;
	mem_free(a);
}

void worker_requests_resume(void *session)
{
	struct session *p = session;
	while (!STAILQ_EMPTY(&p->requests) && p->state == SESSION_WORKER &&
	       conn_unsent_bytes(p->conn) <= send_ahead_bytes(p) && answer_request(p, STAILQ_FIRST(&p->requests)))
		drop_first(p);
}

void worker_requests_file_checked(struct session *p, const struct blob_hash *h, const char *refusal)
{
	const struct worker_request *a = STAILQ_FIRST(&p->requests);
	if (!a || p->state != SESSION_WORKER)
		return;
	/* The file is not checked again, however long the reading took. */
	if (a->is_blob && a->job_or_offset == 0 && blob_hash_equal(&a->hash, h)) {
		send_chunk(p, a, refusal);
		drop_first(p);
	}
	worker_requests_resume(p);
}

void worker_requests_drop(struct session *p)
{
	while (!STAILQ_EMPTY(&p->requests))
		drop_first(p);
}
