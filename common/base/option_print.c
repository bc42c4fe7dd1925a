/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Prints what option_print.h lists. The help and the manual page have the same sentences in two layouts: describe()
 * builds the text of an option from its help, values, default and environment variable. The completion script offers
 * the names of options and, as arguments, an option's values, or files or folders if the argument's name says so.
 *
 * Nothing here returns an error: a description is cut after 4,096 bytes, --usage prints nothing if memory is out, and
 * output lost on stdout is reported when the program ends (program.c).
 */
#include "common/base/option_print.h"

#include "common/base/text.h"
#include "common/base/version.h"

#include <stdlib.h>
#include <string.h>

enum { MARGIN = 79, HELP_COLUMN = 29, DESCRIPTION = 4096 };

/* Appends the values as "path, bdpt or hslt". */
static void put_values(struct text *t, option_values *values)
{
	const char *name;
	for (size_t i = 0; (name = values(i)) != NULL; i++)
		text_put(t, "%s%s", i == 0 ? "" : values(i + 1) ? ", " : " or ", name);
}

static void describe(const struct option_row *r, char *text, size_t size)
{
	struct text t = {text, size};
	*text = 0;
	if (r->values) {
		put_values(&t, r->values);
		text_put(&t, " ");
	}
	text_put(&t, "%s", r->help);
	if (r->standard || r->environment)
		text_put(&t, " (%s%s%s%s)", r->standard ? r->standard : "", r->standard && r->environment ? "; " : "",
			 r->environment ? "or $" : "", r->environment ? r->environment : "");
	if (r->more)
		r->more(t.at, t.left);
}

/* ---- help ---- */

/* Prints the words of a line of n bytes, wrapped at MARGIN. The output is at `column`; further lines are indented to
 * column `indent`. */
static void print_filled(FILE *out, const char *line, size_t n, size_t column, size_t indent)
{
	const char *end = line + n;
	bool first = true;
	while (line < end) {
		size_t word = 0;
		while (line + word < end && line[word] != ' ')
			word++;
		if (!first && column + 1 + word > MARGIN) {
			fprintf(out, "\n%*s", (int)indent, "");
			column = indent;
		} else if (!first) {
			fputc(' ', out);
			column++;
		}
		fwrite(line, 1, word, out);
		column += word;
		line += word;
		while (line < end && *line == ' ')
			line++;
		first = false;
	}
	fputc('\n', out);
}

static void fill_lines(FILE *out, const char *text)
{
	while (*text) {
		size_t n = strcspn(text, "\n");
		print_filled(out, text, n, 0, 0);
		text += n + (text[n] == '\n');
	}
}

/* Prints each line of `text` after the prefix `before`, without wrapping. */
static void print_lines(FILE *out, const char *before, const char *text)
{
	while (*text) {
		size_t n = strcspn(text, "\n");
		fprintf(out, "%s%.*s\n", before, (int)n, text);
		text += n + (text[n] == '\n');
	}
}

static void print_row(FILE *out, const struct option_row *r)
{
	char text[DESCRIPTION], left[128];
	describe(r, text, sizeof text);
	text_print(left, sizeof left, "  %c%c%s --%s%s%s", r->key ? '-' : ' ', r->key ? r->key : ' ',
		   r->key ? "," : " ", r->name, r->arg ? "=" : "", r->arg ? r->arg : "");
	size_t n = strlen(left);
	fputs(left, out);
	if (n + 2 > HELP_COLUMN) {
		fputc('\n', out);
		n = 0;
	}
	fprintf(out, "%*s", (int)(HELP_COLUMN - n), "");
	print_filled(out, text, strlen(text), HELP_COLUMN, HELP_COLUMN);
}

static void print_forms(FILE *out, const struct program *p)
{
	const char *words = p->words ? p->words : "";
	for (bool first = true; first || *words; first = false) {
		size_t n = strcspn(words, "\n");
		fprintf(out, "%s%s [OPTION...]%s%.*s\n", first ? "Usage: " : "  or:  ", p->name, n ? " " : "", (int)n,
			words);
		words += n + (words[n] == '\n');
	}
}

