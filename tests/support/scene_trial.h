/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads, checks and builds a whole scene in a process of its own, and runs a small lease with every integrator. Reports
 * how that ended, with the message.
 */
#ifndef TESTS_SUPPORT_SCENE_TRIAL_H
#define TESTS_SUPPORT_SCENE_TRIAL_H

#include "tests/support/memory_assets.h"

enum trial_end {
	TRIAL_REFUSED = 10, /* refused by an error with file and line */
	TRIAL_RENDERED,
	TRIAL_REFUSED_WITHOUT_PLACE, /* refused by an error without file and line */
	TRIAL_FAILED,		     /* it passed the check but did not render */
};

/* files: the scene first. Returns one of trial_end, or another exit code, or the negative number of the signal that
 * ended the process. */
int scene_trial_run(const struct memory_file *files, char *text, size_t size);

#endif
