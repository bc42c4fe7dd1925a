/* SPDX-License-Identifier: Apache-2.0 */
/* Reads command lines by a table that has every kind of option, and checks what is printed of the table. */
#include "common/base/option.h"
#include "common/base/option_print.h"
#include "common/base/text.h"

#include <float.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct shared_arguments {
	uint64_t spp;
	double seconds;
};

struct arguments {
	struct shared_arguments part;
	const char *output, *tls, *name, *word[2];
	bool wait, quiet;
	double stops, share, trim, keep;
	uint32_t threads;
	uint64_t bytes;
	char kind[16];
};

static const char *kind_name(size_t i)
{
	static const char *const names[] = {"path", "bdpt", "hslt", NULL};
	return names[i];
}

static const char *verb_name(size_t i)
{
	static const char *const names[] = {"list", "fetch", NULL};
	return names[i];
}

static int store_kind(void *target, char *arg, struct error *e)
{
	struct arguments *a = target;
	(void)e;
	snprintf(a->kind, sizeof a->kind, "%s", arg);
	return 0;
}

static void append_remark(char *text, size_t size)
{
	snprintf(text, size, ". There are more");
}

static const struct option_row rows[] = {
	{"output", 'o', "FILE", "The image", OPTION_TEXT(struct arguments, output), .is_required = true},
	{"tls", 0, "DIR", "Certificates", OPTION_TEXT(struct arguments, tls), .environment = "HSLT_TEST_TLS"},
	{"name", 'n', "NAME", "Displayed", OPTION_NAME(struct arguments, name, 9)},
	{"wait", 'w', NULL, "Show progress", OPTION_FLAG(struct arguments, wait)},
	{"quiet", 'q', NULL, "Print errors only", OPTION_FLAG(struct arguments, quiet)},
	{"exposure", 'e', "STOPS", "Twice as bright for each", OPTION_NUMBER(struct arguments, stops, -100, 100),
	 .default_value = "0.5"},
	{"trim", 0, "F", "Leave out", OPTION_NUMBER(struct arguments, trim, 0, 1), .excludes_max = true},
	{"share", 0, "P", "Share of the epochs", OPTION_RATIO(struct arguments, share, 0, 1)},
	{"threads", 't', "N", "Threads", OPTION_COUNT(struct arguments, threads, 1, 1024), .default_value = "3"},
	{"blobs", 0, "GB", "Of the spool", OPTION_SIZE(struct arguments, bytes, 0.01, 1e6, 1e9),
	 .default_value = "100"},
	{"keep", 0, "N", "Days", OPTION_TIME(struct arguments, keep, 0, 36, 86400)},
	{"kind", 'k', "NAME", "(chosen)", OPTION_CUSTOM(store_kind), .values = kind_name,
	 .append_default = append_remark},
	{"wait-for", 0, NULL, "A longer name", OPTION_FLAG(struct arguments, quiet)},
	{0},
};

static const struct option_row shared_rows[] = {
	{"spp", 0, "+N", "Samples", OPTION_COUNT(struct shared_arguments, spp, 1, 1e9)},
	{"time", 0, "SECONDS", "Wall clock", OPTION_SECONDS(struct shared_arguments, seconds, 0, 1e9),
	 .excludes_min = true},
	{0},
};

static int check_shared_arguments(void *target, struct error *e)
{
	const struct shared_arguments *p = target;
	return p->spp == 13 ? error_set(e, EINVAL, "no 13") : 0;
}

static int check_arguments(void *target, struct error *e)
{
	const struct arguments *a = target;
	return a->wait && a->quiet ? error_set(e, EINVAL, "--wait is not quiet") : 0;
}

static int store_word(void *target, size_t index, char *word, struct error *e)
{
	struct arguments *a = target;
	if (index > 1)
		return error_set(e, EINVAL, "one word too many");
	a->word[index] = word;
	return 0;
}

static const struct option_table shared_table = {(const struct option_group[]){{"When to stop:", shared_rows}, {0}},
						 check_shared_arguments};
static const struct program program = {
	.name = "hslt-test",
	.synopsis = "VERB [JOB]\nA.exr",
	.summary = "Tests options.",
	.examples = "hslt-test list",
	.details = ".dot begins 'this'\n\\fB is no escape",
	.exit_codes = "0 done, 2 usage",
	.options = {(const struct option_group[]){{NULL, rows}, {0}}, check_arguments},
	.shared_options = &shared_table,
	.verbs = verb_name,
	.parse_word = store_word,
};

static struct arguments a;
static struct error e;
static enum option_kind requested_output;

