/* SPDX-License-Identifier: Apache-2.0 */
/* Runs programs for the benchmarks and measures their CPU time and peak memory. One thread. Programs that still run
 * when the bench ends are killed. */
#ifndef TESTS_BENCH_PROCESS_H
#define TESTS_BENCH_PROCESS_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

enum { PROCESS_ARGS_MAX = 32 };

struct process {
	pid_t pid;	    /* 0: the process has ended */
	double cpu_seconds; /* of a process that has ended */
	int exit_code;
};

/* Returns whether BIN/name exists. */
bool process_program_exists(const char *bin, const char *name);
/* Starts a program. line: its name in BIN and its arguments, separated by spaces; its output goes to LOG. */
__attribute__((format(printf, 4, 5))) void process_start(struct process *p, const char *bin, const char *log,
							 const char *format, ...);
/* Waits for the process; ends the bench if its exit code is not 0. */
void process_wait(struct process *p);
/* Like process_wait(), and returns the peak of resident memory, sampled every millisecond: the peak of wait4 includes
 * the memory that this process held when it forked. */
double process_wait_peak(struct process *p);
void process_stop(struct process *p); /* sends SIGTERM and waits */
bool process_is_running(const struct process *p);
/* CPU seconds so far of a running process and its children. */
double process_cpu_seconds(const struct process *p);
/* Returns the peak of resident memory. *current: the present value; may be NULL. */
double process_peak_bytes(const struct process *p, double *current);

double process_wall_seconds(void);

/* folder: ends with XXXXXX, which is replaced by the name of a new folder. */
void process_make_folder(char *folder);
void process_remove_folder(const char *folder); /* with its contents */

#endif
