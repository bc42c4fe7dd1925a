/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Parses a command line by a program's tables.
 *
 * Happy path: defaults and environment variables are stored by the same function as arguments (store_argument). Then
 * argv is scanned once (read_all): each option is looked up among all rows (find), its argument is checked by its kind
 * and stored in the struct that its table fills. Checks that involve several options come last (check).
 *
 * Failures: one sentence in struct error and -EINVAL. For an unknown name, the sentence suggests the nearest known one.
 */
#include "common/base/option.h"

#include "common/base/spelling.h"
#include "common/base/target.h"
#include "common/base/text.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { NAME_MOST = 64 };

static const struct option_row general_rows[] = {
	{"help", '?', NULL, "Print this list", .kind = OPTION_IS_HELP},
	{"usage", 0, NULL, "Print a usage summary", .kind = OPTION_IS_USAGE},
	{"version", 'V', NULL, "Print the version", .kind = OPTION_IS_VERSION},
	{"man", 0, NULL, "Print the manual page (for man -l)", .kind = OPTION_IS_MAN},
	{"completion", 0, NULL, "Print a bash completion script", .kind = OPTION_IS_COMPLETION},
	{0},
};
static const struct option_group general_groups[] = {{NULL, general_rows}, {0}};

/* ---- the rows of a program, one after the other ---- */

/* Returns the *i-th row of these groups and its group. If there are fewer rows, returns NULL and reduces *i by their
 * number: it is then the index into the next table. */
static const struct option_row *row_of(const struct option_group *groups, size_t *i, const struct option_group **group)
{
	for (const struct option_group *g = groups; g && g->rows; g++)
		for (const struct option_row *r = g->rows; r->kind != OPTION_IS_END; r++)
			if ((*i)-- == 0) {
				*group = g;
				return r;
			}
	return NULL;
}

const struct option_row *option_at(const struct program *p, size_t i, const struct option_group **group)
{
	const struct option_group *g = NULL;
	const struct option_row *r = row_of(p->own.groups, &i, &g);
	if (!r && p->shared)
		r = row_of(p->shared->groups, &i, &g);
	if (!r)
		r = row_of(general_groups, &i, &g);
	if (group)
		*group = g;
	return r;
}

/* ---- arguments ---- */

/* Sets the error "--NAME takes WHAT RANGE MORE, not 'ARG'", where RANGE is such as "of at least 0 and below 1" or "from
 * 1 to 1024". A count without an upper bound of its own must still fit into 64 bits. */
static int out_of_range(const struct option_row *r, const char *what, const char *more, const char *arg,
			struct error *e)
{
	char range[80];
	if (r->most >= DBL_MAX)
		text_print(range, sizeof range, "%s %.10g%s", r->above ? "above" : "of at least", r->least,
			   r->kind == OPTION_IS_COUNT ? " and below 2^64" : "");
	else if (r->above || r->below)
		text_print(range, sizeof range, "%s %.10g and %s %.10g", r->above ? "above" : "of at least", r->least,
			   r->below ? "below" : "at most", r->most);
	else
		text_print(range, sizeof range, r->most >= 1e10 ? "from %.0f to %.0f" : "from %.10g to %.10g", r->least,
			   r->most);
	return error_set(e, EINVAL, "--%s takes %s %s%s, not '%s'", r->name, what, range, more, arg);
}

static bool is_within(const struct option_row *r, double x)
{
	return (r->above ? x > r->least : x >= r->least) && (r->below ? x < r->most : x <= r->most);
}

static void store_number(const struct option_row *r, void *field, double x)
{
	switch (r->store) {
	case OPTION_DOUBLE:
		*(double *)field = x;
		break;
	case OPTION_UINT64:
		*(uint64_t *)field = (uint64_t)x;
		break;
	case OPTION_UINT32:
		*(uint32_t *)field = (uint32_t)x;
		break;
	default:
		*(int *)field = (int)x;
	}
}

