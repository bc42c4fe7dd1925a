/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/text/snake_case.h"

#include <stdbool.h>

static bool is_upper(char c)
{
	return c >= 'A' && c <= 'Z';
}

void snake_case_from_camel(const char *name, char *out)
{
	char previous = '_';
	for (; *name; name++) {
		if (is_upper(*name) && previous != '_' && !is_upper(previous))
			*out++ = '_';
		*out++ = is_upper(*name) ? (char)(*name - 'A' + 'a') : *name;
		previous = *name;
	}
	*out = 0;
}
