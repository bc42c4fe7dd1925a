/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Plots as gnuplot draws them, read back as XML: points lie where their values say on both kinds of axes, texts
 * survive whatever they contain, axes have tick marks, and an empty plot says so. Without gnuplot, the error names
 * it.
 */
#include "worker/cli/plot/plot.h"
#include "worker/cli/plot/plot_axis.h"

#include "common/base/mem.h"
#include "tests/support/temporary_folder.h"

#include <expat.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>

/* The contents of an SVG, as read by an XML parser in this test. */
struct content {
	char text[4096]; /* of <text> elements, separated by bars */
	size_t text_size, use_count, script_count;
	double use_x[64], use_y[64];
	bool in_text;
};

static void on_element_begin(void *user, const XML_Char *name, const XML_Char **attributes)
{
	struct content *c = user;
	c->in_text |= strcmp(name, "text") == 0;
	c->script_count += strcmp(name, "script") == 0;
	for (size_t i = 0; strcmp(name, "use") == 0 && attributes[i]; i += 2)
		if (strcmp(attributes[i], "transform") == 0 && c->use_count < 64 &&
		    sscanf(attributes[i + 1], "translate(%lf,%lf)", &c->use_x[c->use_count], &c->use_y[c->use_count]) ==
			    2)
			c->use_count++;
}

static void on_element_end(void *user, const XML_Char *name)
{
	struct content *c = user;
	if (strcmp(name, "text") == 0) {
		c->in_text = false;
		c->text[c->text_size++] = '|';
	}
}

static void on_text(void *user, const XML_Char *s, int n)
{
	struct content *c = user;
	if (c->in_text && c->text_size + (size_t)n < sizeof c->text - 64) {
		memcpy(c->text + c->text_size, s, (size_t)n);
		c->text_size += (size_t)n;
	}
}

static void read_svg(const struct plot *p, struct content *c)
{
	struct error e = {""};
	char *svg = NULL;
	size_t size = 0;
	*c = (struct content){.text = ""};
	if (plot_svg(p, &svg, &size, &e))
		fail_msg("%s", e.text);
	assert_int_equal(strlen(svg), size);
	assert_null(strstr(svg, "scale(0.00)")); /* a singular matrix: some viewers then show nothing at all */
	XML_Parser x = XML_ParserCreate(NULL);
	XML_SetUserData(x, c);
	XML_SetElementHandler(x, on_element_begin, on_element_end);
	XML_SetCharacterDataHandler(x, on_text);
	if (XML_Parse(x, svg, (int)size, 1) != XML_STATUS_OK)
		fail_msg("not XML: %s", XML_ErrorString(XML_GetErrorCode(x)));
	XML_ParserFree(x);
	mem_free(svg);
}

static void points_lie_at_their_values(void **unused)
{
	(void)unused;
	const double x[] = {1, 10, 100, 1000, NAN, 10}, y[] = {8, 4, 2, 1, 3, -1};
	struct plot_series s = {.name = "measured", .style = PLOT_POINTS, .count = 6, .x = x, .y = y};
	struct plot p = {"Title", "time", "error", true, true, 1, &s, NULL, 0};
	struct content c;
	read_svg(&p, &c);
	/* Four points are drawn; the fifth mark is the legend's. Equal ratios have equal distances. */
	assert_int_equal(c.use_count, 5);
	size_t first = fabs((c.use_x[1] - c.use_x[0]) - (c.use_x[2] - c.use_x[1])) < 0.5 ? 0 : 1;
	for (size_t i = first; i + 2 < first + 4; i++) {
		assert_true(c.use_x[i + 1] > c.use_x[i] + 50 && c.use_y[i + 1] > c.use_y[i] + 20);
		assert_true(fabs((c.use_x[i + 1] - c.use_x[i]) - (c.use_x[i + 2] - c.use_x[i + 1])) < 0.5);
		assert_true(fabs((c.use_y[i + 1] - c.use_y[i]) - (c.use_y[i + 2] - c.use_y[i + 1])) < 0.5);
	}
	const char *const wanted[] = {"|Title|", "|time|", "|error|", "|measured|", "|1000|", "|2|"};
	for (size_t i = 0; i < 6; i++)
		if (!strstr(c.text, wanted[i]) && strncmp(c.text, wanted[i] + 1, strlen(wanted[i] + 1)) != 0)
			fail_msg("no %s in %s", wanted[i], c.text);
}

static void texts_survive_whatever_they_contain(void **unused)
{
	(void)unused;
	char made[80], nasty[400];
	snprintf(made, sizeof made, "%s/made", temporary_folder);
	snprintf(
		nasty, sizeof nasty,
		"a'b\"c $d $HOME @e `touch %s` {f}_g^2 <h>&amp;</svg>\\n\n!touch %s\n\x01\xff\xed\xa0\x80 \xc3\xa9 %%s",
		made, made);
	const double x[] = {1, 2}, y[] = {1, 2};
	const char *const labels[] = {nasty, ""};
	struct plot_series s[] = {{nasty, PLOT_POINTS, 2, x, y, NULL, NULL, labels},
				  {nasty, PLOT_LINE, 2, x, y, x, y, NULL}};
	struct plot p = {nasty, nasty, nasty, false, false, 2, s, NULL, 0};
	struct content c;
	read_svg(&p, &c);
	size_t seen = 0;
	for (const char *at = c.text; (at = strstr(at, "a'b\"c $d $HOME @e `touch ")) != NULL; at++)
		seen++;
	assert_int_equal(seen, 6);
	assert_non_null(strstr(c.text, "{f}_g^2 <h>&amp;</svg>\\n !touch "));
	assert_non_null(strstr(c.text, "????"));
	assert_non_null(strstr(c.text, "\xc3\xa9 %s"));
	assert_int_equal(c.script_count, 0);
	struct stat st;
	assert_int_equal(stat(made, &st), -1);
}

