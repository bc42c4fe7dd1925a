/* SPDX-License-Identifier: Apache-2.0 */
/* Builds files in memory, line by line, for tests. */
#ifndef TESTS_SUPPORT_APPEND_FORMAT_H
#define TESTS_SUPPORT_APPEND_FORMAT_H

#include <stddef.h>

/* Appends to the `*used` bytes of the text. Fails the test if there is no room. */
__attribute__((format(printf, 4, 5))) void append_format(char *text, size_t size, size_t *used, const char *format,
							 ...);

#endif
