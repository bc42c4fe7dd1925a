/* SPDX-License-Identifier: Apache-2.0 */
/* Changes a world according to its effects: shapes that no path can meet become black, and effects
 * that are off are removed. */
#include "worker/render/world/effects_apply.h"

#include "worker/render/bsdf/lobe_filter.h"
#include "worker/render/world/visibility_bounds.h"

static void remove_emitter(struct world *w, uint32_t i)
{
	w->emitters[i].power = 0;
	if (w->emitter_shapes[i] != UINT32_MAX)
		w->shape_bindings[w->emitter_shapes[i]].emitter = -1;
	if (w->environment == (int32_t)i)
		w->environment = -1;
}

static bool is_switched_off(const struct emitter *em, const struct effects_override *forced)
{
	enum effect which = em->is_delta      ? EFFECT_DELTA_LIGHT
			    : em->is_infinite ? EFFECT_ENVIRONMENT
					      : EFFECT_AREA_LIGHT;
	return forced->states[which] < 0;
}

/* Makes shapes that no path can meet black and removes emitters without effect. Not used if an effect is forced on,
 * which might concern these objects. */
static void remove_invisible(struct world *w, const enum visibility *shape)
{
	uint32_t black = w->bsdf_count++; /* there is room for one more than there are shapes */
	bsdf_make_black(&w->bsdfs[black]);
	for (uint32_t i = 0; i < w->shape_count; i++)
		if (shape[i] != VISIBILITY_VISIBLE || w->bsdfs[w->shape_bindings[i].bsdf].is_black)
			w->shape_bindings[i].bsdf = black;
	for (uint32_t i = 0; i < w->emitter_count; i++)
		if (!visibility_bounds_see_emitter(w, shape, i))
			remove_emitter(w, i);
}

static unsigned switched_off_lobes(const struct bsdf *b, const struct effects_override *forced)
{
	unsigned removed = 0;
	if (forced->states[EFFECT_TRANSMISSION] < 0 && (b->modes & BSDF_TRANSMIT))
		removed |= BSDF_WITHOUT_TRANSMISSION;
	if (forced->states[EFFECT_SPECULAR] < 0 && b->has_delta)
		removed |= BSDF_WITHOUT_DELTA;
	if (forced->states[isfinite(b->min_alpha) ? EFFECT_GLOSSY : EFFECT_DIFFUSE] < 0 && b->has_smooth)
		removed |= BSDF_WITHOUT_SMOOTH;
	return removed;
}

/* If a medium's albedo varies, its optical depth is only known for both effects together (medium.h). */
static int apply_to_medium(struct medium *m, const struct effects *fx, const struct effects_override *forced,
			   struct error *e)
{
	m->is_absorbing = m->is_absorbing && fx->absorption;
	m->is_scattering = m->is_scattering && fx->scattering && forced->states[EFFECT_SCATTERING] >= 0;
	m->is_emissive = m->is_emissive && fx->medium_light;
	if (!volume_varies(&m->second) || m->is_absorbing == m->is_scattering)
		return 0;
	/* Either no path reaches the medium, or the user switched one of the effects off. */
	m->is_absorbing = m->is_scattering = false;
	return forced->states[EFFECT_ABSORPTION] < 0 || forced->states[EFFECT_SCATTERING] < 0
		       ? error_set(
				 e, EINVAL,
				 "absorption and scattering can only be switched off together in this scene: it has a "
				 "medium whose albedo varies from place to place")
		       : 0;
}

int effects_apply(struct world *w, const struct effects_override *forced, const enum visibility *shape, struct error *e)
{
	if (!forced->forces_any_on)
		remove_invisible(w, shape);
	for (uint32_t i = 0; i < w->bsdf_count; i++) {
		struct bsdf *b = &w->bsdfs[i];
		/* Dispersion that is forced on treats the index as varying with wavelength, by an amount of 0. */
		if (!w->effects.dispersion)
			b->is_dispersive = false;
		else if (forced->states[EFFECT_DISPERSION] > 0 && b->eta != 1)
			b->is_dispersive = true;
		unsigned removed = switched_off_lobes(b, forced);
		int rc = removed ? bsdf_filter_lobes(b, removed, &w->arena, e) : 0;
		if (rc)
			return rc;
	}
	for (uint32_t i = 0; i < w->emitter_count; i++)
		if (is_switched_off(&w->emitters[i], forced))
			remove_emitter(w, i);
	for (uint32_t i = 0; i < w->media_count; i++) {
		int rc = apply_to_medium(&w->media[i], &w->effects, forced, e);
		if (rc)
			return rc;
	}
	if (forced->states[EFFECT_APERTURE])
		camera_force_aperture(&w->camera, w->effects.aperture);
	return 0;
}
