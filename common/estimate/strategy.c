/* SPDX-License-Identifier: Apache-2.0 */
#include "common/estimate/strategy.h"

#include "common/base/text.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum { NAME_WIDTH = 24, NUMBER_SIZE = 32 };

static const char *const counter_names[STRATEGY_COUNTERS] = {
	[STRATEGY_PROPOSED] = "proposed",
	[STRATEGY_ACCEPTED] = "accepted",
	[STRATEGY_RAYS] = "rays",
	[STRATEGY_WALKS] = "walks",
	[STRATEGY_ITERATIONS] = "iterations",
	[STRATEGY_REVERSE_WALKS] = "reverseWalks",
	[STRATEGY_FAIL_OUTSIDE] = "outside",
	[STRATEGY_FAIL_MISSED] = "missed",
	[STRATEGY_FAIL_BLOCKED] = "blocked",
	[STRATEGY_FAIL_MODE] = "mode",
	[STRATEGY_FAIL_SINGULAR] = "singular",
	[STRATEGY_FAIL_DIVERGED] = "diverged",
	[STRATEGY_FAIL_ITERATIONS] = "exhausted",
	[STRATEGY_FAIL_REVERSE] = "reverse",
	[STRATEGY_FAIL_SPECULAR] = "specular",
	[STRATEGY_FAIL_EMITTER] = "emitter",
	[STRATEGY_FAIL_DARK] = "dark",
	[STRATEGY_FAIL_INAPPLICABLE] = "inapplicable",
};

const char *strategy_counter_name(enum strategy_counter c)
{
	assert((unsigned)c < STRATEGY_COUNTERS);
	return counter_names[c];
}

/* Prints 5210 as "5,210". */
static const char *print_thousands(uint64_t n, char out[NUMBER_SIZE])
{
	char digits[NUMBER_SIZE];
	int length = snprintf(digits, sizeof digits, "%llu", (unsigned long long)n), at = 0;
	for (int i = 0; i < length; i++) {
		if (i > 0 && (length - i) % 3 == 0)
			out[at++] = ',';
		out[at++] = digits[i];
	}
	out[at] = 0;
	return out;
}

/* Appends a table cell of the given width: factor * a / b, or '-' if b is 0. */
static void append_ratio(struct text *t, int width, double factor, uint64_t a, uint64_t b)
{
	if (b)
		text_appendf(t, " %*.2f", width, factor * (double)a / (double)b);
	else
		text_appendf(t, " %*s", width, "-");
}

static uint64_t sum_failures(const uint64_t c[STRATEGY_COUNTERS])
{
	uint64_t n = 0;
	for (int k = STRATEGY_FAIL_FIRST; k < STRATEGY_COUNTERS; k++)
		n += c[k];
	return n;
}

/* Appends the reasons for failures, in % of the proposals. Reasons that never occurred are left out, to keep lines
 * readable. */
static void append_failures(struct text *t, const uint64_t c[STRATEGY_COUNTERS])
{
	text_appendf(t, " ");
	if (sum_failures(c) == 0)
		text_appendf(t, " -");
	for (int k = STRATEGY_FAIL_FIRST; k < STRATEGY_COUNTERS; k++)
		if (c[k])
			text_appendf(t, " %s %.3g", counter_names[k],
				     100 * (double)c[k] / (double)c[STRATEGY_PROPOSED]);
	text_appendf(t, "\n");
}

