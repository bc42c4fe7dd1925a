/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Prints what option_print.h lists. The help and the manual page have the same sentences in two layouts:
 * describe_option() builds the text of an option from its help, values, default and environment variable. The
 * completion script offers the names of options and, as arguments, an option's values, or files or folders if the
 * argument's name says so.
 *
 * Nothing here returns an error: a description is cut after 4,096 bytes, --usage prints nothing if memory is out, and
 * output lost on stdout is reported when the program ends (program.c).
 */
#include "common/base/option_print.h"

#include "common/base/text.h"
#include "common/base/version.h"

#include <stdlib.h>
#include <string.h>

enum { LINE_WIDTH = 79, HELP_COLUMN = 29, DESCRIPTION_MAX = 4096 };

/* Appends the values as "path, bdpt or hslt". */
static void append_values(struct text *t, option_values *values)
{
	const char *name;
	for (size_t i = 0; (name = values(i)) != NULL; i++)
		text_appendf(t, "%s%s", i == 0 ? "" : values(i + 1) ? ", " : " or ", name);
}

static void describe_option(const struct option_row *r, char *text, size_t size)
{
	struct text t = {text, size};
	*text = 0;
	if (r->values) {
		append_values(&t, r->values);
		text_appendf(&t, " ");
	}
	text_appendf(&t, "%s", r->help);
	if (r->default_value || r->environment)
		text_appendf(&t, " (%s%s%s%s)", r->default_value ? r->default_value : "",
			     r->default_value && r->environment ? "; " : "", r->environment ? "or $" : "",
			     r->environment ? r->environment : "");
	if (r->append_default)
		r->append_default(t.end, t.remaining);
}

/* ---- help ---- */

/* Prints the words of a line of n bytes, wrapped at LINE_WIDTH. The output is at `column`; further lines are indented
 * to column `indent`. */