static void print_help(FILE *out, const struct program *p)
{
	const struct option_group *group, *last = NULL;
	const struct option_row *r;
	print_forms(out, p);
	fill_lines(out, p->summary);
	for (size_t i = 0; (r = option_at(p, i, &group)) != NULL; i++) {
		if (group != last)
			fprintf(out, "\n%s%s%s", group->title ? " " : "", group->title ? group->title : "",
				group->title ? "\n" : "");
		last = group;
		print_row(out, r);
	}
	fprintf(out, "\nExamples:\n");
	print_lines(out, "  ", p->examples);
	fputc('\n', out);
	if (p->details)
		fill_lines(out, p->details);
	char exits[DESCRIPTION];
	text_print(exits, sizeof exits, "Exit codes: %s.", p->exits);
	fill_lines(out, exits);
}

static void print_usage(FILE *out, const struct program *p)
{
	struct text t;
	char *line = malloc(DESCRIPTION);
	const struct option_row *r;
	if (!line)
		return;
	t = (struct text){line, DESCRIPTION};
	text_put(&t, "Usage: %s", p->name);
	for (size_t i = 0; (r = option_at(p, i, NULL)) != NULL; i++)
		text_put(&t, " [--%s%s%s]", r->name, r->arg ? "=" : "", r->arg ? r->arg : "");
	if (p->words)
		text_put(&t, " %.*s", (int)strcspn(p->words, "\n"), p->words);
	print_filled(out, line, strlen(line), 0, 12);
	free(line);
}

/* ---- manual page ---- */

/* Prints text escaped for roff: nothing in it is a request or an escape, and dashes, quotes and the like stay what they
 * are. */
static void roff(FILE *out, const char *text, size_t n)
{
	static const char special[] = "\\-'`^~";
	static const char *const escapes[] = {"\\e", "\\-", "\\(aq", "\\(ga", "\\(ha", "\\(ti"};
	for (size_t i = 0; i < n; i++) {
		const char *s = strchr(special, text[i]);
		if (s)
			fputs(escapes[s - special], out);
		else
			fprintf(out, "%s%c", text[i] == '.' && (i == 0 || text[i - 1] == '\n') ? "\\&" : "", text[i]);
	}
}

static void roff_lines(FILE *out, const char *text)
{
	while (*text) {
		size_t n = strcspn(text, "\n");
		roff(out, text, n);
		fputs(text[n] ? "\n.PP\n" : "\n", out);
		text += n + (text[n] == '\n');
	}
}

static void roff_sentence(FILE *out, const char *text)
{
	roff(out, text, strlen(text));
	fputs(".\n", out);
}

static void roff_row(FILE *out, const struct option_row *r)
{
	char text[DESCRIPTION];
	describe(r, text, sizeof text);
	fputs(".TP\n", out);
	if (r->key)
		fprintf(out, "\\fB\\-%c\\fR, ", r->key);
	fputs("\\fB\\-\\-", out);
	roff(out, r->name, strlen(r->name));
	fputs("\\fR", out);
	if (r->arg) {
		fputs("=\\fI", out);
		roff(out, r->arg, strlen(r->arg));
		fputs("\\fR", out);
	}
	fputc('\n', out);
	roff_sentence(out, text);
}

static void roff_synopsis(FILE *out, const struct program *p)
{
	const char *words = p->words ? p->words : "";
	fputs(".SH SYNOPSIS\n", out);
	for (bool first = true; first || *words; first = false) {
		size_t n = strcspn(words, "\n");
		fputs(first ? "\\fB" : ".br\n\\fB", out);
		roff(out, p->name, strlen(p->name));
		fputs("\\fR [\\fIOPTION\\fR]... ", out);
		roff(out, words, n);
		fputc('\n', out);
		words += n + (words[n] == '\n');
	}
}

static void roff_environment(FILE *out, const struct program *p)
{
	const struct option_row *r;
	bool first = true;
	for (size_t i = 0; (r = option_at(p, i, NULL)) != NULL; i++)
		if (r->environment) {
			fprintf(out, "%s.TP\n\\fB%s\\fR\nStands in for \\fB\\-\\-", first ? ".SH ENVIRONMENT\n" : "",
				r->environment);
			roff(out, r->name, strlen(r->name));
			fputs("\\fR.\n", out);
			first = false;
		}
}

