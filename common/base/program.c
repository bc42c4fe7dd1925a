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
	fprintf(stderr, "%s: stdout: %s\n", program_invocation_short_name,
		errno ? strerror(errno) : "it could not take everything");
	_exit(code ? code : 1);
}

/* A program may be started with some of these closed. The files that it opens would then get their numbers, and its
 * messages would be written into them. What was closed still fails: it is opened for the other direction. */
static void open_standard(void)
{
	for (int fd = STDIN_FILENO; fd <= STDERR_FILENO; fd++)
		if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY) != fd)
			exit(1); /* nobody can be told why */
}

/* A write beyond the limit of a file's size (ulimit -f, LimitFSIZE, queues of clusters) would end the program without a
 * word, and a coordinator again after each restart. It fails with EFBIG instead, as on any disk that refuses. */
static void survive_file_limit(void)
{
	signal(SIGXFSZ, SIG_IGN);
}

void program_options(const struct program *p, int argc, char **argv, void *target)
{
	enum option_kind asked;
	struct error e;
	int rc = on_exit(check_output, NULL);
	assert(rc == 0);
	(void)rc;
	open_standard();
	survive_file_limit();
	if (options_parse(p, argc, argv, target, &asked, &e)) {
		fprintf(stderr, "%s: %s\nTry '%s --help' for more information.\n", p->name, e.text, p->name);
		exit(2);
	}
	if (asked != OPTION_IS_END) {
		option_print(p, asked, stdout);
		exit(0);
	}
}

int program_take_verbose(void *target, char *arg, struct error *e)
{
	(void)target, (void)arg, (void)e;
	log_set_level(LOG_LEVEL_DEBUG);
	return 0;
}
