/*
 * Which integrator a scene calls for: `path`, `bdpt`, or the chains of `hslt`. Decided once, before the plan is made, from a pilot
 * that counts rays instead of seconds and draws random numbers of its own: the same on every machine for the same request, and
 * the plan names what was chosen.
 *
 * The pilot draws samples of `path` and of `bdpt` and looks at what each brings relative to the brightness of its place. Where both
 * find much of the light only in rare contributions of many times that brightness (caustics through water, panes, frosted glass),
 * more of them help slowly, and chains are called for. Elsewhere the better of the two is the one of less second moment times rays,
 * the few largest terms left out, which are fireflies in a few pixels.
 */
#ifndef WORKER_RENDER_CHOOSE_H
#define WORKER_RENDER_CHOOSE_H

#include "worker/render/render.h"

/* What was found of one of them. */
struct render_found {
	double cost;  /* second moment of a sample's relative contribution, times rays a sample */
	double rare;  /* share of the energy beyond RENDER_RARE times the brightness there */
	double heavy; /* the same beyond RENDER_HEAVY times */
};
#define RENDER_RARE 32
#define RENDER_HEAVY 8

struct render_choice {
	struct render_found path, bdpt;
	bool misses; /* path finds less than there is: light of a point or a direction through a specular lobe */
};

/* Sets integrator, kind and mixture of the request, all else of which stands. Ticks. -ENOMEM, -EINVAL */
int render_choose(const struct world *w, struct plan_request *r, struct render_choice *out, struct error *e);
/* By what was found. Pure. */
const char *render_choice_of(const struct render_choice *c);
void render_choice_text(const char *integrator, const struct render_choice *c, char *text, size_t size);

#endif
