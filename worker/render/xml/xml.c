/* SPDX-License-Identifier: Apache-2.0 */
/*
 * expat calls on_start and on_end. open_element puts each element into the arena with its attributes, with $names
 * replaced and files searched along the paths. An <include> is replaced by the contents of its file, which is read at
 * the include's end tag. Nothing is interpreted here.
 *
 * Failures stop the parser at once, with file and line: errors of expat, a document type with declarations, and depth,
 * counts and sizes beyond the limits in xml.h. If a file is not well formed, what comes before the mistake is kept and
 * the error goes into the list of missing things, so that the same run also finds the problems of the rest.
 */
#include "worker/render/xml/xml.h"

#include "common/base/mem.h"
#include "worker/render/asset/asset_name.h"
#include "worker/render/xml/element_make.h"
#include "worker/render/text/number.h"
#include "worker/render/xml/upgrade.h"
#include "worker/render/xml/version.h"
#include "worker/render/xml/xml_files.h"
#include "worker/render/xml/xml_tidy.h"

#include <expat.h>

#include <stdio.h>
#include <string.h>

struct reader {
	struct xml_tree *tree;
	const struct asset_source *assets;
	struct arena *arena;
	struct define_table defines;
	struct error *error;
	int error_code;			 /* the first error's negative errno */
	int include_depth;		 /* number of files that include the current one, one inside another */
	size_t total_bytes;		 /* total size of the files read so far */
	bool has_noted_mixed_dialects;	 /* noted that the files are of both dialects */
	bool has_noted_upgrade;		 /* noted that a file is from before 0.4 */
	bool has_noted_text;		 /* noted that text is ignored */
	bool has_noted_trailing_content; /* noted that what follows a file's first element is ignored */
	bool has_noted_found_by_suffix;	 /* noted that a file was found by the end of its path */
	bool is_malformed;		 /* the last file read is not well formed */
	/* the current file */
	XML_Parser parser;
	const char *file;
	struct xml_element *file_root; /* the file's <scene> */
	struct xml_element *current;   /* innermost open element */
	struct xml_element *include;   /* the <include> element that the file replaces; NULL for the main file */
	int depth;
	const char *newer_version_note; /* the note that a file is of an unknown version */
	int upgrade_minor;		/* minor version of a file before 0.5; otherwise -1 */
	bool is_camel_case;
};

/* expat's realloc does not pass the old size, so the size is stored in front of each block. */
union block_header {
	size_t size;
	max_align_t align;
};

static void *expat_alloc(size_t size)
{
	if (size > SIZE_MAX - sizeof(union block_header))
		return NULL;
	union block_header *h = mem_alloc(1, sizeof *h + size);
	if (!h)
		return NULL;
	h->size = size;
	return h + 1;
}

static void expat_free(void *p)
{
	if (p)
		mem_free((union block_header *)p - 1);
}

static void *expat_realloc(void *p, size_t size)
{
	if (!p)
		return expat_alloc(size);
	if (size > SIZE_MAX - sizeof(union block_header))
		return NULL;
	union block_header *h = (union block_header *)p - 1;
	h = mem_grow(h, sizeof *h + h->size, sizeof *h + size);
	if (!h)
		return NULL;
	h->size = size;
	return h + 1;
}

static const XML_Memory_Handling_Suite expat_memory = {expat_alloc, expat_realloc, expat_free};

/* Returns whether an element has no meaning here: it is marked ignored, with everything inside. */
static bool is_meaningless_element(const char *element)
{
	/* Final or preview mode, objects hidden by an editor, settings of another renderer. */
	return !strcmp(element, "mode") || !strcmp(element, "hide") || !strcmp(element, "dpt");
}

static void stop_parser(struct reader *r, int code)
{
	if (!r->error_code)
		r->error_code = code;
	XML_StopParser(r->parser, XML_FALSE);
}

