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
static double instructions(const char *bin, const char *how, unsigned steps)
{
	char line[4096], text[512];
	const char *folder = getenv("TMPDIR");
	snprintf(
		line, sizeof line,
		"valgrind --tool=callgrind --callgrind-out-file=/dev/null %s/hslt-render -o %s/hslt-bench-effects-%d.exr "
		"--quiet --threads 1 --chains %d --groups %d --bootstrap 1024 --epoch %d --mutations %u %s 2>&1",
		bin, folder ? folder : "/tmp", (int)getpid(), CHAINS, CHAINS, SHORT, CHAINS * steps, how);
	FILE *out = popen(line, "r");
	double count = NAN;
	while (out && fgets(text, sizeof text, out)) {
		const char *at = strstr(text, "Collected :");
		if (at)
			count = strtod(at + 11, NULL);
	}
	return out && pclose(out) == 0 ? count : NAN;
}

static double a_mutation(const char *bin, const char *how)
{
	double few = instructions(bin, how, SHORT), many = instructions(bin, how, LONG);
	if (!isfinite(few) || !isfinite(many)) {
		fprintf(stderr, "bench: hslt-render %s fails under valgrind\n", how);
		exit(1);
	}
	return (many - few) / ((LONG - SHORT) * CHAINS);
}

static const struct {
	const char *effect, *on, *off; /* scenes that call for the effect, and that do not */
	bool may_go;		       /* the effect can be forced off */
} rows[] = {
	{"colour", BOX COLOURED, BOX, false},
	{"wavelength", BOX COLOURED, BOX, true},
	{"dispersion", GLASS " -D b=0.01", GLASS, true},
	{"aperture", GLASS " -D aperture=0.05", GLASS, true},
	{"emitter-move", GLASS, NULL, true},
	{"half-vectors", GLASS, BOX, true},
};

static void add(const char *effect, const char *what, double value, const char *unit)
{
	char name[96];
	snprintf(name, sizeof name, "%s, %s", effect, what);
	bench_single(name, value, unit, BENCH_INFORMS, 0);
}

static void measure_effect(const char *bin, size_t i)
{
	char how[512];
	const char *effect = rows[i].effect;
	double with = a_mutation(bin, rows[i].on);
	add(effect, "on: the scene as it is", with, "instructions a mutation");
	if (rows[i].may_go) {
		snprintf(how, sizeof how, "%s --effects=-%s", rows[i].on, effect);
		double without = a_mutation(bin, how);
		add(effect, "on: forced off", without, "instructions a mutation");
		add(effect, "on: costs", 100 * (with / without - 1), "%");
	}
	if (!rows[i].off)
		return;
	double off = a_mutation(bin, rows[i].off);
	snprintf(how, sizeof how, "%s --effects=+%s", rows[i].off, effect);
	double forced = a_mutation(bin, how);
	add(effect, "off: the scene as it is", off, "instructions a mutation");
	add(effect, "off: forced on", forced, "instructions a mutation");
	add(effect, "off: leaving it out saves", 100 * (1 - off / forced), "%");
}

/* The strategies chosen by the analysis, named by hand: leaving out a strategy must cost what a mixture without it
 * costs. */
static void by_hand(const char *bin)
{
	static const char mixture[] = " --mutations bidirectional=0.05,rejoin=0.8";
	char how[512];
	snprintf(how, sizeof how, "%s%s", BOX, mixture);
	double chosen = a_mutation(bin, BOX), hand = a_mutation(bin, how);
	bench_single("strategies left out: against a mixture by hand without them", 100 * fabs(chosen / hand - 1), "%",
		     BENCH_AT_MOST, 1);
}

/* Colour, dispersion and aperture off, against a renderer without the branches for them. */
static void measure_questions(const char *bin)
{
	static const struct {
		const char *name, *how;
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
			     100 * (a_mutation(bin, scenes[i].how) / a_mutation(plain, scenes[i].how) - 1), "%",
			     BENCH_AT_MOST, 1);
}

void bench_effects(const char *bin)
{
	bench_group("effects", "instructions a mutation, by callgrind");
	if (system("valgrind --version >/dev/null 2>&1") != 0) {
		bench_skip("valgrind is not installed");
		return;
	}
	measure_questions(bin);
	by_hand(bin);
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
		measure_effect(bin, i);
}
