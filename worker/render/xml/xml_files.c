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
static const char *make_canonical_name(struct arena *arena, const char *folder, const char *name)
{
	size_t n = strlen(folder), size = n + 1 + strlen(name);
	char *joined = arena_alloc(arena, size + 1, 1), *out = arena_alloc(arena, ASSET_NAME_SIZE_MAX(size), 1);
	if (!joined || !out)
		return NULL;
	snprintf(joined, size + 1, "%s%s%s", folder, n ? "/" : "", name);
	asset_name_canonicalize(joined, out);
	return out;
}

static bool leads_outside(const char *canonical_name)
{
	const char *rest;
	return asset_name_levels_up(canonical_name, &rest) > 0;
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
static const char *search_folder(const struct xml_files *f, const char *folder, const char *written, bool *found)
{
	const char *candidate = make_canonical_name(f->arena, folder, written);
	*found = candidate && try_open(f, candidate) == 0;
	return candidate;
}

/* Searches as Mitsuba 3 does: beside the file that names it, then beside the one that includes that file, and so on;
 * the scene's own folder comes last. If the name leads out of the scene's folder and is not found, *name becomes the
 * first place tried, for the message. */
static int search_including_folders(const struct xml_files *f, const char *written, const char **name, bool *found)
{
	const char *file = f->naming_file;
	bool use_candidate = leads_outside(*name);
	for (const struct xml_element *include = f->include; include && !*found;) {
		const char *end = strrchr(file, '/');
		char *folder = arena_strdup(f->arena, end ? file : "");
		if (folder && end)
			folder[end - file] = 0;
		const char *candidate = folder ? search_folder(f, folder, written, found) : NULL;
		if (!candidate)
			return -ENOMEM;
		if (*found || use_candidate)
			*name = candidate;
		use_candidate = false;
		file = include->file;
		do
			include = include->parent;
		while (include && strcmp(include->name, "include") != 0);
	}
	return 0;
}

/* Searches the folders of <path>, the last one first, as in Mitsuba 3. If the file is in no folder that may be read
 * but perhaps in one that may not, *name becomes its path there: opening it fails with the --path that would allow
 * it. */
static int search_path_folders(const struct xml_files *f, const char *written, const char **name, bool *found)
{
	const char *outside_candidate = NULL;
	for (uint32_t i = f->path_count; i-- > 0 && !*found;) {
		const char *candidate = make_canonical_name(f->arena, f->search_paths[i], written);
		if (!candidate)
			return -ENOMEM;
		int rc = try_open(f, candidate);
		*found = rc == 0;
		*name = *found ? candidate : *name;
		outside_candidate =
			!outside_candidate && rc == -EINVAL && leads_outside(candidate) ? candidate : outside_candidate;
	}
	if (!*found && outside_candidate && try_open(f, *name) != 0)
		*name = outside_candidate;
	return 0;
}

/* For the path of a file on another machine: looks for the longest end of it that is a file in the scene's folder. */
static int search_by_suffix(const struct xml_files *f, const char *written, const char **name, bool *found)
{
	for (const char *suffix = strchr(written, '/'); suffix && !*found; suffix = strchr(suffix, '/')) {
		suffix += strspn(suffix, "/");
		const char *candidate = *suffix ? search_folder(f, "", suffix, found) : written;
		if (!candidate)
			return -ENOMEM;
		*name = *found ? candidate : *name;
	}
	return 0;
}

static bool is_absolute(const char *written)
{
	bool starts_with_letter = (*written >= 'a' && *written <= 'z') || (*written >= 'A' && *written <= 'Z');
	return *written == '/' || (starts_with_letter && written[1] == ':' && written[2] == '/');
}

/* Finds the first folder that has the file, and stores whether there is one. */
static int search_all(struct xml_files *f, const char *written, bool nested, const char **name, bool *found)
{
	*found = false;
	const char *scene_name = *name = make_canonical_name(f->arena, "", written);
	bool is_relative = !is_absolute(written);
	if (!scene_name || (nested && is_relative && search_including_folders(f, written, name, found)) ||
	    (is_relative && !*found && search_path_folders(f, written, name, found)))
		return -ENOMEM;
	if (*found)
		return 0;
	int rc = try_open(f, scene_name);
	*found = rc == 0;
	*name = *found ? scene_name : *name;
	if (rc == 0 || rc == -EINVAL || is_relative)
		return 0;
	if (search_by_suffix(f, written, name, found))
		return -ENOMEM;
	f->found_by_suffix = *found ? *name : f->found_by_suffix;
	return 0;
}

int xml_files_find(struct xml_files *f, const char **name, bool nested)
{
	bool found = false, has_backslash = strchr(*name, '\\') != NULL;
	const char *written = *name;
	f->found_by_suffix = NULL;
	if (f->path_count == 0 && !has_backslash && !is_absolute(written) && !(nested && f->include))
		return (*name = make_canonical_name(f->arena, "", written)) ? 0 : -ENOMEM;
	int c = search_all(f, written, nested, name, &found);
	if (c || found || !has_backslash)
		return c;
	char *slashed = arena_strdup(f->arena, written);
	if (!slashed)
		return -ENOMEM;
	for (char *p = slashed; *p; p++)
		*p = *p == '\\' ? '/' : *p;
	const char *slashed_name;
	c = search_all(f, slashed, nested, &slashed_name, &found);
	if (!c && found)
		*name = slashed_name;
	return c;
}
