/* SPDX-License-Identifier: Apache-2.0 */
/* Outputs that would destroy an input, each other or a file of another format are refused; all others are accepted. */
#include "common/exr/output_files.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[64];

static int enter_folder(void **state)
{
	(void)state;
	snprintf(folder, sizeof folder, "/tmp/hslt-outputs.XXXXXX");
	return mkdtemp(folder) && chdir(folder) == 0 && mkdir("a", 0700) == 0 ? 0 : -1;
}

static int leave_folder(void **state)
{
	(void)state;
	char command[128];
	snprintf(command, sizeof command, "rm -rf '%s'", folder);
	return chdir("/") || system(command);
}

static void write_file(const char *path, const char *text)
{
	FILE *f = fopen(path, "w");
	assert_non_null(f);
	fputs(text, f);
	assert_int_equal(fclose(f), 0);
}

static int check_outputs(const struct output_files *o, const char *input, struct error *e)
{
	return output_files_check(o, &input, 1, e);
}

static void expect_refused(const struct output_files *o, const char *input, const char *sentence)
{
	struct error e = {""};
	assert_true(check_outputs(o, input, &e) < 0);
	if (!strstr(e.text, sentence))
		fail_msg("'%s', not '%s'", e.text, sentence);
}

static void expect_accepted(const struct output_files *o, const char *input)
{
	struct error e = {""};
	if (check_outputs(o, input, &e))
		fail_msg("%s", e.text);
}

static void test_outputs_may_not_replace_an_input(void **state)
{
	(void)state;
	write_file("in.exr", "\x76\x2f\x31\x01");
	assert_int_equal(symlink("in.exr", "link.exr"), 0);
	assert_int_equal(link("in.exr", "hard.exr"), 0);
	static const char *const names[] = {"in.exr", "./a/../in.exr", "link.exr", "hard.exr"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		expect_refused(&(struct output_files){{{"-o", names[i], OUTPUT_EXR}}}, "in.exr", "which is an input");
		expect_refused(&(struct output_files){{{"-o", "in.exr", OUTPUT_EXR}}}, names[i], "which is an input");
	}
	expect_accepted(&(struct output_files){{{"-o", "out.exr", OUTPUT_EXR}}}, "in.exr");
	expect_accepted(&(struct output_files){{{"-o", "/dev/null", OUTPUT_EXR}}}, "/dev/null");
	expect_accepted(&(struct output_files){{{"-o", NULL, OUTPUT_EXR}}}, "in.exr");
	expect_accepted(&(struct output_files){{{"-o", "out.exr", OUTPUT_EXR}}}, "none.exr");
	struct stat st;
	struct error e;
	struct output_files o = {{{"-o", "link.exr", OUTPUT_EXR}}};
	assert_int_equal(stat("in.exr", &st), 0);
	assert_int_equal(output_files_check_read(&o, st.st_dev, st.st_ino, "in.exr", &e), -EINVAL);
	assert_string_equal(e.text, "-o link.exr would replace in.exr, which is an input");
	assert_int_equal(stat("a", &st), 0);
	assert_int_equal(output_files_check_read(&o, st.st_dev, st.st_ino, "a", &e), 0);
}

