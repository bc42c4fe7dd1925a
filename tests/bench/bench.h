/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The benchmarks' table: each figure is the median of at least ten measurements with the order-statistic interval that
 * contains the median with 97.8 % (from the 2nd least to the 2nd largest of ten). Times are CPU seconds, by the
 * thread's clock where getrusage would round to ticks; values that are compared are measured in turns within the same
 * minute. One thread.
 */
#ifndef TESTS_BENCH_BENCH_H
#define TESTS_BENCH_BENCH_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { BENCH_REPEATS = 11, BENCH_SERIES_MAX = 64 };

struct series {
	unsigned count;
	double value[BENCH_SERIES_MAX];
};

enum bench_target { BENCH_NO_TARGET, BENCH_AT_LEAST, BENCH_AT_MOST };

void series_add(struct series *s, double x);
double series_median(const struct series *s);

double bench_cpu_seconds(void); /* of this thread */

/* Prints the heading of the rows that follow; the name is also their prefix in the JSON. */
void bench_group(const char *name, const char *description);
void bench_row(const char *name, const struct series *s, const char *unit, enum bench_target kind, double target);
void bench_single(const char *name, double value, const char *unit, enum bench_target kind, double target);
void bench_skip(const char *why);
__attribute__((noreturn)) void bench_die(const struct error *e);
/* Like mem_alloc, but ends the bench if out of memory. */
void *bench_alloc(size_t count, size_t size);

/* Keeps the compiler from removing computations whose results are stored here. */
extern volatile double bench_sink;

/* Each benchmark is one file. bin: the folder of the programs. */
void bench_rays(const char *bin);
void bench_hslt(const char *bin);
void bench_equal_time(const char *bin); /* most of an hour: runs only when named */
void bench_tiles(const char *bin);
void bench_parts(const char *bin);
void bench_loading(const char *bin);
void bench_sharing(const char *bin);
void bench_sending(const char *bin);
void bench_farm(const char *bin);
void bench_memory(const char *bin);
void bench_effects(const char *bin); /* minutes of valgrind: runs only when named */

#endif
