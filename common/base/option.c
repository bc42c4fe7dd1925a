/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/option.h"

#include <stdlib.h>

double option_number(struct argp_state *state, const char *option, const char *arg, double least, double most)
{
	char *end;
	double x = strtod(arg, &end);
	if (*end || end == arg || !(x >= least && x <= most))
		argp_error(state, "%s takes a number from %g to %g, not '%s'", option, least, most, arg);
	return x;
}
