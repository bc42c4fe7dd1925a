/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/text/snake_case.h"

#include <stdbool.h>

static bool is_upper(char c)
{
	return c >= 'A' && c <= 'Z';
}

void snake_case(const char *name, char *out)
{
	char before = '_';
	for (; *name; name++) {
		if (is_upper(*name) && before != '_' && !is_upper(before))
			*out++ = '_';
		*out++ = is_upper(*name) ? (char)(*name - 'A' + 'a') : *name;
		before = *name;
	}
	*out = 0;
}
