/* SPDX-License-Identifier: Apache-2.0 */
/* What may be written to a terminal: TERM and NO_COLOR (https://no-color.org) decide. Any thread that changes no
 * environment. */
#ifndef COMMON_BASE_TERMINAL_H
#define COMMON_BASE_TERMINAL_H

#include <stdbool.h>

bool terminal_moves_cursor(int fd); /* a terminal, and not a dumb one: lines can be drawn over */
bool terminal_shows_colors(int fd); /* the same, and nobody asked for none */

#endif