static void print_man(FILE *out, const struct program *p)
{
	const struct option_group *group, *last = NULL;
	const struct option_row *r;
	fputs(".TH \"", out);
	roff(out, p->name, strlen(p->name));
	fputs("\" 1 \"\" \"HSLT Farm ", out);
	roff(out, HSLT_VERSION, strlen(HSLT_VERSION));
	fputs("\" \"User Commands\"\n.SH NAME\n", out);
	roff(out, p->name, strlen(p->name));
	fputs(" \\- ", out);
	roff_lines(out, p->summary);
	roff_synopsis(out, p);
	if (p->details) {
		fputs(".SH DESCRIPTION\n", out);
		roff_lines(out, p->details);
	}
	fputs(".SH OPTIONS\n", out);
	for (size_t i = 0; (r = option_at(p, i, &group)) != NULL; i++) {
		if (group != last && group->title) {
			fputs(".SS \"", out);
			roff(out, group->title, strcspn(group->title, ":"));
			fputs("\"\n", out);
		} else if (group != last && last) {
			fputs(".SS \"General\"\n", out);
		}
		last = group;
		roff_row(out, r);
	}
	roff_environment(out, p);
	fputs(".SH EXIT STATUS\n", out);
	roff_sentence(out, p->exits);
	fputs(".SH EXAMPLES\n.nf\n", out);
	roff(out, p->examples, strlen(p->examples));
	fputs("\n.fi\n", out);
}

/* ---- completion ---- */

static bool names_file(const char *arg)
{
	return strstr(arg, "FILE") || strstr(arg, "PATH") || strchr(arg, '.');
}

static bool names_folder(const char *arg)
{
	return strstr(arg, "DIR") || strstr(arg, "FOLDER");
}

static void print_case(FILE *out, const struct option_row *r)
{
	const char *name;
	if (r->key)
		fprintf(out, "\t-%c | ", r->key);
	fprintf(out, "%s--%s) mapfile -t COMPREPLY < <(compgen ", r->key ? "" : "\t", r->name);
	if (r->values) {
		fputs("-W \"", out);
		for (size_t i = 0; (name = r->values(i)) != NULL; i++)
			fprintf(out, "%s%s", i ? " " : "", name);
		fputc('"', out);
	} else {
		fputs(names_file(r->arg) ? "-f" : names_folder(r->arg) ? "-d" : "-W \"\"", out);
	}
	fputs(" -- \"$word\") ;;\n", out);
}

/* The script accounts for bash splitting words at '=': it receives `--size=3` as three words. */
static void print_completion(FILE *out, const struct program *p)
{
	char function[64];
	const struct option_row *r;
	const char *name;
	text_copy(function, sizeof function, p->name);
	for (char *c = function; *c; c++)
		if (*c == '-')
			*c = '_';
	fprintf(out,
		"# bash completion of %s, printed by %s --completion\n"
		"_%s()\n{\n"
		"\tlocal word=${COMP_WORDS[COMP_CWORD]} option=${COMP_WORDS[COMP_CWORD - 1]}\n"
		"\tif [[ $word == = ]]; then\n\t\tword=\n"
		"\telif [[ $option == = ]]; then\n\t\toption=${COMP_WORDS[COMP_CWORD - 2]}\n\tfi\n"
		"\tcase $option in\n",
		p->name, p->name, function);
	for (size_t i = 0; (r = option_at(p, i, NULL)) != NULL; i++)
		if (r->arg)
			print_case(out, r);
	fputs("\t*)\n\t\tif [[ $word == -* ]]; then\n\t\t\tmapfile -t COMPREPLY < <(compgen -W \"", out);
	for (size_t i = 0; (r = option_at(p, i, NULL)) != NULL; i++)
		fprintf(out, "%s--%s", i ? " " : "", r->name);
	fputs("\" -- \"$word\")\n\t\telse\n\t\t\tmapfile -t COMPREPLY < <(compgen -W \"", out);
	for (size_t i = 0; p->verbs && (name = p->verbs(i)) != NULL; i++)
		fprintf(out, "%s%s", i ? " " : "", name);
	fprintf(out, "\" %s -- \"$word\")\n\t\tfi\n\t\t;;\n\tesac\n}\ncomplete -o filenames -F _%s %s\n",
		p->words && names_file(p->words) ? "-f" : "", function, p->name);
}

void option_print(const struct program *p, enum option_kind what, FILE *out)
{
	switch (what) {
	case OPTION_IS_HELP:
		print_help(out, p);
		break;
	case OPTION_IS_USAGE:
		print_usage(out, p);
		break;
	case OPTION_IS_MAN:
		print_man(out, p);
		break;
	case OPTION_IS_COMPLETION:
		print_completion(out, p);
		break;
	default:
		fprintf(out, "%s %s\n", p->name, HSLT_VERSION);
	}
}
