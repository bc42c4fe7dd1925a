/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The data is written as a script for gnuplot, which reads it on its standard input and writes an SVG or PNG to its
 * standard output. Script, output and messages are files in memory (memfd), each complete before it is read, so that
 * neither side waits for the other. Every name in the script is quoted here, and every number printed here, so that
 * nothing from outside can become a command.
 *
 * Failures: gnuplot is not installed (-ENOENT), gnuplot exits with an error (the sentence has its message), no room for
 * its output.
 */
#include "worker/cli/plot/plot.h"

#include "common/base/fnv.h"
#include "common/base/io.h"
#include "common/base/mem.h"
#include "common/exr/image_file.h"
#include "worker/cli/base/text_file.h"
#include "worker/cli/plot/plot_axis.h"

#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { OUTPUT_MAX = 1 << 26 };

extern char **environ;

/* Appends a text in single quotes, in which gnuplot interprets only the quote itself. Such a text cannot contain a line
 * break, so control characters become blanks. */
static void put_quoted(struct text_file *s, const char *text)
{
	enum { QUOTED_MAX = 400 };
	const char *end = text + strlen(text);
	text_file_put_bytes(s, "'", 1);
	for (size_t done = 0; text < end && done < QUOTED_MAX; done++) {
		size_t n = text_file_character_length(text);
		if (n == 0 || *text == '\t' || *text == '\n')
			text_file_put_bytes(s, *text > 0 ? " " : "?", 1);
		else if (*text == '\'')
			text_file_put_bytes(s, "''", 2);
		else
			text_file_put_bytes(s, text, n);
		text += n ? n : 1;
	}
	text_file_put_bytes(s, "'", 1);
}

/* Blue, vermilion, green, purple, orange, sky (Okabe and Ito 2008), which can be distinguished with all kinds of colour
 * vision, on white and in print. */
static const char *const colours[] = {"#0072b2", "#d55e00", "#009e73", "#aa4499", "#e69f00", "#56b4e9"};
static const int shapes[] = {7, 5, 9, 13, 11, 4};

static void put_axis(struct text_file *s, char which, const struct plot_axis *a, const char *label)
{
	text_file_put(s, "set %clabel ", which);
	put_quoted(s, label);
	text_file_put(s, "\nset %crange [%.9g:%.9g]\n", which, a->min, a->max);
	if (!a->is_log)
		return;
	text_file_put(s, "set logscale %c\nset %ctics (", which, which);
	for (size_t i = 0; i < a->tic_count; i++)
		text_file_put(s, "%s'%.6g' %.9g", i ? "," : "", a->tics[i], a->tics[i]);
	text_file_put(s, ")\n");
}

static void put_x_names(struct text_file *s, const struct plot *p)
{
	if (!p->x_names)
		return;
	text_file_put(s, "set xrange [0.5:%zu.5]\nset xtics (", p->x_name_count);
	for (size_t i = 0; i < p->x_name_count; i++) {
		text_file_put(s, i ? "," : "");
		put_quoted(s, p->x_names[i]);
		text_file_put(s, " %zu", i + 1);
	}
	text_file_put(s, ")\n");
}

static void put_style(struct text_file *s, bool png, uint64_t name)
{
	if (png)
		text_file_put(
			s,
			"set terminal pngcairo noenhanced size 1440,880 fontscale 1.7 linewidth 1.6 pointscale 1.7 font 'DejaVu Sans,11' "
			"background '#ffffff'\n");
	else
		text_file_put(
			s,
			"set terminal svg noenhanced size 720,440 name 'p%016llx' font 'DejaVu Sans,Verdana,Helvetica,Arial,sans-serif,13' "
			"background '#ffffff'\n",
			(unsigned long long)name);
	text_file_put(
		s,
		"set encoding utf8\nset border 3 lw 1 lc rgb '#555555'\nset tics out nomirror scale 0.6 textcolor rgb '#222222'\n"
		"set xzeroaxis lt 1 lw 1 lc rgb '#777777'\nset grid lc rgb '#dddddd' lt 1 lw 0.8\n"
		"set key tmargin center horizontal reverse Left noautotitle samplen 2 width 2 textcolor rgb '#222222'\n"
		"set style fill transparent solid 0.2 noborder\nset bars 0.6\nset format '%%.6g'\n");
}

