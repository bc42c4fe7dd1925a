/* SPDX-License-Identifier: Apache-2.0 */
/* Files that a test writes into memory, line by line. */
#ifndef TESTS_SUPPORT_APPEND_H
#define TESTS_SUPPORT_APPEND_H

#include <stddef.h>

/* Behind the `*used` bytes that the text has already. The test fails where there is no room. */
__attribute__((format(printf, 4, 5))) void append(char *text, size_t size, size_t *used, const char *format, ...);

#endif
