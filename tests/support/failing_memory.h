/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Memory that runs out: all tests are linked with functions between the product and common/base/mem.h (the linker's
 * --wrap, in the Makefile). Any thread.
 */
#ifndef TESTS_SUPPORT_FAILING_MEMORY_H
#define TESTS_SUPPORT_FAILING_MEMORY_H

/* Lets the next n allocations succeed and the one after them fail, once; n < 0: none fails. */
void mem_fail_after(long n);

#endif
