/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/jobs/storage.h"

#include "common/base/disk.h"
#include "common/base/mem.h"
#include "coordinator/retention/kept_films.h"

#include <stdlib.h>

bool storage_evict(const struct jobs *jobs)
{
	return blob_store_evict(jobs->blobs) || kept_films_drop_all(jobs);
}

/* Returns the size of the next checkpoint, supposing that it is as large as the last one; before the first one, an
 * upper bound. */
static uint64_t checkpoint_size(const struct live_job *job)
{
	return job->checkpoint_bytes ? job->checkpoint_bytes : canvas_bytes(&job->plan);
}

static uint64_t usual_journal_limit(const struct jobs *jobs, const struct live_job *job)
{
	return job->checkpoint_bytes > jobs->config.max_journal_bytes ? job->checkpoint_bytes
								      : jobs->config.max_journal_bytes;
}

static uint64_t available_bytes(const struct jobs *jobs)
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
	bool complete = true;
	*sum = 0;
	for (size_t i = 0; i < jobs->ended_job_count; i++) {
		complete = spool_film_bytes(jobs->spool, jobs->ended_jobs[i].id, 1, &bytes, NULL) == 0 && complete;
		*sum += bytes;
	}
	for (const struct live_job *job = jobs->live_jobs; job; job = job->next) {
		complete = spool_film_bytes(jobs->spool, job->id, 1, &bytes, NULL) == 0 && complete;
		*sum += bytes;
		if (job->canvas && canvas_is_mapped(job->canvas))
			*sum += canvas_bytes(&job->plan) - canvas_unreserved_bytes(job->canvas);
	}
	return complete;
}

int storage_check_fits(const struct jobs *jobs, uint64_t bytes, struct error *e)
{
	uint64_t free_bytes = available_bytes(jobs), freed;
	if (bytes <= free_bytes || jobs->recovering_jobs || jobs->extended_job)
		return 0;
	bool is_complete = job_bytes(jobs, &freed);
	freed += blob_store_bytes(jobs->blobs);
	if (!is_complete || bytes - free_bytes <= freed)
		return 0;
	return error_set(
		e, ENOSPC,
		"it may need %llu bytes for its files and films, and the disk of the "
		"coordinator's spool has %llu: %llu are free, %llu belong to scenes and jobs that end: a smaller "
		"--size or --crop, or fewer --groups",
		(unsigned long long)bytes, (unsigned long long)(free_bytes + freed), (unsigned long long)free_bytes,
		(unsigned long long)freed);
}

bool storage_is_ample(const struct jobs *jobs)
{
	uint64_t need = 0, largest = 0;
	for (const struct live_job *job = jobs->live_jobs; job; job = job->next) {
		uint64_t limit = job->merged_record_bytes + usual_journal_limit(jobs, job), size = checkpoint_size(job);
		need += limit > journal_bytes(job->journal) ? limit - journal_bytes(job->journal) : 0;
		largest = size > largest ? size : largest;
	}
	return need + largest <= available_bytes(jobs);
}

static int compare_claims(const void *first, const void *second)
{
	const struct storage_claim *a = first, *b = second;
	if (a->priority != b->priority)
		return a->priority > b->priority ? -1 : 1;
	return a->job < b->job ? -1 : a->job > b->job;
}

void storage_grant_claims(struct storage_claim *claims, size_t count, uint64_t available)
{
	bool any = false;
	if (count)
		qsort(claims, count, sizeof *claims, compare_claims);
	for (size_t i = 0; i < count; i++) {
		claims[i].may_write = claims[i].bytes <= available;
		available -= claims[i].may_write ? claims[i].bytes : 0;
		any = any || claims[i].may_write;
	}
	if (count && !any)
		claims[0].may_write = true;
}

static uint64_t claim_bytes(const struct jobs *jobs, const struct live_job *job)
{
	uint64_t size = checkpoint_size(job), max_journal = job->merged_record_bytes + size,
		 journal = journal_bytes(job->journal);
	uint64_t films = job->canvas ? canvas_unreserved_bytes(job->canvas) : 0;
	if (!job->canvas && jobs_film_folder(jobs, &job->plan))
		films = canvas_bytes(&job->plan);
	return size + (max_journal > journal ? max_journal - journal : 0) + films;
}

/* Returns the claims of all jobs from which results may come, and of `requesting_job`, sorted and decided by
 * storage_grant_claims; mem_alloc'd, NULL: out of memory. */
static struct storage_claim *decide_claims(const struct jobs *jobs, const struct live_job *requesting_job,
					   size_t *count)
{
	size_t live = 0;
	for (const struct live_job *j = jobs->live_jobs; j; j = j->next)
		live++;
	struct storage_claim *claims = mem_alloc(live, sizeof *claims);
	*count = 0;
	for (const struct live_job *j = jobs->live_jobs; j && claims; j = j->next) {
		int priority;
		bool expects = farm_job_expects_results(jobs->farm, j->id, &priority);
		if (j->journal && !j->has_ended && (expects || j == requesting_job))
			claims[(*count)++] = (struct storage_claim){j->id, claim_bytes(jobs, j), priority, false};
	}
	if (claims)
		storage_grant_claims(claims, *count, available_bytes(jobs));
	return claims;
}

uint64_t storage_find_write_blocker(const struct jobs *jobs, const struct live_job *job)
{
	size_t count;
	uint64_t first = 0;
	struct storage_claim *claims = decide_claims(jobs, job, &count);
	for (size_t i = count; claims && i-- > 0;) {
		if (claims[i].may_write)
			first = claims[i].job;
		if (first == job->id)
			break;
	}
	mem_free(claims);
	return first == job->id ? 0 : first;
}

uint64_t storage_find_states_blocker(const struct jobs *jobs, const struct live_job *job, uint64_t after)
{
	const struct live_job *largest_job = NULL;
	uint64_t large = 0, small = 0, limit = jobs->config.max_state_bytes;
	uint64_t small_limit = limit / STORAGE_SMALL_JOB_DIVISOR, small_reserve = limit / STORAGE_SMALL_RESERVE_DIVISOR;
	for (const struct live_job *j = jobs->live_jobs; j; j = j->next) {
		if (j == job)
			continue;
		*(j->state_bytes <= small_limit ? &small : &large) += j->state_bytes;
		largest_job = !largest_job || j->state_bytes > largest_job->state_bytes ? j : largest_job;
	}
	bool is_small = after <= small_limit;
	uint64_t others = large + (is_small ? small : small > small_reserve ? small - small_reserve : 0);
	return others <= limit / 2 || (is_small && small + after <= small_reserve) ? 0 : largest_job->id;
}

uint64_t storage_journal_limit(const struct jobs *jobs, const struct live_job *job, bool ample)
{
	uint64_t usual = usual_journal_limit(jobs, job), size = checkpoint_size(job);
	return ample || size > usual ? usual : size;
}

bool storage_fits_checkpoint(const struct jobs *jobs, const struct live_job *job, uint64_t bytes)
{
	uint64_t size = checkpoint_size(job), journal = journal_bytes(job->journal);
	return !job->canvas || journal < job->merged_record_bytes + size || bytes + size <= available_bytes(jobs);
}
