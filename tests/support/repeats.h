/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Many renders of one world that differ only in their seeds, made as by hslt-render, on two threads: for tests of
 * stated errors. Seeds follow from the test's name, so that results are the same in each run.
 */
#ifndef TESTS_SUPPORT_REPEATS_H
#define TESTS_SUPPORT_REPEATS_H

#include "common/estimate/canvas_image.h"
#include "worker/render/world/world.h"

struct repeats_options {
	const char *integrator, *test;
	uint32_t count;
	uint64_t spp, bootstrap, epoch; /* 0: by the plan's rule; for spp, until the target is met */
	uint32_t chains, groups;
	double target_error;
};

/* Examines a render after each complete round. Called from two threads, but for each render from only one of them. */
typedef void repeats_observer(void *user, uint32_t render, uint64_t rounds, const struct canvas *c);

struct repeats {
	uint32_t count, value_count; /* value_count: width x height x 3 */
	struct plan plan;	     /* of the first render */
	struct canvas_image *images;
	double cpu_seconds; /* of all leases together */
};

void repeats_run(const struct world *w, const struct repeats_options *options, repeats_observer *observer, void *user,
		 struct repeats *out);
void repeats_fini(struct repeats *r);

#endif
