/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Looks for a file where Mitsuba does: beside the scene file that names it and beside the files that include that one,
 * then in the folders of <path>, then in the scene's folder. After that, unlike Mitsuba, it looks for the end of the
 * path in the scene's folder. Files are opened to see whether they exist, and closed again.
 *
 * The only failure is -ENOMEM. A file that is found nowhere is reported by the code that opens it.
 */
#include "worker/render/xml/xml_files.h"

#include "worker/render/asset/asset_name.h"

#include <stdio.h>
#include <string.h>

/* Returns the canonical form of FOLDER/NAME, or of NAME if the folder is "". NULL if out of memory. */
static const char *canonical(struct arena *arena, const char *folder, const char *name)
{
	size_t n = strlen(folder), size = n + 1 + strlen(name);
	char *joined = arena_alloc(arena, size + 1, 1), *out = arena_alloc(arena, ASSET_NAME_ROOM(size), 1);
	if (!joined || !out)
		return NULL;
	snprintf(joined, size + 1, "%s%s%s", folder, n ? "/" : "", name);
	asset_name_canonical(joined, out);
	return out;
}

static bool leads_out(const char *canonical_name)
{
	const char *rest;
	return asset_name_up(canonical_name, &rest) > 0;
}

/* Returns 0 if the file can be opened, otherwise the error: -EINVAL if it is outside the folders that may be read. */
static int try_open(const struct xml_files *f, const char *name)
{
	struct asset a;
	struct error ignored;
	int rc = f->assets->open(f->assets->user, name, &a, &ignored);
	if (!rc)
		f->assets->close(f->assets->user, &a);
	return rc;
}

/* Returns the canonical name of the file in that folder and stores whether it exists. NULL if out of memory. */
static const char *look_in(const struct xml_files *f, const char *folder, const char *written, bool *found)
{
	const char *there = canonical(f->arena, folder, written);
	*found = there && try_open(f, there) == 0;
	return there;
}

/* Searches as Mitsuba 3 does: beside the file that names it, then beside the one that includes that file, and so on;
 * the scene's own folder comes last. If the name leads out of the scene's folder and is not found, *name becomes the
 * first place tried, for the message. */
static int look_around(const struct xml_files *f, const char *written, const char **name, bool *found)
{
	const char *file = f->file;
	bool instead = leads_out(*name);
	for (const struct xml_element *by = f->hook; by && !*found;) {
		const char *end = strrchr(file, '/');
		char *folder = arena_strdup(f->arena, end ? file : "");
		if (folder && end)
			folder[end - file] = 0;
		const char *there = folder ? look_in(f, folder, written, found) : NULL;
		if (!there)
			return -ENOMEM;
		if (*found || instead)
			*name = there;
		instead = false;
		file = by->file;
		do
			by = by->parent;
		while (by && strcmp(by->name, "include") != 0);
	}
	return 0;
}

/* Searches the folders of <path>, the last one first, as in Mitsuba 3. If the file is in no folder that may be read
 * but perhaps in one that may not, *name becomes its path there: opening it fails with the --path that would allow
 * it. */
static int look_along_paths(const struct xml_files *f, const char *written, const char **name, bool *found)
{
	const char *outside = NULL;
	for (uint32_t i = f->path_count; i-- > 0 && !*found;) {
		const char *there = canonical(f->arena, f->paths[i], written);
		if (!there)
			return -ENOMEM;
		int rc = try_open(f, there);
		*found = rc == 0;
		*name = *found ? there : *name;
		outside = !outside && rc == -EINVAL && leads_out(there) ? there : outside;
	}
	if (!*found && outside && try_open(f, *name) != 0)
		*name = outside;
	return 0;
}

/* For the path of a file on another machine: looks for the longest end of it that is a file in the scene's folder. */
static int look_by_end(const struct xml_files *f, const char *written, const char **name, bool *found)
{
	for (const char *end = strchr(written, '/'); end && !*found; end = strchr(end, '/')) {
		end += strspn(end, "/");
		const char *there = *end ? look_in(f, "", end, found) : written;
		if (!there)
			return -ENOMEM;
		*name = *found ? there : *name;
	}
	return 0;
}

static bool is_absolute(const char *written)
{
	bool letter = (*written >= 'a' && *written <= 'z') || (*written >= 'A' && *written <= 'Z');
	return *written == '/' || (letter && written[1] == ':' && written[2] == '/');
}

/* Finds the first folder that has the file, and stores whether there is one. */
static int search(struct xml_files *f, const char *written, bool nested, const char **name, bool *found)
{
	*found = false;
	const char *own = *name = canonical(f->arena, "", written);
	bool relative = !is_absolute(written);
	if (!own || (nested && relative && look_around(f, written, name, found)) ||
	    (relative && !*found && look_along_paths(f, written, name, found)))
		return -ENOMEM;
	if (*found)
		return 0;
	int rc = try_open(f, own);
	*found = rc == 0;
	*name = *found ? own : *name;
	if (rc == 0 || rc == -EINVAL || relative)
		return 0;
	if (look_by_end(f, written, name, found))
		return -ENOMEM;
	f->by_end = *found ? *name : f->by_end;
	return 0;
}

int xml_files_find(struct xml_files *f, const char **name, bool nested)
{
	bool found = false, windows = strchr(*name, '\\') != NULL;
	const char *written = *name;
	f->by_end = NULL;
	if (f->path_count == 0 && !windows && !is_absolute(written) && !(nested && f->hook))
		return (*name = canonical(f->arena, "", written)) ? 0 : -ENOMEM;
	int c = search(f, written, nested, name, &found);
	if (c || found || !windows)
		return c;
	char *turned = arena_strdup(f->arena, written);
	if (!turned)
		return -ENOMEM;
	for (char *p = turned; *p; p++)
		*p = *p == '\\' ? '/' : *p;
	const char *other;
	c = search(f, turned, nested, &other, &found);
	if (!c && found)
		*name = other;
	return c;
}
