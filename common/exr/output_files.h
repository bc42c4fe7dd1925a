/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The files that a command is told to write, checked before any work is done, so that none of them destroys something
 * else: a file that the command reads, another of its outputs, or a file of another kind that happens to have the name.
 * Files are the same if device and inode are, so links and other spellings of a path do not matter. What is not a
 * regular file (pipes, devices) holds nothing that could be lost. Any thread.
 */
#ifndef COMMON_EXR_OUTPUT_FILES_H
#define COMMON_EXR_OUTPUT_FILES_H

#include "common/base/error.h"

#include <stddef.h>
#include <stdint.h>

enum output_format { OUTPUT_EXR, OUTPUT_PNG, OUTPUT_SVG, OUTPUT_HTML, OUTPUT_CSV, OUTPUT_JSON };

struct output_file {
	const char *option; /* that names it, such as "--stats" */
	const char *path;   /* NULL: not asked for */
	enum output_format format;
};

enum { OUTPUT_FILES_MOST = 4 };
struct output_files {
	struct output_file files[OUTPUT_FILES_MOST];
};

/* inputs: paths; those that do not exist or are "-" are left to whoever reads them. An existing regular file is
 * replaced only if it is empty or begins as files of the format do. -EINVAL: also for a name of another format of
 * pictures. */
int output_files_check(const struct output_files *o, const char *const *inputs, size_t input_count, struct error *e);

/* Refuses a file that is read while the command runs. */
int output_files_check_read(const struct output_files *o, uint64_t device, uint64_t inode, const char *name,
			    struct error *e);

/* By the ending of a plot's name, .svg or .png; anything else is refused by output_files_check. */
enum output_format output_format_of_plot(const char *path);

#endif
