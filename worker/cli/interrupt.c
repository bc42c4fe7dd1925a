/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/interrupt.h"

#include <signal.h>
#include <stdbool.h>
#include <stddef.h>

atomic_bool interrupted;

static void interrupt(int signal_number)
{
	(void)signal_number;
	atomic_store(&interrupted, true);
}

void interrupt_watch(void)
{
	struct sigaction act = {.sa_handler = interrupt, .sa_flags = (int)SA_RESETHAND};
	sigaction(SIGINT, &act, NULL);
	sigaction(SIGTERM, &act, NULL);
}
