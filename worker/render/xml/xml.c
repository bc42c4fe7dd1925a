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
	int failed;    /* the first error's negative errno */
	int includes;  /* number of files that include the current one, one inside another */
	size_t bytes;  /* total size of the files read so far */
	bool mixed;    /* noted that the files are of both dialects */
	bool upgraded; /* noted that a file is from before 0.4 */
	bool worded;   /* noted that text is ignored */
	bool cut;      /* noted that what follows a file's first element is ignored */
	bool by_end;   /* noted that a file was found by the end of its path */
	bool broken;   /* the last file read is not well formed */
	/* the current file */
	XML_Parser parser;
	const char *file;
	struct xml_element *top;     /* the file's <scene> */
	struct xml_element *current; /* innermost open element */
	struct xml_element *hook;    /* the <include> element that the file replaces; NULL for the main file */
	int depth;
	const char *newer; /* the note that a file is of an unknown version */
	int minor;	   /* minor version of a file before 0.5; otherwise -1 */
	bool snake;
};

/* expat's realloc does not pass the old size, so the size is stored in front of each block. */
union header {
	size_t size;
	max_align_t align;
};

static void *expat_alloc(size_t size)
{
	if (size > SIZE_MAX - sizeof(union header))
		return NULL;
	union header *h = mem_alloc(1, sizeof *h + size);
	if (!h)
		return NULL;
	h->size = size;
	return h + 1;
}

static void expat_free(void *p)
{
	if (p)
		mem_free((union header *)p - 1);
}

static void *expat_realloc(void *p, size_t size)
{
	if (!p)
		return expat_alloc(size);
	if (size > SIZE_MAX - sizeof(union header))
		return NULL;
	union header *h = (union header *)p - 1;
	h = mem_grow(h, sizeof *h + h->size, sizeof *h + size);
	if (!h)
		return NULL;
	h->size = size;
	return h + 1;
}

static const XML_Memory_Handling_Suite expat_memory = {expat_alloc, expat_realloc, expat_free};

/* Returns whether an element has no meaning here: it is marked ignored, with everything inside. */
static bool xml_is_foreign(const char *element)
{
	/* Final or preview mode, objects hidden by an editor, settings of another renderer. */
	return !strcmp(element, "mode") || !strcmp(element, "hide") || !strcmp(element, "dpt");
}

static void stop(struct reader *r, int code)
{
	if (!r->failed)
		r->failed = code;
	XML_StopParser(r->parser, XML_FALSE);
}

static int line_now(const struct reader *r)
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
			 r->file, line_now(r), XML_MEMORY_MAX >> 20);
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

