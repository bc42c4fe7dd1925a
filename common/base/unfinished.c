/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/unfinished.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
enum { NUMBERS = sizeof numbers / sizeof *numbers };
static struct sigaction before[NUMBERS];
static const char *file; /* read by the handler, written while the signals are blocked */

static void remove_and_end(int number)
{
	unlink(file);
	raise(number); /* SA_RESETHAND has restored the default action, which is taken when this function returns */
}

static void block_signals(sigset_t *old)
{
	sigset_t all;
	sigemptyset(&all);
	for (int i = 0; i < NUMBERS; i++)
		sigaddset(&all, numbers[i]);
	sigprocmask(SIG_BLOCK, &all, old);
}

int unfinished_begin(char *path, struct error *e)
{
	struct sigaction a = {.sa_handler = remove_and_end, .sa_flags = (int)SA_RESETHAND};
	sigset_t old;
	block_signals(&old);
	int fd = mkstemp(path);
	int rc = fd < 0 ? error_set(e, errno, "%s", strerror(errno)) : fd;
	file = path;
	sigemptyset(&a.sa_mask);
	for (int i = 0; i < NUMBERS && fd >= 0; i++)
		if (sigaction(numbers[i], NULL, &before[i]) == 0 && before[i].sa_handler == SIG_DFL)
			sigaction(numbers[i], &a, NULL);
	sigprocmask(SIG_SETMASK, &old, NULL);
	return rc;
}

void unfinished_end(void)
{
	sigset_t old;
	block_signals(&old);
	for (int i = 0; i < NUMBERS; i++)
		sigaction(numbers[i], &before[i], NULL);
	sigprocmask(SIG_SETMASK, &old, NULL);
}