static int current_line(const struct reader *r)
{
#if XML_MAJOR_VERSION > 2 || XML_MINOR_VERSION >= 9 /* which deprecates the other */
	return (int)XML_GetCurrentLineNumber64(r->parser);
#else
	return (int)XML_GetCurrentLineNumber(r->parser);
#endif
}

static int out_of_memory(struct reader *r)
{
	return error_set(r->error, ENOMEM, "%s:%d: out of memory, or the scene files take more than %d MB of it",
			 r->file, current_line(r), XML_MEMORY_MAX >> 20);
}

/* Adds the error to the list of missing things: all undefined names and all missing files are reported. */
static int note_missing(struct reader *r)
{
	const char *text = arena_strdup(r->arena, r->error->text);
	if (!text)
		return out_of_memory(r);
	r->tree->missing[r->tree->missing_count++] = text;
	return 0;
}

static int copy_attributes(struct reader *r, struct xml_element *el, const char **expat_attributes)
{
	size_t n = 0;
	while (expat_attributes[2 * n])
		n++;
	if (n > XML_ATTRIBUTES_MAX)
		return xml_error(el, r->error, E2BIG, "more than %d attributes", XML_ATTRIBUTES_MAX);
	struct xml_attribute *a = arena_alloc(r->arena, n, sizeof *a);
	if (!a)
		return out_of_memory(r);
	for (size_t i = 0; i < n; i++) {
		const char *value = expat_attributes[2 * i + 1];
		a[i].name = arena_strdup(r->arena, expat_attributes[2 * i]);
		if (!a[i].name)
			return out_of_memory(r);
		if (strlen(value) > XML_VALUE_MAX)
			return xml_error(el, r->error, E2BIG, "a value of more than %d bytes", XML_VALUE_MAX);
		int c = 0;
		if (el->is_ignored || !strchr(value, '$'))
			a[i].value = arena_strdup(r->arena, value);
		else /* Mitsuba 0.6 writes $scene['memUsage'] and the like as labels into images */
			c = define_substitute(&r->defines, value, r->is_camel_case && strchr(value, '['), XML_VALUE_MAX,
					      &a[i].value, r->error);
		if (c == -ENOENT || c == -EEXIST) {
			if (c == -ENOENT)
				error_prefix(r->error, c, "%s:%d: <%.64s>: attribute `%.64s`", el->file, el->line,
					     el->name, a[i].name);
			c = c == -ENOENT ? note_missing(r) : 0;
			el->is_unset = true;
			a[i].value = arena_strdup(r->arena, value);
		} else if (c) {
			error_prefix(r->error, c, "%s:%d: <%.64s>: attribute `%.64s`", el->file, el->line, el->name,
				     a[i].name);
		}
		if (c)
			return c;
		if (!a[i].value)
			return out_of_memory(r);
		el->attributes = a;
		el->attribute_count = (uint32_t)i + 1;
	}
	return 0;
}

/* Mitsuba accepts type, id and name on <scene>, where they have no effect; XML editors add namespaces. */
static bool is_meaningless_attribute(const char *attribute)
{
	return !strcmp(attribute, "type") || !strcmp(attribute, "id") || !strcmp(attribute, "name") ||
	       !strcmp(attribute, "xmlns") || strchr(attribute, ':');
}

static void drop_meaningless_attributes(struct xml_element *scene)
{
	uint32_t kept = 0;
	for (uint32_t i = 0; i < scene->attribute_count; i++)
		if (!is_meaningless_attribute(scene->attributes[i].name))
			scene->attributes[kept++] = scene->attributes[i];
	scene->attribute_count = kept;
}

static int refuse_without_version(const struct reader *r, const struct xml_element *el)
{
	return xml_error(el, r->error, EINVAL, "needs a version, such as version=\"0.6.0\" or version=\"3.0.0\"");
}

