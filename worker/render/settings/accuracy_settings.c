/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The list of settings (setting_list.h) is read into one table. Texts are parsed against it entry by entry and printed
 * in its order, which makes them canonical.
 *
 * Failures: an unknown name (the message suggests the nearest one), or a value outside its range or choices.
 */
#include "worker/render/settings/accuracy_settings.h"

#include "common/base/spelling.h"
#include "common/base/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const struct render_setting setting_table[] = {
#define SETTING(field, name_, kind_, place_, standard_, least_, greatest_, choices_, summary_, ...) \
	{.name = name_,                                                                             \
	 .summary = summary_,                                                                       \
	 .kind = kind_,                                                                             \
	 .scope = place_,                                                                           \
	 .default_value = standard_,                                                                \
	 .min = least_,                                                                             \
	 .max = greatest_,                                                                          \
	 .choices = choices_,                                                                       \
	 .sweep = {__VA_ARGS__}},
#include "worker/render/settings/setting_list.h"
#undef SETTING
};

enum { SETTING_COUNT = sizeof setting_table / sizeof *setting_table, VALUE_BYTES = 24 };

static const size_t setting_offset[SETTING_COUNT] = {
#define SETTING(field, ...) offsetof(struct accuracy_settings, field),
#include "worker/render/settings/setting_list.h"
#undef SETTING
};

const struct accuracy_settings accuracy_settings_default = {
#define SETTING(field, name, kind, place, standard, ...) .field = standard,
#include "worker/render/settings/setting_list.h"
#undef SETTING
};

const struct render_setting *render_setting_at(size_t index)
{
	return index < SETTING_COUNT ? &setting_table[index] : NULL;
}

static double get_value(const struct accuracy_settings *k, size_t index)
{
	double value;
	memcpy(&value, (const char *)k + setting_offset[index], sizeof value);
	return value;
}

static void set_value(struct accuracy_settings *k, size_t index, double value)
{
	memcpy((char *)k + setting_offset[index], &value, sizeof value);
}

/* Copies the choice at index `index`, or, if it is -1, the choice worth `value`. Returns false if there is none. */
static bool copy_choice(const char *choices, int index, double value, char *text, size_t size)
{
	const char *choice = choices;
	for (int i = 0; *choice; i++) {
		size_t n = strcspn(choice, " ");
		double choice_value = *choice >= '0' && *choice <= '9' ? strtod(choice, NULL) : i;
		if (index == i || (index < 0 && choice_value == value)) {
			text_copy(text, n + 1 < size ? n + 1 : size, choice);
			return true;
		}
		choice += n;
		choice += *choice == ' ';
	}
	return false;
}

void accuracy_settings_print_value(const struct accuracy_settings *k, size_t index, char *text, size_t size)
{
	struct text t = {text, size};
	double value = get_value(k, index);
	if (setting_table[index].kind != SETTING_CHOICE ||
	    !copy_choice(setting_table[index].choices, -1, value, text, size))
		text_appendf(&t, "%.6g", value);
}

void render_setting_print_range(const struct render_setting *k, char *text, size_t size)
{
	struct text t = {text, size};
	char choice[VALUE_BYTES], next[VALUE_BYTES];
	if (k->kind != SETTING_CHOICE) {
		text_appendf(&t, "%g to %g", k->min, k->max);
		return;
	}
	for (int i = 0; copy_choice(k->choices, i, 0, choice, sizeof choice); i++)
		text_appendf(&t, "%s%s",
			     i == 0						    ? ""
			     : copy_choice(k->choices, i + 1, 0, next, sizeof next) ? ", "
										    : " or ",
			     choice);
}

static int unknown_name_error(const char *name, struct error *e)
{
	struct spelling s = {.wanted_name = name};
	char hint[80], names[256] = "";
	for (size_t i = 0; i < SETTING_COUNT; i++) {
		spelling_offer(&s, setting_table[i].name);
		spelling_append_to_list(names, sizeof names, setting_table[i].name);
	}
	return error_set(e, EINVAL, "no setting is called '%s'%s; there are %s", name,
			 spelling_hint(&s, hint, sizeof hint), names);
}

/* Returns a hint about a setting that is written without a value; "" if only the value is missing. */
static const char *name_hint(const char *name, char *text, size_t size)
{
	struct spelling s = {.wanted_name = name};
	for (size_t i = 0; i < SETTING_COUNT; i++)
		spelling_offer(&s, setting_table[i].name);
	if (s.best_match && s.best_distance == 0)
		s.best_match = NULL;
	return spelling_hint(&s, text, size);
}

