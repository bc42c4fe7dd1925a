/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Text helpers (common/base/text.h): buffers never exceed their limit, texts are cut between UTF-8 characters and lose
 * their control characters, values cannot forge a line of the log, and numbers, counts and times are printed for
 * people.
 */
#include "common/base/buf.h"
#include "common/base/error.h"
#include "common/base/log.h"
#include "common/base/mem.h"
#include "common/base/progress.h"
#include "common/base/text.h"
#include "tests/support/failing_memory.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <setjmp.h>
#include <cmocka.h>

#include <string.h>

static void buffers_keep_their_limit(void **state)
{
	(void)state;
	struct buf b = {.limit = 1000};
	char chunk[300];
	memset(chunk, 'x', sizeof chunk);
	for (int i = 0; i < 3; i++)
		assert_true(buf_append(&b, chunk, sizeof chunk));
	assert_false(buf_append(&b, chunk, sizeof chunk));
	assert_int_equal(b.size, 900);
	assert_true(buf_append(&b, chunk, 100));
	assert_false(buf_append(&b, chunk, 1));
	assert_true(buf_append(&b, NULL, 0));
	assert_true(b.capacity <= 1000);
	buf_fini(&b);
	assert_true(buf_append(&b, "12 apples", 9));
	assert_int_equal(b.size, 9);
	assert_memory_equal(b.bytes, "12 apples", 9);
	mem_fail_after(0);
	assert_false(buf_reserve(&b, 800));
	mem_fail_after(-1);
	assert_memory_equal(b.bytes, "12 apples", 9);
	buf_fini(&b);
}

static void lines_that_do_not_fit_are_counted(void **state)
{
	(void)state;
	char out[64], longest[64];
	const char *const three[] = {"one", "two", "three"};
	text_join_lines(out, sizeof out, NULL, 0);
	assert_string_equal(out, "");
	text_join_lines(out, sizeof out, three, 1);
	assert_string_equal(out, "one");
	text_join_lines(out, sizeof out, three, 3);
	assert_string_equal(out, "one\ntwo\nthree");
	memset(longest, 'x', sizeof longest - 1);
	longest[sizeof longest - 1] = 0;
	const char *const full[] = {longest}, *const cut[] = {"one", longest, "three"};
	text_join_lines(out, sizeof out, full, 1);
	assert_string_equal(out, longest);
	text_join_lines(out, sizeof out, cut, 3);
	assert_string_equal(out, "one\nand 2 more");
	text_join_lines(out, 8, cut + 1, 2);
	assert_string_equal(out, "and 2 m"); /* never writes beyond the end of the buffer */
}

static void texts_are_cut_between_characters(void **state)
{
	(void)state;
	char out[8];
	text_copy(out, sizeof out, "short");
	assert_string_equal(out, "short");
	text_copy(out, sizeof out, "1234567890");
	assert_string_equal(out, "1234567");
	text_copy(out, sizeof out, "12345\xe2\x82\xac"); /* a euro sign that does not fit */
	assert_string_equal(out, "12345");
	text_copy(out, sizeof out, "1234\xe2\x82\xac");
	assert_string_equal(out, "1234\xe2\x82\xac");
	text_copy(out, 1, "x");
	assert_string_equal(out, "");
	text_print(out, sizeof out, "%d%s", 1, "2345\xe2\x82\xac");
	assert_string_equal(out, "12345");
	text_print(out, sizeof out, "%d%s", 1, "234\xe2\x82\xac");
	assert_string_equal(out, "1234\xe2\x82\xac");
	struct text t = {out, sizeof out};
	text_appendf(&t, "123%s", "\xc3\xa4\xc3\xa4\xc3\xa4");
	assert_string_equal(out, "123\xc3\xa4\xc3\xa4");
	t = (struct text){out, sizeof out};
	text_appendf(&t, "1234%s", "\xc3\xa4\xc3\xa4");
	text_appendf(&t, "x"); /* nothing is appended to a text that was cut */
	assert_string_equal(out, "1234\xc3\xa4");
}

