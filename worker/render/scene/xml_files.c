/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Looks for a file where Mitsuba does: around the files that include the one which names it, in the scene's folder, and
 * in those of <path>. Files are opened to see whether they are there, and closed again.
 *
 * Failure: -ENOMEM only. A file that is nowhere is reported by whoever opens it.
 */
#include "worker/render/scene/xml_files.h"

#include "worker/render/scene/asset_name.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

const char *xml_files_canonical(struct arena *arena, const char *folder, const char *name)
{
	size_t n = strlen(folder), size = n + 1 + strlen(name);
	char *joined = arena_alloc(arena, size + 1, 1), *out = arena_alloc(arena, ASSET_NAME_ROOM(size), 1);
	if (!joined || !out)
		return NULL;
	snprintf(joined, size + 1, "%s%s%s", folder, n ? "/" : "", name);
	asset_name_canonical(joined, out);
	return out;
}

bool xml_files_leads_out(const char *canonical_name)
{
	const char *rest;
	return asset_name_up(canonical_name, &rest) > 0;
}

static bool is_there(const struct xml_files *f, const char *name)
{
	struct asset a;
	struct error ignored;
	if (f->assets->open(f->assets->user, name, &a, &ignored))
		return false;
	f->assets->close(f->assets->user, &a);
	return true;
}

/* What the file is called in that folder; *found: whether it is there. NULL: out of memory. */
static const char *look_in(const struct xml_files *f, const char *folder, const char *written, bool *found)
{
	const char *there = xml_files_canonical(f->arena, folder, written);
	*found = there && is_there(f, there);
	return there;
}

/* As in Mitsuba 3: in the folder of the file that names it, in that of the one which includes this, and so on; the
 * scene's own folder comes after them. A name that leads out of the scene's folder is complained of as it is in the
 * first of them. */
static int look_around(const struct xml_files *f, const char *written, const char **name, bool *found)
{
	const char *file = f->file;
	bool instead = xml_files_leads_out(*name);
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

/* The first of the folders that has the file; *found: whether one has. */
static int search(const struct xml_files *f, const char *written, bool nested, const char **name, bool *found)
{
	*found = false;
	const char *own = *name = xml_files_canonical(f->arena, "", written);
	if (!own || (nested && *written != '/' && look_around(f, written, name, found)))
		return -ENOMEM;
	if (!*found && is_there(f, own)) {
		*name = own;
		*found = true;
	}
	for (uint32_t i = 0; *written != '/' && i < f->path_count && !*found; i++) {
		const char *there = look_in(f, f->paths[i], written, found);
		if (!there)
			return -ENOMEM;
		*name = *found ? there : *name;
	}
	return 0;
}

int xml_files_find(const struct xml_files *f, const char **name, bool nested)
{
	bool found = false, windows = strchr(*name, '\\') != NULL;
	const char *written = *name;
	if (f->path_count == 0 && !windows && !(nested && f->hook))
		return (*name = xml_files_canonical(f->arena, "", written)) ? 0 : -ENOMEM;
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
