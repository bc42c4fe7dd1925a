/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/age.h"

#include <stdlib.h>

static int compare_ends(const void *a, const void *b)
{
	const struct age_job *x = a, *y = b;
	if (x->end_order != y->end_order)
		return x->end_order < y->end_order ? -1 : 1;
	return (x->id > y->id) - (x->id < y->id);
}

static void choose_by_age(struct age_job *j, const struct age_limits *l, double now)
{
	double age = now - j->ended;
	j->drop_films = j->drop_result = j->drop_record = false;
	if (!(l->max_age_seconds > 0) || j->is_in_use)
		return;
	j->drop_films = j->drop_result = age > l->max_age_seconds;
	j->drop_record = age > AGE_RECORD_FACTOR * l->max_age_seconds;
}

void age_choose_deletions(struct age_job *jobs, size_t count, const struct age_limits *l, double now)
{
	uint64_t bytes = 0;
	if (count)
		qsort(jobs, count, sizeof *jobs, compare_ends);
	for (size_t i = 0; i < count; i++) {
		choose_by_age(&jobs[i], l, now);
		bytes += (jobs[i].drop_films ? 0 : jobs[i].film_bytes) +
			 (jobs[i].drop_result ? 0 : jobs[i].result_bytes);
	}
	for (size_t i = 0; i < count && l->max_bytes && bytes > l->max_bytes; i++)
		if (!jobs[i].drop_films && jobs[i].film_bytes) {
			jobs[i].drop_films = true;
			bytes -= jobs[i].film_bytes;
		}
	for (size_t i = 0; i < count && l->max_bytes && bytes > l->max_bytes; i++)
		if (!jobs[i].drop_result && jobs[i].result_bytes && !jobs[i].is_in_use) {
			jobs[i].drop_result = true;
			bytes -= jobs[i].result_bytes;
		}
}