static void control_characters_are_replaced(void **state)
{
	(void)state;
	char text[] = "a\xc3\xa4\xe2\x82\"\n\x7f\xed\xa0\x80\xf0\x9f\x98\x80\xff";
	assert_false(text_is_clean(text));
	text_clean(text);
	assert_string_equal(text, "a\xc3\xa4??\"  ???\xf0\x9f\x98\x80?");
	assert_true(text_is_clean(text));
	char command[] = "\xc2\x9b"
			 "2J\xc2\x80\xc2\xa0\xc2\x9f";
	assert_false(text_is_clean(command));
	text_clean(command);
	assert_string_equal(command, "  2J  \xc2\xa0  ");
	assert_true(text_is_clean(command));
	/* a sentence has no control characters, whatever it quotes */
	struct error e;
	error_set(&e, EINVAL, "<%.4s>: %s", "abc\xc3\xa4", "caf\xe9");
	assert_string_equal(e.text, "<abc?>: caf?");
	assert_int_equal(error_prefix(&e, -1, "%.2s", "x\xc3\xa4"), -1);
	assert_string_equal(e.text, "x?: <abc?>: caf?");
}

static void values_cannot_forge_a_log_line(void **state)
{
	(void)state;
	assert_string_equal(log_quote("a \"b\"\nlevel=error \\ \x01").text, "\"a \\\"b\\\" level=error \\\\  \"");
	char longer[2000];
	memset(longer, '"', sizeof longer - 1);
	longer[sizeof longer - 1] = 0;
	struct log_value v = log_quote(longer);
	assert_true(strlen(v.text) < LOG_VALUE_MAX);
	assert_int_equal(v.text[strlen(v.text) - 1], '"');
	char line[64];
	size_t n = log_format(line, sizeof line, LOG_JOB_DONE, "job=j1");
	assert_int_equal(n, strlen(line));
	assert_true(n < sizeof line);
	char whole[256];
	log_format(whole, sizeof whole, LOG_JOB_DONE, "job=j1");
	assert_non_null(strstr(whole, "Z level=info event=job_done job=j1"));
}

static void numbers_and_times_are_printed_for_people(void **state)
{
	(void)state;
	static const struct {
		double x;
		const char *text;
	} numbers[] = {{0, "0"},	  {12.4, "12"},	     {999.4, "999"},  {999.6, "1.00 k"}, {1234, "1.23 k"},
		       {99900, "99.9 k"}, {123456, "123 k"}, {5e6, "5.00 M"}, {2e12, "2.00 T"}},
	  times[] = {{0, "0 s"}, {0.2, "1 s"}, {59, "59 s"}, {61, "1:01"}, {3600, "1:00:00"}, {36061, "10:01:01"}},
	  spans[] = {{0, "0.0 s"},	 {4.46, "4.5 s"},    {31, "31 s"},	    {119, "119 s"},
		     {180, "3.0 min"},	 {3600, "60 min"},   {8000, "2.2 h"},	    {2e6, "23 days"},
		     {1e8, "3.2 years"}, {1e15, "for ever"}, {HUGE_VAL, "for ever"}};
	char text[32];
	for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
		progress_format_number(numbers[i].x, text, sizeof text);
		assert_string_equal(text, numbers[i].text);
	}
	for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
		progress_format_time(times[i].x, text, sizeof text);
		assert_string_equal(text, times[i].text);
	}
	for (size_t i = 0; i < sizeof spans / sizeof *spans; i++) {
		progress_format_duration(spans[i].x, text, sizeof text);
		assert_string_equal(text, spans[i].text);
	}
}

