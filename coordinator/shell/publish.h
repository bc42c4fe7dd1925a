/*
 * Work on a whole film: its error, its image as EXR in the spool. Runs in the pool; the order is busy meanwhile and its
 * results wait. Started and finished on the loop's thread.
 */
#ifndef COORDINATOR_SHELL_PUBLISH_H
#define COORDINATOR_SHELL_PUBLISH_H

#include "coordinator/shell/server.h"

enum publish_what {
	PUBLISH_ERROR_ONLY, /* answered by EVENT_ERROR_KNOWN */
	PUBLISH_PREVIEW,    /* preview.exr */
	PUBLISH_RESULT,     /* result.exr */
};

void publish_start(struct server *s, struct order *o, enum publish_what what, uint64_t rounds);

#endif
