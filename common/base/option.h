/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The options of a program as rows of a table. The command line is parsed by it (options_parse), and --help, the manual
 * page and shell completion are printed from it (option_print.h). One thread.
 *
 * As with getopt_long, options and other words may be mixed, names may be abbreviated as long as they are unambiguous,
 * arguments are written `--name=ARG`, `--name ARG`, `-n ARG` or `-nARG`, one-letter flags may be joined, and nothing
 * after `--` is an option. A word such as -5 is not an option.
 */
#ifndef COMMON_BASE_OPTION_H
#define COMMON_BASE_OPTION_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The kind of an option's argument; the last ones are the options that every program has. */
enum option_kind {
	OPTION_IS_END,	  /* no row: the table ends */
	OPTION_IS_FLAG,	  /* takes none */
	OPTION_IS_TEXT,	  /* borrowed from argv */
	OPTION_IS_OUTPUT, /* likewise, but "-" is /dev/stdout */
	OPTION_IS_NAME,	  /* a text to be displayed: up to `most` bytes without control characters */
	OPTION_IS_NUMBER, /* from least to most */
	OPTION_IS_COUNT,  /* a whole number: 4000, 1.5k */
	OPTION_IS_SIZE,	  /* a number of `unit` bytes, or 500k, 64M, 20G, 2T; stored in bytes */
	OPTION_IS_TIME,	  /* a number of `unit` seconds, or 90s, 5m, 2h, 3d; stored in seconds */
	OPTION_IS_RATIO,  /* 0.05, 5%; above 1 as percent only */
	OPTION_IS_OTHER,  /* converted by `take` */
	OPTION_IS_HELP,
	OPTION_IS_USAGE,
	OPTION_IS_VERSION,
	OPTION_IS_MAN,
	OPTION_IS_COMPLETION,
};

enum option_store { OPTION_BOOL, OPTION_STRING, OPTION_DOUBLE, OPTION_UINT64, OPTION_UINT32, OPTION_INT };

/* The i-th accepted name, NULL after the last. */
typedef const char *option_values(size_t i);

/* A `most` of DBL_MAX means no upper bound. The argument's name has a meaning: FILE and PATH are completed by files,
 * DIR and FOLDER by folders; the argument of +N may begin with a plus sign. */
struct option_row {
	const char *name; /* without its dashes */
	char key;	  /* one letter; 0: none */
	const char *arg;  /* its argument's name; NULL: it takes none */
	const char *help; /* without full stop and default */
	enum option_kind kind;
	enum option_store store;
	size_t offset;		  /* offset in the struct that the table fills */
	double least, most, unit; /* the bounds are in units, for numbers 1 */
	bool above, below;	  /* the bound itself is not allowed */
	bool needed;		  /* a text: leaving it NULL is a usage error */
	const char *standard;	  /* the default, parsed like an argument; NULL: keep what the struct holds */
	const char *environment;  /* environment variable used if the option is not given; NULL: none */
	option_values *values;	  /* the only accepted arguments; NULL: any */
	int (*take)(void *target, char *arg, struct error *e); /* arg: from argv, may be changed; NULL without `arg` */
	void (*more)(char *text, size_t size); /* what the help text adds as the default; NULL: nothing */
};

#define OPTION_STORE(type, field) \
	.offset = offsetof(type, field), .store = _Generic(((type *)0)->field, bool                                    \
							   : OPTION_BOOL, const char *                                 \
							   : OPTION_STRING, double                                     \
							   : OPTION_DOUBLE, uint64_t                                   \
							   : OPTION_UINT64, uint32_t                                   \
							   : OPTION_UINT32, int                                        \
							   : OPTION_INT)
/* The last part of a row: its kind, and the field that it fills. */
#define OPTION_FLAG(type, field) .kind = OPTION_IS_FLAG, OPTION_STORE(type, field)
#define OPTION_TEXT(type, field) .kind = OPTION_IS_TEXT, OPTION_STORE(type, field)
#define OPTION_OUTPUT(type, field) .kind = OPTION_IS_OUTPUT, OPTION_STORE(type, field)
#define OPTION_NAME(type, field, bytes) .kind = OPTION_IS_NAME, OPTION_STORE(type, field), .most = (bytes)
#define OPTION_NUMBER(type, field, from, to) \
	.kind = OPTION_IS_NUMBER, OPTION_STORE(type, field), .least = (from), .most = (to), .unit = 1
#define OPTION_SIZE(type, field, from, to, bytes) \
	.kind = OPTION_IS_SIZE, OPTION_STORE(type, field), .least = (from), .most = (to), .unit = (bytes)
#define OPTION_COUNT(type, field, from, to) \
	.kind = OPTION_IS_COUNT, OPTION_STORE(type, field), .least = (from), .most = (to)
#define OPTION_TIME(type, field, from, to, seconds) \
	.kind = OPTION_IS_TIME, OPTION_STORE(type, field), .least = (from), .most = (to), .unit = (seconds)
#define OPTION_SECONDS(type, field, from, to) OPTION_TIME(type, field, from, to, 1)
#define OPTION_RATIO(type, field, from, to) \
	.kind = OPTION_IS_RATIO, OPTION_STORE(type, field), .least = (from), .most = (to)
#define OPTION_TAKE(function) .kind = OPTION_IS_OTHER, .take = (function)

struct option_group {
	const char *title; /* NULL: none */
	const struct option_row *rows;
};

/* Options that fill one struct. */
struct option_table {
	const struct option_group *groups; /* ends with an empty row */
	int (*check)(void *target,
		     struct error *e); /* checks their combination, after the last word; NULL: nothing to check */
};

/* Paragraphs are filled; in texts of several lines, each line is filled, except in examples. */
struct program {
	const char *name;
	const char *words;    /* what follows the options, one line per form of the command; NULL: nothing */
	const char *summary;  /* one sentence */
	const char *examples; /* one per line */
	const char *details;  /* further text */
	const char *exits;    /* "0 done, 1 failed, 2 usage" */
	struct option_table own;
	const struct option_table *shared; /* by several programs: fills the struct's first member; NULL: none */
	option_values *verbs;		   /* accepted first words; NULL: any */
	/* Takes the index-th word that is not an option; NULL: there must be none. */
	int (*word)(void *target, size_t index, char *word, struct error *e);
};

/* Stores the defaults of a table; does not read the environment. */
int option_defaults(const struct option_table *t, void *target, struct error *e);

/* Defaults, environment, command line, then the checks. -EINVAL, with a sentence for the user: a usage error. *asked
 * is one of the last kinds if such an option was given, and then nothing after it was parsed; otherwise
 * OPTION_IS_END. */
int options_parse(const struct program *p, int argc, char **argv, void *target, enum option_kind *asked,
		  struct error *e);

/* All rows of a program, those that every program has at the end; NULL after the last. group may be NULL. */
const struct option_row *option_at(const struct program *p, size_t i, const struct option_group **group);

#endif