static void counts_with_units_are_parsed(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		uint64_t count;
	} good[] = {{"0", 0},
		    {"17", 17},
		    {"1.5k", 1500},
		    {"2K", 2000},
		    {"0.25M", 250000},
		    {"3G", 3000000000u},
		    {".5k", 500},
		    {"1.001k", 1001}, /* 1.001 * 1e3 < 1001 */
		    {"2.01G", 2010000000},
		    {"18446744073709551615", UINT64_MAX},
		    {"9007199254740993", 9007199254740993u}};
	static const char *const bad[] = {
		"",	"k",   "1.5", "1.2345k", "1.0001k", "-1",  "+1",    " 1",
		"1 ",	"1kk", "1m",  "1e400",	 "nan",	    "inf", "0x10k", "18446744073709551616",
		"1e30G"};
	uint64_t n;
	for (size_t i = 0; i < sizeof good / sizeof *good; i++)
		if (!text_parse_count(good[i].text, &n) || n != good[i].count)
			fail_msg("'%s' is read as %llu", good[i].text, (unsigned long long)n);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		if (text_parse_count(bad[i], &n))
			fail_msg("'%s' is taken for %llu", bad[i], (unsigned long long)n);
}

static void times_with_units_are_parsed(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double seconds;
	} good[] = {{"90", 90}, {"0.5", 0.5}, {"90s", 90}, {"5m", 300}, {"1.5h", 5400}, {"2d", 172800}};
	static const char *const bad[] = {"", "m", "5 m", "5min", "-5", "5M", "1e999", "nan", "inf", "5mm"};
	double x;
	for (size_t i = 0; i < sizeof good / sizeof *good; i++)
		if (!text_parse_time(good[i].text, 1, &x) || x != good[i].seconds)
			fail_msg("'%s' is read as %g", good[i].text, x);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		if (text_parse_time(bad[i], 1, &x))
			fail_msg("'%s' is taken for %g s", bad[i], x);
	assert_true(text_parse_time("1.5", 86400, &x) && x == 129600);
	assert_true(text_parse_time("2h", 86400, &x) && x == 7200);
	assert_false(text_parse_time("1e308", 86400, &x));
}

static void sizes_with_units_are_parsed(void **state)
{
	(void)state;
	static const struct {
		const char *text;
		double bytes;
	} good[] = {{"64", 64e6},   {"0.5", 5e5},  {"500k", 5e5},   {"64M", 64e6},
		    {"64MB", 64e6}, {"20G", 2e10}, {"1.5g", 1.5e9}, {"2TB", 2e12}};
	static const char *const bad[] = {"", "M", "5 M", "5GiB", "-5", "5B", "5MBB", "1e307T", "nan", "0x5M"};
	double x;
	for (size_t i = 0; i < sizeof good / sizeof *good; i++)
		if (!text_parse_bytes(good[i].text, 1e6, &x) || x != good[i].bytes)
			fail_msg("'%s' is read as %g", good[i].text, x);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		if (text_parse_bytes(bad[i], 1e6, &x))
			fail_msg("'%s' is taken for %g bytes", bad[i], x);
}

static void lists_of_counts_are_parsed(void **state)
{
	(void)state;
	uint32_t n[4];
	static const char *const bad[] = {"",	   "1k",   "1kx",  "x1k",  "1.0001kx2",
					  "1x2x3", "1x2 ", "-1x2", "5Gx1", "00000000000000000000000000000000001x2"};
	assert_true(text_parse_counts("1k", "x", n, 1) && n[0] == 1000);
	assert_true(text_parse_counts("1.5kx720", "x", n, 2) && n[0] == 1500 && n[1] == 720);
	assert_true(text_parse_counts("0,1k,320,.5k", ",,,", n, 4) && n[0] == 0 && n[1] == 1000 && n[2] == 320 &&
		    n[3] == 500);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		if (text_parse_counts(bad[i], "x", n, 2))
			fail_msg("'%s' is taken for %u and %u", bad[i], n[0], n[1]);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(counts_with_units_are_parsed),
		cmocka_unit_test(times_with_units_are_parsed),
		cmocka_unit_test(sizes_with_units_are_parsed),
		cmocka_unit_test(lists_of_counts_are_parsed),
		cmocka_unit_test(buffers_keep_their_limit),
		cmocka_unit_test(lines_that_do_not_fit_are_counted),
		cmocka_unit_test(texts_are_cut_between_characters),
		cmocka_unit_test(control_characters_are_replaced),
		cmocka_unit_test(values_cannot_forge_a_log_line),
		cmocka_unit_test(numbers_and_times_are_printed_for_people),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
