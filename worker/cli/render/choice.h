/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Measures what must be known about a scene before a plan is made for it: the integrator
 * (worker/render/choose_integrator.h) if none was given, how much light its samples hardly ever find
 * (worker/render/unseen_light.h), and how many rays they take (worker/render/count_rays.h) if a time or an error ends
 * the render. One thread.
 */
#ifndef WORKER_CLI_RENDER_CHOICE_H
#define WORKER_CLI_RENDER_CHOICE_H

#include "worker/cli/base/options.h"
#include "worker/render/choose_integrator.h"

#include <jansson.h>

struct choice {
	bool is_made; /* false: an integrator was given, and the rest is empty */
	struct render_choice result;
	double seconds;	   /* wall-clock time that the choice took */
	char summary[512]; /* the choice in one line, for the user */
};

/* Makes the choice for the scene `name` in `folder`. a: complete except for the values that are chosen or measured. */
int choice_make(struct render_arguments *a, const char *folder, const char *name, struct choice *out, struct error *e);
/* Does the same in an existing world. */
int choice_in_world(const struct world *w, struct render_arguments *a, struct choice *out, struct error *e);

/* Prints the choice in one line on stderr; nothing if no choice was made. (--explain prints the reasons.) */
void choice_print(const struct choice *c, const char *integrator);
/* Returns a JSON object, JSON null if no choice was made, or NULL if memory is out. */
json_t *choice_to_json(const struct choice *c);

#endif
