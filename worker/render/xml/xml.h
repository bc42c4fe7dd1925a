/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Reads a scene file into a tree of elements, with expat: includes are opened and defaults substituted, but nothing is
 * interpreted. A DOCTYPE with declarations is refused, and with it every entity; depth, sizes and counts are bounded.
 * One thread; the tree is allocated in the given arena.
 */
#ifndef WORKER_RENDER_XML_XML_H
#define WORKER_RENDER_XML_XML_H

#include "common/base/arena.h"
#include "worker/render/asset/asset.h"
#include "worker/render/xml/define.h"
#include "worker/render/xml/element.h"

#include <stdint.h>

enum {
	XML_DEPTH_MAX = 64,	    /* nesting of elements, and of objects that refer to objects */
	XML_INCLUDE_DEPTH_MAX = 15, /* files that include files */
	XML_FILES_MAX = 1024,	    /* files included in total */
	XML_PATHS_MAX = 16,	    /* values of <path> */
	XML_NOTES_MAX = 8,	    /* notes that apply to a file as a whole */
	XML_MISSING_MAX = DEFINE_MISSING_MAX,
	XML_ELEMENTS_MAX = 1 << 20,
	XML_ATTRIBUTES_MAX = 24,
	XML_VALUE_MAX = 1 << 20,	 /* bytes of an attribute's value */
	XML_FILE_MAX = 64 << 20,	 /* bytes of a scene file */
	XML_TOTAL_BYTES_MAX = 256 << 20, /* total, counted once per inclusion */
	XML_MEMORY_MAX = 1 << 30,	 /* bytes of the tree */
};

struct xml_tree {
	struct xml_element *root; /* <scene>. The contents of an included file are children of its <include>; inside an
				     object, the included object takes the <include>'s place. */
	bool is_dialect_3;
	bool has_black_backs; /* an XML file of version >= 2 was read: as in Mitsuba 3, one-sided materials are black
			     from behind */
	uint32_t element_count, include_count, path_count, note_count, missing_count;
	const char *included_files[XML_FILES_MAX]; /* names of included files, with repetitions */
	const char *notes[XML_NOTES_MAX];	   /* notes for the user about the file */
	const char *missing[XML_MISSING_MAX]; /* a sentence for each $name without a value and each file that is missing
						 or cannot be read to its end */
	bool has_missing_files; /* some file is missing: unknown ids are not reported, because it may define them */
	bool has_unset_path; /* a <path> has no value: the scene is not built, since files that are there would seem to
		       be missing */
	const char *search_paths[XML_PATHS_MAX]; /* of <path>, for the files named after it */
};

int xml_read(struct xml_tree *t, const struct asset_source *assets, const char *name,
	     const struct scene_define *defines, size_t define_count, struct arena *arena, struct error *e);

#endif