static int find_setting(const char *name, size_t *index, struct error *e)
{
	for (*index = 0; *index < SETTING_COUNT; ++*index)
		if (strcmp(setting_table[*index].name, name) == 0)
			return 0;
	return unknown_name_error(name, e);
}

/* Returns "; did you mean `double`?" for an unknown choice; otherwise "". */
static const char *value_hint(const struct render_setting *k, const char *wanted, char *text, size_t size)
{
	char choice[VALUE_BYTES];
	struct spelling s = {.wanted_name = wanted};
	for (int i = 0; k->kind == SETTING_CHOICE && copy_choice(k->choices, i, 0, choice, sizeof choice); i++)
		spelling_offer(&s, choice);
	return spelling_hint(&s, text, size);
}

/* Parses a value. Numbers are rounded to the digits of a plan's text, so that a text and its
 * canonical form mean the same. */
static bool parse_value(const struct render_setting *k, const char *text, double *value)
{
	char *end, choice[VALUE_BYTES], digits[VALUE_BYTES];
	if (k->kind == SETTING_CHOICE) {
		for (int i = 0; copy_choice(k->choices, i, 0, choice, sizeof choice); i++)
			if (strcmp(choice, text) == 0) {
				*value = choice[0] >= '0' && choice[0] <= '9' ? strtod(choice, NULL) : i;
				return true;
			}
		return false;
	}
	double x = strtod(text, &end);
	if (!((*text >= '0' && *text <= '9') || *text == '.') || *end || !(x >= k->min && x <= k->max))
		return false;
	if (k->kind == SETTING_INTEGER && x != floor(x))
		return false;
	struct text t = {digits, sizeof digits};
	text_appendf(&t, "%.6g", x);
	*value = strtod(digits, NULL);
	return true;
}

static int read_entry(const char *text, size_t length, struct accuracy_settings *out, struct error *e)
{
	char entry[80], range[80], hint[80];
	if (length >= sizeof entry)
		return error_set(e, EINVAL, "'%.60s...': a setting is written NAME=VALUE", text);
	text_copy(entry, length + 1, text);
	char *equals = strchr(entry, '=');
	if (!equals || equals == entry)
		return error_set(e, EINVAL, "'%s': a setting is written NAME=VALUE%s", entry,
				 name_hint(entry, hint, sizeof hint));
	*equals = 0;
	size_t index;
	double value;
	int rc = find_setting(entry, &index, e);
	if (rc)
		return rc;
	if (!parse_value(&setting_table[index], equals + 1, &value)) {
		render_setting_print_range(&setting_table[index], range, sizeof range);
		return error_set(e, EINVAL, "%s is%s %s, not '%s'%s", entry,
				 setting_table[index].kind == SETTING_INTEGER ? " a whole number from" : "", range,
				 equals + 1, value_hint(&setting_table[index], equals + 1, hint, sizeof hint));
	}
	set_value(out, index, value);
	return 0;
}

int accuracy_settings_read(const char *text, struct accuracy_settings *out, struct error *e)
{
	*out = accuracy_settings_default;
	if (!text || !*text)
		return 0;
	for (const char *entry = text;; entry++) {
		size_t n = strcspn(entry, ",");
		int rc = read_entry(entry, n, out, e);
		if (rc)
			return rc;
		entry += n;
		if (!*entry)
			return 0;
	}
}

void accuracy_settings_print(const struct accuracy_settings *k, char text[PLAN_ACCURACY_MAX])
{
	struct text t = {text, PLAN_ACCURACY_MAX};
	memset(text, 0, PLAN_ACCURACY_MAX);
	for (size_t i = 0; i < SETTING_COUNT; i++) {
		char value[VALUE_BYTES];
		if (get_value(k, i) == setting_table[i].default_value)
			continue;
		accuracy_settings_print_value(k, i, value, sizeof value);
		text_appendf(&t, "%s%s=%s", *text ? "," : "", setting_table[i].name, value);
	}
}

int accuracy_settings_canonicalize(const char *text, char canonical[PLAN_ACCURACY_MAX], struct error *e)
{
	struct accuracy_settings k;
	int rc = accuracy_settings_read(text, &k, e);
	if (!rc)
		accuracy_settings_print(&k, canonical);
	return rc;
}
