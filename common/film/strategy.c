#include "common/film/strategy.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { NAME = 24, NUMBER = 32 };

static const char *const names[STRATEGY_COUNTERS] = {
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
	return names[c];
}

struct text {
	char *at;
	size_t left;
};

__attribute__((format(printf, 2, 3))) static void put(struct text *t, const char *format, ...)
{
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(t->at, t->left, format, ap);
	va_end(ap);
	size_t used = n < 0 ? 0 : (size_t)n;
	if (t->left && used >= t->left)
		used = t->left - 1;
	t->at += used;
	t->left -= used;
}

/* 5210 -> "5,210". */
static const char *thousands(uint64_t n, char out[NUMBER])
{
	char digits[NUMBER];
	int length = snprintf(digits, sizeof digits, "%llu", (unsigned long long)n), at = 0;
	for (int i = 0; i < length; i++) {
		if (i > 0 && (length - i) % 3 == 0)
			out[at++] = ',';
		out[at++] = digits[i];
	}
	out[at] = 0;
	return out;
}

/* A cell of the given width: a / b with a suffix, or '-' where there is no b. */
static void put_ratio(struct text *t, int width, int decimals, double factor, uint64_t a, uint64_t b)
{
	if (b)
		put(t, " %*.*f", width, decimals, factor * (double)a / (double)b);
	else
		put(t, " %*s", width, "-");
}

static uint64_t failures(const uint64_t c[STRATEGY_COUNTERS])
{
	uint64_t n = 0;
	for (int k = STRATEGY_FAIL_FIRST; k < STRATEGY_COUNTERS; k++)
		n += c[k];
	return n;
}

/* Reasons that nobody met are left out, or the lines would be too long to read. */
static void put_failures(struct text *t, const uint64_t c[STRATEGY_COUNTERS])
{
	put(t, " ");
	if (failures(c) == 0)
		put(t, " -");
	for (int k = STRATEGY_FAIL_FIRST; k < STRATEGY_COUNTERS; k++)
		if (c[k])
			put(t, " %s %.3g", names[k], 100 * (double)c[k] / (double)c[STRATEGY_PROPOSED]);
	put(t, "\n");
}

void strategy_table(const char *mixture, const struct canvas_counts *n, char *text, size_t size)
{
	struct text t = {text, size};
	int count = plan_strategy_count(mixture);
	uint64_t proposed = 0;
	if (size)
		text[0] = 0;
	for (int i = 0; i < count; i++)
		proposed += n->strategy[i][STRATEGY_PROPOSED];
	if (!proposed)
		return;
	put(&t, "%-*s %14s %9s %9s %14s %9s %14s %8s  %s\n", NAME, "strategy", "proposals", "accepted%", "rays/prop", "walks",
	    "iter/walk", "reverse walks", "failed%", "failures in % of proposals");
	for (int i = 0; i < count; i++) {
		const uint64_t *c = n->strategy[i];
		char name[NAME + 1], number[3][NUMBER];
		plan_strategy_name(mixture, (uint32_t)i, name, sizeof name);
		put(&t, "%-*s %14s", NAME, name, thousands(c[STRATEGY_PROPOSED], number[0]));
		put_ratio(&t, 9, 2, 100, c[STRATEGY_ACCEPTED], c[STRATEGY_PROPOSED]);
		put_ratio(&t, 9, 2, 1, c[STRATEGY_RAYS], c[STRATEGY_PROPOSED]);
		put(&t, " %14s", thousands(c[STRATEGY_WALKS], number[1]));
		put_ratio(&t, 9, 2, 1, c[STRATEGY_ITERATIONS], c[STRATEGY_WALKS]);
		put(&t, " %14s", thousands(c[STRATEGY_REVERSE_WALKS], number[2]));
		put_ratio(&t, 8, 2, 100, failures(c), c[STRATEGY_PROPOSED]);
		put_failures(&t, c);
	}
}

void strategy_stuck(const struct plan *p, uint64_t rounds, const struct canvas_counts *n, char *text, size_t size)
{
	char number[5][NUMBER];
	uint64_t stuck = n->counters[COUNT_STUCK];
	if (size)
		text[0] = 0;
	if (!stuck)
		return;
	snprintf(text, size, "%s of %s epochs of chains (%s chains, %s %s) passed without an accepted mutation; longest run: %s rejections",
		 thousands(stuck, number[0]), thousands(p->chains * rounds, number[1]), thousands(p->chains, number[2]),
		 thousands(rounds, number[3]), rounds == 1 ? "round" : "rounds",
		 thousands(n->counters[COUNT_LONGEST_STUCK], number[4]));
}
