/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The header attributes "hslt:..." of an image, in one table: name, type, meaning. EXR has no 64-bit integers, so
 * counts are strings of decimal digits. The coordinator and hslt-render fill them in with the same function, so equal
 * images have equal headers, except for attributes marked `is_excluded`, which may differ between runs with the same
 * plan (times, workers, date).
 */
#ifndef COMMON_EXR_HEADER_H
#define COMMON_EXR_HEADER_H

#include "common/base/text.h"
#include "common/estimate/canvas_image.h"
#include "common/exr/exr_image.h"
#include "common/plan/plan_text.h"

struct header_row {
	const char *name;
	int type;	  /* EXR_ATTRIBUTE_... of struct exr_attribute */
	bool is_excluded; /* ignored by hslt-compare --exact */
	const char *meaning;
};
extern const struct header_row header_rows[]; /* ends with a NULL name */

/* Returns `is_excluded` of the attribute; false for unknown names. */
bool header_is_excluded(const char *name);

/* One effect of the renderer and why it was switched on or off. */
struct header_effect {
	const char *name;
	bool is_on, is_forced;
	const char *reason, *savings;
};

struct header_extra {
	const char *scene;		 /* the scene file's name, without folders */
	const char *scene_hash;		 /* SHA-256 of the scene file in hexadecimal; NULL: not known */
	const struct plan_scene *inputs; /* options -D and --path; NULL: none */
	const char *camera;		 /* from render_camera_text; NULL or "": not known */
	const char *scene_notes;	 /* one per line, in at most HEADER_SCENE_NOTES_MAX bytes; NULL or "": none */
	size_t effect_count;
	const struct header_effect *effects;
	/* workers of different numeric fingerprints took part: the bits are not reproducible */
	bool has_mixed_fingerprints;
	double wall_seconds, cpu_seconds;
	uint32_t worker_count;
	const char *date;     /* UTC; NULL: now */
	const char *end_name; /* from merge_end_name; NULL: the image is a preview */
};

enum { HEADER_ATTRIBUTES_MAX = 64, HEADER_TEXT_MAX = 49152, HEADER_SCENE_NOTES_MAX = 4096 };
struct header {
	size_t count;
	struct exr_attribute attributes[HEADER_ATTRIBUTES_MAX];
	char text[HEADER_TEXT_MAX]; /* the strings of the attributes */
	struct text unused_bytes;   /* the unused part of `text` */
};
/* Fills in all attributes. Never fails: text that does not fit is cut. Allocates nothing. h must not be moved
 * afterwards, since attributes point into it. */
void header_fill(struct header *h, const struct canvas_image *img, const struct plan *p, const struct header_extra *x);

#endif
