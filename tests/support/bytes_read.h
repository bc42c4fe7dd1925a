/* SPDX-License-Identifier: Apache-2.0 */
/* How much a call reads from files, whatever the machine's speed and caches. */
#ifndef TESTS_SUPPORT_BYTES_READ_H
#define TESTS_SUPPORT_BYTES_READ_H

#include <stdbool.h>
#include <stdint.h>

/* Bytes that this process has been given by read and pread so far. false: the kernel does not count them. */
bool bytes_read(uint64_t *bytes);

#endif