static void print_wrapped(FILE *out, const char *line, size_t n, size_t column, size_t indent)
{
	const char *end = line + n;
	bool first = true;
	while (line < end) {
		size_t word = 0;
		while (line + word < end && line[word] != ' ')
			word++;
		if (!first && column + 1 + word > LINE_WIDTH) {
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

static void print_wrapped_lines(FILE *out, const char *text)
{
	while (*text) {
		size_t n = strcspn(text, "\n");
		print_wrapped(out, text, n, 0, 0);
		text += n + (text[n] == '\n');
	}
}

/* Prints each line of `text` after the prefix `prefix`, without wrapping. */
static void print_lines(FILE *out, const char *prefix, const char *text)
{
	while (*text) {
		size_t n = strcspn(text, "\n");
		fprintf(out, "%s%.*s\n", prefix, (int)n, text);
		text += n + (text[n] == '\n');
	}
}

static void print_option(FILE *out, const struct option_row *r)
{
	char text[DESCRIPTION_MAX], option_column[128];
	describe_option(r, text, sizeof text);
	text_print(option_column, sizeof option_column, "  %c%c%s --%s%s%s", r->key ? '-' : ' ', r->key ? r->key : ' ',
		   r->key ? "," : " ", r->name, r->arg ? "=" : "", r->arg ? r->arg : "");
	size_t n = strlen(option_column);
	fputs(option_column, out);
	if (n + 2 > HELP_COLUMN) {
		fputc('\n', out);
		n = 0;
	}
	fprintf(out, "%*s", (int)(HELP_COLUMN - n), "");
	print_wrapped(out, text, strlen(text), HELP_COLUMN, HELP_COLUMN);
}

static void print_usage_forms(FILE *out, const struct program *p)
{
	const char *words = p->synopsis ? p->synopsis : "";
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
	print_usage_forms(out, p);
	print_wrapped_lines(out, p->summary);
	for (size_t i = 0; (r = option_row_at(p, i, &group)) != NULL; i++) {
		if (group != last)
			fprintf(out, "\n%s%s%s", group->title ? " " : "", group->title ? group->title : "",
				group->title ? "\n" : "");
		last = group;
		print_option(out, r);
	}
	fprintf(out, "\nExamples:\n");
	print_lines(out, "  ", p->examples);
	fputc('\n', out);
	if (p->details)
		print_wrapped_lines(out, p->details);
	char exits[DESCRIPTION_MAX];
	text_print(exits, sizeof exits, "Exit codes: %s.", p->exit_codes);
	print_wrapped_lines(out, exits);
}

static void print_usage(FILE *out, const struct program *p)
{
	struct text t;
	char *line = malloc(DESCRIPTION_MAX);
	const struct option_row *r;
	if (!line)
		return;
	t = (struct text){line, DESCRIPTION_MAX};
	text_appendf(&t, "Usage: %s", p->name);
	for (size_t i = 0; (r = option_row_at(p, i, NULL)) != NULL; i++)
		text_appendf(&t, " [--%s%s%s]", r->name, r->arg ? "=" : "", r->arg ? r->arg : "");
	if (p->synopsis)
		text_appendf(&t, " %.*s", (int)strcspn(p->synopsis, "\n"), p->synopsis);
	print_wrapped(out, line, strlen(line), 0, 12);
	free(line);
}

/* ---- manual page ---- */

/* Prints text escaped for roff: nothing in it is a request or an escape, and dashes, quotes and the like stay what they
 * are. */
static void print_roff(FILE *out, const char *text, size_t n)
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

static void print_roff_lines(FILE *out, const char *text)
{
	while (*text) {
		size_t n = strcspn(text, "\n");
		print_roff(out, text, n);
		fputs(text[n] ? "\n.PP\n" : "\n", out);
		text += n + (text[n] == '\n');
	}
}

static void print_roff_sentence(FILE *out, const char *text)
{
	print_roff(out, text, strlen(text));
	fputs(".\n", out);
}

static void print_roff_option(FILE *out, const struct option_row *r)
{
	char text[DESCRIPTION_MAX];
	describe_option(r, text, sizeof text);
	fputs(".TP\n", out);
	if (r->key)
		fprintf(out, "\\fB\\-%c\\fR, ", r->key);
	fputs("\\fB\\-\\-", out);
	print_roff(out, r->name, strlen(r->name));
	fputs("\\fR", out);
	if (r->arg) {
		fputs("=\\fI", out);
		print_roff(out, r->arg, strlen(r->arg));
		fputs("\\fR", out);
	}
	fputc('\n', out);
	print_roff_sentence(out, text);
}

static void print_roff_synopsis(FILE *out, const struct program *p)
{
	const char *words = p->synopsis ? p->synopsis : "";
	fputs(".SH SYNOPSIS\n", out);
	for (bool first = true; first || *words; first = false) {
		size_t n = strcspn(words, "\n");
		fputs(first ? "\\fB" : ".br\n\\fB", out);
		print_roff(out, p->name, strlen(p->name));
		fputs("\\fR [\\fIOPTION\\fR]... ", out);
		print_roff(out, words, n);
		fputc('\n', out);
		words += n + (words[n] == '\n');
	}
}

static void print_roff_environment(FILE *out, const struct program *p)
{
	const struct option_row *r;
	bool first = true;
	for (size_t i = 0; (r = option_row_at(p, i, NULL)) != NULL; i++)
		if (r->environment) {
			fprintf(out, "%s.TP\n\\fB%s\\fR\nStands in for \\fB\\-\\-", first ? ".SH ENVIRONMENT\n" : "",
				r->environment);
			print_roff(out, r->name, strlen(r->name));
			fputs("\\fR.\n", out);
			first = false;
		}
}

static void print_man(FILE *out, const struct program *p)
{
	const struct option_group *group, *last = NULL;
	const struct option_row *r;
	fputs(".TH \"", out);
	print_roff(out, p->name, strlen(p->name));
	fputs("\" 1 \"\" \"HSLT Farm ", out);
	print_roff(out, HSLT_VERSION, strlen(HSLT_VERSION));
	fputs("\" \"User Commands\"\n.SH NAME\n", out);
	print_roff(out, p->name, strlen(p->name));
	fputs(" \\- ", out);
	print_roff_lines(out, p->summary);
	print_roff_synopsis(out, p);
	if (p->details) {
		fputs(".SH DESCRIPTION\n", out);
		print_roff_lines(out, p->details);
	}
	fputs(".SH OPTIONS\n", out);
	for (size_t i = 0; (r = option_row_at(p, i, &group)) != NULL; i++) {
		if (group != last && group->title) {
			fputs(".SS \"", out);
			print_roff(out, group->title, strcspn(group->title, ":"));
			fputs("\"\n", out);
		} else if (group != last && last) {
			fputs(".SS \"General\"\n", out);
		}
		last = group;
		print_roff_option(out, r);
	}
	print_roff_environment(out, p);
	fputs(".SH EXIT STATUS\n", out);
	print_roff_sentence(out, p->exit_codes);
	fputs(".SH EXAMPLES\n.nf\n", out);
	print_roff(out, p->examples, strlen(p->examples));
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

static void print_completion_case(FILE *out, const struct option_row *r)
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
	for (size_t i = 0; (r = option_row_at(p, i, NULL)) != NULL; i++)
		if (r->arg)
			print_completion_case(out, r);
	fputs("\t*)\n\t\tif [[ $word == -* ]]; then\n\t\t\tmapfile -t COMPREPLY < <(compgen -W \"", out);
	for (size_t i = 0; (r = option_row_at(p, i, NULL)) != NULL; i++)
		fprintf(out, "%s--%s", i ? " " : "", r->name);
	fputs("\" -- \"$word\")\n\t\telse\n\t\t\tmapfile -t COMPREPLY < <(compgen -W \"", out);
	for (size_t i = 0; p->verbs && (name = p->verbs(i)) != NULL; i++)
		fprintf(out, "%s%s", i ? " " : "", name);
	fprintf(out, "\" %s -- \"$word\")\n\t\tfi\n\t\t;;\n\tesac\n}\ncomplete -o filenames -F _%s %s\n",
		p->synopsis && names_file(p->synopsis) ? "-f" : "", function, p->name);
}

void option_print(const struct program *p, enum option_kind request, FILE *out)
{
	switch (request) {
	case OPTION_KIND_HELP:
		print_help(out, p);
		break;
	case OPTION_KIND_USAGE:
		print_usage(out, p);
		break;
	case OPTION_KIND_MAN:
		print_man(out, p);
		break;
	case OPTION_KIND_COMPLETION:
		print_completion(out, p);
		break;
	default:
		fprintf(out, "%s %s\n", p->name, HSLT_VERSION);
	}
}