/* A file without a version is read as one from before 0.3, and checked at its end; so are files that it includes. */
static const char *file_version(const struct reader *r, const struct xml_element *el)
{
	const char *version = xml_attribute_value(el, "version");
	bool is_unversioned = !version && strcmp(el->name, "scene") == 0 &&
			      (!r->include || !xml_attribute_value(r->tree->root, "version"));
	return is_unversioned ? "0.2" : version;
}

/* Selects the file's dialect by its version. An included file may hold a single object instead of a <scene>. */
static int begin_file(struct reader *r, struct xml_element *el)
{
	if (!el->parent && strcmp(el->name, "scene") != 0)
		return xml_error(el, r->error, EINVAL, "a scene file must begin with <scene version=\"...\">");
	if (strcmp(el->name, "scene") == 0)
		drop_meaningless_attributes(el);
	const char *version = file_version(r, el);
	int64_t major, minor;
	if (!version || !version_parse(version, &major, &minor))
		return refuse_without_version(r, el);
	r->upgrade_minor = major == 0 && minor >= 0 && minor < 5 ? (int)minor : -1;
	if (r->upgrade_minor >= 0 && r->upgrade_minor < 4 && !r->has_noted_upgrade &&
	    r->tree->note_count < XML_NOTES_MAX) {
		r->has_noted_upgrade = true;
		r->tree->notes[r->tree->note_count++] =
			"is of a version before 0.4: read as by Mitsuba 0.5, which mirrors the cameras of such files";
	}
	if (!r->newer_version_note && r->tree->note_count < XML_NOTES_MAX &&
	    (r->newer_version_note = version_newer_note(el, major, r->arena)))
		r->tree->notes[r->tree->note_count++] = r->newer_version_note;
	r->is_camel_case = major < 2;
	bool dialect_3 = major >= 2;
	if (el->parent && !r->has_noted_mixed_dialects && r->tree->is_dialect_3 != dialect_3 &&
	    r->tree->note_count < XML_NOTES_MAX) {
		r->has_noted_mixed_dialects = true;
		r->tree->notes[r->tree->note_count++] =
			"includes a file of another dialect; everything is read as by Mitsuba 3, with the old names in "
			"the old files";
	}
	r->tree->has_black_backs |= dialect_3;
	r->tree->is_dialect_3 |= dialect_3; /* 3.x reads older files, but 0.6 does not read newer ones */
	return 0;
}

/* Selects the names of an object: from 2.x on, it may have a version of its own. */
static int begin_object(struct reader *r, struct xml_element *el)
{
	el->is_camel_case = r->is_camel_case || (el != r->file_root && el->parent->is_camel_case);
	const char *version = xml_attribute_value(el, "version");
	if (el == r->file_root || !version || !r->tree->is_dialect_3 || el->is_ignored || el->is_unset)
		return 0;
	int64_t major, minor;
	if (!version_parse(version, &major, &minor))
		return xml_error(el, r->error, EINVAL, "version=\"%.64s\" is not one of Mitsuba's", version);
	el->is_camel_case |= major < 2;
	return 0;
}

static int read_default(struct reader *r, const struct xml_element *el)
{
	const char *name = xml_attribute_value(el, "name"), *value = xml_attribute_value(el, "value");
	if (!name || !value)
		return xml_error(el, r->error, EINVAL, "needs name and value");
	if (el->is_unset && strchr(name, '$'))
		return 0;
	int c = el->is_unset ? define_add_valueless(&r->defines, name, r->error)
			     : define_add_default(&r->defines, name, value, r->error);
	return c ? error_prefix(r->error, c, "%s:%d: <default>", el->file, el->line) : 0;
}

/* Adds a folder. Files named after this element are searched for there before the scene's own folder. */
static int read_path(struct reader *r, const struct xml_element *el)
{
	const char *value = xml_attribute_value(el, "value");
	if (!value)
		return xml_error(el, r->error, EINVAL, "needs a value: the name of a folder");
	r->tree->has_unset_path |= el->is_unset;
	if (el->is_unset)
		return 0;
	if (r->tree->path_count == XML_PATHS_MAX)
		return xml_error(el, r->error, E2BIG, "more than %d search paths", XML_PATHS_MAX);
	r->tree->search_paths[r->tree->path_count++] = value;
	return 0;
}

