/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Parses a command line by a program's tables.
 *
 * Happy path: defaults and environment variables are stored by the same function as arguments (store_argument). Then
 * argv is scanned once (parse_arguments): each option is looked up among all rows (find_option), its argument is
 * checked by its kind and stored in the struct that its table fills. Checks that involve several options come last
 * (run_checks).
 *
 * Failures: one sentence in struct error and -EINVAL. For an unknown name, the sentence suggests the nearest known one.
 */
#include "common/base/option.h"

#include "common/base/spelling.h"
#include "common/base/output_target.h"
#include "common/base/text.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OPTION_NAME_MAX = 64 };

static const struct option_row general_rows[] = {
	{"help", '?', NULL, "Print this list", .kind = OPTION_KIND_HELP},
	{"usage", 0, NULL, "Print a usage summary", .kind = OPTION_KIND_USAGE},
	{"version", 'V', NULL, "Print the version", .kind = OPTION_KIND_VERSION},
	{"man", 0, NULL, "Print the manual page (for man -l)", .kind = OPTION_KIND_MAN},
	{"completion", 0, NULL, "Print a bash completion script", .kind = OPTION_KIND_COMPLETION},
	{0},
};
static const struct option_group general_groups[] = {{NULL, general_rows}, {0}};

/* ---- the rows of a program, one after the other ---- */

/* Returns the *i-th row of these groups and its group. If there are fewer rows, returns NULL and reduces *i by their
 * number: it is then the index into the next table. */
static const struct option_row *nth_row(const struct option_group *groups, size_t *i, const struct option_group **group)
{
	for (const struct option_group *g = groups; g && g->rows; g++)
		for (const struct option_row *r = g->rows; r->kind != OPTION_KIND_END; r++)
			if ((*i)-- == 0) {
				*group = g;
				return r;
			}
	return NULL;
}

const struct option_row *option_row_at(const struct program *p, size_t i, const struct option_group **group)
{
	const struct option_group *g = NULL;
	const struct option_row *r = nth_row(p->options.groups, &i, &g);
	if (!r && p->shared_options)
		r = nth_row(p->shared_options->groups, &i, &g);
	if (!r)
		r = nth_row(general_groups, &i, &g);
	if (group)
		*group = g;
	return r;
}

/* ---- arguments ---- */

/* Sets the error "--NAME takes KIND RANGE SUFFIX, not 'ARG'", where RANGE is such as "of at least 0 and below 1" or
 * "from 1 to 1024". A count without an upper bound of its own must still fit into 64 bits. */
static int refuse_out_of_range(const struct option_row *r, const char *kind, const char *suffix, const char *arg,
			       struct error *e)
{
	char range[80];
	if (r->max >= DBL_MAX)
		text_print(range, sizeof range, "%s %.10g%s", r->excludes_min ? "above" : "of at least", r->min,
			   r->kind == OPTION_KIND_COUNT ? " and below 2^64" : "");
	else if (r->excludes_min || r->excludes_max)
		text_print(range, sizeof range, "%s %.10g and %s %.10g", r->excludes_min ? "above" : "of at least",
			   r->min, r->excludes_max ? "below" : "at most", r->max);
	else
		text_print(range, sizeof range, r->max >= 1e10 ? "from %.0f to %.0f" : "from %.10g to %.10g", r->min,
			   r->max);
	return error_set(e, EINVAL, "--%s takes %s %s%s, not '%s'", r->name, kind, range, suffix, arg);
}

static bool is_within(const struct option_row *r, double x)
{
	return (r->excludes_min ? x > r->min : x >= r->min) && (r->excludes_max ? x < r->max : x <= r->max);
}

