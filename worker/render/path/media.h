/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Media are numbers: 0 is none, others are 1 + an index into world.media. The camera stands in the one that the sensor
 * states. From it on, the medium changes where the path leaves a shape that states an interior or an exterior, to the
 * one on that side (a side without one is empty), and nowhere else, as in Mitsuba: a stone in water need not state any.
 * So the medium of every edge follows from the path seen from the camera, whichever technique made it.
 *
 * Where media only absorb, what the light's sub-path loses is found when it is joined to the camera's.
 *
 * Where one scatters, faces of `null` are no vertices: edges pass them, so that a lamp outside of a cloud is seen from
 * its inside, and only the medium changes there. An edge's distance to an event is drawn from the optical depth at one
 * of the wavelengths, chosen evenly; its density is the mean over all of them (the balance heuristic), so that none
 * counts more than four times. It is the same in both directions but for the coefficient at the event. Media that only
 * absorb have no events.
 *
 * A light sub-path must know earlier where events can happen: it starts in the medium that surrounds its emitter,
 * follows the same rule, and is joined only if both sub-paths agree about every edge. Where they cannot, since the
 * scene states media that do not fit together, that technique does not exist for that path, and the others have its
 * weight.
 */
#ifndef WORKER_RENDER_PATH_MEDIA_H
#define WORKER_RENDER_PATH_MEDIA_H

#include "worker/render/path/vertex.h"

/* More faces of `null` than these on an edge count as nothing found. */
enum { PATH_FACES_MOST = 1024 };

/* The medium of that number, which is not 0. */
static inline const struct medium *path_medium(const struct world *w, uint32_t number)
{
	return &w->media[number - 1];
}

/* The medium of the edge that leaves v along `away`, if v was reached through `medium`. */
uint32_t path_medium_after(const struct world *w, const struct path_vertex *v, uint32_t medium, vec3 away);

/* ---- where media only absorb ---- */

/* The transmittance of the edge between two vertices. */
spectrum path_transmittance(const struct world *w, const struct wavelengths *wl, uint32_t medium,
			    const struct path_vertex *a, const struct path_vertex *b);
/* Sets the medium of `to`, which the camera's sub-path reached from `at` along wi, and multiplies its beta by the
 * transmittance. */
void path_absorb(const struct path_context *c, const struct path_vertex *at, vec3 wi, struct path_vertex *to);
/* The same for a vertex of a joint, whose beta is the transmittance of the joint, which is returned. */
spectrum path_absorb_share(const struct path_context *c, const struct path_vertex *at, vec3 wi, spectrum share,
			   struct path_vertex *to);

/* ---- where media scatter ---- */

/* The medium around a point of an emitter, on the side of `away`. */
uint32_t path_medium_of_emitter(const struct world *w, const struct path_vertex *v, vec3 away);

/* What media emit towards the beginning of an edge. */
struct path_emission {
	double u;     /* in [0,1): where */
	spectrum sum; /* for the edge as a sub-path draws it: where it passes with probability P, light counts 1/P times
		       */
};
/* path_extend to the next event in a medium, for u in [0,1), or to what is behind the faces of `null`. *left: the share
 * of light that the edge lets through. emission: NULL, or what shines on the way is added to its sum, whatever is
 * found. */
bool path_extend_in_media(struct path_context *c, const struct path_vertex *at, vec3 d, double t_min, double t_max,
			  double u, struct path_emission *emission, struct path_vertex *to, spectrum *left);
/* The same without events. */
bool path_extend_past_events(struct path_context *c, const struct path_vertex *at, vec3 d, double t_min, double t_max,
			     struct path_vertex *to, spectrum *left);
/* An event at that distance along d. Its edge is not known yet. */
void path_stop_in_medium(struct path_vertex *to, const struct path_vertex *from, double distance, vec3 d);
/* Whether z (not at infinity; any end of the camera's sub-path) and y see each other through faces of `null`. Fills in
 * the edge to y, with `before` at z, and what it lets through. Counts rays. */
bool path_see_in_media(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
		       struct path_edge *edge, spectrum *left);

/* What the edge contributes to the density of `to` as generated from its other end. If `to` is an event in a medium:
 * its density per length, in `medium`. Otherwise: the probability that there is no event on the way. */
double path_edge_pdf(const struct path_context *c, const struct path_edge *edge, uint32_t medium,
		     const struct path_vertex *to);
/* Multiplies path_edge_pdf of a sub-path's last edge into its density, and transmittance over it into its beta. */
void path_travel(const struct path_context *c, struct path_vertex *to, spectrum left);

/* sigma_s times the phase function, of VERTEX_MEDIUM. 1 / length / solid angle */
spectrum path_scatter_in_medium(const struct world *w, const struct wavelengths *wl, const struct path_vertex *v,
				vec3 wo, vec3 wi);

#endif
