/* SPDX-License-Identifier: Apache-2.0 */
/* Preloaded: building a scene takes $HSLT_BUILD seconds, and its start is reported by a line on stderr; with
 * $HSLT_BUILD_TICKS the build reports progress meanwhile. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef bool monitor(void *, double);

static monitor *told;
static void *told_user;

void rtcSetSceneProgressMonitorFunction(void *scene, monitor *f, void *user)
{
	void (*next)(void *, monitor *, void *) = dlsym(RTLD_NEXT, "rtcSetSceneProgressMonitorFunction");
	told = f;
	told_user = user;
	next(scene, f, user);
}

void rtcCommitScene(void *scene)
{
	void (*next)(void *) = dlsym(RTLD_NEXT, "rtcCommitScene");
	fputs("building\n", stderr);
	for (double left = atof(getenv("HSLT_BUILD")); left > 0; left -= 0.1) {
		nanosleep(&(struct timespec){0, 100000000}, NULL);
		if (told && getenv("HSLT_BUILD_TICKS"))
			told(told_user, 0);
	}
	next(scene);
}
