/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/asset/asset_name.h"

#include "common/base/text.h"

#include <string.h>

enum { UP = sizeof ASSET_NAME_UP - 1, TOP = sizeof ASSET_NAME_TOP - 1 };

static bool is_up(const char *part, size_t n)
{
	return (n == 2 && memcmp(part, "..", 2) == 0) || (n == UP && memcmp(part, ASSET_NAME_UP, UP) == 0);
}

static bool is_top(const char *name, size_t n)
{
	return n == TOP && memcmp(name, ASSET_NAME_TOP, TOP) == 0;
}

/* Returns where the last component of out[0..n) begins. */
static size_t last_part(const char *out, size_t n)
{
	while (n > 0 && out[n - 1] != '/')
		n--;
	return n;
}

void asset_name_canonical(const char *written, char *out)
{
	size_t used = *written == '/' ? TOP : 0;
	memcpy(out, ASSET_NAME_TOP, used);
	for (const char *part = written + strspn(written, "/"); *part; part += strspn(part, "/")) {
		size_t n = strcspn(part, "/"), before = last_part(out, used);
		bool up = is_up(part, n);
		if (up && used > 0 && !is_up(out + before, used - before)) {
			used = is_top(out, used) ? used : before > 0 ? before - 1 : 0;
		} else if (n > 1 || *part != '.') {
			if (used > 0)
				out[used++] = '/';
			memcpy(out + used, up ? ASSET_NAME_UP : part, up ? UP : n);
			used += up ? UP : n;
		}
		part += n;
	}
	out[used] = 0;
	if (used == 0 || is_top(out, used))
		strcpy(out, written);
}

size_t asset_name_up(const char *canonical, const char **rest)
{
	size_t count = 0;
	if (strncmp(canonical, ASSET_NAME_TOP "/", TOP + 1) == 0) {
		*rest = canonical + TOP + 1;
		return ASSET_NAME_ABSOLUTE;
	}
	while (strncmp(canonical, ASSET_NAME_UP "/", UP + 1) == 0) {
		canonical += UP + 1;
		count++;
	}
	*rest = canonical;
	return count;
}

const char *asset_name_shown(const char *canonical, char *out, size_t size)
{
	const char *rest;
	size_t up = asset_name_up(canonical, &rest);
	bool absolute = up == ASSET_NAME_ABSOLUTE;
	struct text t = {out, size};
	for (up = absolute ? 1 : up; up > 0; up--)
		text_put(&t, "%s", absolute ? "/" : "../");
	text_put(&t, "%s", rest);
	return out;
}
