/*
 * The settings that trade accuracy for time (tolerances, limits, precision), each with a name, a range and a default: a line in
 * knob_list.h. A plan carries those that differ from the default as text, "tolerance=1e-05,iterations=30"; a world is built by
 * them, and everything that runs in it reads them there. Pure; any thread; nothing allocates.
 */
#ifndef WORKER_RENDER_KNOBS_H
#define WORKER_RENDER_KNOBS_H

#include "common/base/error.h"
#include "common/plan/plan.h"

enum knob_kind { KNOB_REAL, KNOB_WHOLE, KNOB_CHOICE };

/* What another value changes. */
enum knob_place {
	KNOB_WORLD,  /* the world that is built */
	KNOB_PATHS,  /* every path */
	KNOB_CHAINS, /* what chains of whole paths propose */
};

enum { KNOB_SWEEP_MAX = 8 };

struct render_knob {
	const char *name, *summary;
	enum knob_kind kind;
	enum knob_place place;
	double standard, least, greatest; /* standard: the default */
	const char *choices;              /* of KNOB_CHOICE, with spaces between; a choice that is a number is worth that number,
					     another one its place from 0 on */
	const char *sweep[KNOB_SWEEP_MAX + 1]; /* values worth comparing, NULL at the end; none: it is no matter
						  * of accuracy */
};

/* NULL at the end. */
const struct render_knob *render_knob_at(size_t index);

enum { KNOB_DOUBLE, KNOB_SINGLE }; /* precision */

struct knobs {
#define KNOB(field, ...) double field;
#include "worker/render/knob_list.h"
#undef KNOB
};
extern const struct knobs knobs_default;

/* text: NAME=VALUE with commas between, the last of a name counts; NULL or "": all defaults. -EINVAL with a sentence that names
 * the range, or the nearest name. */
int knobs_read(const char *text, struct knobs *out, struct error *e);

/* The spelling that a plan holds: what differs from the default, in the order of the list; zeros behind the text. A canonical
 * text comes back as it is. */
void knobs_print(const struct knobs *k, char text[PLAN_KNOBS_MAX]);
int render_knobs_canonical(const char *text, char canonical[PLAN_KNOBS_MAX], struct error *e);

/* The value of the knob of that index as --set takes it. */
void knobs_value(const struct knobs *k, size_t index, char *text, size_t size);
/* "1e-09 to 1", "double or single". */
void render_knob_range(const struct render_knob *k, char *text, size_t size);

#endif