static void put_data(struct text_file *s, const struct plot *p, const struct plot_axis *y_axis, size_t k)
{
	const struct plot_series *r = &p->series[k];
	text_file_put(s, "$d%zu << EOD\n", k);
	for (size_t i = 0; i < r->count; i++) {
		if (!plot_point_is_shown(p, r, i))
			continue;
		double y = r->y ? r->y[i] : r->low[i];
		bool bars = r->low && r->high && isfinite(r->low[i]) && isfinite(r->high[i]) &&
			    (!p->is_log_y || r->high[i] > 0);
		double low = bars ? r->low[i] : y, high = bars ? r->high[i] : y;
		/* On a logarithmic axis, a bar that reaches 0 extends to the edge. */
		text_file_put(s, "%.9g %.9g %.9g %.9g\n", r->x[i], y,
			      p->is_log_y && !(low > y_axis->min) ? y_axis->min : low, high);
	}
	text_file_put(s, "EOD\n");
	for (size_t i = 0; r->labels && i < r->count; i++) {
		if (!r->labels[i] || !*r->labels[i] || !plot_point_is_shown(p, r, i))
			continue;
		text_file_put(s, "set label ");
		put_quoted(s, r->labels[i]);
		text_file_put(s, " at %.9g,%.9g left offset character 0.7,0.5 textcolor rgb '#444444' front\n", r->x[i],
			      r->y ? r->y[i] : r->low[i]);
	}
}

static bool has_points(const struct plot *p, size_t k)
{
	for (size_t i = 0; i < p->series[k].count; i++)
		if (plot_point_is_shown(p, &p->series[k], i))
			return true;
	return false;
}

static void put_series(struct text_file *s, const struct plot *p, size_t k)
{
	const struct plot_series *r = &p->series[k];
	const char *colour = colours[k % (sizeof colours / sizeof *colours)];
	int shape = shapes[k % (sizeof shapes / sizeof *shapes)];
	if (r->style != PLOT_BAND && r->low && r->high)
		text_file_put(s, "$d%zu using 1:2:3:4 with yerrorbars pt 0 lw 1.4 lc rgb '%s', ", k, colour);
	text_file_put(s, "$d%zu using ", k);
	if (r->style == PLOT_BAND)
		text_file_put(s, "1:3:4 with filledcurves lc rgb '%s'", colour);
	else if (r->style == PLOT_LINE)
		text_file_put(s, "1:2 with lines lw 2 lc rgb '%s'", colour);
	else
		text_file_put(s, "1:2 with points pt %d ps 0.8 lc rgb '%s'", shape, colour);
	if (*r->name) {
		text_file_put(s, " title ");
		put_quoted(s, r->name);
	}
}

static int write_script(struct text_file *s, const struct plot *p, bool png, struct error *e)
{
	struct plot_axis x, y;
	struct text_file body = {.has_failed = false};
	if (!plot_axes(p, &x, &y))
		return error_set(e, EINVAL, "the plot '%.80s' has no point that could be shown", p->title);
	text_file_put(&body, "set title ");
	put_quoted(&body, p->title);
	text_file_put(&body, "\n");
	put_axis(&body, 'x', &x, p->x_label);
	put_axis(&body, 'y', &y, p->y_label);
	put_x_names(&body, p);
	for (size_t k = 0; k < p->series_count; k++)
		put_data(&body, p, &y, k);
	for (size_t k = 0, shown = 0; k < p->series_count; k++) {
		if (!has_points(p, k))
			continue;
		text_file_put(&body, shown++ ? ", " : "plot ");
		put_series(&body, p, k);
	}
	text_file_put(&body, "\n");
	/* Plots in the same page need distinct ids for their parts; these are derived from the contents, so that they
	 * are reproducible. */
	put_style(s, png, fnv_add(FNV_OFFSET_BASIS, body.text.bytes, body.text.size));
	text_file_put_bytes(s, body.text.bytes, body.text.size);
	s->has_failed = s->has_failed || body.has_failed;
	text_file_fini(&body);
	return s->has_failed ? error_set(e, ENOMEM, "the plot '%.80s' has too many points", p->title) : 0;
}

/* Runs gnuplot with these files as stdin, stdout and stderr, and waits for its end. Returns -EIO without a sentence if
 * gnuplot fails. */
static int run_gnuplot(const int fd[3], struct error *e)
{
	char name[] = "gnuplot", settings[] = "--default-settings", input[] = "-";
	char *argv[] = {name, settings, input, NULL};
	posix_spawn_file_actions_t actions;
	posix_spawnattr_t attributes;
	sigset_t none, all;
	pid_t pid;
	int status;
	sigemptyset(&none);
	sigfillset(&all);
	posix_spawn_file_actions_init(&actions);
	posix_spawnattr_init(&attributes);
	for (int i = 0; i < 3; i++)
		posix_spawn_file_actions_adddup2(&actions, fd[i], i);
	/* In a process group of its own, gnuplot does not get an interrupt from the terminal: this program handles it
	 * and finishes its report, for which it needs the plot. */
	posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
	posix_spawnattr_setpgroup(&attributes, 0);
	posix_spawnattr_setsigmask(&attributes, &none);
	posix_spawnattr_setsigdefault(&attributes, &all);
	int rc = posix_spawnp(&pid, name, &actions, &attributes, argv, environ);
	posix_spawn_file_actions_destroy(&actions);
	posix_spawnattr_destroy(&attributes);
	if (rc == ENOENT)
		return error_set(e, ENOENT, "no plots: gnuplot is not installed (Debian: apt-get install gnuplot-nox)");
	if (rc)
		return error_set(e, rc, "no plots: gnuplot cannot be started: %s", strerror(rc));
	while ((rc = waitpid(pid, &status, 0)) < 0 && errno == EINTR)
		;
	if (rc < 0)
		return error_set(e, errno, "no plots: waiting for gnuplot: %s", strerror(errno));
	return WIFEXITED(status) && WEXITSTATUS(status) == 0 ? 0 : -EIO;
}