static int take_name(const struct option_row *r, const char **field, const char *arg, struct error *e)
{
	if (!*arg || (double)strlen(arg) > r->most || !text_is_clean(arg))
		return error_set(e, EINVAL, "--%s takes 1 to %.0f bytes of UTF-8 without control characters", r->name,
				 r->most);
	*field = arg;
	return 0;
}

static int take_number(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	char *end;
	double x = strtod(arg, &end);
	if (end == arg || *end || !is_within(r, x))
		return out_of_range(r, "a number", "", arg, e);
	store_number(r, field, x);
	return 0;
}

static int take_count(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	uint64_t n = 0;
	if (!text_count(arg, &n) || !is_within(r, (double)n))
		return out_of_range(r, "a whole number", "", arg, e);
	if (r->store == OPTION_UINT64)
		*(uint64_t *)field = n;
	else
		*(uint32_t *)field = (uint32_t)n;
	return 0;
}

static int take_size(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	double x = 0;
	const char *unit = r->unit >= 1e9 ? "GB" : "MB";
	if (!text_bytes(arg, r->unit, &x))
		return error_set(e, EINVAL, "--%s takes a size in %s, or one such as 500M, 20G or 2T, not '%s'",
				 r->name, unit, arg);
	if (!is_within(r, x / r->unit))
		return out_of_range(r, r->unit >= 1e9 ? "a number of GB" : "a number of MB", "", arg, e);
	store_number(r, field, x);
	return 0;
}

static int take_time(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	double x = 0;
	const char *unit = r->unit >= 86400 ? "days" : r->unit >= 60 ? "minutes" : "seconds";
	char number[40];
	text_print(number, sizeof number, "a number of %s", unit);
	if (!text_time(arg, r->unit, &x))
		return error_set(e, EINVAL, "--%s takes a time such as 90s, 5m, 2h or 3d, or %s, not '%s'", r->name,
				 number, arg);
	if (!is_within(r, x / r->unit))
		return out_of_range(r, number, "", arg, e);
	store_number(r, field, x);
	return 0;
}

/* A ratio above 1 is refused with a question: 5 may mean 5 percent, and 150% may be a slip of 1.5%. */
static int take_ratio(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	double x = 0;
	if (!text_ratio(arg, &x))
		return error_set(e, EINVAL, "--%s takes something like 0.02 or 2%%, not '%s'", r->name, arg);
	if (x > 1 && x <= 100)
		return error_set(e, EINVAL, "--%s: %.15g %% is above 100 %%; did you mean %.15g%%?", r->name, 100 * x,
				 x);
	if (!is_within(r, x))
		return out_of_range(r, "a number", ", or percent", arg, e);
	*(double *)field = x;
	return 0;
}

/* Returns 0 if arg is among the values. Otherwise the error suggests the nearest value or lists them all. */
static int check_value(const char *noun, option_values *values, const char *arg, struct error *e)
{
	char hint[128], list[512] = "";
	struct spelling s = {.wanted = arg};
	const char *name;
	for (size_t i = 0; (name = values(i)) != NULL; i++) {
		if (strcmp(name, arg) == 0)
			return 0;
		spelling_offer(&s, name);
		spelling_list(list, sizeof list, name);
	}
	spelling_hint(&s, hint, sizeof hint);
	return error_set(e, EINVAL, "there is no %s '%s'%s%s", noun, arg, *hint ? hint : "; there are ",
			 *hint ? "" : list);
}

/* Stores an option's argument (NULL if it takes none) at its place in target. */
static int store_argument(const struct option_row *r, void *target, char *arg, struct error *e)
{
	void *field = (char *)target + r->offset;
	if (r->values && check_value(r->name, r->values, arg, e))
		return -EINVAL;
	if (arg && !*arg && strncmp(r->arg, "FILE", 4) == 0)
		return error_set(e, EINVAL, "--%s takes the name of a file, not ''", r->name);
	if (arg && *r->arg == '+' && *arg != '+')
		return error_set(e, EINVAL, "--%s takes what is to be added, such as +8, not '%s'", r->name, arg);
	if (arg && *r->arg == '+')
		arg++;
	switch (r->kind) {
	case OPTION_IS_FLAG:
		*(bool *)field = true;
		return 0;
	case OPTION_IS_TEXT:
		*(const char **)field = arg;
		return 0;
	case OPTION_IS_OUTPUT:
		*(const char **)field = target_of(arg);
		return 0;
	case OPTION_IS_NAME:
		return take_name(r, field, arg, e);
	case OPTION_IS_NUMBER:
		return take_number(r, field, arg, e);
	case OPTION_IS_COUNT:
		return take_count(r, field, arg, e);
	case OPTION_IS_SIZE:
		return take_size(r, field, arg, e);
	case OPTION_IS_TIME:
		return take_time(r, field, arg, e);
	case OPTION_IS_RATIO:
		return take_ratio(r, field, arg, e);
	default:
		return r->take(target, arg, e);
	}
}

