/* SPDX-License-Identifier: Apache-2.0 */
/*
 * SIGINT, SIGTERM and SIGHUP (unless it is ignored) as a flag that renders check: the first signal asks for an end that
 * keeps complete rounds, the second kills, except for SIGHUP. One per process.
 */
#ifndef WORKER_CLI_BASE_INTERRUPT_H
#define WORKER_CLI_BASE_INTERRUPT_H

#include <stdatomic.h>

extern atomic_bool interrupted;
void interrupt_watch(void);

/* From now on such a signal writes the text (owned by the caller) to stderr and then takes its default action. */
void interrupt_say(const char *text);

#endif
