/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/base/source_place.h"

#include <limits.h>
#include <string.h>
#include <unistd.h>

/* Returns the length of the file's name in "name:12: ..."; 0 if the text begins otherwise. */
static size_t file_name_length(const char *text)
{
	for (const char *at = strchr(text, ':'); at; at = strchr(at + 1, ':')) {
		size_t digits = strspn(at + 1, "0123456789");
		if (digits && at[1 + digits] == ':')
			return (size_t)(at - text);
	}
	return 0;
}

void source_place_print(FILE *to, const char *label, const char *scene, const char *text)
{
	char path[PATH_MAX];
	const char *slash = strrchr(scene, '/');
	int folder = slash ? (int)(slash + 1 - scene) : 0, name = (int)file_name_length(text);
	size_t scene_name_length = slash ? strlen(slash + 1) : 0;
	if (!name && scene_name_length && strncmp(text, slash + 1, scene_name_length) == 0 &&
	    text[scene_name_length] == ':') /* of the scene file as a whole */
		name = (int)scene_name_length;
	int n = folder && name ? snprintf(path, sizeof path, "%.*s%.*s", folder, scene, name, text) : -1;
	if (n < 0 || (size_t)n >= sizeof path || access(path, F_OK))
		folder = 0;
	fprintf(to, "%s%.*s%s\n", label, folder, scene, text);
}
