/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/output.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void check(int code, void *user)
{
	(void)user;
	errno = 0;
	if (fflush(stdout) == 0 && !ferror(stdout))
		return;
	fprintf(stderr, "%s: stdout: %s\n", program_invocation_short_name,
		errno ? strerror(errno) : "it could not take everything");
	_exit(code ? code : 1);
}

void output_check_at_exit(void)
{
	int rc = on_exit(check, NULL);
	assert(rc == 0);
	(void)rc;
}
