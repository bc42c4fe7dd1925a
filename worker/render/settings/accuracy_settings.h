/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The settings that trade accuracy for time (tolerances, limits, precision), each with a name, a range and a default.
 * Each is a line in setting_list.h. A plan carries those that differ from the default as text,
 * "tolerance=1e-05,iterations=30". A world is built with the settings, and everything that runs in it reads them there.
 * Pure; any thread; nothing allocates.
 */
#ifndef WORKER_RENDER_SETTINGS_ACCURACY_SETTINGS_H
#define WORKER_RENDER_SETTINGS_ACCURACY_SETTINGS_H

#include "common/base/error.h"
#include "common/plan/plan.h"

enum setting_kind { SETTING_REAL, SETTING_INTEGER, SETTING_CHOICE };

/* What a setting affects. */
enum setting_scope {
	SETTING_WORLD,	/* the world as it is built */
	SETTING_PATHS,	/* every path */
	SETTING_CHAINS, /* the proposals of chains of whole paths */
};

enum { SETTING_SWEEP_MAX = 8 };

struct render_setting {
	const char *name, *summary;
	enum setting_kind kind;
	enum setting_scope scope;
	double default_value, min, max;
	/* For SETTING_CHOICE: the choices, separated by spaces. A numeric choice has that number as its value, any
	 * other its index from 0 on. */
	const char *choices;
	/* Values worth comparing, terminated by NULL; empty if the setting does not affect accuracy. */
	const char *sweep[SETTING_SWEEP_MAX + 1];
};

/* Returns NULL at the end of the list. */
const struct render_setting *render_setting_at(size_t index);

enum { SETTING_DOUBLE, SETTING_SINGLE };			      /* precision */
enum { SETTING_BY_PLACE, SETTING_BY_POWER };			      /* emitter_choice */
enum { SETTING_BACKS_AUTO, SETTING_BACKS_LIT, SETTING_BACKS_BLACK };  /* backs */
enum { SETTING_MEDIA_AUTO, SETTING_MEDIA_SHOWN, SETTING_MEDIA_NONE }; /* media */

struct accuracy_settings {
#define SETTING(field, ...) double field;
#include "worker/render/settings/setting_list.h"
#undef SETTING
};
extern const struct accuracy_settings accuracy_settings_default;

/* Reads NAME=VALUE pairs separated by commas; the last pair of a name counts. NULL or "": all defaults. Returns -EINVAL
 * and an error message that gives the range, or the nearest name. */
int accuracy_settings_read(const char *text, struct accuracy_settings *out, struct error *e);

/* Write the canonical text, as in a plan: the settings that differ from the default, in the order of the list, padded
 * with zero bytes. A canonical text is returned unchanged. */
void accuracy_settings_print(const struct accuracy_settings *k, char text[PLAN_ACCURACY_MAX]);
int accuracy_settings_canonicalize(const char *text, char canonical[PLAN_ACCURACY_MAX], struct error *e);

/* Writes the value of the setting with that index as --set takes it. */
void accuracy_settings_print_value(const struct accuracy_settings *k, size_t index, char *text, size_t size);
/* Writes "1e-09 to 1", or "double or single". */
void render_setting_print_range(const struct render_setting *k, char *text, size_t size);

#endif
