/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/retention/age.h"

#include <stdlib.h>

static int by_end(const void *a, const void *b)
{
	const struct age_job *x = a, *y = b;
	if (x->order != y->order)
		return x->order < y->order ? -1 : 1;
	return (x->id > y->id) - (x->id < y->id);
}

static void by_age(struct age_job *j, const struct age_limits *l, double now)
{
	double age = now - j->ended;
	j->no_films = j->no_result = j->no_record = false;
	if (!(l->seconds > 0) || j->busy)
		return;
	j->no_films = j->no_result = age > l->seconds;
	j->no_record = age > AGE_RECORD * l->seconds;
}

void age_choose(struct age_job *jobs, size_t count, const struct age_limits *l, double now)
{
	uint64_t bytes = 0;
	if (count)
		qsort(jobs, count, sizeof *jobs, by_end);
	for (size_t i = 0; i < count; i++) {
		by_age(&jobs[i], l, now);
		bytes += (jobs[i].no_films ? 0 : jobs[i].films) + (jobs[i].no_result ? 0 : jobs[i].result);
	}
	for (size_t i = 0; i < count && l->bytes && bytes > l->bytes; i++)
		if (!jobs[i].no_films && jobs[i].films) {
			jobs[i].no_films = true;
			bytes -= jobs[i].films;
		}
	for (size_t i = 0; i < count && l->bytes && bytes > l->bytes; i++)
		if (!jobs[i].no_result && jobs[i].result && !jobs[i].busy) {
			jobs[i].no_result = true;
			bytes -= jobs[i].result;
		}
}
