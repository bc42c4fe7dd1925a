/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Turns SIGINT, SIGTERM and SIGHUP (unless it is ignored) into a flag that renders check. The first signal asks for an
 * end that keeps complete rounds; a second SIGINT or SIGTERM ends the process. One per process.
 */
#ifndef WORKER_CLI_BASE_INTERRUPT_H
#define WORKER_CLI_BASE_INTERRUPT_H

#include <stdatomic.h>

extern atomic_bool interrupted;
void interrupt_watch(void);

/* From now on, such a signal writes the text, which must stay valid, to stderr, and then takes its default action. */
void interrupt_set_message(const char *text);

#endif
