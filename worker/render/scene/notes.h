/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The notes on what is left out of a scene, ignored or replaced: one for each kind of thing, at its first occurrence.
 * Each function returns 0 or -ENOMEM. One thread.
 */
#ifndef WORKER_RENDER_SCENE_NOTES_H
#define WORKER_RENDER_SCENE_NOTES_H

#include "worker/render/xml/element.h"
#include "worker/render/plugin/param.h"
#include "worker/render/scene/report.h"

struct notes {
	struct report *report;
	struct error *error;
	const struct xml_element *last_owner; /* the object whose parameters without effect were noted last, or NULL */
	uint32_t note_index;		      /* of that note */
	int note_line;
	char parameter_names[256]; /* the parameters that it lists */
};

/* Adds a note. The element's name, `type` and `property` together identify the kind of thing. */
__attribute__((format(printf, 5, 6))) int note_add(const struct notes *t, const struct xml_element *el,
						   const char *type, const char *property, const char *format, ...);
/* Notes what happens to a parameter; what: "is ignored", for example. */
int note_parameter(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		   const char *name, const char *what);
/* Notes that a parameter has no effect on light; those of one object share a note. */
int note_no_effect(struct notes *t, const struct xml_element *owner, const struct xml_element *el, const char *name);
/* Notes that a parameter which is not supported would change the light a little. */
int note_difference(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		    const char *name);
/* Notes that a name of 0.6 in a file of 3.x is read as a name of 3.x. */
int note_old_name(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		  const char *name);
/* An object for which plugin_is_sampling_hint() is true. */
int note_guide(const struct notes *t, const struct xml_element *el);
/* The first is for an element that is ignored with everything inside it, the second for an object of which only the
 * parameters in its table are used. */
int note_ignored_element(const struct notes *t, const struct xml_element *el);
int note_ignored_plugin(const struct notes *t, const struct xml_element *el, const struct plugin_decl *decl);
int note_unused_medium(const struct notes *t, const struct xml_element *el); /* in a shape, without a name */
/* Leaves out an element that is not supported, with a note. */
int note_left_out(const struct notes *t, const struct xml_element *el, const char *type, const char *property,
		  const char *what);

#endif