static void bars_and_bands_are_drawn(void **unused)
{
	(void)unused;
	const double x[] = {1, 2, 3}, y[] = {5, 4, 3}, low[] = {4, -1, 2.5}, high[] = {6, 5, INFINITY};
	struct plot_series s[] = {{"band", PLOT_BAND, 3, x, NULL, low, high, NULL},
				  {"line", PLOT_LINE, 3, x, y, low, high, NULL}};
	struct plot p = {"Bars", "x", "y", false, true, 2, s, NULL, 0};
	struct plot_axis ax, ay;
	struct content c;
	read_svg(&p, &c);
	assert_true(plot_axes(&p, &ax, &ay));
	assert_true(ay.is_log && !ax.is_log && ay.min > 0 && ay.min < 2.5 && ay.max > 6 && ay.tic_count >= 3);
}

static void empty_plot_is_an_error(void **unused)
{
	(void)unused;
	const double x[] = {-1, NAN}, y[] = {1, 1};
	struct plot_series s = {"", PLOT_POINTS, 2, x, y, NULL, NULL, NULL};
	struct plot p = {"None", "", "", true, false, 1, &s, NULL, 0};
	struct error e = {""};
	char *svg;
	size_t size;
	assert_int_equal(plot_svg(&p, &svg, &size, &e), -EINVAL);
	assert_non_null(strstr(e.text, "None"));
	p.is_log_x = false;
	assert_int_equal(plot_write(&p, "/nowhere/plot.txt", &e), -EINVAL);
	assert_non_null(strstr(e.text, "plot.txt"));
}

static void axes_have_tick_marks(void **unused)
{
	(void)unused;
	for (double from = 1e-7; from < 1e7; from *= 7.3)
		for (double ratio = 1; ratio < 1e12; ratio *= 2.7) {
			const double x[] = {from, from * ratio};
			struct plot_series s = {"", PLOT_POINTS, 2, x, x, NULL, NULL, NULL};
			struct plot p = {"", "", "", true, false, 1, &s, NULL, 0};
			struct plot_axis ax, ay;
			assert_true(plot_axes(&p, &ax, &ay));
			assert_true(ax.min < from && ax.max > from * ratio && ay.min < ay.max);
			if (ax.tic_count < 2 || ax.tic_count > 24)
				fail_msg("%g to %g: %zu marks", ax.min, ax.max, ax.tic_count);
		}
}

static void plots_are_written_as_png_and_svg(void **unused)
{
	(void)unused;
	const double x[] = {1, 2, 3}, y[] = {3, 1, 2};
	struct plot_series s = {"", PLOT_LINE, 3, x, y, NULL, NULL, NULL};
	struct plot p = {"File", "x", "y", false, false, 1, &s, NULL, 0};
	struct error e = {""};
	char path[128];
	static const char *const ending[2] = {"png", "svg"}, *const begins[2] = {"\x89PNG", "<?xml"};
	for (int i = 0; i < 2; i++) {
		char head[8] = {0};
		snprintf(path, sizeof path, "%s/plot.%s", temporary_folder, ending[i]);
		if (plot_write(&p, path, &e))
			fail_msg("%s", e.text);
		FILE *f = fopen(path, "rb");
		assert_non_null(f);
		assert_int_equal(fread(head, 1, 5, f), 5);
		fclose(f);
		assert_memory_equal(head, begins[i], strlen(begins[i]));
	}
}

static void missing_gnuplot_is_named(void **unused)
{
	(void)unused;
	char *old = strdup(getenv("PATH"));
	const double x[] = {1}, y[] = {1};
	struct plot_series s = {"", PLOT_POINTS, 1, x, y, NULL, NULL, NULL};
	struct plot p = {"Alone", "", "", false, false, 1, &s, NULL, 0};
	struct error e = {""};
	char *svg;
	size_t size;
	setenv("PATH", temporary_folder, 1);
	int rc = plot_svg(&p, &svg, &size, &e);
	setenv("PATH", old, 1);
	free(old);
	assert_int_equal(rc, -ENOENT);
	assert_non_null(strstr(e.text, "gnuplot-nox"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(points_lie_at_their_values),
		cmocka_unit_test_setup_teardown(texts_survive_whatever_they_contain, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test(bars_and_bands_are_drawn),
		cmocka_unit_test(empty_plot_is_an_error),
		cmocka_unit_test(axes_have_tick_marks),
		cmocka_unit_test_setup_teardown(plots_are_written_as_png_and_svg, temporary_folder_set_up,
						temporary_folder_tear_down),
		cmocka_unit_test_setup_teardown(missing_gnuplot_is_named, temporary_folder_set_up,
						temporary_folder_tear_down),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}
