/* SPDX-License-Identifier: Apache-2.0 */
/*
 * A program as its user meets it: its options are rows of a table, from which the command line is read (options_parse)
 * and --help, the manual page and the completion of a shell are printed (option_print.h). One thread.
 *
 * As with getopt_long: options and other words may come in any order, names may be cut short as long as they are
 * unambiguous, an argument follows as `--name=ARG`, `--name ARG`, `-n ARG` or `-nARG`, flags of one letter may be
 * joined, and after `--` nothing is an option. A word such as -5 is no option.
 */
#ifndef COMMON_BASE_OPTION_H
#define COMMON_BASE_OPTION_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What the argument of an option is; the last ones are those of every program. */
enum option_kind {
	OPTION_IS_END,	   /* no row: the table ends */
	OPTION_IS_FLAG,	   /* none */
	OPTION_IS_TEXT,	   /* borrowed from argv */
	OPTION_IS_NUMBER,  /* from least to most, stored times unit */
	OPTION_IS_COUNT,   /* a whole number: 4000, 1.5k */
	OPTION_IS_SECONDS, /* 90, 90s, 5m, 2h */
	OPTION_IS_RATIO,   /* 0.05, 5%; above 1 as percent only */
	OPTION_IS_OTHER,   /* what `take` makes of it */
	OPTION_IS_HELP,
	OPTION_IS_USAGE,
	OPTION_IS_VERSION,
	OPTION_IS_MAN,
	OPTION_IS_COMPLETION,
};

enum option_store { OPTION_BOOL, OPTION_STRING, OPTION_DOUBLE, OPTION_UINT64, OPTION_UINT32, OPTION_INT };

/* The i-th name that is known, NULL after the last. */
typedef const char *option_values(size_t i);

/* A `most` of DBL_MAX is no bound. What the name of the argument says: FILE and PATH are completed by files, DIR and
 * FOLDER by folders; the argument of +N may begin with a plus sign. */
struct option_row {
	const char *name; /* without its dashes */
	char key;	  /* of one letter; 0: none */
	const char *arg;  /* its argument's name; NULL: it takes none */
	const char *help; /* without a full stop, and without the default */
	enum option_kind kind;
	enum option_store store;
	size_t offset; /* of where it is stored in the struct that the table fills */
	double least, most, unit;
	bool above, below;	 /* the bound itself is excluded */
	bool needed;		 /* a text: it is a usage error if it stays NULL */
	bool hidden;		 /* an old name: not shown, and not to be cut short */
	const char *standard;	 /* the default, read as an argument is; NULL: what the struct holds already */
	const char *environment; /* the variable that stands in for the option; NULL: none */
	option_values *values;	 /* the only arguments that there are; NULL: any */
	int (*take)(void *target, char *arg, struct error *e); /* arg: of argv, may be changed; NULL without `arg` */
	void (*more)(char *text, size_t size);		       /* what help says behind the default; NULL: nothing */
};

#define OPTION_STORE(type, field) \
	.offset = offsetof(type, field), .store = _Generic(((type *)0)->field, bool                                    \
							   : OPTION_BOOL, const char *                                 \
							   : OPTION_STRING, double                                     \
							   : OPTION_DOUBLE, uint64_t                                   \
							   : OPTION_UINT64, uint32_t                                   \
							   : OPTION_UINT32, int                                        \
							   : OPTION_INT)
/* The last part of a row: its kind, and the field of the struct that holds it. */
#define OPTION_FLAG(type, field) .kind = OPTION_IS_FLAG, OPTION_STORE(type, field)
#define OPTION_TEXT(type, field) .kind = OPTION_IS_TEXT, OPTION_STORE(type, field)
#define OPTION_NUMBER(type, field, from, to) \
	.kind = OPTION_IS_NUMBER, OPTION_STORE(type, field), .least = (from), .most = (to), .unit = 1
#define OPTION_SCALED(type, field, from, to, times) \
	.kind = OPTION_IS_NUMBER, OPTION_STORE(type, field), .least = (from), .most = (to), .unit = (times)
#define OPTION_COUNT(type, field, from, to) \
	.kind = OPTION_IS_COUNT, OPTION_STORE(type, field), .least = (from), .most = (to)
#define OPTION_SECONDS(type, field, from, to) \
	.kind = OPTION_IS_SECONDS, OPTION_STORE(type, field), .least = (from), .most = (to)
#define OPTION_RATIO(type, field, from, to) \
	.kind = OPTION_IS_RATIO, OPTION_STORE(type, field), .least = (from), .most = (to)
#define OPTION_TAKE(function) .kind = OPTION_IS_OTHER, .take = (function)

struct option_group {
	const char *title; /* NULL: none */
	const struct option_row *rows;
};

/* Options that fill one struct. */
struct option_table {
	const struct option_group *groups;	     /* until one without rows */
	int (*check)(void *target, struct error *e); /* that they go together, after the last word; NULL: they do */
};

/* Texts without line breaks are filled; those of more lines have each line filled, examples none. */
struct program {
	const char *name;
	const char *words;    /* what follows the options, a line each way to call it; NULL: nothing does */
	const char *summary;  /* one sentence */
	const char *examples; /* a line each */
	const char *details;  /* what else there is to know */
	const char *exits;    /* "0 done, 1 failed, 2 usage" */
	struct option_table own;
	const struct option_table *shared; /* by several programs; NULL: none */
	size_t shared_offset;		   /* of its struct in the one that `own` fills */
	option_values *verbs;		   /* what the first word must be; NULL: anything */
	/* The index-th word that is no option; NULL: there must be none. */
	int (*word)(void *target, size_t index, char *word, struct error *e);
};

/* The defaults of a table into what it fills; the environment is not looked at. */
int option_defaults(const struct option_table *t, void *target, struct error *e);

/* Defaults, environment, command line, then the checks. -EINVAL with a sentence for the user: a usage error. *asked is
 * one of the last kinds if it was asked for, and then the rest was not looked at; else OPTION_IS_END. */
int options_parse(const struct program *p, int argc, char **argv, void *target, enum option_kind *asked,
		  struct error *e);

/* All rows of a program, with those that every program has at the end; NULL after the last. group and offset (of what
 * its table fills) may be NULL. */
const struct option_row *option_at(const struct program *p, size_t i, const struct option_group **group,
				   size_t *offset);

#endif
