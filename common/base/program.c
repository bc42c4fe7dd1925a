/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/program.h"

#include "common/base/log.h"
#include "common/base/option_print.h"

#include <assert.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Makes the program fail if its output on stdout was lost. */
static void check_output(int code, void *user)
{
	(void)user;
	errno = 0;
	if (fflush(stdout) == 0 && !ferror(stdout))
		return;
	fprintf(stderr, "%s: stdout: %s\n", program_invocation_short_name, errno ? strerror(errno) : "a write failed");
	_exit(code ? code : 1);
}

/* A program may be started with standard descriptors closed. Files that it opens would then get these numbers, and its
 * messages would be written into those files. Closed descriptors are opened here on /dev/null in the wrong direction,
 * so that using them still fails. */
static void open_standard_descriptors(void)
{
	for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; fd++)
		if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY) != fd)
			exit(1); /* there is nowhere to report this */
}

/* By default, a write beyond the limit of a file's size (ulimit -f, LimitFSIZE, batch systems) would end the program
 * without a message, and a coordinator again after each restart. With the signal ignored, the write fails with EFBIG,
 * which is handled like any other error of the disk. */
static void ignore_file_size_signal(void)
{
	signal(SIGXFSZ, SIG_IGN);
}

void program_parse_options(const struct program *p, int argc, char **argv, void *target)
{
	enum option_kind requested;
	struct error e;
	int rc = on_exit(check_output, NULL);
	assert(rc == 0);
	(void)rc;
	open_standard_descriptors();
	ignore_file_size_signal();
	if (options_parse(p, argc, argv, target, &requested, &e)) {
		fprintf(stderr, "%s: %s\nTry '%s --help' for more information.\n", p->name, e.text, p->name);
		exit(2);
	}
	if (requested != OPTION_KIND_END) {
		option_print(p, requested, stdout);
		exit(0);
	}
}

int program_parse_verbose(void *target, char *arg, struct error *e)
{
	(void)target, (void)arg, (void)e;
	log_set_level(LOG_LEVEL_DEBUG);
	return 0;
}
