/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/base/interrupt.h"

#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

atomic_bool interrupted;

static void interrupt(int signal_number)
{
	(void)signal_number;
	atomic_store(&interrupted, true);
}

/* Handles SIGHUP, unless it is ignored, as under nohup. The handler of interrupt_watch stays installed, because closing
 * a terminal may send the signal twice, by the kernel and by the shell. */
static void handle_hangup(void (*handler)(int), int flags)
{
	struct sigaction act = {.sa_handler = handler, .sa_flags = flags}, before;
	if (sigaction(SIGHUP, NULL, &before) == 0 && before.sa_handler != SIG_IGN)
		sigaction(SIGHUP, &act, NULL);
}

static void handle_first(void (*handler)(int))
{
	struct sigaction act = {.sa_handler = handler, .sa_flags = (int)SA_RESETHAND};
	sigaction(SIGINT, &act, NULL);
	sigaction(SIGTERM, &act, NULL);
}

void interrupt_watch(void)
{
	handle_first(interrupt);
	handle_hangup(interrupt, 0);
}

static const char *_Atomic last_words;

static void say_and_end(int signal_number)
{
	const char *text = atomic_load(&last_words);
	/* SA_RESETHAND has restored the default action, which raise triggers when this handler returns. */
	if (write(STDERR_FILENO, text, strlen(text)) < 0)
		_exit(128 + signal_number);
	raise(signal_number);
}

void interrupt_say(const char *text)
{
	atomic_store(&last_words, text);
	handle_first(say_and_end);
	handle_hangup(say_and_end, (int)SA_RESETHAND);
}
