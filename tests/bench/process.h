/* SPDX-License-Identifier: Apache-2.0 */
/* Programs run and watched by the benchmarks: CPU time, peak memory. One thread.
 * What still runs when the bench ends is killed. */
#ifndef TESTS_BENCH_PROCESS_H
#define TESTS_BENCH_PROCESS_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

enum { PROCESS_ARGS = 32 };

struct process {
	pid_t pid;	    /* 0: ended */
	double cpu_seconds; /* of an ended one */
	int code;
};

/* BIN/name is there. */
bool process_exists(const char *bin, const char *name);
/* line: the program's name in BIN and its arguments, separated by spaces; its output goes into LOG. */
__attribute__((format(printf, 4, 5))) void process_start(struct process *p, const char *bin, const char *log,
							 const char *format, ...);
/* Waits; ends the bench when the exit code is not 0. */
void process_wait(struct process *p);
/* As process_wait. Its peak of resident memory, looked at every millisecond: that of wait4 includes what this process
 * held when it forked. */
double process_wait_peak(struct process *p);
void process_stop(struct process *p); /* SIGTERM, waits */
bool process_is_running(const struct process *p);
/* Of a running one and its children. */
double process_cpu_seconds(const struct process *p);
double process_peak_bytes(const struct process *p, double *now); /* resident; now may be NULL */

double wall_seconds(void);

/* folder: ends with XXXXXX, which is replaced. */
void process_make_folder(char *folder);
void process_remove_folder(const char *folder); /* with its contents */

#endif