int option_defaults(const struct option_table *t, void *target, struct error *e)
{
	const struct option_group *group;
	const struct option_row *r;
	int rc = 0;
	for (size_t i = 0, k = 0; !rc && (k = i, r = row_of(t->groups, &k, &group)) != NULL; i++)
		if (r->standard && (rc = store_argument(r, target, text_borrow(r->standard), e)) != 0)
			error_prefix(e, rc, "the default of --%s", r->name);
	return rc;
}

/* ---- the command line ---- */

struct reader {
	const struct program *program;
	int argc, at; /* argv[at] is being read */
	char **argv;
	void *target;
	size_t words;		/* words read that are not options */
	enum option_kind asked; /* as for options_parse */
	struct error *e;
};

static int apply_environment(const struct reader *x)
{
	const struct option_row *r;
	for (size_t i = 0; (r = option_at(x->program, i, NULL)) != NULL; i++) {
		char *value = r->environment ? getenv(r->environment) : NULL;
		int rc = value ? store_argument(r, x->target, value, x->e) : 0;
		if (rc)
			return error_prefix(x->e, rc, "$%s", r->environment);
	}
	return 0;
}

static int refuse_unknown(const struct reader *x, const char *dashes, const char *name)
{
	struct spelling s = {.wanted = name};
	const struct option_row *r;
	for (size_t i = 0; (r = option_at(x->program, i, NULL)) != NULL; i++)
		spelling_offer(&s, r->name);
	/* One program's --status-socket is another's --socket. */
	for (size_t i = 0; !s.best && (r = option_at(x->program, i, NULL)) != NULL; i++) {
		size_t n = strlen(name), m = strlen(r->name);
		if (n > m && name[n - m - 1] == '-' && strcmp(name + n - m, r->name) == 0)
			s.best = r->name;
	}
	return error_set(x->e, EINVAL, "unknown option '%s%s'%s%s%s", dashes, name, s.best ? "; did you mean '--" : "",
			 s.best ? s.best : "", s.best ? "'?" : "");
}

/* Returns the row of a name or of an unambiguous prefix; NULL, with the error set, if there is none. */
static const struct option_row *find(const struct reader *x, const char *name)
{
	const struct option_row *r, *found = NULL;
	char list[512] = "", shown[NAME_MOST + 2];
	size_t n = strlen(name), count = 0;
	for (size_t i = 0; (r = option_at(x->program, i, NULL)) != NULL; i++) {
		bool whole = strcmp(r->name, name) == 0;
		if (!whole && (n == 0 || strncmp(r->name, name, n) != 0))
			continue;
		found = r;
		if (whole)
			return r;
		count++;
		snprintf(shown, sizeof shown, "--%s", r->name);
		spelling_list(list, sizeof list, shown);
	}
	if (count > 1)
		error_set(x->e, EINVAL, "option '--%s' is ambiguous: %s", name, list);
	else if (!found)
		refuse_unknown(x, "--", name);
	return count == 1 ? found : NULL;
}

static int apply_option(struct reader *x, const struct option_row *r, char *arg)
{
	if (r->kind >= OPTION_IS_HELP) {
		x->asked = r->kind;
		return 0;
	}
	if (r->arg && !arg) {
		if (x->at + 1 >= x->argc)
			return error_set(x->e, EINVAL, "option '--%s' needs an argument: %s", r->name, r->arg);
		arg = x->argv[++x->at];
	}
	return store_argument(r, x->target, arg, x->e);
}

