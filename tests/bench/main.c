/* SPDX-License-Identifier: Apache-2.0 */
/* make bench: runs all benchmarks, or those named. */
#include "tests/bench/bench.h"

#include "common/base/clock.h"
#include "common/base/mem.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

volatile double bench_sink;

static json_t *rows, *skipped;
static const char *current_group = "";
static unsigned missed_targets;

void series_add(struct series *s, double x)
{
	if (s->count < BENCH_SERIES_MAX)
		s->value[s->count++] = x;
}

static int ascending(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

static struct series sorted_series(const struct series *s)
{
	struct series t = *s;
	qsort(t.value, t.count, sizeof *t.value, ascending);
	return t;
}

double series_median(const struct series *s)
{
	struct series t = sorted_series(s);
	return 0.5 * (t.value[(t.count - 1) / 2] + t.value[t.count / 2]);
}

double bench_cpu_seconds(void)
{
	return clock_thread_seconds();
}

void bench_group(const char *name, const char *description)
{
	current_group = name;
	printf("\n%s: %s\n", name, description);
	fflush(stdout);
}

void bench_row(const char *name, const struct series *s, const char *unit, enum bench_target kind, double target)
{
	static const char *const sign[] = {"", ">=", "<="};
	struct series t = sorted_series(s);
	unsigned trimmed = t.count >= 10 ? 1 : 0;
	double m = series_median(s), low = t.value[trimmed], high = t.value[t.count - 1 - trimmed];
	bool met = kind == BENCH_NO_TARGET || (kind == BENCH_AT_LEAST ? m >= target : m <= target);
	missed_targets += !met;
	printf("  %-44s %10.4g  [%.4g, %.4g] %s", name, m, low, high, unit);
	if (kind != BENCH_NO_TARGET)
		printf("   (target %s %g: %s)", sign[kind], target, met ? "met" : "MISSED");
	printf("\n");
	fflush(stdout);
	json_t *row = json_pack("{s:s, s:s, s:f, s:f, s:f, s:i, s:s}", "group", current_group, "name", name, "median",
				m, "low", low, "high", high, "repeats", (int)t.count, "unit", unit);
	if (kind != BENCH_NO_TARGET) {
		json_object_set_new(row, "target", json_real(target));
		json_object_set_new(row, "bound", json_string(sign[kind]));
		json_object_set_new(row, "met", json_boolean(met));
	}
	json_array_append_new(rows, row);
}

void bench_single(const char *name, double value, const char *unit, enum bench_target kind, double target)
{
	struct series s = {1, {value}};
	bench_row(name, &s, unit, kind, target);
}

void bench_skip(const char *why)
{
	printf("  skipped: %s\n", why);
	json_array_append_new(skipped, json_pack("{s:s, s:s}", "group", current_group, "why", why));
}

void bench_die(const struct error *e)
{
	fprintf(stderr, "bench: %s\n", e->text);
	exit(1);
}

void *bench_alloc(size_t count, size_t size)
{
	struct error e;
	void *p = mem_alloc(count, size);
	if (!p) {
		error_set(&e, ENOMEM, "out of memory");
		bench_die(&e);
	}
	return p;
}

static const struct {
	const char *name;
	void (*run)(const char *bin);
	bool only_when_named;
} benches[] = {
	{"rays", bench_rays, false},	   {"hslt", bench_hslt, false},	      {"equal-time", bench_equal_time, true},
	{"tiles", bench_tiles, false},	   {"parts", bench_parts, false},     {"farm", bench_farm, false},
	{"memory", bench_memory, false},   {"effects", bench_effects, true},  {"loading", bench_loading, false},
	{"sharing", bench_sharing, false}, {"sending", bench_sending, false},
};

static bool is_selected(const char *name, bool only_when_named, char **names, int count)
{
	for (int i = 0; i < count; i++)
		if (strcmp(names[i], name) == 0)
			return true;
	return count == 0 && !only_when_named;
}

int main(int argc, char **argv)
{
	const char *bin = "build/bin", *json = NULL;
	int i = 1;
	for (; i + 1 < argc && strncmp(argv[i], "--", 2) == 0; i += 2) {
		if (strcmp(argv[i], "--bin") == 0)
			bin = argv[i + 1];
		else if (strcmp(argv[i], "--json") == 0)
			json = argv[i + 1];
	}
	rows = json_array();
	skipped = json_array();
	for (size_t k = 0; k < sizeof benches / sizeof *benches; k++)
		if (is_selected(benches[k].name, benches[k].only_when_named, argv + i, argc - i))
			benches[k].run(bin);
	printf("\n%u target%s missed\n", missed_targets, missed_targets == 1 ? "" : "s");
	json_t *all = json_pack("{s:i, s:o, s:o}", "schema", 1, "rows", rows, "skipped", skipped);
	if (json && json_dump_file(all, json, JSON_INDENT(1) | JSON_REAL_PRECISION(6))) {
		fprintf(stderr, "bench: %s cannot be written\n", json);
		return 1;
	}
	json_decref(all);
	return 0;
}