/* Parses the words of a command line, without the program's name. */
static int parse(const char *line)
{
	static char text[512];
	char *argv[32] = {text}, *at;
	int argc = 1;
	snprintf(text, sizeof text, "%s", line);
	for (char *word = strtok_r(text, " ", &at); word; word = strtok_r(NULL, " ", &at))
		argv[argc++] = word;
	memset(&a, 0, sizeof a);
	e.text[0] = 0;
	return options_parse(&program, argc, argv, &a, &requested_output, &e);
}

static void expect_accepted(const char *line)
{
	if (parse(line))
		fail_msg("%s: %s", line, e.text);
}

static void expect_refused(const char *line, const char *why)
{
	assert_int_equal(parse(line), -EINVAL);
	assert_string_equal(e.text, why);
}

static void test_every_kind_of_value_is_parsed(void **state)
{
	(void)state;
	expect_accepted(
		"list -o x --name gr\xc3\xbc\xc3\x9f\x65. --trim 0.25 --share 5% --threads 1k --time 2m --spp +2k "
		"--blobs 0.5 --kind bdpt -e -2");
	assert_string_equal(a.output, "x");
	assert_string_equal(a.name, "gr\xc3\xbc\xc3\x9f\x65.");
	assert_true(a.trim == 0.25 && a.share == 0.05 && a.stops == -2 && a.part.seconds == 120);
	assert_true(a.threads == 1000 && a.part.spp == 2000);
	assert_int_equal(a.bytes, 500000000);
	assert_string_equal(a.kind, "bdpt");
	expect_accepted("list -o x --blobs 250M --keep 36h");
	assert_true(a.bytes == 250000000 && a.keep == 129600);
	expect_accepted("list -o x --blobs 2TB --keep 1.5 --share 100%");
	assert_true(a.bytes == 2000000000000 && a.keep == 129600 && a.share == 1);
}

static void test_values_out_of_bounds_are_refused(void **state)
{
	(void)state;
	expect_refused("list -o x --threads 0", "--threads takes a whole number from 1 to 1024, not '0'");
	expect_refused("list -o x --threads 1025", "--threads takes a whole number from 1 to 1024, not '1025'");
	expect_refused("list -o x --threads 1.5", "--threads takes a whole number from 1 to 1024, not '1.5'");
	expect_refused("list -o x --trim 1", "--trim takes a number of at least 0 and below 1, not '1'");
	expect_refused("list -o x --exposure nan", "--exposure takes a number from -100 to 100, not 'nan'");
	expect_refused("list -o x --exposure 1x", "--exposure takes a number from -100 to 100, not '1x'");
	expect_refused("list -o x --share 2", "--share: 200 % is above 100 %; did you mean 2%?");
	expect_refused("list -o x --share 200%", "--share: 200 % is above 100 %; did you mean 2%?");
	expect_refused("list -o x --share 1.5", "--share: 150 % is above 100 %; did you mean 1.5%?");
	expect_refused("list -o x --share 100.0001%", "--share: 100.0001 % is above 100 %; did you mean 1.000001%?");
	expect_refused("list -o x --share 15000%", "--share takes a number from 0 to 1, or percent, not '15000%'");
	expect_refused("list -o x --share -1%", "--share takes a number from 0 to 1, or percent, not '-1%'");
	expect_refused("list -o x --share two", "--share takes something like 0.02 or 2%, not 'two'");
	expect_refused("list -o x --time 0",
		       "--time takes a number of seconds above 0 and at most 1000000000, not '0'");
	expect_refused("list -o x --time 5y",
		       "--time takes a time such as 90s, 5m, 2h or 3d, or a number of seconds, not '5y'");
	expect_refused("list -o x --keep 40", "--keep takes a number of days from 0 to 36, not '40'");
	expect_refused("list -o x --blobs 5M", "--blobs takes a number of GB from 0.01 to 1000000, not '5M'");
	expect_refused("list -o x --blobs big",
		       "--blobs takes a size in GB, or one such as 500M, 20G or 2T, not 'big'");
	expect_refused("list --output=", "--output takes the name of a file, not ''");
	expect_refused("list -o x --name=", "--name takes 1 to 9 bytes of UTF-8 without control characters");
	expect_refused("list -o x --name 0123456789", "--name takes 1 to 9 bytes of UTF-8 without control characters");
	expect_refused("list -o x --name a\033[2J", "--name takes 1 to 9 bytes of UTF-8 without control characters");
	expect_refused("list -o x --name a\xff", "--name takes 1 to 9 bytes of UTF-8 without control characters");
	expect_refused("list -o x --spp 8", "--spp takes what is to be added, such as +8, not '8'");
	expect_refused("list -o x --spp ++8", "--spp takes a whole number from 1 to 1000000000, not '+8'");
	expect_refused("list -o x --threads +3", "--threads takes a whole number from 1 to 1024, not '+3'");
}