static int copy_attributes(struct reader *r, struct xml_element *el, const char **given)
{
	size_t n = 0;
	while (given[2 * n])
		n++;
	if (n > XML_ATTRIBUTES_MAX)
		return xml_error(el, r->error, E2BIG, "more than %d attributes", XML_ATTRIBUTES_MAX);
	struct xml_attribute *a = arena_alloc(r->arena, n, sizeof *a);
	if (!a)
		return out_of_memory(r);
	for (size_t i = 0; i < n; i++) {
		const char *value = given[2 * i + 1];
		a[i].name = arena_strdup(r->arena, given[2 * i]);
		if (!a[i].name)
			return out_of_memory(r);
		if (strlen(value) > XML_VALUE_MAX)
			return xml_error(el, r->error, E2BIG, "a value of more than %d bytes", XML_VALUE_MAX);
		int c = 0;
		if (el->ignored || !strchr(value, '$'))
			a[i].value = arena_strdup(r->arena, value);
		else /* Mitsuba 0.6 writes $scene['memUsage'] and the like as labels into images */
			c = define_substitute(&r->defines, value, r->snake && strchr(value, '['), XML_VALUE_MAX,
					      &a[i].value, r->error);
		if (c == -ENOENT || c == -EEXIST) {
			if (c == -ENOENT)
				error_prefix(r->error, c, "%s:%d: <%.64s>: attribute `%.64s`", el->file, el->line,
					     el->name, a[i].name);
			c = c == -ENOENT ? note_missing(r) : 0;
			el->unset = true;
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
static bool means_nothing(const char *attribute)
{
	return !strcmp(attribute, "type") || !strcmp(attribute, "id") || !strcmp(attribute, "name") ||
	       !strcmp(attribute, "xmlns") || strchr(attribute, ':');
}

static void drop_attributes(struct xml_element *scene)
{
	uint32_t kept = 0;
	for (uint32_t i = 0; i < scene->attribute_count; i++)
		if (!means_nothing(scene->attributes[i].name))
			scene->attributes[kept++] = scene->attributes[i];
	scene->attribute_count = kept;
}

static int needs_version(const struct reader *r, const struct xml_element *el)
{
	return xml_error(el, r->error, EINVAL, "needs a version, such as version=\"0.6.0\" or version=\"3.0.0\"");
}

/* A file without a version is read as one from before 0.3, and checked at its end; so are files that it includes. */
static const char *version_of(const struct reader *r, const struct xml_element *el)
{
	const char *version = xml_attribute(el, "version");
	bool old = !version && strcmp(el->name, "scene") == 0 && (!r->hook || !xml_attribute(r->tree->root, "version"));
	return old ? "0.2" : version;
}

/* Selects the file's dialect by its version. An included file may hold a single object instead of a <scene>. */
static int begin_file(struct reader *r, struct xml_element *el)
{
	if (!el->parent && strcmp(el->name, "scene") != 0)
		return xml_error(el, r->error, EINVAL, "a scene file must begin with <scene version=\"...\">");
	if (strcmp(el->name, "scene") == 0)
		drop_attributes(el);
	const char *version = version_of(r, el);
	int64_t major, minor;
	if (!version || !version_read(version, &major, &minor))
		return needs_version(r, el);
	r->minor = major == 0 && minor >= 0 && minor < 5 ? (int)minor : -1;
	if (r->minor >= 0 && r->minor < 4 && !r->upgraded && r->tree->note_count < XML_NOTES_MAX) {
		r->upgraded = true;
		r->tree->notes[r->tree->note_count++] =
			"is of a version before 0.4: read as by Mitsuba 0.5, which mirrors the cameras of such files";
	}
	if (!r->newer && r->tree->note_count < XML_NOTES_MAX && (r->newer = version_newer(el, major, r->arena)))
		r->tree->notes[r->tree->note_count++] = r->newer;
	r->snake = major < 2;
	bool dialect_3 = major >= 2;
	if (el->parent && !r->mixed && r->tree->dialect_3 != dialect_3 && r->tree->note_count < XML_NOTES_MAX) {
		r->mixed = true;
		r->tree->notes[r->tree->note_count++] =
			"includes a file of another dialect; everything is read as by Mitsuba 3, with the old names in "
			"the old files";
	}
	r->tree->black_backs |= dialect_3;
	r->tree->dialect_3 |= dialect_3; /* 3.x reads older files, but 0.6 does not read newer ones */
	return 0;
}

/* Selects the names of an object: from 2.x on, it may have a version of its own. */
static int begin_object(struct reader *r, struct xml_element *el)
{
	el->snake = r->snake || (el != r->top && el->parent->snake);
	const char *version = xml_attribute(el, "version");
	if (el == r->top || !version || !r->tree->dialect_3 || el->ignored || el->unset)
		return 0;
	int64_t major, minor;
	if (!version_read(version, &major, &minor))
		return xml_error(el, r->error, EINVAL, "version=\"%.64s\" is not one of Mitsuba's", version);
	el->snake |= major < 2;
	return 0;
}

static int read_default(struct reader *r, const struct xml_element *el)
{
	const char *name = xml_attribute(el, "name"), *value = xml_attribute(el, "value");
	if (!name || !value)
		return xml_error(el, r->error, EINVAL, "needs name and value");
	if (el->unset && strchr(name, '$'))
		return 0;
	int c = el->unset ? define_without_value(&r->defines, name, r->error)
			  : define_default(&r->defines, name, value, r->error);
	return c ? error_prefix(r->error, c, "%s:%d: <default>", el->file, el->line) : 0;
}

/* Adds a folder. Files named after this element are searched for there before the scene's own folder. */
static int read_path(struct reader *r, const struct xml_element *el)
{
	const char *value = xml_attribute(el, "value");
	if (!value)
		return xml_error(el, r->error, EINVAL, "needs a value: the name of a folder");
	r->tree->blind |= el->unset;
	if (el->unset)
		return 0;
	if (r->tree->path_count == XML_PATHS_MAX)
		return xml_error(el, r->error, E2BIG, "more than %d search paths", XML_PATHS_MAX);
	r->tree->paths[r->tree->path_count++] = value;
	return 0;
}

/* Notes that a file was found by the end of its path, once per scene: there are often hundreds of such paths. */
static int note_end(struct reader *r, const char *written, const char *name)
{
	if (!name || r->by_end || r->tree->note_count == XML_NOTES_MAX)
		return 0;
	enum { TEXT = 512 };
	char *text = arena_alloc(r->arena, TEXT, 1), shown[160];
	if (!text)
		return out_of_memory(r);
	snprintf(
		text, TEXT,
		"paths of files that are not on this machine are looked for by their ends in the scene's folder and those of "
		"--path: for example, %.160s is used for %.160s",
		asset_name_shown(name, shown, sizeof shown), written);
	r->tree->notes[r->tree->note_count++] = text;
	r->by_end = true;
	return 0;
}

/* Finds the files named by <include filename>, <spectrum filename> and <string name="filename" value>. The last is for
 * a plug-in; as Mitsuba's do not know which scene file names it, it is not looked for beside that file. */
static int find_files(struct reader *r, struct xml_element *el)
{
	const char *named = xml_attribute(el, "name");
	bool string = strcmp(el->name, "string") == 0 && named && strcmp(named, "filename") == 0;
	struct xml_files files = {.assets = r->assets,
				  .arena = r->arena,
				  .file = r->file,
				  .hook = r->hook,
				  .paths = r->tree->paths,
				  .path_count = r->tree->path_count};
	for (uint32_t i = 0; i < el->attribute_count; i++) {
		const char *written = el->attributes[i].value;
		if (strcmp(el->attributes[i].name, string ? "value" : "filename") != 0)
			continue;
		if (xml_files_find(&files, &el->attributes[i].value, !string))
			return out_of_memory(r);
		int c = note_end(r, written, files.by_end);
		if (c)
			return c;
	}
	return 0;
}

static int open_element(struct reader *r, const char *name, const char **attributes)
{
	if (r->depth >= XML_DEPTH_MAX)
		return error_set(r->error, E2BIG, "%s:%d: <%.64s>: elements are nested more than %d deep", r->file,
				 line_now(r), name, XML_DEPTH_MAX);
	if (r->tree->element_count >= XML_ELEMENTS_MAX)
		return error_set(r->error, E2BIG, "%s:%d: more than %d elements", r->file, line_now(r),
				 XML_ELEMENTS_MAX);
	struct xml_element *el = arena_alloc(r->arena, 1, sizeof *el);
	if (!el)
		return out_of_memory(r);
	r->tree->element_count++;
	el->name = arena_strdup(r->arena, name);
	if (!el->name)
		return out_of_memory(r);
	el->file = r->file;
	el->line = line_now(r);
	el->parent = r->current ? r->current : r->hook;
	el->ignored = xml_is_foreign(name) || (el->parent && el->parent->ignored);
	int c = copy_attributes(r, el, attributes);
	if (!c && !r->current) {
		r->top = el;
		c = begin_file(r, el);
	}
	if (!c)
		c = begin_object(r, el);
	if (!c && el->parent)
		element_link(el->parent, el);
	else if (!c)
		r->tree->root = el;
	if (!c && !el->ignored)
		c = find_files(r, el);
	if (!c && !el->ignored && strcmp(name, "default") == 0)
		c = read_default(r, el);
	if (!c && !el->ignored && strcmp(name, "path") == 0)
		c = read_path(r, el);
	r->current = el;
	r->depth++;
	return c;
}

static int read_file(struct reader *r, const char *name);

/* Marks an element that is still open where a file breaks off. An open <include> has not been read yet. */
static void leave_open(struct xml_element *el)
{
	el->told = true;
	el->unset |= strcmp(el->name, "include") == 0;
}

/* Returns whether the part before the mistake of a file that is not well formed can be used. Elements that are still
 * open there are incomplete and are not interpreted. */
static bool keep_beginning(struct reader *r)
{
	if (!r->top || r->minor >= 0 || !xml_attribute(r->top, "version"))
		return false;
	for (struct xml_element *el = r->current; el && el != r->top; el = el->parent)
		leave_open(el);
	leave_open(r->top);
	return true;
}

/* Replaces an <include> inside an object by the object in its file. */
static int become_included(struct xml_element *el, struct error *e)
{
	const struct xml_element include = *el;
	if (strcmp(el->first->name, "scene") == 0)
		return xml_error(el, e, EINVAL, "a file with a <scene> can only be included directly in <scene>");
	*el = *el->first;
	el->parent = include.parent;
	el->next = include.next;
	for (struct xml_element *c = el->first; c; c = c->next)
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
	bool at_top = el->parent == r->top && strcmp(r->top->name, "scene") == 0;
	const char *name = xml_attribute(el, "filename");
	if (!name)
		return xml_error(el, r->error, EINVAL, "needs filename");
	if (!at_top && r->minor >= 0)
		return xml_error(el, r->error, EINVAL, "in files before 0.5 it must be directly in <scene>");
	int c = at_top ? 0 : element_check(el, "filename", false, r->error);
	if (c)
		return c;
	if (el->unset) { /* has been noted */
		r->tree->holes = r->defines.incomplete = true;
		return 0;
	}
	if (r->includes >= XML_INCLUDE_MAX)
		return xml_error(el, r->error, ELOOP, "files include each other more than %d deep", XML_INCLUDE_MAX);
	if (r->tree->include_count >= XML_FILES_MAX)
		return xml_error(el, r->error, E2BIG, "more than %d files are included", XML_FILES_MAX);
	r->tree->includes[r->tree->include_count++] = name;
	struct reader outer = *r;
	r->parser = NULL;
	r->top = r->current = NULL;
	r->hook = el;
	r->depth = at_top ? 0 : outer.depth;
	r->includes++;
	c = read_file(r, name);
	if (c && r->file == outer.file)
		c = error_prefix(r->error, c, "%s:%d: <include>", el->file, el->line);
	bool closed = r->file == outer.file,
	     absent = c && c != -ENOMEM && (closed || r->broken) && r->tree->missing_count < XML_MISSING_MAX;
	if (absent)
		c = note_missing(r);
	el->unset = absent && (closed || !at_top || !keep_beginning(r));
	if (el->unset)
		el->first = el->last = NULL;
	if (!c && !at_top && !absent)
		c = become_included(el, r->error);
	outer.failed = r->failed;
	outer.mixed = r->mixed;
	outer.upgraded = r->upgraded;
	outer.by_end = r->by_end;
	outer.worded = r->worded;
	outer.cut = r->cut;
	outer.bytes = r->bytes;
	outer.defines = r->defines;
	outer.defines.incomplete |= absent;
	outer.tree->holes |= absent;
	outer.tree->include_count -= absent && closed;
	*r = outer;
	return c;
}

static void on_start(void *user, const char *name, const char **attributes)
{
	struct reader *r = user;
	if (r->failed)
		return;
	int c = open_element(r, name, attributes);
	if (c)
		stop(r, c);
}

/* Notes text between elements, most often a stray character: once per scene, since Mitsuba ignores it silently. */
static int note_text(struct reader *r, const struct xml_element *el)
{
	if (!el->text || el->ignored || r->worded || r->tree->note_count == XML_NOTES_MAX)
		return 0;
	enum { TEXT = 160 };
	char *text = arena_alloc(r->arena, TEXT, 1);
	if (!text)
		return out_of_memory(r);
	snprintf(text, TEXT, "text in <%.64s> of line %d is ignored, as by Mitsuba", el->name, el->line);
	r->tree->notes[r->tree->note_count++] = text;
	r->worded = true;
	return 0;
}

static void on_end(void *user, const char *name)
{
	struct reader *r = user;
	if (r->failed)
		return;
	struct xml_element *el = r->current;
	int c = note_text(r, el);
	if (!c && !el->ignored && strcmp(name, "include") == 0)
		c = el->first ? xml_error(el, r->error, EINVAL, "must be empty") : read_include(r, el);
	if (!c && el == r->top && !r->hook && !xml_attribute(el, "version") && !upgrade_is_unmarked(el))
		c = needs_version(r, el);
	if (!c && el == r->top && r->minor >= 0)
		c = upgrade_file(el, r->minor, r->arena, r->error);
	r->depth--;
	r->current = el == r->top ? NULL : el->parent;
	if (c)
		stop(r, c);
}

static void on_text(void *user, const char *text, int length)
{
	struct reader *r = user;
	for (int i = 0; i < length && r->current; i++)
		if (!number_is_blank(text[i]))
			r->current->text = true;
}

/* A DOCTYPE without declarations has no effect: the file that it names is never opened. */
static void on_doctype(void *user, const char *name, const char *system, const char *public_id, int has_subset)
{
	(void)name, (void)system, (void)public_id;
	struct reader *r = user;
	if (!r->failed && has_subset)
		stop(r,
		     error_set(r->error, EINVAL, "%s:%d: <!DOCTYPE>: scene files must not declare elements or entities",
			       r->file, line_now(r)));
}

/* Mitsuba 3 reads the first element of a file and nothing after it. */
static bool ends_early(struct reader *r, enum XML_Error code)
{
	if (code != XML_ERROR_JUNK_AFTER_DOC_ELEMENT || r->snake)
		return false;
	enum { TEXT = 256 };
	char *text = r->cut || r->tree->note_count == XML_NOTES_MAX ? NULL : arena_alloc(r->arena, TEXT, 1);
	if (text) {
		snprintf(text, TEXT, "what follows the first element of %.160s is ignored, as by Mitsuba 3", r->file);
		r->tree->notes[r->tree->note_count++] = text;
		r->cut = true;
	}
	return true;
}

/* Returns whether the file is not XML at all, but perhaps another program's scene, a mesh or an image. */
static bool is_something_else(const struct asset *a)
{
	const unsigned char *text = a->bytes;
	size_t at = 0;
	while (at < a->size && number_is_blank((char)text[at]))
		at++;
	return at < a->size && strchr("<\xef\xfe\xff", text[at]) == NULL;
}

static int parse_bytes(struct reader *r, const struct asset *a)
{
	if (a->size > XML_FILE_MAX)
		return error_set(r->error, EFBIG, "%s: a scene file of more than %d MB", r->file, XML_FILE_MAX >> 20);
	r->bytes += a->size;
	if (r->bytes > XML_FILES_BYTES)
		return error_set(r->error, EFBIG, "%s: the included files have more than %d MB in total", r->file,
				 XML_FILES_BYTES >> 20);
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
	int c = r->failed;
	enum XML_Error code = XML_GetErrorCode(parser);
	bool whole = status == XML_STATUS_OK || (!c && ends_early(r, code));
	if (!c && !whole && code == XML_ERROR_NO_ELEMENTS) {
		c = r->current ? error_set(r->error, EINVAL, "%s:%d: the file ends before </%.64s>", r->file,
					   line_now(r), r->current->name)
			       : error_set(r->error, EINVAL, "%s: the file is empty", r->file);
	} else if (!c && !whole && is_something_else(a)) {
		c = error_set(r->error, EINVAL, "%s: this is neither Mitsuba's XML nor a glTF file (.gltf, .glb)",
			      r->file);
	} else if (!c && !whole) {
		c = error_set(r->error, code == XML_ERROR_NO_MEMORY ? ENOMEM : EINVAL, "%s:%d: %s%s%.64s%s", r->file,
			      line_now(r), XML_ErrorString(code), r->current ? " in <" : "",
			      r->current ? r->current->name : "", r->current ? ">" : "");
	}
	r->broken = c == -EINVAL && !r->failed;
	XML_ParserFree(parser);
	return c;
}

static int read_file(struct reader *r, const char *name)
{
	struct asset a;
	int c = r->assets->open(r->assets->user, name, &a, r->error);
	if (c)
		return c;
	char *shown = arena_alloc(r->arena, strlen(name) + 1, 1);
	r->file = shown ? asset_name_shown(name, shown, strlen(name) + 1) : name;
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
	if (c && r.broken && t->missing_count < XML_MISSING_MAX && keep_beginning(&r)) {
		t->holes = true;
		c = note_missing(&r);
	}
	return c || t->missing_count ? c : define_check_used(&r.defines, e);
}