/* Notes that a file was found by the end of its path, once per scene: there are often hundreds of such paths. */
static int note_found_by_suffix(struct reader *r, const char *written, const char *name)
{
	if (!name || r->has_noted_found_by_suffix || r->tree->note_count == XML_NOTES_MAX)
		return 0;
	enum { TEXT = 512 };
	char *text = arena_alloc(r->arena, TEXT, 1), display_name[160];
	if (!text)
		return out_of_memory(r);
	snprintf(
		text, TEXT,
		"paths of files that are not on this machine are looked for by their ends in the scene's folder and those of "
		"--path: for example, %.160s is used for %.160s",
		asset_name_display(name, display_name, sizeof display_name), written);
	r->tree->notes[r->tree->note_count++] = text;
	r->has_noted_found_by_suffix = true;
	return 0;
}

/* Finds the files named by <include filename>, <spectrum filename> and <string name="filename" value>. The last is for
 * a plug-in; as Mitsuba's do not know which scene file names it, it is not looked for beside that file. */
static int find_files(struct reader *r, struct xml_element *el)
{
	const char *parameter_name = xml_attribute_value(el, "name");
	bool is_plugin_file =
		strcmp(el->name, "string") == 0 && parameter_name && strcmp(parameter_name, "filename") == 0;
	struct xml_files files = {.assets = r->assets,
				  .arena = r->arena,
				  .naming_file = r->file,
				  .include = r->include,
				  .search_paths = r->tree->search_paths,
				  .path_count = r->tree->path_count};
	for (uint32_t i = 0; i < el->attribute_count; i++) {
		const char *written = el->attributes[i].value;
		if (strcmp(el->attributes[i].name, is_plugin_file ? "value" : "filename") != 0)
			continue;
		if (xml_files_find(&files, &el->attributes[i].value, !is_plugin_file))
			return out_of_memory(r);
		int c = note_found_by_suffix(r, written, files.found_by_suffix);
		if (c)
			return c;
	}
	return 0;
}

static int open_element(struct reader *r, const char *name, const char **attributes)
{
	if (r->depth >= XML_DEPTH_MAX)
		return error_set(r->error, E2BIG, "%s:%d: <%.64s>: elements are nested more than %d deep", r->file,
				 current_line(r), name, XML_DEPTH_MAX);
	if (r->tree->element_count >= XML_ELEMENTS_MAX)
		return error_set(r->error, E2BIG, "%s:%d: more than %d elements", r->file, current_line(r),
				 XML_ELEMENTS_MAX);
	struct xml_element *el = arena_alloc(r->arena, 1, sizeof *el);
	if (!el)
		return out_of_memory(r);
	r->tree->element_count++;
	el->name = arena_strdup(r->arena, name);
	if (!el->name)
		return out_of_memory(r);
	el->file = r->file;
	el->line = current_line(r);
	el->parent = r->current ? r->current : r->include;
	el->is_ignored = is_meaningless_element(name) || (el->parent && el->parent->is_ignored);
	int c = copy_attributes(r, el, attributes);
	if (!c && !r->current) {
		r->file_root = el;
		c = begin_file(r, el);
	}
	if (!c)
		c = begin_object(r, el);
	if (!c && el->parent)
		element_append(el->parent, el);
	else if (!c)
		r->tree->root = el;
	if (!c && !el->is_ignored)
		c = find_files(r, el);
	if (!c && !el->is_ignored && strcmp(name, "default") == 0)
		c = read_default(r, el);
	if (!c && !el->is_ignored && strcmp(name, "path") == 0)
		c = read_path(r, el);
	r->current = el;
	r->depth++;
	return c;
}

static int read_file(struct reader *r, const char *name);

