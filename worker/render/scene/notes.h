/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The sentences for what is left out of a scene, ignored or replaced: each kind of thing once, where it is met first.
 * Each returns 0 or -ENOMEM. One thread.
 */
#ifndef WORKER_RENDER_SCENE_NOTES_H
#define WORKER_RENDER_SCENE_NOTES_H

#include "worker/render/xml/element.h"
#include "worker/render/plugin/param.h"
#include "worker/render/scene/report.h"

struct notes {
	struct report *report;
	struct error *error;
	const struct xml_element *owner; /* the object whose parameters without effect were noted last; NULL: none */
	uint32_t at;			 /* which note that is */
	int line;			 /* its place */
	char names[256];		 /* the parameters in it */
};

/* type, property: with the element's name the kind of thing. */
__attribute__((format(printf, 5, 6))) int note(const struct notes *t, const struct xml_element *el, const char *type,
					       const char *property, const char *format, ...);
/* What becomes of a parameter: "is ignored". */
int note_parameter(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		   const char *name, const char *what);
/* A parameter without effect on light; all of one object share a line. */
int note_no_effect(struct notes *t, const struct xml_element *owner, const struct xml_element *el, const char *name);
/* A parameter that would change the light a little. */
int note_difference(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		    const char *name);
/* A name of 0.6 in a file of 3.x. */
int note_old_name(const struct notes *t, const struct xml_element *owner, const struct xml_element *el,
		  const char *name);
int note_guide(const struct notes *t, const struct xml_element *el); /* plugin_is_guide */
/* An element that is ignored with everything inside it; and an object of which only what its table lists is kept. */
int note_foreign(const struct notes *t, const struct xml_element *el);
int note_ignored_plugin(const struct notes *t, const struct xml_element *el, const struct plugin_decl *decl);
/* Leaves out an element that is not supported, with a note. */
int leave_out(const struct notes *t, const struct xml_element *el, const char *type, const char *property,
	      const char *what);

#endif