/* Counts with the largest bounds, which are printed in full. */
static void test_widest_bounds_are_printed_in_full(void **state)
{
	(void)state;
	static const struct option_row wide_rows[] = {
		{"seed", 0, "N", "Seed", OPTION_COUNT(struct shared_arguments, spp, 0, DBL_MAX)},
		{"work", 0, "N", "Work", OPTION_COUNT(struct shared_arguments, spp, 1, 1e18)},
		{0},
	};
	static const struct option_group wide_groups[] = {{NULL, wide_rows}, {0}};
	static const struct program wide = {.name = "hslt-test", .options = {wide_groups, NULL}};
	static const char *const cases[][3] = {
		{"--seed", "-1", "--seed takes a whole number of at least 0 and below 2^64, not '-1'"},
		{"--seed", "18446744073709551616",
		 "--seed takes a whole number of at least 0 and below 2^64, not '18446744073709551616'"},
		{"--work", "0", "--work takes a whole number from 1 to 1000000000000000000, not '0'"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		struct shared_arguments p = {0};
		char *argv[] = {text_unconst("hslt-test"), text_unconst(cases[i][0]), text_unconst(cases[i][1]), NULL};
		assert_int_equal(options_parse(&wide, 3, argv, &p, &requested_output, &e), -EINVAL);
		assert_string_equal(e.text, cases[i][2]);
	}
}

static void test_environment_overrides_defaults(void **state)
{
	(void)state;
	assert_int_equal(unsetenv("HSLT_TEST_TLS"), 0);
	expect_accepted("list -o x");
	assert_true(a.stops == 0.5 && a.threads == 3 && a.bytes == 100000000000u && !a.tls);
	assert_int_equal(setenv("HSLT_TEST_TLS", "folder", 1), 0);
	expect_accepted("list -o x");
	assert_string_equal(a.tls, "folder");
	expect_accepted("list -o x --tls other");
	assert_string_equal(a.tls, "other");
	assert_int_equal(unsetenv("HSLT_TEST_TLS"), 0);
}

static void test_options_are_accepted_in_any_order_and_form(void **state)
{
	(void)state;
	static const char *const lines[] = {"fetch j1 -o x -w -e 3 --threads 2", "-wox fetch --threads=2 -e3 j1",
					    "-e 3 --thr 2 -w fetch --out=x j1", "--wait -t2 -o x -e3 -- fetch j1"};
	for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
		expect_accepted(lines[i]);
		assert_string_equal(a.output, "x");
		assert_string_equal(a.word[0], "fetch");
		assert_string_equal(a.word[1], "j1");
		assert_true(a.wait && a.stops == 3 && a.threads == 2);
	}
	expect_accepted("list -o x --wait"); /* though --wait is also a prefix of --wait-for */
	assert_true(a.wait && !a.quiet);
	expect_accepted("-o x fetch -5");
	assert_string_equal(a.word[1], "-5");
	expect_accepted("-o x fetch -");
	assert_string_equal(a.word[1], "-");
	expect_accepted("-o x fetch -- --wait");
	assert_string_equal(a.word[1], "--wait");
	expect_accepted("list -o --wait");
	assert_string_equal(a.output, "--wait");
}

static void test_mistyped_words_get_a_suggestion(void **state)
{
	(void)state;
	expect_refused("list --ouptut x", "unknown option '--ouptut'; did you mean '--output'?");
	expect_refused("list --tiem=5", "unknown option '--tiem'; did you mean '--time'?");
	expect_refused("list --wall-clock-time=5", "unknown option '--wall-clock-time'; did you mean '--time'?");
	expect_refused("list -x", "unknown option '-x'");
	expect_refused("list -spp 5", "unknown option '-spp'; did you mean '--spp'?");
	expect_refused("list --entirely-other", "unknown option '--entirely-other'");
	expect_refused("list --t 5", "option '--t' is ambiguous: --tls, --trim, --threads, --time");
	expect_refused("list --wait=1", "option '--wait' takes no argument");
	expect_refused("list --output", "option '--output' needs an argument: FILE");
	expect_refused("list -o x --kind hslr", "there is no kind 'hslr'; did you mean `hslt`?");
	expect_refused("list -o x --kind zzz", "there is no kind 'zzz'; there are path, bdpt, hslt");
	expect_refused("fecth j1 -o x", "there is no verb 'fecth'; did you mean `fetch`?");
	expect_refused("-o x", "a verb is missing: list, fetch");
	expect_refused("list a b -o x", "one word too many");
}

static void test_required_options_and_checks_are_enforced(void **state)
{
	(void)state;
	expect_refused("list", "--output FILE is needed");
	expect_refused("list -o x -w -q", "--wait is not quiet");
	expect_refused("list -o x --spp +13", "no 13");
}