/* Marks an element that is still open where a file breaks off. An open <include> has not been read yet. */
static void mark_incomplete(struct xml_element *el)
{
	el->is_rejected = true;
	el->is_unset |= strcmp(el->name, "include") == 0;
}

/* Returns whether the part before the mistake of a file that is not well formed can be used. Elements that are still
 * open there are incomplete and are not interpreted. */
static bool keep_well_formed_part(struct reader *r)
{
	if (!r->file_root || r->upgrade_minor >= 0 || !xml_attribute_value(r->file_root, "version"))
		return false;
	for (struct xml_element *el = r->current; el && el != r->file_root; el = el->parent)
		mark_incomplete(el);
	mark_incomplete(r->file_root);
	return true;
}

/* Replaces an <include> inside an object by the object in its file. */
static int replace_by_included(struct xml_element *el, struct error *e)
{
	const struct xml_element include = *el;
	if (strcmp(el->first_child->name, "scene") == 0)
		return xml_error(el, e, EINVAL, "a file with a <scene> can only be included directly in <scene>");
	*el = *el->first_child;
	el->parent = include.parent;
	el->next_sibling = include.next_sibling;
	for (struct xml_element *c = el->first_child; c; c = c->next_sibling)
		c->parent = el;
	uint32_t kept = 0;
	for (uint32_t i = 0; i < el->attribute_count; i++)
		if (strcmp(el->attributes[i].name, "version") != 0)
			el->attributes[kept++] = el->attributes[i];
	el->attribute_count = kept;
	return 0;
}

static int read_include(struct reader *r, struct xml_element *el)
{
	bool in_scene = el->parent == r->file_root && strcmp(r->file_root->name, "scene") == 0;
	const char *name = xml_attribute_value(el, "filename");
	if (!name)
		return xml_error(el, r->error, EINVAL, "needs filename");
	if (!in_scene && r->upgrade_minor >= 0)
		return xml_error(el, r->error, EINVAL, "in files before 0.5 it must be directly in <scene>");
	int c = in_scene ? 0 : element_check_contents(el, "filename", false, r->error);
	if (c)
		return c;
	if (el->is_unset) { /* has been noted */
		r->tree->has_missing_files = r->defines.is_incomplete = true;
		return 0;
	}
	if (r->include_depth >= XML_INCLUDE_DEPTH_MAX)
		return xml_error(el, r->error, ELOOP, "files include each other more than %d deep",
				 XML_INCLUDE_DEPTH_MAX);
	if (r->tree->include_count >= XML_FILES_MAX)
		return xml_error(el, r->error, E2BIG, "more than %d files are included", XML_FILES_MAX);
	r->tree->included_files[r->tree->include_count++] = name;
	struct reader outer = *r;
	r->parser = NULL;
	r->file_root = r->current = NULL;
	r->include = el;
	r->depth = in_scene ? 0 : outer.depth;
	r->include_depth++;
	c = read_file(r, name);
	if (c && r->file == outer.file)
		c = error_prefix(r->error, c, "%s:%d: <include>", el->file, el->line);
	bool is_unopened = r->file == outer.file, is_missing = c && c != -ENOMEM && (is_unopened || r->is_malformed) &&
							       r->tree->missing_count < XML_MISSING_MAX;
	if (is_missing)
		c = note_missing(r);
	el->is_unset = is_missing && (is_unopened || !in_scene || !keep_well_formed_part(r));
	if (el->is_unset)
		el->first_child = el->last_child = NULL;
	if (!c && !in_scene && !is_missing)
		c = replace_by_included(el, r->error);
	outer.error_code = r->error_code;
	outer.has_noted_mixed_dialects = r->has_noted_mixed_dialects;
	outer.has_noted_upgrade = r->has_noted_upgrade;
	outer.has_noted_found_by_suffix = r->has_noted_found_by_suffix;
	outer.has_noted_text = r->has_noted_text;
	outer.has_noted_trailing_content = r->has_noted_trailing_content;
	outer.total_bytes = r->total_bytes;
	outer.defines = r->defines;
	outer.defines.is_incomplete |= is_missing;
	outer.tree->has_missing_files |= is_missing;
	outer.tree->include_count -= is_missing && is_unopened;
	*r = outer;
	return c;
}

