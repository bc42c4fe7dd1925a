/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Sends files of jobs to clients, chunk by chunk. A file is opened once per fetch, so all chunks are of the same file
 * even if another one takes its name meanwhile.
 */
#include "coordinator/peers/fetch.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/jobs/publish.h"
#include "coordinator/peers/client_answers.h"

#include <fcntl.h>
#include <string.h>

enum { CHUNK_BYTES = 1 << 20 };
static const double preview_max_age = 5; /* a preview younger than this is sent again */

static const char *file_name(Farm__What what)
{
	switch (what) {
	case FARM__WHAT__WHAT_RESULT:
		return "result.exr";
	case FARM__WHAT__WHAT_LOG:
		return "log";
	case FARM__WHAT__WHAT_PREVIEW:
		return "preview.exr";
	default:
		return NULL; /* an unknown number in the message */
	}
}

static int cleared_error(const struct job_record *r, struct error *e)
{
	char day[32];
	struct tm t;
	time_t at = (time_t)r->cleared;
	strftime(day, sizeof day, "%Y-%m-%d", gmtime_r(&at, &t));
	return error_set(e, ENOENT,
			 "job j%llu: its result was cleared on %s, by --keep-days or --keep-gb of the coordinator",
			 (unsigned long long)r->id, day);
}

void fetch_end(struct session *p)
{
	if (!p->fetch.job)
		return;
	disk_close(p->fetch.fd);
	p->fetch = (struct file_fetch){0};
	p->peers->fetch_count--;
}

/* Drops the fetch that has been idle longest if there are too many: clients that start and stop must not block those
 * that continue. */
static void drop_idlest_fetch(struct peers *s)
{
	struct session *idlest = NULL;
	if (s->fetch_count < s->jobs->config.max_fetches)
		return;
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		if (p->fetch.job && (!idlest || p->fetch.sent_at < idlest->fetch.sent_at))
			idlest = p;
	fetch_end(idlest);
}

static int open_file(struct session *p, const Farm__Fetch *f, const char *file, struct error *e)
{
	char path[SPOOL_PATH_MAX];
	struct stat st;
	spool_job_path(p->jobs->spool, f->job, file, path);
	int fd = disk_open(path, O_RDONLY | O_CLOEXEC, 0);
	if (fd < 0 && errno == ENOENT)
		return f->what == FARM__WHAT__WHAT_PREVIEW
			       ? error_set(e, ENOENT, "no round of j%llu is complete yet", (unsigned long long)f->job)
			       : error_set(e, ENOENT, "j%llu has no %s", (unsigned long long)f->job, file);
	if (fd < 0 || disk_fstat(fd, &st)) {
		int rc = error_set(e, errno, "%s", strerror(errno));
		if (fd >= 0)
			disk_close(fd);
		return rc;
	}
	if (st.st_size > CHUNK_BYTES) /* otherwise the first chunk is the only one */
		drop_idlest_fetch(p->peers);
	p->fetch = (struct file_fetch){.job = f->job, .file_kind = f->what, .fd = fd, .size = (uint64_t)st.st_size};
	p->peers->fetch_count++;
	return 0;
}

static int begin_fetch(struct session *p, const Farm__Fetch *f, struct job_view *v, struct error *e)
{
	const char *file = file_name(f->what);
	fetch_end(p);
	if (!client_find_job(p, f->job, v))
		return error_set(e, ENOENT, "j%llu: no such job", (unsigned long long)f->job);
	if (!file)
		return error_set(e, EINVAL, "unknown kind of file to fetch");
	if (f->what == FARM__WHAT__WHAT_RESULT && v->record.cleared > 0)
		return cleared_error(&v->record, e);
	if (f->what == FARM__WHAT__WHAT_RESULT && !v->record.has_result)
		return error_set(e, ENOENT, "job j%llu is %s: it has no result%s", (unsigned long long)f->job,
				 v->record.state,
				 v->record.ended > 0 ? "" : "; hslt-job fetch --preview fetches the image so far");
	return open_file(p, f, file, e);
}

