/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/room.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/retention/keep.h"

#include <stdlib.h>

bool room_make(const struct jobs *jobs)
{
	return blob_store_evict(jobs->blobs) || keep_drop_all(jobs);
}

/* Returns the size of the next checkpoint, supposing that it is as large as the last one; before the first one, an
 * upper bound. */
static uint64_t checkpoint_size(const struct live_job *job)
{
	return job->checkpoint_bytes ? job->checkpoint_bytes : canvas_bytes(&job->plan);
}

static uint64_t usual_limit(const struct jobs *jobs, const struct live_job *job)
{
	return job->checkpoint_bytes > jobs->config.journal_bytes ? job->checkpoint_bytes : jobs->config.journal_bytes;
}

static uint64_t available(const struct jobs *jobs)
{
	char path[SPOOL_PATH_MAX];
	spool_path(jobs->spool, "jobs", path);
	return disk_available(path);
}

/* Adds up the merged results of ended and live jobs on the disk, without images and scene files. Returns false if not
 * all of them could be read. */
static bool job_bytes(const struct jobs *jobs, uint64_t *sum)
{
	uint64_t bytes;
	bool whole = true;
	*sum = 0;
	for (size_t i = 0; i < jobs->ended_count; i++) {
		whole = spool_film_bytes(jobs->spool, jobs->ended[i].id, 1, &bytes, NULL) == 0 && whole;
		*sum += bytes;
	}
	for (const struct live_job *job = jobs->live; job; job = job->next) {
		whole = spool_film_bytes(jobs->spool, job->id, 1, &bytes, NULL) == 0 && whole;
		*sum += bytes;
		if (job->canvas && canvas_is_mapped(job->canvas))
			*sum += canvas_bytes(&job->plan) - canvas_unreserved(job->canvas);
	}
	return whole;
}

int room_could_hold(const struct jobs *jobs, uint64_t bytes, struct error *e)
{
	uint64_t left = available(jobs), freed;
	if (bytes <= left || jobs->found || jobs->reading)
		return 0;
	bool known = job_bytes(jobs, &freed);
	freed += blob_store_bytes(jobs->blobs);
	if (!known || bytes - left <= freed)
		return 0;
	return error_set(
		e, ENOSPC,
		"it may need %llu bytes for its files and films, and the disk of the "
		"coordinator's spool has %llu: %llu are free, %llu belong to scenes and jobs that end: a smaller "
		"--size or --crop, or fewer --groups",
		(unsigned long long)bytes, (unsigned long long)(left + freed), (unsigned long long)left,
		(unsigned long long)freed);
}

bool room_is_ample(const struct jobs *jobs)
{
	uint64_t need = 0, largest = 0;
	for (const struct live_job *job = jobs->live; job; job = job->next) {
		uint64_t limit = job->kept_bytes + usual_limit(jobs, job), size = checkpoint_size(job);
		need += limit > journal_bytes(job->journal) ? limit - journal_bytes(job->journal) : 0;
		largest = size > largest ? size : largest;
	}
	return need + largest <= available(jobs);
}

static int compare(const void *first, const void *second)
{
	const struct room_claim *a = first, *b = second;
	if (a->priority != b->priority)
		return a->priority > b->priority ? -1 : 1;
	return a->job < b->job ? -1 : a->job > b->job;
}

void room_share(struct room_claim *claims, size_t count, uint64_t available)
{
	bool any = false;
	if (count)
		qsort(claims, count, sizeof *claims, compare);
	for (size_t i = 0; i < count; i++) {
		claims[i].goes = claims[i].bytes <= available;
		available -= claims[i].goes ? claims[i].bytes : 0;
		any = any || claims[i].goes;
	}
	if (count && !any)
		claims[0].goes = true;
}

static uint64_t claim_of(const struct jobs *jobs, const struct live_job *job)
{
	uint64_t size = checkpoint_size(job), most = job->kept_bytes + size, journal = journal_bytes(job->journal);
	uint64_t films = job->canvas ? canvas_unreserved(job->canvas) : 0;
	if (!job->canvas && jobs_film_folder(jobs, &job->plan))
		films = canvas_bytes(&job->plan);
	return size + (most > journal ? most - journal : 0) + films;
}

/* Returns the claims of all jobs from which results may come, and of `asking`, sorted and decided by room_share;
 * mem_alloc'd, NULL: out of memory. */
static struct room_claim *claims_of_all(const struct jobs *jobs, const struct live_job *asking, size_t *count)
{
	size_t live = 0;
	for (const struct live_job *j = jobs->live; j; j = j->next)
		live++;
	struct room_claim *claims = mem_alloc(live, sizeof *claims);
	*count = 0;
	for (const struct live_job *j = jobs->live; j && claims; j = j->next) {
		int priority;
		bool expects = farm_expects_results(jobs->farm, j->id, &priority);
		if (j->journal && !j->ended && (expects || j == asking))
			claims[(*count)++] = (struct room_claim){j->id, claim_of(jobs, j), priority, false};
	}
	if (claims)
		room_share(claims, *count, available(jobs));
	return claims;
}

uint64_t room_first(const struct jobs *jobs, const struct live_job *job)
{
	size_t count;
	uint64_t first = 0;
	struct room_claim *claims = claims_of_all(jobs, job, &count);
	for (size_t i = count; claims && i-- > 0;) {
		if (claims[i].goes)
			first = claims[i].job;
		if (first == job->id)
			break;
	}
	mem_free(claims);
	return first == job->id ? 0 : first;
}

uint64_t room_for_states(const struct jobs *jobs, const struct live_job *job, uint64_t after)
{
	const struct live_job *most = NULL;
	uint64_t large = 0, small = 0, all = jobs->config.state_bytes;
	uint64_t one = all / ROOM_SMALL_JOB, apart = all / ROOM_SMALL_JOBS;
	for (const struct live_job *j = jobs->live; j; j = j->next) {
		if (j == job)
			continue;
		*(j->state_bytes <= one ? &small : &large) += j->state_bytes;
		most = !most || j->state_bytes > most->state_bytes ? j : most;
	}
	bool is_small = after <= one;
	uint64_t others = large + (is_small ? small : small > apart ? small - apart : 0);
	return others <= all / 2 || (is_small && small + after <= apart) ? 0 : most->id;
}

uint64_t room_for_journal(const struct jobs *jobs, const struct live_job *job, bool ample)
{
	uint64_t usual = usual_limit(jobs, job), size = checkpoint_size(job);
	return ample || size > usual ? usual : size;
}

bool room_is_left(const struct jobs *jobs, const struct live_job *job, uint64_t bytes)
{
	uint64_t size = checkpoint_size(job), journal = journal_bytes(job->journal);
	return !job->canvas || journal < job->kept_bytes + size || bytes + size <= available(jobs);
}
