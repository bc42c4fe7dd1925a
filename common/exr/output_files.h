/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Checks the files that a command is to write, before any work is done: no output may replace a file that the command
 * reads, another of its outputs, or an existing file of another kind. Files are the same if device and inode are, so
 * links and other spellings of a path do not matter. Files that are not regular (pipes, devices) hold nothing that
 * could be lost. Any thread.
 */
#ifndef COMMON_EXR_OUTPUT_FILES_H
#define COMMON_EXR_OUTPUT_FILES_H

#include "common/base/error.h"

#include <stddef.h>
#include <stdint.h>

enum output_format { OUTPUT_EXR, OUTPUT_PNG, OUTPUT_SVG, OUTPUT_HTML, OUTPUT_CSV, OUTPUT_JSON };

struct output_file {
	const char *option; /* the option that names the file, such as "--stats" */
	const char *path;   /* NULL: this output is not wanted */
	enum output_format format;
};

enum { OUTPUT_FILES_MAX = 4 };
struct output_files {
	struct output_file files[OUTPUT_FILES_MAX];
};

/* Checks all outputs. inputs: paths of files that the command reads; NULL, "-" and files that do not exist are skipped.
 * Returns -EINVAL if an output is an input or another output, or if its extension stands for another picture format;
 * -EEXIST if a regular file exists that is neither empty nor begins like a file of the output's format; -errno if a
 * file cannot be created. */
int output_files_check(const struct output_files *o, const char *const *inputs, size_t input_count, struct error *e);

/* Checks the names alone, for the check of a program's options: -EINVAL if an extension stands for another picture
 * format, or if a plot's is not known. */
int output_files_check_names(const struct output_files *o, struct error *e);

/* Checks that a file that is read later, while the command runs, is none of the outputs: 0 or -EINVAL. */
int output_files_check_read(const struct output_files *o, uint64_t device, uint64_t inode, const char *name,
			    struct error *e);

/* Returns the format of a plot by its extension: PNG for .png, otherwise SVG; output_files_check refuses extensions
 * other than .svg and .png. */
enum output_format output_plot_format(const char *path);

#endif
