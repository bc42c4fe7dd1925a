/* SPDX-License-Identifier: Apache-2.0 */
/* Preloaded: building a scene takes $HSLT_BUILD seconds, and its start is reported by a line on stderr; with
 * $HSLT_BUILD_TICKS the build reports progress meanwhile. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef bool progress_function(void *, double);

static progress_function *progress_monitor;
static void *progress_user;

void rtcSetSceneProgressMonitorFunction(void *scene, progress_function *f, void *user)
{
	void (*next)(void *, progress_function *, void *) = dlsym(RTLD_NEXT, "rtcSetSceneProgressMonitorFunction");
	progress_monitor = f;
	progress_user = user;
	next(scene, f, user);
}

void rtcCommitScene(void *scene)
{
	void (*next)(void *) = dlsym(RTLD_NEXT, "rtcCommitScene");
	fputs("building\n", stderr);
	for (double remaining = atof(getenv("HSLT_BUILD")); remaining > 0; remaining -= 0.1) {
		nanosleep(&(struct timespec){0, 100000000}, NULL);
		if (progress_monitor && getenv("HSLT_BUILD_TICKS"))
			progress_monitor(progress_user, 0);
	}
	next(scene);
}