static void test_outputs_may_not_be_the_same_file(void **state)
{
	(void)state;
	assert_int_equal(symlink("new.exr", "to_new"), 0);
	static const char *const names[] = {"new.exr", "./new.exr", "a/../new.exr", "to_new"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		expect_refused(
			&(struct output_files){{{"-o", "new.exr", OUTPUT_EXR}, {"--stats", names[i], OUTPUT_JSON}}},
			NULL, "-o and --stats are the same file");
	expect_accepted(&(struct output_files){{{"-o", "new.exr", OUTPUT_EXR}, {"--stats", "a/new.json", OUTPUT_JSON}}},
			NULL);
	expect_accepted(
		&(struct output_files){{{"-o", "/dev/null", OUTPUT_EXR}, {"--stats", "/dev/null", OUTPUT_JSON}}}, NULL);
	/* One pipe, named by two of its descriptors, and another pipe. */
	int ends[2], others[2];
	char first[32], again[32], other[32];
	assert_true(pipe(ends) == 0 && pipe(others) == 0);
	int copy = dup(ends[1]);
	snprintf(first, sizeof first, "/dev/fd/%d", ends[1]);
	snprintf(again, sizeof again, "/dev/fd/%d", copy);
	snprintf(other, sizeof other, "/dev/fd/%d", others[1]);
	expect_refused(&(struct output_files){{{"-o", first, OUTPUT_EXR}, {"--stats", first, OUTPUT_JSON}}}, NULL,
		       "-o and --stats are the same file");
	expect_refused(&(struct output_files){{{"-o", first, OUTPUT_EXR}, {"--stats", again, OUTPUT_JSON}}}, NULL,
		       "-o and --stats are the same file");
	expect_accepted(&(struct output_files){{{"-o", first, OUTPUT_EXR}, {"--stats", other, OUTPUT_JSON}}}, NULL);
	expect_accepted(&(struct output_files){{{"-o", first, OUTPUT_EXR}, {"--stats", "/dev/null", OUTPUT_JSON}}},
			NULL);
	int nothing = open("/dev/null", O_WRONLY);
	snprintf(other, sizeof other, "/dev/fd/%d", nothing);
	expect_accepted(&(struct output_files){{{"-o", other, OUTPUT_EXR}, {"--stats", "/dev/null", OUTPUT_JSON}}},
			NULL);
	expect_accepted(&(struct output_files){{{"-o", other, OUTPUT_EXR}, {"--stats", other, OUTPUT_JSON}}}, NULL);
	close(nothing);
	for (int i = 0; i < 2; i++) {
		close(ends[i]);
		close(others[i]);
	}
	close(copy);
	assert_int_equal(access("new.exr", F_OK), -1); /* no file is left behind */
}

static void test_outputs_may_not_replace_another_format(void **state)
{
	(void)state;
	static const struct {
		enum output_format format;
		const char *begin, *noun;
	} rows[] = {
		{OUTPUT_EXR, "\x76\x2f\x31\x01\x02", "not an OpenEXR file"},
		{OUTPUT_PNG, "\x89PNG\r\n\x1a\n", "not a PNG file"},
		{OUTPUT_SVG, "<?xml version=\"1.0\"?>\n<svg width=\"1\">", "not an SVG file"},
		{OUTPUT_HTML, "<!DOCTYPE html>\n<html>", "not an HTML file"},
		{OUTPUT_CSV, "setting,parameter,value\n", "not a table of hslt-accuracy"},
		{OUTPUT_JSON, "{\n  \"schema\": 1,", "not a file of statistics"},
	};
	enum { ROWS = sizeof rows / sizeof *rows };
	for (size_t i = 0; i < ROWS; i++)
		for (size_t j = 0; j < ROWS; j++) {
			const char *name = rows[j].format == OUTPUT_SVG ? "file.svg" : "file";
			struct output_files o = {{{"-o", name, rows[j].format}}};
			write_file(name, rows[i].begin);
			if (i == j)
				expect_accepted(&o, NULL);
			else
				expect_refused(&o, NULL, rows[j].noun);
		}
	for (size_t j = 0; j < ROWS; j++) {
		const char *name = rows[j].format == OUTPUT_SVG ? "file.svg" : "file";
		struct output_files o = {{{"-o", name, rows[j].format}}};
		write_file(name, "<scene version=\"0.6.0\"/>");
		expect_refused(&o, NULL, rows[j].noun);
		write_file(name, "");
		expect_accepted(&o, NULL);
	}
	assert_int_equal(output_plot_format("cost.svg"), OUTPUT_SVG);
	assert_int_equal(output_plot_format("cost.png"), OUTPUT_PNG);
	static const char *const plots[][2] = {
		{"cost.sgv", "as .svg or .png; did you mean `.svg`?"},
		{"cost.pngg", "did you mean `.png`?"},
		{"cost.jpg", "as .svg or .png"},
		{"a.svg/cost", "as .svg or .png"},
		{"-", "as .svg or .png"},
	};
	for (size_t i = 0; i < sizeof plots / sizeof *plots; i++)
		expect_refused(&(struct output_files){{{"--plot", plots[i][0], output_plot_format(plots[i][0])}}}, NULL,
			       plots[i][1]);
	expect_refused(&(struct output_files){{{"-o", "report.PNG", OUTPUT_HTML}}}, NULL,
		       "-o report.PNG: an HTML file is written, so the name should end in .html");
	expect_refused(&(struct output_files){{{"--stats", "room.exr", OUTPUT_JSON}}}, NULL,
		       "a file of statistics is written, so the name should end in .json");
	expect_refused(
		&(struct output_files){{{"-o", "/dev/stdout", OUTPUT_EXR}, {"--stats", "/dev/stdout", OUTPUT_JSON}}},
		NULL, "are the same file, stdout");
}

/* A name must not suggest another format than the file has; a name without a format, or in capitals, is accepted. */
static void test_names_may_not_suggest_another_format(void **state)
{
	(void)state;
	expect_refused(&(struct output_files){{{"-o", "x.png", OUTPUT_EXR}}}, NULL,
		       "an OpenEXR file is written, so the name should end in .exr");
	expect_refused(&(struct output_files){{{"-o", "x.JPG", OUTPUT_EXR}}}, NULL, "hslt-tonemap");
	expect_refused(&(struct output_files){{{"OUT", "x.svg", OUTPUT_PNG}}}, NULL,
		       "OUT x.svg: a PNG file is written, so the name should end in .png");
	expect_refused(&(struct output_files){{{"--heatmap", "x.exr", OUTPUT_PNG}}}, NULL, "a PNG file is written");
	expect_accepted(&(struct output_files){{{"-o", "x.EXR", OUTPUT_EXR}, {"--heatmap", "x.PNG", OUTPUT_PNG}}},
			NULL);
	expect_accepted(&(struct output_files){{{"-o", "x.2", OUTPUT_EXR}, {"--plot", "x.svg", OUTPUT_SVG}}}, NULL);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_outputs_may_not_replace_an_input),
		cmocka_unit_test(test_outputs_may_not_be_the_same_file),
		cmocka_unit_test(test_outputs_may_not_replace_another_format),
		cmocka_unit_test(test_names_may_not_suggest_another_format),
	};
	return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
