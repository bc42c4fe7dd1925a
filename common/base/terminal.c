/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/terminal.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool terminal_moves_cursor(int fd)
{
	const char *term = getenv("TERM");
	return isatty(fd) && term && *term && strcmp(term, "dumb") != 0;
}

bool terminal_shows_colors(int fd)
{
	const char *none = getenv("NO_COLOR");
	return terminal_moves_cursor(fd) && !(none && *none);
}