static void on_start(void *user, const char *name, const char **attributes)
{
	struct reader *r = user;
	if (r->error_code)
		return;
	int c = open_element(r, name, attributes);
	if (c)
		stop_parser(r, c);
}

/* Notes text between elements, most often a stray character: once per scene, since Mitsuba ignores it silently. */
static int note_text(struct reader *r, const struct xml_element *el)
{
	if (!el->has_text || el->is_ignored || r->has_noted_text || r->tree->note_count == XML_NOTES_MAX)
		return 0;
	enum { TEXT = 160 };
	char *text = arena_alloc(r->arena, TEXT, 1);
	if (!text)
		return out_of_memory(r);
	snprintf(text, TEXT, "text in <%.64s> of line %d is ignored, as by Mitsuba", el->name, el->line);
	r->tree->notes[r->tree->note_count++] = text;
	r->has_noted_text = true;
	return 0;
}

static void on_end(void *user, const char *name)
{
	struct reader *r = user;
	if (r->error_code)
		return;
	struct xml_element *el = r->current;
	int c = note_text(r, el);
	if (!c && !el->is_ignored && strcmp(name, "include") == 0)
		c = el->first_child ? xml_error(el, r->error, EINVAL, "must be empty") : read_include(r, el);
	if (!c && el == r->file_root && !r->include && !xml_attribute_value(el, "version") &&
	    !upgrade_is_before_0_3(el))
		c = refuse_without_version(r, el);
	if (!c && el == r->file_root && r->upgrade_minor >= 0)
		c = upgrade_file(el, r->upgrade_minor, r->arena, r->error);
	r->depth--;
	r->current = el == r->file_root ? NULL : el->parent;
	if (c)
		stop_parser(r, c);
}

static void on_text(void *user, const char *text, int length)
{
	struct reader *r = user;
	for (int i = 0; i < length && r->current; i++)
		if (!number_is_blank(text[i]))
			r->current->has_text = true;
}

/* A DOCTYPE without declarations has no effect: the file that it names is never opened. */
static void on_doctype(void *user, const char *name, const char *system, const char *public_id, int has_subset)
{
	(void)name, (void)system, (void)public_id;
	struct reader *r = user;
	if (!r->error_code && has_subset)
		stop_parser(r, error_set(r->error, EINVAL,
					 "%s:%d: <!DOCTYPE>: scene files must not declare elements or entities",
					 r->file, current_line(r)));
}

/* Mitsuba 3 reads the first element of a file and nothing after it. */
static bool accept_trailing_content(struct reader *r, enum XML_Error code)
{
	if (code != XML_ERROR_JUNK_AFTER_DOC_ELEMENT || r->is_camel_case)
		return false;
	enum { TEXT = 256 };
	char *text = r->has_noted_trailing_content || r->tree->note_count == XML_NOTES_MAX
			     ? NULL
			     : arena_alloc(r->arena, TEXT, 1);
	if (text) {
		snprintf(text, TEXT, "what follows the first element of %.160s is ignored, as by Mitsuba 3", r->file);
		r->tree->notes[r->tree->note_count++] = text;
		r->has_noted_trailing_content = true;
	}
	return true;
}

/* Returns whether the file is not XML at all, but perhaps another program's scene, a mesh or an image. */
static bool is_not_xml(const struct asset *a)
{
	const unsigned char *text = a->bytes;
	size_t offset = 0;
	while (offset < a->size && number_is_blank((char)text[offset]))
		offset++;
	return offset < a->size && strchr("<\xef\xfe\xff", text[offset]) == NULL;
}