/* --help and --version take precedence over all errors. */
static void test_help_and_version_take_precedence(void **state)
{
	(void)state;
	expect_accepted("list -o x");
	assert_int_equal(requested_output, OPTION_KIND_END);
	expect_accepted("--help --no-such-option");
	assert_int_equal(requested_output, OPTION_KIND_HELP);
	expect_accepted("-wV");
	assert_int_equal(requested_output, OPTION_KIND_VERSION);
	expect_refused("--no-such-option --help", "unknown option '--no-such-option'");
}

static char *print_to_text(enum option_kind what)
{
	static char text[16384];
	FILE *f = fmemopen(text, sizeof text, "w");
	assert_non_null(f);
	option_print(&program, what, f);
	assert_int_equal(fclose(f), 0);
	return text;
}

static void expect_substring(const char *text, const char *wanted)
{
	if (strstr(text, wanted))
		return;
	fprintf(stderr, "no '%s' in:\n%s", wanted, text);
	fail();
}

static void test_help_lists_every_option(void **state)
{
	(void)state;
	const char *text = print_to_text(OPTION_KIND_HELP);
	expect_substring(
		text, "Usage: hslt-test [OPTION...] VERB [JOB]\n  or:  hslt-test [OPTION...] A.exr\nTests options.\n");
	expect_substring(text, "\n  -o, --output=FILE          The image\n");
	expect_substring(text, "\n      --tls=DIR              Certificates (or $HSLT_TEST_TLS)\n");
	expect_substring(text, "\n      --blobs=GB             Of the spool (100)\n");
	expect_substring(text, "\n  -k, --kind=NAME            path, bdpt or hslt (chosen). There are more\n");
	expect_substring(text, "\n\n When to stop:\n      --spp=+N               Samples\n");
	expect_substring(text, "\n      --man                  Print the manual page (for man -l)\n");
	expect_substring(text, "\n      --completion           Print a bash completion script\n");
	expect_substring(text, "\nExamples:\n  hslt-test list\n");
	expect_substring(text, "\nExit codes: 0 done, 2 usage.\n");
}

static void test_man_page_has_every_section(void **state)
{
	(void)state;
	const char *text = print_to_text(OPTION_KIND_MAN);
	expect_substring(text, ".TH \"hslt\\-test\" 1 ");
	expect_substring(text, "\n.SH NAME\nhslt\\-test \\- Tests options.\n.SH SYNOPSIS\n");
	expect_substring(text, "\n.SH DESCRIPTION\n\\&.dot begins \\(aqthis\\(aq\n.PP\n\\efB is no escape\n");
	expect_substring(text, "\n.TP\n\\fB\\-o\\fR, \\fB\\-\\-output\\fR=\\fIFILE\\fR\nThe image.\n");
	expect_substring(text, "\n.SS \"When to stop\"\n");
	expect_substring(text, "\n.TP\n\\fBHSLT_TEST_TLS\\fR\nStands in for \\fB\\-\\-tls\\fR.\n");
	expect_substring(text, "\n.SH EXIT STATUS\n0 done, 2 usage.\n");
}

static void test_completion_script_covers_every_option(void **state)
{
	(void)state;
	const char *text = print_to_text(OPTION_KIND_COMPLETION);
	expect_substring(text, "\t-o | --output) mapfile -t COMPREPLY < <(compgen -f -- \"$word\") ;;\n");
	expect_substring(text, "\t--tls) mapfile -t COMPREPLY < <(compgen -d -- ");
	expect_substring(text, "\t-k | --kind) mapfile -t COMPREPLY < <(compgen -W \"path bdpt hslt\" -- ");
	expect_substring(text, "\t--share) mapfile -t COMPREPLY < <(compgen -W \"\" -- ");
	expect_substring(text, "-W \"--output --tls --name --wait --quiet --exposure ");
	expect_substring(text, "-W \"list fetch\" -f -- ");
	expect_substring(text, "\ncomplete -o filenames -F _hslt_test hslt-test\n");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_every_kind_of_value_is_parsed),
		cmocka_unit_test(test_values_out_of_bounds_are_refused),
		cmocka_unit_test(test_widest_bounds_are_printed_in_full),
		cmocka_unit_test(test_environment_overrides_defaults),
		cmocka_unit_test(test_options_are_accepted_in_any_order_and_form),
		cmocka_unit_test(test_mistyped_words_get_a_suggestion),
		cmocka_unit_test(test_required_options_and_checks_are_enforced),
		cmocka_unit_test(test_help_and_version_take_precedence),
		cmocka_unit_test(test_help_lists_every_option),
		cmocka_unit_test(test_man_page_has_every_section),
		cmocka_unit_test(test_completion_script_covers_every_option),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
