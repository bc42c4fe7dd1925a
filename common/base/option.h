/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The options of a program as rows of a table. options_parse reads the command line by this table; --help, the manual
 * page and the shell completion are printed from it (option_print.h). One thread.
 *
 * As with getopt_long, options and other words may be mixed, names may be abbreviated as long as they are unambiguous,
 * arguments are written `--name=ARG`, `--name ARG`, `-n ARG` or `-nARG`, one-letter flags may be joined, and nothing
 * after `--` is an option. A word such as -5 is not an option, unless the program has a one-letter option `5`.
 */
#ifndef COMMON_BASE_OPTION_H
#define COMMON_BASE_OPTION_H

#include "common/base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The kind of an option's argument. From OPTION_KIND_HELP on: the options that every program has. */
enum option_kind {
	OPTION_KIND_END,    /* no option: marks the end of a table */
	OPTION_KIND_FLAG,   /* no argument */
	OPTION_KIND_TEXT,   /* any text; points into argv */
	OPTION_KIND_OUTPUT, /* the path of an output file, like a text, but "-" becomes /dev/stdout */
	OPTION_KIND_NAME,   /* a text to be displayed: 1 to `max` bytes of UTF-8 without control characters */
	OPTION_KIND_NUMBER, /* a floating point number from `min` to `max` */
	OPTION_KIND_COUNT,  /* a whole number: 4000, 1.5k */
	OPTION_KIND_SIZE,   /* a number of `unit` bytes, or 500k, 64M, 20G, 2T; stored in bytes */
	OPTION_KIND_TIME,   /* a number of `unit` seconds, or 90s, 5m, 2h, 3d; stored in seconds */
	OPTION_KIND_RATIO,  /* 0.05 or 5%, at most 1 */
	OPTION_KIND_CUSTOM, /* converted by the row's function `parse` */
	OPTION_KIND_HELP,
	OPTION_KIND_USAGE,
	OPTION_KIND_VERSION,
	OPTION_KIND_MAN,
	OPTION_KIND_COMPLETION,
};

enum option_field_type { OPTION_BOOL, OPTION_STRING, OPTION_DOUBLE, OPTION_UINT64, OPTION_UINT32, OPTION_INT };

/* Returns the i-th accepted name; NULL after the last. */
typedef const char *option_values(size_t i);

/* One option. The name of the argument has a meaning: FILE and PATH are completed by files, DIR and FOLDER by folders;
 * an argument named +N must begin with a plus sign. */
struct option_row {
	const char *name; /* without the dashes */
	char key;	  /* the one-letter form; 0: none */
	const char *arg;  /* name of the argument; NULL: the option takes none */
	const char *help; /* without a full stop at the end, and without the default */
	enum option_kind kind;
	enum option_field_type field_type;
	size_t offset;			 /* of the field in the struct that the table fills */
	double min, max, unit;		 /* the bounds, in units (1 for numbers); max = DBL_MAX: no upper bound */
	bool excludes_min, excludes_max; /* `min` or `max` itself is not allowed */
	bool is_required;		 /* for a text: a NULL after parsing is a usage error */
	const char *default_value;	 /* the default, parsed like an argument; NULL: the field is left as it is */
	const char *environment;	 /* environment variable used if the option is not given; NULL: none */
	option_values *values;		 /* the only accepted arguments; NULL: any */
	int (*parse)(void *target, char *arg, struct error *e); /* arg may be changed; may be NULL */
	/* appends a default known only at run time to the help; NULL: none */
	void (*append_default)(char *text, size_t size);
};

#define OPTION_FIELD(type, field) \
	.offset = offsetof(type, field), .field_type = _Generic(((type *)0)->field, bool                                    \
							   : OPTION_BOOL, const char *                                 \
							   : OPTION_STRING, double                                     \
							   : OPTION_DOUBLE, uint64_t                                   \
							   : OPTION_UINT64, uint32_t                                   \
							   : OPTION_UINT32, int                                        \
							   : OPTION_INT)
/* The last part of a row: the kind of the argument, and the field that it fills. */
#define OPTION_FLAG(type, field) .kind = OPTION_KIND_FLAG, OPTION_FIELD(type, field)
#define OPTION_TEXT(type, field) .kind = OPTION_KIND_TEXT, OPTION_FIELD(type, field)
#define OPTION_OUTPUT(type, field) .kind = OPTION_KIND_OUTPUT, OPTION_FIELD(type, field)
#define OPTION_NAME(type, field, bytes) .kind = OPTION_KIND_NAME, OPTION_FIELD(type, field), .max = (bytes)
#define OPTION_NUMBER(type, field, from, to) \
	.kind = OPTION_KIND_NUMBER, OPTION_FIELD(type, field), .min = (from), .max = (to), .unit = 1
#define OPTION_SIZE(type, field, from, to, bytes) \
	.kind = OPTION_KIND_SIZE, OPTION_FIELD(type, field), .min = (from), .max = (to), .unit = (bytes)
#define OPTION_COUNT(type, field, from, to) \
	.kind = OPTION_KIND_COUNT, OPTION_FIELD(type, field), .min = (from), .max = (to)
#define OPTION_TIME(type, field, from, to, seconds) \
	.kind = OPTION_KIND_TIME, OPTION_FIELD(type, field), .min = (from), .max = (to), .unit = (seconds)
#define OPTION_SECONDS(type, field, from, to) OPTION_TIME(type, field, from, to, 1)
#define OPTION_RATIO(type, field, from, to) \
	.kind = OPTION_KIND_RATIO, OPTION_FIELD(type, field), .min = (from), .max = (to)
#define OPTION_CUSTOM(function) .kind = OPTION_KIND_CUSTOM, .parse = (function)

struct option_group {
	const char *title; /* NULL: none */
	const struct option_row *rows;
};

/* Options that fill one struct. */
struct option_table {
	const struct option_group *groups;	     /* ends with an empty row */
	int (*check)(void *target, struct error *e); /* checks combinations, after parsing; NULL: nothing to check */
};

/* A program as its help describes it. Each line of a text is wrapped on its own, except in the examples. */
struct program {
	const char *name;
	const char *synopsis;	/* the words after the options, one line per form of the command; NULL: nothing */
	const char *summary;	/* one sentence */
	const char *examples;	/* one per line */
	const char *details;	/* further text */
	const char *exit_codes; /* "0 done, 1 failed, 2 usage" */
	struct option_table options;
	/* options of several programs: fill the struct's first member; NULL: none */
	const struct option_table *shared_options;
	option_values *verbs; /* accepted first words; NULL: any */
	/* Called with the index-th word that is not an option; NULL: such words are errors. */
	int (*parse_word)(void *target, size_t index, char *word, struct error *e);
};

/* Stores the defaults of a table; does not read the environment. */
int option_set_defaults(const struct option_table *t, void *target, struct error *e);

/* Stores the defaults, then reads the environment and the command line, then runs the checks. Returns -EINVAL with a
 * sentence for the user after a usage error. If an option that every program has was given, *requested is its kind and
 * the words after it have not been parsed; otherwise *requested is OPTION_KIND_END. */
int options_parse(const struct program *p, int argc, char **argv, void *target, enum option_kind *requested,
		  struct error *e);

/* Returns the i-th row of a program, NULL after the last: its own rows, the shared ones, then those that every program
 * has. *group is the group of the row; group may be NULL. */
const struct option_row *option_row_at(const struct program *p, size_t i, const struct option_group **group);

#endif
