/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/expiry.h"

#include <stdlib.h>

static int compare_ends(const void *a, const void *b)
{
	const struct expiry_job *x = a, *y = b;
	if (x->end_order != y->end_order)
		return x->end_order < y->end_order ? -1 : 1;
	return (x->id > y->id) - (x->id < y->id);
}

static void choose_by_age(struct expiry_job *j, const struct expiry_limits *l, double now)
{
	double age = now - j->ended_at;
	j->must_drop_films = j->must_drop_result = j->must_drop_record = false;
	if (!(l->max_age_seconds > 0) || j->is_in_use)
		return;
	j->must_drop_films = j->must_drop_result = age > l->max_age_seconds;
	j->must_drop_record = age > EXPIRY_RECORD_FACTOR * l->max_age_seconds;
}

void expiry_choose_deletions(struct expiry_job *jobs, size_t count, const struct expiry_limits *l, double now)
{
	uint64_t bytes = 0;
	if (count)
		qsort(jobs, count, sizeof *jobs, compare_ends);
	for (size_t i = 0; i < count; i++) {
		choose_by_age(&jobs[i], l, now);
		bytes += (jobs[i].must_drop_films ? 0 : jobs[i].film_bytes) +
			 (jobs[i].must_drop_result ? 0 : jobs[i].result_bytes);
	}
	for (size_t i = 0; i < count && l->max_bytes && bytes > l->max_bytes; i++)
		if (!jobs[i].must_drop_films && jobs[i].film_bytes) {
			jobs[i].must_drop_films = true;
			bytes -= jobs[i].film_bytes;
		}
	for (size_t i = 0; i < count && l->max_bytes && bytes > l->max_bytes; i++)
		if (!jobs[i].must_drop_result && jobs[i].result_bytes && !jobs[i].is_in_use) {
			jobs[i].must_drop_result = true;
			bytes -= jobs[i].result_bytes;
		}
}
