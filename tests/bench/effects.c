/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Instructions per mutation (callgrind), from whole renders of two lengths, so that building and the bootstrap cancel
 * out: for each effect in a scene that calls for it, as it is and with the effect forced off; in a scene that does not,
 * as it is and forced on; and with colour, dispersion and aperture off, against a renderer compiled without them (make
 * plain). The counts are of one thread and one plan, and do not vary from run to run.
 */
#include "tests/bench/bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define BOX "tests/bench/scenes/effects-box.xml"
#define GLASS "tests/bench/scenes/effects-glass.xml"
#define COLOURED " -D wall=0.5,0.4,0.3"
enum { CHAINS = 16, SHORT = 256, LONG = 1280 };

/* Returns the number of instructions of one render; NAN if the program failed. */
static double count_instructions(const char *bin, const char *options, unsigned steps)
{
	char command[4096], text[512];
	const char *folder = getenv("TMPDIR");
	snprintf(
		command, sizeof command,
		"valgrind --tool=callgrind --callgrind-out-file=/dev/null %s/hslt-render -o %s/hslt-bench-effects-%d.exr "
		"--quiet --threads 1 --chains %d --groups %d --bootstrap 1024 --epoch %d --mutations %u %s 2>&1",
		bin, folder ? folder : "/tmp", (int)getpid(), CHAINS, CHAINS, SHORT, CHAINS * steps, options);
	FILE *out = popen(command, "r");
	double count = NAN;
	while (out && fgets(text, sizeof text, out)) {
		const char *match = strstr(text, "Collected :");
		if (match)
			count = strtod(match + 11, NULL);
	}
	return out && pclose(out) == 0 ? count : NAN;
}

static double instructions_per_mutation(const char *bin, const char *options)
{
	double few = count_instructions(bin, options, SHORT), many = count_instructions(bin, options, LONG);
	if (!isfinite(few) || !isfinite(many)) {
		fprintf(stderr, "bench: hslt-render %s fails under valgrind\n", options);
		exit(1);
	}
	return (many - few) / ((LONG - SHORT) * CHAINS);
}

static const struct {
	const char *effect, *with_effect, *without_effect; /* scenes that call for the effect, and that do not */
	bool can_be_forced_off;
} rows[] = {
	{"colour", BOX COLOURED, BOX, false},
	{"wavelength", BOX COLOURED, BOX, true},
	{"dispersion", GLASS " -D b=0.01", GLASS, true},
	{"aperture", GLASS " -D aperture=0.05", GLASS, true},
	{"emitter-move", GLASS, NULL, true},
	{"half-vectors", GLASS, BOX, true},
};

static void add_figure(const char *effect, const char *label, double value, const char *unit)
{
	char name[96];
	snprintf(name, sizeof name, "%s, %s", effect, label);
	bench_single(name, value, unit, BENCH_NO_TARGET, 0);
}

static void measure_effect(const char *bin, size_t i)
{
	char options[512];
	const char *effect = rows[i].effect;
	double with = instructions_per_mutation(bin, rows[i].with_effect);
	add_figure(effect, "on: the scene as it is", with, "instructions a mutation");
	if (rows[i].can_be_forced_off) {
		snprintf(options, sizeof options, "%s --effects=-%s", rows[i].with_effect, effect);
		double without = instructions_per_mutation(bin, options);
		add_figure(effect, "on: forced off", without, "instructions a mutation");
		add_figure(effect, "on: costs", 100 * (with / without - 1), "%");
	}
	if (!rows[i].without_effect)
		return;
	double off = instructions_per_mutation(bin, rows[i].without_effect);
	snprintf(options, sizeof options, "%s --effects=+%s", rows[i].without_effect, effect);
	double forced = instructions_per_mutation(bin, options);
	add_figure(effect, "off: the scene as it is", off, "instructions a mutation");
	add_figure(effect, "off: forced on", forced, "instructions a mutation");
	add_figure(effect, "off: leaving it out saves", 100 * (1 - off / forced), "%");
}

/* The strategies chosen by the analysis, named by hand: leaving out a strategy must cost what a mixture without it
 * costs. */
static void measure_hand_made_mixture(const char *bin)
{
	static const char mixture[] = " --mutations bidirectional=0.05,rejoin=0.8";
	char options[512];
	snprintf(options, sizeof options, "%s%s", BOX, mixture);
	double chosen = instructions_per_mutation(bin, BOX), hand = instructions_per_mutation(bin, options);
	bench_single("strategies left out: against a mixture by hand without them", 100 * fabs(chosen / hand - 1), "%",
		     BENCH_AT_MOST, 1);
}

/* Colour, dispersion and aperture off, against a renderer without the branches for them. */
static void measure_against_plain(const char *bin)
{
	static const struct {
		const char *name, *options;
	} scenes[] = {
		{"colour, dispersion, aperture off: grey box, hslt", BOX},
		{"colour, dispersion, aperture off: grey box, half vectors", BOX " --effects=+half-vectors"},
		{"colour, dispersion, aperture off: grey box, pssmlt", BOX " --integrator pssmlt"},
	};
	char plain[4096];
	snprintf(plain, sizeof plain, "%s/../plain/bin", bin);
	char program[4200];
	snprintf(program, sizeof program, "%s/hslt-render", plain);
	if (access(program, X_OK) != 0) {
		bench_skip("no renderer without effects: make plain");
		return;
	}
	for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++)
		bench_single(scenes[i].name,
			     100 * (instructions_per_mutation(bin, scenes[i].options) /
					    instructions_per_mutation(plain, scenes[i].options) -
				    1),
			     "%", BENCH_AT_MOST, 1);
}

void bench_effects(const char *bin)
{
	bench_group("effects", "instructions a mutation, by callgrind");
	if (system("valgrind --version >/dev/null 2>&1") != 0) {
		bench_skip("valgrind is not installed");
		return;
	}
	measure_against_plain(bin);
	measure_hand_made_mixture(bin);
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
		measure_effect(bin, i);
}
