/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Media are identified by numbers: 0 means no medium, others are 1 + an index into world.media. The camera is inside
 * the medium that the sensor states. Along the path from the camera, the medium changes only where the path leaves a
 * shape that states an interior or an exterior medium; it changes to the medium stated for that side (a side without
 * one is empty). As in Mitsuba, a stone in water need not state any medium. So the medium of every edge follows from
 * the path as seen from the camera, whichever technique made the path.
 *
 * Where media only absorb, the attenuation of the light sub-path is computed when it is joined to the camera's.
 *
 * Where a medium scatters, faces of `null` are not vertices: edges pass through them, so that a cloud is lit by a lamp
 * outside, and only the medium changes at such a face. The distance along an edge to a scattering event is sampled from
 * the optical depth at one of the wavelengths, chosen uniformly; its density is the mean over all wavelengths (the
 * balance heuristic), so no wavelength counts more than four times. That density is the same in both directions except
 * for the coefficient at the event. Media that only absorb have no events.
 *
 * A light sub-path must know in advance where events can happen: it starts in the medium that surrounds its emitter,
 * follows the same rule, and is joined only if both sub-paths agree about the media along every edge. Where they cannot
 * agree, because the scene states media that do not fit together, that technique does not exist for that path, and the
 * other techniques share its weight.
 */
#ifndef WORKER_RENDER_PATH_MEDIA_H
#define WORKER_RENDER_PATH_MEDIA_H

#include "worker/render/path/vertex.h"

/* Limit on the `null` faces along one edge; beyond it, the ray counts as a miss. */
enum { PATH_NULL_FACES_MAX = 1024 };

/* Returns the medium with this number, which must not be 0. */
static inline const struct medium *path_medium(const struct world *w, uint32_t number)
{
	return &w->media[number - 1];
}

/* Returns the medium of the edge that leaves v along `away`, if v was reached through `medium`. */
uint32_t path_medium_after(const struct world *w, const struct path_vertex *v, uint32_t medium, vec3 away);

/* ---- where media only absorb ---- */

/* Returns the transmittance of the edge between two vertices. */
spectrum path_transmittance(const struct world *w, const struct wavelengths *wl, uint32_t medium,
			    const struct path_vertex *a, const struct path_vertex *b);
/* Sets the medium of `to`, which the camera's sub-path reached from `vertex` along wi, and multiplies its beta by the
 * transmittance of the edge. */
void path_absorb(const struct path_context *c, const struct path_vertex *vertex, vec3 wi, struct path_vertex *to);
/* Like path_absorb(), but for a vertex in a joint: sets the beta of `to` to `weight` times the transmittance of the
 * edge, and returns it. Returns `weight` if the world has no absorption. */
spectrum path_absorb_weight(const struct path_context *c, const struct path_vertex *vertex, vec3 wi, spectrum weight,
			    struct path_vertex *to);

/* ---- where media scatter ---- */

/* Returns the medium around a point of an emitter, on the side of `away`. */
uint32_t path_medium_of_emitter(const struct world *w, const struct path_vertex *v, vec3 away);

/* The light that media emit towards the beginning of an edge. */
struct path_emission {
	double u; /* random number in [0,1) that chooses the position */
	/* The sum of the contributions along the edge; where the edge gets that far with probability
	 * P, they count 1/P times. */
	spectrum sum;
};
/* Like path_extend(), but ends at the next event in a medium, chosen by u in [0,1), or at the first hit that is not a
 * `null` face. Sets *transmittance to that of the edge. If emission is not NULL, the light emitted along
 * the way is added to its sum, whatever the ray meets. */
bool path_extend_in_media(struct path_context *c, const struct path_vertex *vertex, vec3 d, double t_min, double t_max,
			  double u, struct path_emission *emission, struct path_vertex *to, spectrum *transmittance);
/* Like path_extend_in_media(), but without events and emission. */
bool path_extend_without_events(struct path_context *c, const struct path_vertex *vertex, vec3 d, double t_min,
				double t_max, struct path_vertex *to, spectrum *transmittance);
/* Makes `to` an event at that distance from `from` along d. Its edge is not set. */
void path_make_medium_vertex(struct path_vertex *to, const struct path_vertex *from, double distance, vec3 d);
/* Whether z (an end of the camera's sub-path, not at infinity) and y see each other through faces of `null`. Fills in
 * the edge to y, whose `previous_medium` is the medium at z, and sets *transmittance. Counts rays. */
bool path_is_visible_in_media(struct path_context *c, const struct path_vertex *z, const struct path_vertex *y,
			      struct path_edge *edge, spectrum *transmittance);

/* Returns the factor that the edge contributes to the density of `to` as generated from its other end. If `to` is
 * an event in `medium`, this is the density of the event per length; otherwise it is the probability that no
 * event happens on the edge. */
double path_edge_pdf(const struct path_context *c, const struct path_edge *edge, uint32_t medium,
		     const struct path_vertex *to);
/* Multiplies the density of `to` by path_edge_pdf of its edge, and its beta by transmittance / path_edge_pdf. */
void path_apply_edge(const struct path_context *c, struct path_vertex *to, spectrum transmittance);

/* Returns sigma_s times the phase function at a VERTEX_MEDIUM, in 1 / (length x solid angle). */
spectrum path_scatter_in_medium(const struct world *w, const struct wavelengths *wl, const struct path_vertex *v,
				vec3 wo, vec3 wi);

#endif