static int read_long(struct reader *x, char *text)
{
	char name[NAME_MOST];
	char *equals = strchr(text, '=');
	text_copy(name, sizeof name, text);
	if (equals && (size_t)(equals - text) < sizeof name)
		name[equals - text] = 0;
	const struct option_row *r = find(x, name);
	if (!r)
		return -EINVAL;
	if (equals && !r->arg)
		return error_set(x->e, EINVAL, "option '--%s' takes no argument", r->name);
	return apply_option(x, r, equals ? equals + 1 : NULL);
}

static const struct option_row *find_key(const struct reader *x, char key)
{
	const struct option_row *r;
	for (size_t i = 0; (r = option_at(x->program, i, NULL)) != NULL; i++)
		if (r->key == key)
			return r;
	return NULL;
}

static int read_short(struct reader *x, char *text)
{
	int rc = 0;
	for (char *k = text; !rc && x->asked == OPTION_IS_END && *k; k++) {
		const struct option_row *r = find_key(x, *k);
		if (!r)
			return refuse_unknown(x, "-", text);
		rc = apply_option(x, r, r->arg && k[1] ? k + 1 : NULL);
		if (r->arg)
			break;
	}
	return rc;
}

static int read_word(struct reader *x, char *text)
{
	const struct program *p = x->program;
	if (!p->word)
		return error_set(x->e, EINVAL, "'%s': only options are accepted", text);
	if (p->verbs && x->words == 0 && check_value("verb", p->verbs, text, x->e))
		return -EINVAL;
	return p->word(x->target, x->words++, text, x->e);
}

static bool is_option(const struct reader *x, const char *text)
{
	bool negative = text[0] == '-' && text[1] >= '0' && text[1] <= '9';
	return text[0] == '-' && text[1] && !(negative && !find_key(x, text[1]));
}

static int read_all(struct reader *x)
{
	bool options = true;
	int rc = 0;
	for (x->at = 1; !rc && x->asked == OPTION_IS_END && x->at < x->argc; x->at++) {
		char *text = x->argv[x->at];
		if (options && strcmp(text, "--") == 0)
			options = false;
		else if (!options || !is_option(x, text))
			rc = read_word(x, text);
		else
			rc = text[1] == '-' ? read_long(x, text + 2) : read_short(x, text + 1);
	}
	return rc;
}

static int check_needed(const struct reader *x)
{
	const struct option_row *r;
	for (size_t i = 0; (r = option_at(x->program, i, NULL)) != NULL; i++)
		if (r->needed && !*(const char **)((char *)x->target + r->offset))
			return error_set(x->e, EINVAL, "--%s %s is needed%s%s%s", r->name, r->arg,
					 r->environment ? " (or $" : "", r->environment ? r->environment : "",
					 r->environment ? ")" : "");
	return 0;
}

static int check(const struct reader *x)
{
	const struct program *p = x->program;
	char list[512] = "";
	const char *name;
	int rc = 0;
	if (p->verbs && x->words == 0) {
		for (size_t i = 0; (name = p->verbs(i)) != NULL; i++)
			spelling_list(list, sizeof list, name);
		return error_set(x->e, EINVAL, "a verb is missing: %s", list);
	}
	if (p->shared && p->shared->check)
		rc = p->shared->check(x->target, x->e);
	if (!rc && p->own.check)
		rc = p->own.check(x->target, x->e);
	return rc ? rc : check_needed(x);
}

int options_parse(const struct program *p, int argc, char **argv, void *target, enum option_kind *asked,
		  struct error *e)
{
	struct reader x = {.program = p, .argc = argc, .argv = argv, .target = target, .e = e};
	int rc = option_defaults(&p->own, target, e);
	if (!rc && p->shared)
		rc = option_defaults(p->shared, target, e);
	if (!rc)
		rc = apply_environment(&x);
	if (!rc)
		rc = read_all(&x);
	if (!rc && x.asked == OPTION_IS_END)
		rc = check(&x);
	*asked = x.asked;
	return rc;
}
