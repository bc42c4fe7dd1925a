/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/clock.h"
#include "common/base/progress.h"

#include "common/base/terminal.h"
#include "common/base/text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

enum { BAR_WIDTH_MAX = 40, BAR_WIDTH_MIN = 10, COLUMNS_DEFAULT = 80 };
static const double min_line_seconds = 10, max_line_seconds = 60, min_line_fraction = 0.1;

void progress_begin(struct progress *p)
{
	memset(p, 0, sizeof *p);
	p->is_terminal = terminal_moves_cursor(STDERR_FILENO);
	p->printed_fraction = -1;
}

static void draw_bar(double fraction, const char *state, const char *detail)
{
	struct winsize w;
	int columns = ioctl(STDERR_FILENO, TIOCGWINSZ, &w) == 0 && w.ws_col ? w.ws_col : COLUMNS_DEFAULT;
	int room = columns - (int)strlen(state) - (int)strlen(detail) - 12;
	int width = room > BAR_WIDTH_MAX ? BAR_WIDTH_MAX : room < BAR_WIDTH_MIN ? BAR_WIDTH_MIN : room;
	char bar[BAR_WIDTH_MAX + 1] = "";
	for (int i = 0; i < width; i++)
		bar[i] = i < (int)(fraction * width) ? '#' : '.';
	fprintf(stderr, "\r\033[K%s [%s] %5.1f %% %s", state, bar, 100 * fraction, detail);
	fflush(stderr);
}

void progress_show(struct progress *p, double fraction, const char *state, const char *detail)
{
	fraction = fraction > 0 ? fraction < 1 ? fraction : 1 : 0;
	if (p->is_terminal) {
		draw_bar(fraction, state, detail);
		p->is_bar_drawn = true;
		return;
	}
	double t = clock_seconds();
	bool due = p->printed_fraction < 0 || strcmp(state, p->printed_state) != 0 ||
		   fraction >= p->printed_fraction + min_line_fraction || t >= p->printed_time + max_line_seconds ||
		   (fraction > p->printed_fraction && (t >= p->printed_time + min_line_seconds || fraction >= 1));
	if (!due)
		return;
	fprintf(stderr, "%s %.1f %% %s\n", state, 100 * fraction, detail);
	p->printed_fraction = fraction;
	p->printed_time = t;
	text_copy(p->printed_state, sizeof p->printed_state, state);
}

double progress_max_fraction(struct progress *p, double fraction, const char *state)
{
	if (strcmp(state, p->max_fraction_state) != 0) {
		text_copy(p->max_fraction_state, sizeof p->max_fraction_state, state);
		p->max_fraction = 0;
	}
	p->max_fraction = fmax(p->max_fraction, fraction);
	return p->max_fraction;
}

void progress_explain_decrease(struct progress *p, double fraction, const char *state, char *detail, size_t size)
{
	double max_fraction = progress_max_fraction(p, fraction, state);
	size_t n = strlen(detail);
	if (max_fraction - fraction >= 0.001 && n < size)
		snprintf(detail + n, size - n, "; it was at %.1f %%, and more is to be done now", 100 * max_fraction);
}

void progress_end(struct progress *p)
{
	if (p->is_bar_drawn)
		fputc('\n', stderr);
	p->is_bar_drawn = false;
}

void progress_format_number(double x, char *text, size_t size)
{
	static const char *const units[] = {"", " k", " M", " G", " T"};
	int unit = 0;
	while (fabs(x) >= 999.5 && unit < 4) {
		x /= 1000;
		unit++;
	}
	snprintf(text, size, x < 9.995 && unit ? "%.2f%s" : x < 99.95 && unit ? "%.1f%s" : "%.0f%s", x, units[unit]);
}

void progress_format_time(double seconds, char *text, size_t size)
{
	double s = seconds > 0 ? ceil(seconds) : 0;
	long n = s < 1e9 ? (long)s : 1000000000;
	if (n < 60)
		snprintf(text, size, "%ld s", n);
	else if (n < 3600)
		snprintf(text, size, "%ld:%02ld", n / 60, n % 60);
	else
		snprintf(text, size, "%ld:%02ld:%02ld", n / 3600, n / 60 % 60, n % 60);
}

void progress_format_duration(double seconds, char *text, size_t size)
{
	static const struct {
		double unit;
		const char *name;
	} units[] = {{1, "s"}, {60, "min"}, {3600, "h"}, {86400, "days"}, {31557600, "years"}};
	size_t i = 0;
	while (i + 1 < sizeof units / sizeof *units && seconds >= 1.995 * units[i + 1].unit)
		i++;
	double x = seconds / units[i].unit;
	if (!(x < 1e6))
		snprintf(text, size, "for ever");
	else
		snprintf(text, size, "%.*f %s", x < 9.95 ? 1 : 0, x, units[i].name);
}