static int read_chunk(const struct file_fetch *t, const Farm__Fetch *f, unsigned char *bytes, size_t *count,
		      struct error *e)
{
	if (t->job != f->job || t->file_kind != f->what)
		return error_set(e, ESTALE,
				 "j%llu: the fetch was dropped in favour of others, or did not start at the beginning",
				 (unsigned long long)f->job);
	if (f->offset > t->size)
		return error_set(e, EINVAL, "the file ends before that");
	uint64_t remaining = t->size - f->offset;
	ssize_t n = disk_pread(t->fd, bytes, remaining < CHUNK_BYTES ? remaining : CHUNK_BYTES, (off_t)f->offset);
	if (n < 0 || (n == 0 && remaining))
		return error_set(e, n < 0 ? errno : EIO, "%s",
				 n < 0 ? strerror(errno) : "the file is shorter than it was");
	*count = (size_t)n;
	return 0;
}

static void answer_fetch(struct session *p, const Farm__Fetch *f)
{
	struct job_view v;
	struct error e = {""};
	unsigned char *bytes = mem_alloc(CHUNK_BYTES, 1);
	size_t count = 0;
	Farm__FetchChunk chunk =
		MESSAGE(fetch_chunk, .job = f->job, .what = f->what, .offset = f->offset, .error = e.text);
	int rc = !bytes ? error_set(&e, ENOMEM, "no memory") : f->offset ? 0 : begin_fetch(p, f, &v, &e);
	if (!rc && !f->offset)
		chunk.output = v.record.output;
	if (!rc)
		rc = read_chunk(&p->fetch, f, bytes, &count, &e);
	if (!rc)
		chunk.size = p->fetch.size;
	p->fetch.sent_at = jobs_now(p->jobs);
	if (rc || f->offset + count == chunk.size)
		fetch_end(p);
	conn_send(p->conn, ENVELOPE_OF(FETCH_CHUNK, fetch_chunk, &chunk), bytes, count);
	mem_free(bytes);
}

/* Whether a new preview must be made. Previews are made on demand; making one delays the job's results for as long as
 * it takes. */
static bool is_preview_old(const struct jobs *jobs, const struct live_job *job)
{
	return job && job->canvas && !job->has_ended &&
	       (job->preview_made_at <= 0 || jobs_now(jobs) - job->preview_made_at > preview_max_age);
}

void fetch_serve_previews(struct peers *s, uint64_t id)
{
	for (struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next)) {
		struct live_job *job = jobs_find_live(s->jobs, id);
		if (p->preview_job != id || (job && job->is_busy))
			continue;
		if (is_preview_old(s->jobs, job)) {
			publish_start(s->jobs, job, PUBLISH_PREVIEW, 0);
			continue;
		}
		p->preview_job = 0;
		answer_fetch(p, &MESSAGE(fetch, .job = id, .what = FARM__WHAT__WHAT_PREVIEW));
	}
}

void fetch_begin(struct session *p, const Farm__Fetch *f)
{
	struct job_view v;
	if (f->what != FARM__WHAT__WHAT_PREVIEW || f->offset || !client_find_job(p, f->job, &v)) {
		answer_fetch(p, f);
		return;
	}
	p->preview_job = f->job;
	fetch_serve_previews(p->peers, f->job);
}

bool fetch_uses_result(const struct peers *s, uint64_t job)
{
	static const double fetching_seconds = 60;
	double cutoff = jobs_now(s->jobs) - fetching_seconds;
	for (const struct session *p = LIST_FIRST(&s->sessions); p; p = LIST_NEXT(p, next))
		if (p->watched_job == job || (p->ended_watch.job == job && p->ended_watch.notified_at > cutoff) ||
		    (p->fetch.job == job && p->fetch.sent_at > cutoff))
			return true;
	return false;
}
