/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/program.h"

#include "common/base/option_print.h"

#include <stdio.h>
#include <stdlib.h>

void program_options(const struct program *p, int argc, char **argv, void *target)
{
	enum option_kind asked;
	struct error e;
	if (options_parse(p, argc, argv, target, &asked, &e)) {
		fprintf(stderr, "%s: %s\nTry '%s --help' for more information.\n", p->name, e.text, p->name);
		exit(2);
	}
	if (asked != OPTION_IS_END) {
		option_print(p, asked, stdout);
		exit(0);
	}
}
