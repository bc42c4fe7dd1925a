/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The header attributes "hslt:..." of an image, in one table: name, type, meaning. EXR has no 64-bit integer, so counts
 * are strings of decimal digits. The coordinator and hslt-render fill them in with the same function, so equal images
 * have equal headers, except for the attributes marked `excluded`, which say how the image was made.
 */
#ifndef COMMON_EXR_HEADER_H
#define COMMON_EXR_HEADER_H

#include "common/base/text.h"
#include "common/estimate/canvas_image.h"
#include "common/exr/exr_image.h"
#include "common/plan/plan_text.h"

struct header_row {
	const char *name;
	int type; /* of enum in struct exr_attribute */
	bool excluded;
	const char *meaning;
};
extern const struct header_row header_rows[]; /* ends with a NULL name */

bool header_excluded(const char *name); /* hslt-compare --exact ignores it */

struct header_effect { /* see render_effects */
	const char *name;
	bool on, forced;
	const char *why, *saves;
};

struct header_extra {
	const char *scene;		 /* the scene file's name, without folders */
	const char *scene_hash;		 /* its SHA-256 in hexadecimal; NULL: not known */
	const struct plan_scene *inputs; /* NULL: none */
	const char *camera;		 /* render_camera_text; NULL or "": not known */
	const char *scene_notes;	 /* text_lines of them, in HEADER_SCENE_NOTES bytes; NULL or "": none */
	size_t effect_count;
	const struct header_effect *effects;
	bool mixed; /* workers of different numeric fingerprints took part: the bits are not reproducible */
	double wall_seconds, cpu_seconds;
	uint32_t workers;
	const char *date; /* NULL: now, UTC */
	const char *end;  /* merge_end_name; NULL: a preview */
};

enum { HEADER_ATTRIBUTES = 64, HEADER_TEXT = 49152, HEADER_SCENE_NOTES = 4096 };
struct header {
	size_t count;
	struct exr_attribute attributes[HEADER_ATTRIBUTES]; /* storage of the strings */
	char text[HEADER_TEXT];
	struct text rest; /* of the text */
};
/* Never fails: text that does not fit is cut. Allocates nothing; h must not be moved afterwards. */
void header_fill(struct header *h, const struct canvas_image *img, const struct plan *p, const struct header_extra *x);

#endif
