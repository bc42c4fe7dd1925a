/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Looks for a file where Mitsuba does: in the folders of the file that names it and of those that include this one, in
 * those of <path>, in the scene's folder. At last, only here, it is looked for by the end of its path. Files are opened
 * to see whether they are there, and closed again.
 *
 * Failure: -ENOMEM only. A file that is nowhere is reported by whoever opens it.
 */
#include "worker/render/xml/xml_files.h"

#include "worker/render/asset/asset_name.h"

#include <stdio.h>
#include <string.h>

/* FOLDER/NAME, or NAME alone. NULL: out of memory. */
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

/* 0, or why it cannot be opened: -EINVAL where it leads out of the folders that may be read. */
static int try_open(const struct xml_files *f, const char *name)
{
	struct asset a;
	struct error ignored;
	int rc = f->assets->open(f->assets->user, name, &a, &ignored);
	if (!rc)
		f->assets->close(f->assets->user, &a);
	return rc;
}

/* What the file is called in that folder; *found: whether it is there. NULL: out of memory. */
static const char *look_in(const struct xml_files *f, const char *folder, const char *written, bool *found)
{
	const char *there = canonical(f->arena, folder, written);
	*found = there && try_open(f, there) == 0;
	return there;
}

/* As in Mitsuba 3: in the folder of the file that names it, in that of the one which includes this, and so on; the
 * scene's own folder comes after them. A name that leads out of the scene's folder is complained of as it is in the
 * first of them. */
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

/* In the folders of <path>, the last one first, as in Mitsuba 3. If the file is in none that may be read, *name is its
 * path in one that may not: opening it fails, with the --path that would allow it. */
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

/* The path of a file on another machine: the longest end of it that is a name in the scene's folder. */
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

/* The first of the folders that has the file; *found: whether one has. */
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