void strategy_print_table(const char *mixture, const struct canvas_counts *n, char *text, size_t size)
{
	struct text t = {text, size};
	int count = plan_strategy_count(mixture);
	uint64_t proposed = 0;
	if (size)
		text[0] = 0;
	for (int i = 0; i < count; i++)
		proposed += n->strategies[i][STRATEGY_PROPOSED];
	if (!proposed)
		return;
	text_appendf(&t, "%-*s %14s %9s %9s %14s %9s %14s %8s  %s\n", NAME_WIDTH, "strategy", "proposals", "accepted%",
		     "rays/prop", "walks", "iter/walk", "reverse walks", "failed%", "failures in % of proposals");
	for (int i = 0; i < count; i++) {
		const uint64_t *c = n->strategies[i];
		char name[NAME_WIDTH + 1], number[3][NUMBER_SIZE];
		plan_strategy_name(mixture, (uint32_t)i, name, sizeof name);
		text_appendf(&t, "%-*s %14s", NAME_WIDTH, name, print_thousands(c[STRATEGY_PROPOSED], number[0]));
		append_ratio(&t, 9, 100, c[STRATEGY_ACCEPTED], c[STRATEGY_PROPOSED]);
		append_ratio(&t, 9, 1, c[STRATEGY_RAYS], c[STRATEGY_PROPOSED]);
		text_appendf(&t, " %14s", print_thousands(c[STRATEGY_WALKS], number[1]));
		append_ratio(&t, 9, 1, c[STRATEGY_ITERATIONS], c[STRATEGY_WALKS]);
		text_appendf(&t, " %14s", print_thousands(c[STRATEGY_REVERSE_WALKS], number[2]));
		append_ratio(&t, 8, 100, sum_failures(c), c[STRATEGY_PROPOSED]);
		append_failures(&t, c);
	}
}

void strategy_print_lines(const char *mixture, const struct canvas_counts *n, char *text, size_t size)
{
	struct text t = {text, size};
	int count = plan_strategy_count(mixture);
	if (size)
		text[0] = 0;
	for (int i = 0; i < count; i++) {
		char name[PLAN_MUTATIONS_MAX];
		plan_strategy_name(mixture, (uint32_t)i, name, sizeof name);
		text_appendf(&t, "%s%s:", i ? "\n" : "", name);
		for (int k = 0; k < STRATEGY_COUNTERS; k++)
			text_appendf(&t, " %s %llu", counter_names[k], (unsigned long long)n->strategies[i][k]);
	}
}

/* Returns the number of chain epochs made. Chains without a state have made no mutations and do not count. */
static uint64_t chain_epochs(const struct plan *p, const struct canvas_counts *n)
{
	return n->counters[COUNT_SAMPLES] / p->epoch;
}

void strategy_print_note(const struct plan *p, const struct canvas_counts *n, bool black, char *text, size_t size)
{
	struct text t = {text, size};
	char number[4][NUMBER_SIZE];
	uint64_t stuck = p->kind == PLAN_CHAINS ? n->counters[COUNT_STUCK] : 0;
	uint64_t bad = n->counters[COUNT_NAN] + n->counters[COUNT_INFINITE] + n->counters[COUNT_NEGATIVE];
	const char *separator = "";
	if (size)
		text[0] = 0;
	if (black && p->kind == PLAN_CHAINS && n->counters[COUNT_SAMPLES] == 0)
		text_appendf(&t, "the image is black: none of the %s bootstrap samples found light",
			     print_thousands(p->bootstrap, number[0]));
	else if (black)
		text_appendf(&t, "the image is black: no sample found light");
	if (black)
		separator = "; ";
	if (bad) {
		text_appendf(&t, "%s%s contributions were NaN, infinite or negative, and were left out", separator,
			     print_thousands(bad, number[0]));
		separator = "; ";
	}
	uint64_t lost = n->counters[COUNT_STATES_LOST];
	if (lost) {
		text_appendf(
			&t,
			"%s%s of %s chain epochs ended in a state that could not be read back; the chain returned to "
			"the start of the epoch",
			separator, print_thousands(lost, number[0]), print_thousands(chain_epochs(p, n), number[1]));
		separator = "; ";
	}
	if (stuck)
		text_appendf(&t, "%s%s of %s chain epochs accepted nothing (%s chains); longest run: %s rejections",
			     separator, print_thousands(stuck, number[0]),
			     print_thousands(chain_epochs(p, n), number[1]), print_thousands(p->chains, number[2]),
			     print_thousands(n->counters[COUNT_LONGEST_STUCK], number[3]));
}

void strategy_append_overlong(double share, char *note, size_t size)
{
	size_t used = strnlen(note, size);
	if (share > 0.001)
		text_print(
			note + used, size - used,
			"%s%.2g %% of the light is missing: it comes by paths of more edges than are simulated (128; pssmlt: 32)",
			used ? "; " : "", 100 * share);
}
