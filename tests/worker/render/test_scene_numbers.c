/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Whole scenes with one to three of their numbers made extreme (tests/support/scene_numbers.h): each is refused with
 * file and line, or rendered by every integrator without an invalid operation. Each scene runs in a process of its
 * own, which no signal may end. The seed is the test's name; FULL=1 takes 8 times as many scenes. With arguments the
 * program is the source of tests/fuzz/numbers.sh: test_scene_numbers --write FOLDER FIRST COUNT writes the scenes
 * FIRST ... FIRST + COUNT - 1 as FOLDER/N/scene.xml with their files, and prints the changes on stdout.
 */
#include "tests/support/test_length.h"
#include "tests/support/scene_numbers.h"
#include "tests/support/scene_trial.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <cmocka.h>

#define FOLDER "tests/scenes/numbers/"
static const char *const scenes[] = {"glass.xml", "metal.xml", "surfaces.xml"};
enum { SCENES = sizeof scenes / sizeof *scenes, COUNT = 600 };

static char *read_all(const char *name, size_t *size)
{
	char path[256];
	snprintf(path, sizeof path, FOLDER "%s", name);
	FILE *f = fopen(path, "rb");
	assert_non_null(f);
	char *bytes = calloc(1, 1 << 16);
	*size = fread(bytes, 1, (1 << 16) - 1, f);
	fclose(f);
	return bytes;
}

struct mutant {
	struct memory_file files[4]; /* scene, mesh, environment */
	char description[400];
};

static void make_mutant(struct mutant *m, uint64_t index)
{
	char name[64];
	snprintf(name, sizeof name, "scene numbers %llu", (unsigned long long)index);
	struct dice d = dice_for_test(name);
	const char *scene = scenes[index % SCENES];
	bool in_mesh = dice_below(&d, 12) == 0;
	*m = (struct mutant){.files = {{scene, NULL, 0}, {"wedge.obj", NULL, 0}, {"sky.hdr", NULL, 0}}};
	for (int i = 0; i < 3; i++)
		m->files[i].bytes = read_all(m->files[i].name, &m->files[i].size);
	struct memory_file *changed = &m->files[in_mesh];
	char *text = scene_numbers_mutate(changed->bytes, &d, m->description, sizeof m->description);
	free((void *)(uintptr_t)changed->bytes);
	changed->bytes = text;
	changed->size = strlen(text);
}

static void free_mutant(struct mutant *m)
{
	for (int i = 0; i < 3; i++)
		free((void *)(uintptr_t)m->files[i].bytes);
}

struct counts {
	size_t refused, rendered, failures;
};

static void try_mutant(uint64_t index, struct counts *c)
{
	struct mutant m;
	char text[2048];
	make_mutant(&m, index);
	int end = scene_trial_run(m.files, text, sizeof text);
	c->refused += end == TRIAL_REFUSED;
	c->rendered += end == TRIAL_RENDERED;
	if (end != TRIAL_REFUSED && end != TRIAL_RENDERED) {
		c->failures++;
		print_message("%llu, %s: %s: %s %d: %s\n", (unsigned long long)index, m.files[0].name, m.description,
			      end < 0 ? "signal" : "end", end < 0 ? -end : end, text);
	}
	free_mutant(&m);
}

static void extreme_numbers_are_refused_or_rendered(void **state)
{
	(void)state;
	struct counts c = {0};
	const char *many = getenv("HSLT_TEST_NUMBERS"), *first = getenv("HSLT_TEST_NUMBERS_FIRST");
	size_t count = many ? strtoul(many, NULL, 10) : dice_scaled_count(COUNT),
	       begin = first ? strtoul(first, NULL, 10) : 0;
	for (size_t i = begin; i < begin + count; i++)
		try_mutant(i, &c);
	print_message("%zu scenes: %zu refused with their place, %zu rendered, %zu neither\n", count, c.refused,
		      c.rendered, c.failures);
	assert_int_equal(c.failures, 0);
	assert_true(count < 20 || (c.refused > count / 10 &&
				   c.rendered > count / 10)); /* the numbers are neither all harmless nor all fatal */
}

/* Scenes found by long runs: rays beyond Embree's range from segments that floats cannot tell from points, lights
 * that are points by rounding, texture coordinates of 1e45. */
static void scenes_found_by_long_runs_stay_fixed(void **state)
{
	(void)state;
	static const uint64_t found[] = {1242, 1973, 3566, 4203, 4335, 5255, 5613, 5852, 5880, 20328, 20445, 67413939};
	struct counts c = {0};
	for (size_t i = 0; i < sizeof found / sizeof *found; i += test_is_scaled() ? 4 : 1)
		try_mutant(found[i], &c);
	assert_int_equal(c.failures, 0);
}

static int write_mutants(const char *folder, size_t first, size_t count)
{
	for (size_t i = first; i < first + count; i++) {
		struct mutant m;
		make_mutant(&m, i);
		for (int k = 0; k < 3; k++) {
			char path[512];
			snprintf(path, sizeof path, "%s/%zu", folder, i);
			if (k == 0)
				mkdir(path, 0777);
			snprintf(path, sizeof path, "%s/%zu/%s", folder, i, k ? m.files[k].name : "scene.xml");
			FILE *f = fopen(path, "wb");
			if (!f || fwrite(m.files[k].bytes, 1, m.files[k].size, f) != m.files[k].size || fclose(f)) {
				perror(path);
				return 1;
			}
		}
		printf("%zu %s: %s\n", i, m.files[0].name, m.description);
		free_mutant(&m);
	}
	return 0;
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {cmocka_unit_test(extreme_numbers_are_refused_or_rendered),
					   cmocka_unit_test(scenes_found_by_long_runs_stay_fixed)};
	if (argc == 5 && strcmp(argv[1], "--write") == 0)
		return write_mutants(argv[2], strtoul(argv[3], NULL, 10), strtoul(argv[4], NULL, 10));
	return cmocka_run_group_tests(tests, NULL, NULL);
}
