/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/asset/asset_name.h"

#include "common/base/text.h"

#include <string.h>

enum { PARENT_LENGTH = sizeof ASSET_NAME_PARENT - 1, ROOT_LENGTH = sizeof ASSET_NAME_ROOT - 1 };

static bool is_parent_part(const char *part, size_t n)
{
	return (n == 2 && memcmp(part, "..", 2) == 0) ||
	       (n == PARENT_LENGTH && memcmp(part, ASSET_NAME_PARENT, PARENT_LENGTH) == 0);
}

static bool is_root(const char *name, size_t n)
{
	return n == ROOT_LENGTH && memcmp(name, ASSET_NAME_ROOT, ROOT_LENGTH) == 0;
}

/* Returns where the last component of out[0..n) begins. */
static size_t last_part_begin(const char *out, size_t n)
{
	while (n > 0 && out[n - 1] != '/')
		n--;
	return n;
}

void asset_name_canonicalize(const char *written, char *out)
{
	size_t length = *written == '/' ? ROOT_LENGTH : 0;
	memcpy(out, ASSET_NAME_ROOT, length);
	for (const char *part = written + strspn(written, "/"); *part; part += strspn(part, "/")) {
		size_t n = strcspn(part, "/"), last_begin = last_part_begin(out, length);
		bool is_parent = is_parent_part(part, n);
		if (is_parent && length > 0 && !is_parent_part(out + last_begin, length - last_begin)) {
			length = is_root(out, length) ? length : last_begin > 0 ? last_begin - 1 : 0;
		} else if (n > 1 || *part != '.') {
			if (length > 0)
				out[length++] = '/';
			memcpy(out + length, is_parent ? ASSET_NAME_PARENT : part, is_parent ? PARENT_LENGTH : n);
			length += is_parent ? PARENT_LENGTH : n;
		}
		part += n;
	}
	out[length] = 0;
	if (length == 0 || is_root(out, length))
		strcpy(out, written);
}

size_t asset_name_levels_up(const char *canonical, const char **rest)
{
	size_t count = 0;
	if (strncmp(canonical, ASSET_NAME_ROOT "/", ROOT_LENGTH + 1) == 0) {
		*rest = canonical + ROOT_LENGTH + 1;
		return ASSET_NAME_ABSOLUTE;
	}
	while (strncmp(canonical, ASSET_NAME_PARENT "/", PARENT_LENGTH + 1) == 0) {
		canonical += PARENT_LENGTH + 1;
		count++;
	}
	*rest = canonical;
	return count;
}

const char *asset_name_display(const char *canonical, char *out, size_t size)
{
	const char *rest;
	size_t levels = asset_name_levels_up(canonical, &rest);
	bool absolute = levels == ASSET_NAME_ABSOLUTE;
	struct text t = {out, size};
	for (levels = absolute ? 1 : levels; levels > 0; levels--)
		text_appendf(&t, "%s", absolute ? "/" : "../");
	text_appendf(&t, "%s", rest);
	return out;
}
