/* SPDX-License-Identifier: Apache-2.0 */
/* What a terminal can display, judged by TERM and NO_COLOR (https://no-color.org). Any thread, as long as the
 * environment does not change. */
#ifndef COMMON_BASE_TERMINAL_H
#define COMMON_BASE_TERMINAL_H

#include <stdbool.h>

bool terminal_moves_cursor(int fd); /* a terminal that is not "dumb": lines can be redrawn */
bool terminal_shows_colors(int fd); /* a terminal that is not "dumb", and NO_COLOR is not set */

#endif
