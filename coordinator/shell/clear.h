/*
 * Finished jobs go by age and by space (store/age.h): at the start, every hour, and soon after a job has ended. Never a living
 * job's files, never a result that a client is fetching or
 * waits for. The record says first that the result is gone, and when; then the files
 * go. The loop's thread.
 */
#ifndef COORDINATOR_SHELL_CLEAR_H
#define COORDINATOR_SHELL_CLEAR_H

#include "coordinator/shell/server.h"

void clear_tick(struct server *s);
void clear_soon(struct server *s); /* a job has ended */
/* With another clock, s since 1970. */
void clear_run(struct server *s, double now);

#endif
