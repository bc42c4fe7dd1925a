/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A whole scene in a process of its own: read, checked, built, and a small lease of every integrator. What ends it, and
 * what it said, comes back.
 */
#ifndef TESTS_SUPPORT_SCENE_TRIAL_H
#define TESTS_SUPPORT_SCENE_TRIAL_H

#include "tests/support/memory_assets.h"

enum trial_end {
	TRIAL_REFUSED = 10, /* by a sentence with file and line */
	TRIAL_RENDERED,
	TRIAL_NO_PLACE, /* refused by a sentence without them */
	TRIAL_FAILED,	/* it passed the check and did not render */
};

/* files: the scene first. One of trial_end, else the exit code, or the negative number of the signal that ended it. */
int scene_trial(const struct memory_file *files, char *text, size_t size);

#endif
