/* SPDX-License-Identifier: Apache-2.0 */
/* Measures how much a call reads from files, independently of the machine's speed and caches. */
#ifndef TESTS_SUPPORT_BYTES_READ_H
#define TESTS_SUPPORT_BYTES_READ_H

#include <stdbool.h>
#include <stdint.h>

/* Stores the number of bytes that read and pread have returned to this process so far. Returns false if the kernel
 * does not count them. */
bool bytes_read_count(uint64_t *bytes);

#endif