static void store_number(const struct option_row *r, void *field, double x)
{
	switch (r->field_type) {
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

static int parse_name(const struct option_row *r, const char **field, const char *arg, struct error *e)
{
	if (!*arg || (double)strlen(arg) > r->max || !text_is_clean(arg))
		return error_set(e, EINVAL, "--%s takes 1 to %.0f bytes of UTF-8 without control characters", r->name,
				 r->max);
	*field = arg;
	return 0;
}

static int parse_number(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	char *end;
	double x = strtod(arg, &end);
	if (end == arg || *end || !is_within(r, x))
		return refuse_out_of_range(r, "a number", "", arg, e);
	store_number(r, field, x);
	return 0;
}

static int parse_count(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	uint64_t n = 0;
	if (!text_parse_count(arg, &n) || !is_within(r, (double)n))
		return refuse_out_of_range(r, "a whole number", "", arg, e);
	if (r->field_type == OPTION_UINT64)
		*(uint64_t *)field = n;
	else
		*(uint32_t *)field = (uint32_t)n;
	return 0;
}

static int parse_size(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	double x = 0;
	const char *unit = r->unit >= 1e9 ? "GB" : "MB";
	if (!text_parse_bytes(arg, r->unit, &x))
		return error_set(e, EINVAL, "--%s takes a size in %s, or one such as 500M, 20G or 2T, not '%s'",
				 r->name, unit, arg);
	if (!is_within(r, x / r->unit))
		return refuse_out_of_range(r, r->unit >= 1e9 ? "a number of GB" : "a number of MB", "", arg, e);
	store_number(r, field, x);
	return 0;
}

static int parse_time(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	double x = 0;
	const char *unit = r->unit >= 86400 ? "days" : r->unit >= 60 ? "minutes" : "seconds";
	char number[40];
	text_print(number, sizeof number, "a number of %s", unit);
	if (!text_parse_time(arg, r->unit, &x))
		return error_set(e, EINVAL, "--%s takes a time such as 90s, 5m, 2h or 3d, or %s, not '%s'", r->name,
				 number, arg);
	if (!is_within(r, x / r->unit))
		return refuse_out_of_range(r, number, "", arg, e);
	store_number(r, field, x);
	return 0;
}

/* A ratio above 1 is refused with a question: 5 may mean 5 percent, and 150% may be a slip of 1.5%. */
static int parse_ratio(const struct option_row *r, void *field, const char *arg, struct error *e)
{
	double x = 0;
	if (!text_parse_ratio(arg, &x))
		return error_set(e, EINVAL, "--%s takes something like 0.02 or 2%%, not '%s'", r->name, arg);
	if (x > 1 && x <= 100)
		return error_set(e, EINVAL, "--%s: %.15g %% is above 100 %%; did you mean %.15g%%?", r->name, 100 * x,
				 x);
	if (!is_within(r, x))
		return refuse_out_of_range(r, "a number", ", or percent", arg, e);
	*(double *)field = x;
	return 0;
}

/* Returns 0 if arg is among the values. Otherwise the error suggests the nearest value or lists them all. */
static int check_value(const char *noun, option_values *values, const char *arg, struct error *e)
{
	char hint[128], list[512] = "";
	struct spelling s = {.wanted_name = arg};
	const char *name;
	for (size_t i = 0; (name = values(i)) != NULL; i++) {
		if (strcmp(name, arg) == 0)
			return 0;
		spelling_offer(&s, name);
		spelling_append_to_list(list, sizeof list, name);
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
	case OPTION_KIND_FLAG:
		*(bool *)field = true;
		return 0;
	case OPTION_KIND_TEXT:
		*(const char **)field = arg;
		return 0;
	case OPTION_KIND_OUTPUT:
		*(const char **)field = output_target_from_arg(arg);
		return 0;
	case OPTION_KIND_NAME:
		return parse_name(r, field, arg, e);
	case OPTION_KIND_NUMBER:
		return parse_number(r, field, arg, e);
	case OPTION_KIND_COUNT:
		return parse_count(r, field, arg, e);
	case OPTION_KIND_SIZE:
		return parse_size(r, field, arg, e);
	case OPTION_KIND_TIME:
		return parse_time(r, field, arg, e);
	case OPTION_KIND_RATIO:
		return parse_ratio(r, field, arg, e);
	default:
		return r->parse(target, arg, e);
	}
}

int option_set_defaults(const struct option_table *t, void *target, struct error *e)
{
	const struct option_group *group;
	const struct option_row *r;
	int rc = 0;
	for (size_t i = 0, k = 0; !rc && (k = i, r = nth_row(t->groups, &k, &group)) != NULL; i++)
		if (r->default_value && (rc = store_argument(r, target, text_unconst(r->default_value), e)) != 0)
			error_prefix(e, rc, "the default of --%s", r->name);
	return rc;
}

/* ---- the command line ---- */

struct option_parser {
	const struct program *program;
	int argc, index; /* argv[index] is being read */
	char **argv;
	void *target;
	size_t word_count;		  /* words read that are not options */
	enum option_kind requested_print; /* as for options_parse */
	struct error *e;
};

static int apply_environment(const struct option_parser *x)
{
	const struct option_row *r;
	for (size_t i = 0; (r = option_row_at(x->program, i, NULL)) != NULL; i++) {
		char *value = r->environment ? getenv(r->environment) : NULL;
		int rc = value ? store_argument(r, x->target, value, x->e) : 0;
		if (rc)
			return error_prefix(x->e, rc, "$%s", r->environment);
	}
	return 0;
}

static int refuse_unknown(const struct option_parser *x, const char *dashes, const char *name)
{
	struct spelling s = {.wanted_name = name};
	const struct option_row *r;
	for (size_t i = 0; (r = option_row_at(x->program, i, NULL)) != NULL; i++)
		spelling_offer(&s, r->name);
	/* One program's --status-socket is another's --socket. */
	for (size_t i = 0; !s.best_match && (r = option_row_at(x->program, i, NULL)) != NULL; i++) {
		size_t n = strlen(name), m = strlen(r->name);
		if (n > m && name[n - m - 1] == '-' && strcmp(name + n - m, r->name) == 0)
			s.best_match = r->name;
	}
	return error_set(x->e, EINVAL, "unknown option '%s%s'%s%s%s", dashes, name,
			 s.best_match ? "; did you mean '--" : "", s.best_match ? s.best_match : "",
			 s.best_match ? "'?" : "");
}

/* Returns the row of a name or of an unambiguous prefix; NULL, with the error set, if there is none. */
static const struct option_row *find_option(const struct option_parser *x, const char *name)
{
	const struct option_row *r, *found = NULL;
	char list[512] = "", shown[OPTION_NAME_MAX + 2];
	size_t n = strlen(name), count = 0;
	for (size_t i = 0; (r = option_row_at(x->program, i, NULL)) != NULL; i++) {
		bool exact = strcmp(r->name, name) == 0;
		if (!exact && (n == 0 || strncmp(r->name, name, n) != 0))
			continue;
		found = r;
		if (exact)
			return r;
		count++;
		snprintf(shown, sizeof shown, "--%s", r->name);
		spelling_append_to_list(list, sizeof list, shown);
	}
	if (count > 1)
		error_set(x->e, EINVAL, "option '--%s' is ambiguous: %s", name, list);
	else if (!found)
		refuse_unknown(x, "--", name);
	return count == 1 ? found : NULL;
}

static int apply_option(struct option_parser *x, const struct option_row *r, char *arg)
{
	if (r->kind >= OPTION_KIND_HELP) {
		x->requested_print = r->kind;
		return 0;
	}
	if (r->arg && !arg) {
		if (x->index + 1 >= x->argc)
			return error_set(x->e, EINVAL, "option '--%s' needs an argument: %s", r->name, r->arg);
		arg = x->argv[++x->index];
	}
	return store_argument(r, x->target, arg, x->e);
}

static int parse_long_option(struct option_parser *x, char *text)
{
	char name[OPTION_NAME_MAX];
	char *equals = strchr(text, '=');
	text_copy(name, sizeof name, text);
	if (equals && (size_t)(equals - text) < sizeof name)
		name[equals - text] = 0;
	const struct option_row *r = find_option(x, name);
	if (!r)
		return -EINVAL;
	if (equals && !r->arg)
		return error_set(x->e, EINVAL, "option '--%s' takes no argument", r->name);
	return apply_option(x, r, equals ? equals + 1 : NULL);
}

static const struct option_row *find_option_by_key(const struct option_parser *x, char key)
{
	const struct option_row *r;
	for (size_t i = 0; (r = option_row_at(x->program, i, NULL)) != NULL; i++)
		if (r->key == key)
			return r;
	return NULL;
}

static int parse_short_options(struct option_parser *x, char *text)
{
	int rc = 0;
	for (char *k = text; !rc && x->requested_print == OPTION_KIND_END && *k; k++) {
		const struct option_row *r = find_option_by_key(x, *k);
		if (!r)
			return refuse_unknown(x, "-", text);
		rc = apply_option(x, r, r->arg && k[1] ? k + 1 : NULL);
		if (r->arg)
			break;
	}
	return rc;
}

static int parse_word(struct option_parser *x, char *text)
{
	const struct program *p = x->program;
	if (!p->parse_word)
		return error_set(x->e, EINVAL, "'%s': only options are accepted", text);
	if (p->verbs && x->word_count == 0 && check_value("verb", p->verbs, text, x->e))
		return -EINVAL;
	return p->parse_word(x->target, x->word_count++, text, x->e);
}

static bool is_option(const struct option_parser *x, const char *text)
{
	bool negative = text[0] == '-' && text[1] >= '0' && text[1] <= '9';
	return text[0] == '-' && text[1] && !(negative && !find_option_by_key(x, text[1]));
}

static int parse_arguments(struct option_parser *x)
{
	bool options = true;
	int rc = 0;
	for (x->index = 1; !rc && x->requested_print == OPTION_KIND_END && x->index < x->argc; x->index++) {
		char *text = x->argv[x->index];
		if (options && strcmp(text, "--") == 0)
			options = false;
		else if (!options || !is_option(x, text))
			rc = parse_word(x, text);
		else
			rc = text[1] == '-' ? parse_long_option(x, text + 2) : parse_short_options(x, text + 1);
	}
	return rc;
}

static int check_required(const struct option_parser *x)
{
	const struct option_row *r;
	for (size_t i = 0; (r = option_row_at(x->program, i, NULL)) != NULL; i++)
		if (r->is_required && !*(const char **)((char *)x->target + r->offset))
			return error_set(x->e, EINVAL, "--%s %s is needed%s%s%s", r->name, r->arg,
					 r->environment ? " (or $" : "", r->environment ? r->environment : "",
					 r->environment ? ")" : "");
	return 0;
}

static int run_checks(const struct option_parser *x)
{
	const struct program *p = x->program;
	char list[512] = "";
	const char *name;
	int rc = 0;
	if (p->verbs && x->word_count == 0) {
		for (size_t i = 0; (name = p->verbs(i)) != NULL; i++)
			spelling_append_to_list(list, sizeof list, name);
		return error_set(x->e, EINVAL, "a verb is missing: %s", list);
	}
	if (p->shared_options && p->shared_options->check)
		rc = p->shared_options->check(x->target, x->e);
	if (!rc && p->options.check)
		rc = p->options.check(x->target, x->e);
	return rc ? rc : check_required(x);
}

int options_parse(const struct program *p, int argc, char **argv, void *target, enum option_kind *requested,
		  struct error *e)
{
	struct option_parser x = {.program = p, .argc = argc, .argv = argv, .target = target, .e = e};
	int rc = option_set_defaults(&p->options, target, e);
	if (!rc && p->shared_options)
		rc = option_set_defaults(p->shared_options, target, e);
	if (!rc)
		rc = apply_environment(&x);
	if (!rc)
		rc = parse_arguments(&x);
	if (!rc && x.requested_print == OPTION_KIND_END)
		rc = run_checks(&x);
	*requested = x.requested_print;
	return rc;
}
