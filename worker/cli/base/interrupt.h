/* SPDX-License-Identifier: Apache-2.0 */
/*
 * SIGINT and SIGTERM as a flag that renders look at: the first asks for an end that leaves what is complete, the second
 * one kills. One a process.
 */
#ifndef WORKER_CLI_BASE_INTERRUPT_H
#define WORKER_CLI_BASE_INTERRUPT_H

#include <stdatomic.h>

extern atomic_bool interrupted;
void interrupt_watch(void);

/* From now on such a signal writes the text (kept by the caller) to stderr and ends the process as it would have
 * without it. */
void interrupt_say(const char *text);

#endif