static int parse_bytes(struct reader *r, const struct asset *a)
{
	if (a->size > XML_FILE_MAX)
		return error_set(r->error, EFBIG, "%s: a scene file of more than %d MB", r->file, XML_FILE_MAX >> 20);
	r->total_bytes += a->size;
	if (r->total_bytes > XML_TOTAL_BYTES_MAX)
		return error_set(r->error, EFBIG, "%s: the included files have more than %d MB in total", r->file,
				 XML_TOTAL_BYTES_MAX >> 20);
	r->parser = XML_ParserCreate_MM(NULL, &expat_memory, NULL);
	if (!r->parser)
		return error_set(r->error, ENOMEM, "%s: out of memory", r->file);
	XML_SetUserData(r->parser, r);
	XML_SetElementHandler(r->parser, on_start, on_end);
	XML_SetCharacterDataHandler(r->parser, on_text);
	XML_SetStartDoctypeDeclHandler(r->parser, on_doctype);
	XML_Parser parser = r->parser;
	size_t size = a->size;
	char *text = xml_tidy(a->bytes, &size);
	if (!text) {
		XML_ParserFree(parser);
		return error_set(r->error, ENOMEM, "%s: out of memory", r->file);
	}
	enum XML_Status status = XML_Parse(parser, text, (int)size, XML_TRUE);
	mem_free(text);
	int c = r->error_code;
	enum XML_Error code = XML_GetErrorCode(parser);
	bool is_complete = status == XML_STATUS_OK || (!c && accept_trailing_content(r, code));
	if (!c && !is_complete && code == XML_ERROR_NO_ELEMENTS) {
		c = r->current ? error_set(r->error, EINVAL, "%s:%d: the file ends before </%.64s>", r->file,
					   current_line(r), r->current->name)
			       : error_set(r->error, EINVAL, "%s: the file is empty", r->file);
	} else if (!c && !is_complete && is_not_xml(a)) {
		c = error_set(r->error, EINVAL, "%s: this is neither Mitsuba's XML nor a glTF file (.gltf, .glb)",
			      r->file);
	} else if (!c && !is_complete) {
		c = error_set(r->error, code == XML_ERROR_NO_MEMORY ? ENOMEM : EINVAL, "%s:%d: %s%s%.64s%s", r->file,
			      current_line(r), XML_ErrorString(code), r->current ? " in <" : "",
			      r->current ? r->current->name : "", r->current ? ">" : "");
	}
	r->is_malformed = c == -EINVAL && !r->error_code;
	XML_ParserFree(parser);
	return c;
}

static int read_file(struct reader *r, const char *name)
{
	struct asset a;
	int c = r->assets->open(r->assets->user, name, &a, r->error);
	if (c)
		return c;
	char *display_name = arena_alloc(r->arena, strlen(name) + 1, 1);
	r->file = display_name ? asset_name_display(name, display_name, strlen(name) + 1) : name;
	c = parse_bytes(r, &a);
	r->assets->close(r->assets->user, &a);
	return c;
}

int xml_read(struct xml_tree *t, const struct asset_source *assets, const char *name,
	     const struct scene_define *defines, size_t define_count, struct arena *arena, struct error *e)
{
	*t = (struct xml_tree){0};
	struct reader r = {.tree = t, .assets = assets, .arena = arena, .error = e};
	int c = define_init(&r.defines, defines, define_count, arena, e);
	if (c)
		return c;
	const char *file = arena_strdup(arena, name);
	if (!file)
		return error_set(e, ENOMEM, "out of memory");
	c = read_file(&r, file);
	if (c == -ENOENT && !r.file)
		return error_set(e, ENOENT, "%s: %s", file, strerror(ENOENT));
	if (c && r.is_malformed && t->missing_count < XML_MISSING_MAX && keep_well_formed_part(&r)) {
		t->has_missing_files = true;
		c = note_missing(&r);
	}
	return c || t->missing_count ? c : define_check_used(&r.defines, e);
}