/* Reads the whole file and appends a 0. */
static int read_output(int fd, char **bytes, size_t *size, struct error *e)
{
	struct stat st;
	if (fstat(fd, &st) != 0 || st.st_size < 1 || st.st_size > OUTPUT_MAX)
		return error_set(e, EIO, "gnuplot wrote nothing, or too much");
	*size = (size_t)st.st_size;
	*bytes = mem_alloc(*size + 1, 1);
	if (!*bytes)
		return error_set(e, ENOMEM, "no memory for a plot of %zu bytes", *size);
	ssize_t n = lseek(fd, 0, SEEK_SET) ? -errno : io_read_all(fd, *bytes, *size);
	if (n == st.st_size)
		return 0;
	mem_free(*bytes);
	*bytes = NULL;
	return error_set(e, EIO, "reading gnuplot's output: %s", n < 0 ? strerror((int)-n) : "it became shorter");
}

static void report_gnuplot(int fd, const struct plot *p, struct error *e)
{
	char text[400];
	ssize_t n = pread(fd, text, sizeof text - 1, 0);
	text[n > 0 ? n : 0] = 0;
	for (char *c = text; *c; c++)
		*c = (unsigned char)*c < 0x20 ? ' ' : *c;
	error_set(e, EIO, "gnuplot failed at the plot '%.80s': %s", p->title, text);
}

static int draw_plot(const struct plot *p, bool png, char **bytes, size_t *size, struct error *e)
{
	static const char *const names[3] = {"plot-script", "plot-output", "plot-errors"};
	struct text_file s = {.has_failed = false};
	int fd[3] = {-1, -1, -1};
	int rc = write_script(&s, p, png, e);
	for (int i = 0; !rc && i < 3; i++) {
		fd[i] = memfd_create(names[i], MFD_CLOEXEC);
		if (fd[i] < 0)
			rc = error_set(e, errno, "no room for a plot: %s", strerror(errno));
	}
	if (!rc && (io_write_all(fd[0], s.text.bytes, s.text.size) || lseek(fd[0], 0, SEEK_SET)))
		rc = error_set(e, EIO, "no room for a plot's data");
	if (!rc) {
		rc = run_gnuplot(fd, e);
		if (rc == -EIO)
			report_gnuplot(fd[2], p, e);
	}
	if (!rc)
		rc = read_output(fd[1], bytes, size, e);
	for (int i = 0; i < 3; i++)
		if (fd[i] >= 0)
			close(fd[i]);
	text_file_fini(&s);
	return rc;
}

/* Removes the meaningless titles that gnuplot gives to each part, and that browsers show at the pointer. */
static void drop_titles(char *svg, size_t *size)
{
	char *to = svg;
	for (const char *from = svg; *from;) {
		const char *end = strncmp(from, "<title>", 7) == 0 ? strstr(from, "</title>") : NULL;
		if (end)
			from = end + 8;
		else
			*to++ = *from++;
	}
	*to = 0;
	*size = (size_t)(to - svg);
}

int plot_svg(const struct plot *p, char **svg, size_t *size, struct error *e)
{
	int rc = draw_plot(p, false, svg, size, e);
	if (!rc)
		drop_titles(*svg, size);
	return rc;
}

int plot_write(const struct plot *p, const char *path, struct error *e)
{
	size_t n = strlen(path), size;
	char *bytes;
	bool png = n > 4 && strcmp(path + n - 4, ".png") == 0;
	if (!png && !(n > 4 && strcmp(path + n - 4, ".svg") == 0))
		return error_set(e, EINVAL, "%s: plots are .svg or .png", path);
	int rc = png ? draw_plot(p, true, &bytes, &size, e) : plot_svg(p, &bytes, &size, e);
	if (rc)
		return rc;
	union {
		char *text;
		unsigned char *bytes;
	} u = {bytes};
	rc = image_file_write(path, u.bytes, size, e);
	mem_free(bytes);
	return rc;
}
