/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Decides which effects a scene needs.
 *
 * take_census goes through materials, emitters and shapes once and counts which of them use what. Then each effect is
 * decided in the order of dependencies: whether the scene needs it, whether the user forces it, and the sentence with
 * the reason. Nothing fails: impossible choices were refused when the text was parsed (effects_text.c).
 */
#include "worker/render/world/effects_analyse.h"

#include "common/base/text.h"
#include "worker/render/bsdf/ior.h"
#include "worker/render/world/displacement.h"
#include "worker/render/world/visibility_bounds.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* A count of objects, and the name of the first. */
struct tally {
	size_t count;
	char first_name[112];
};

static void count_object(struct tally *t, const struct scene_node *n, const char *nameless)
{
	char place[NODE_PLACE_MAX];
	if (t->count++)
		return;
	if (!n)
		snprintf(t->first_name, sizeof t->first_name, "%s", nameless);
	else if (n->id)
		snprintf(t->first_name, sizeof t->first_name, "`%.40s`", n->id);
	else
		snprintf(t->first_name, sizeof t->first_name, "the %.24s%s in %s", n->type,
			 n->cls == PLUGIN_EMITTER ? " emitter" : "", node_place(n, place));
}

enum { NAMES_MAX = 144 };

/* Returns "`glass1`", or "`glass1` and 2 more". */
static const char *tally_names(const struct tally *t, char text[NAMES_MAX])
{
	if (t->count > 1)
		snprintf(text, NAMES_MAX, "%s and %zu more", t->first_name, t->count - 1);
	else
		snprintf(text, NAMES_MAX, "%s", t->first_name);
	return text;
}

static const char *tally_verb(const struct tally *t, const char *singular, const char *plural)
{
	return t->count == 1 ? singular : plural;
}

struct census {
	struct tally specular, glossy, diffuse, transmission, textured, coloured, dispersive, constant_eta;
	struct tally hidden_specular, hidden_dispersive,
		/* Materials that no path meets, and materials that no shape uses. */
		unused_dispersive;
	struct tally absorbing, scattering, emitting;
	struct tally see_through, refracting;
	struct tally environment, area, delta, textured_light, coloured_light;
	enum visibility why_hidden;
	size_t by_color_shape[3];
};

static void add_material(struct census *c, const struct bsdf *b, const struct scene_node *n)
{
	static const char nameless[] = "the default material";
	bool smooth = b->has_smooth;
	if (b->is_black)
		return;
	if (b->has_delta)
		count_object(&c->specular, n, nameless);
	if (smooth)
		count_object(isfinite(b->min_alpha) ? &c->glossy : &c->diffuse, n, nameless);
	if (b->modes & BSDF_TRANSMIT)
		count_object(&c->transmission, n, nameless);
	if (bsdf_passes_connections(b))
		count_object(&c->see_through, n, nameless);
	if (bsdf_refracts_connections(b))
		count_object(&c->refracting, n, nameless);
	if (b->is_textured)
		count_object(&c->textured, n, nameless);
	if (b->color_kind != COLOR_KIND_CONSTANT)
		count_object(&c->coloured, n, nameless);
	if (b->is_dispersive)
		count_object(&c->dispersive, n, nameless);
	else if (b->eta != 1)
		count_object(&c->constant_eta, n, nameless);
}

static void add_hidden_material(struct census *c, const struct bsdf *b, const struct scene_node *n, enum visibility why)
{
	c->why_hidden = why;
	if (b->has_delta)
		count_object(&c->hidden_specular, n, "");
	if (b->is_dispersive)
		count_object(&c->hidden_dispersive, n, "");
}

/* For each BSDF: finds whether paths can reach one of its shapes, otherwise the reason for its last shape; YES if it
 * has no shape. One pass over the shapes, however many BSDFs there are. */
static void find_bsdf_visibility(const struct world *w, const enum visibility *shape, struct bsdf_visibility *out)
{
	for (uint32_t k = 0; k < w->bsdf_count; k++)
		out[k] = (struct bsdf_visibility){VISIBILITY_VISIBLE, false};
	for (uint32_t i = 0; i < w->shape_count; i++) {
		struct bsdf_visibility *r = &out[w->shape_bindings[i].bsdf];
		if (!r->has_shape || r->visibility != VISIBILITY_VISIBLE)
			*r = (struct bsdf_visibility){shape[i], true};
	}
}

static void add_unused_materials(struct census *c, const struct world *w, const struct effects_source *src)
{
	for (uint32_t i = 0; i < src->scene->object_count; i++) {
		const struct scene_node *n = src->scene->objects[i];
		uint32_t k = 0;
		if (n->cls != PLUGIN_BSDF || !(ior_has_coefficients(n) || node_bool(n, "dispersion", false)))
			continue;
		while (k < w->bsdf_count && src->bsdf_nodes[k] != n)
			k++;
		if (k == w->bsdf_count)
			count_object(&c->unused_dispersive, n, "");
	}
}

static void add_emitter(struct census *c, const struct emitter *em, const struct scene_node *n)
{
	count_object(em->is_delta ? &c->delta : em->is_infinite ? &c->environment : &c->area, n, "");
	if (em->is_textured)
		count_object(&c->textured_light, n, "");
	if (em->color_kind == COLOR_KIND_OTHER)
		count_object(&c->coloured_light, n, "");
	c->by_color_shape[em->color_kind]++;
}

static void add_medium(struct census *c, const struct world *w, uint32_t number, const struct scene_node *owner,
		       const struct scene_node *medium)
{
	const struct medium *m = number ? &w->media[number - 1] : NULL;
	if (!m)
		return;
	if (m->is_absorbing)
		count_object(&c->absorbing, owner, "");
	if (m->is_scattering)
		count_object(&c->scattering, owner, "");
	if ((m->is_absorbing || m->is_scattering) && medium_is_colored(m))
		count_object(&c->coloured, medium, "");
	if (!m->is_emissive)
		return;
	count_object(&c->emitting, owner, "");
	if (emission_color_kind(&m->emission) == COLOR_KIND_OTHER)
		count_object(&c->coloured_light, medium, "");
	c->by_color_shape[emission_color_kind(&m->emission)]++;
}

static struct census take_census(const struct world *w, const struct effects_source *src, const enum visibility *shape)
{
	struct census c = {.why_hidden = VISIBILITY_VISIBLE};
	find_bsdf_visibility(w, shape, src->bsdf_visibility);
	for (uint32_t i = 0; i < w->bsdf_count; i++) {
		enum visibility r = src->bsdf_visibility[i].visibility;
		if (r == VISIBILITY_VISIBLE)
			add_material(&c, &w->bsdfs[i], src->bsdf_nodes[i]);
		else
			add_hidden_material(&c, &w->bsdfs[i], src->bsdf_nodes[i], r);
	}
	for (uint32_t i = 0; i < w->emitter_count; i++)
		if (visibility_bounds_see_emitter(w, shape, i))
			add_emitter(&c, &w->emitters[i], src->emitter_nodes[i]);
	for (uint32_t i = 0; i < w->shape_count; i++)
		if (shape[i] == VISIBILITY_VISIBLE) {
			const struct scene_node *n = src->shape_nodes[i];
			add_medium(&c, w, w->shape_bindings[i].interior, n, node_ref(n, "interior"));
			add_medium(&c, w, w->shape_bindings[i].exterior, n, node_ref(n, "exterior"));
		}
	if (w->camera_medium)
		add_medium(&c, w, w->camera_medium, src->sensor, node_child(src->sensor, PLUGIN_MEDIUM, 0));
	add_unused_materials(&c, w, src);
	return c;
}

/* ---- lines ---- */

struct effect_report {
	struct effects *fx;
	const struct effects_override *forced;
};

/* Adds the line of an effect. is_needed: the scene needs it. Returns whether the effect is on. */
__attribute__((format(printf, 4, 5))) static bool add_line(struct effect_report *r, enum effect effect, bool is_needed,
							   const char *why, ...)
{
	const struct effect_decl *d = &effect_table[effect];
	int force = r->forced->states[effect];
	struct effect_line *l = &r->fx->effect_lines[r->fx->effect_line_count++];
	*l = (struct effect_line){.name = d->name, .is_on = force ? force > 0 : is_needed, .savings = d->savings};
	l->is_forced = force && l->is_on != is_needed;
	l->changes_scene = l->is_forced && is_needed && (d->override_flags & EFFECT_CHANGES_SCENE);
	va_list ap;
	va_start(ap, why);
	vsnprintf(l->reason, sizeof l->reason, why, ap);
	va_end(ap);
	text_clean(l->reason);
	return l->is_on;
}

static const char *visibility_reason(enum visibility r)
{
	switch (r) {
	case VISIBILITY_ENCLOSED:
		return "it is inside a closed opaque shape";
	case VISIBILITY_DARK:
		return "nothing shines";
	case VISIBILITY_TOO_SHORT:
		return "paths of one edge do not scatter";
	case VISIBILITY_VISIBLE:
		break;
	}
	return "";
}

static void decide_colour(struct effect_report *r, const struct census *c)
{
	struct effects *fx = r->fx;
	char text[NAMES_MAX];
	bool one_shape = c->by_color_shape[COLOR_KIND_OTHER] == 0 &&
			 (!c->by_color_shape[COLOR_KIND_CONSTANT] || !c->by_color_shape[COLOR_KIND_D65]);
	bool is_needed = c->coloured.count > 0 || !one_shape;
	fx->illuminant = c->by_color_shape[COLOR_KIND_CONSTANT] ? COLOR_KIND_CONSTANT : COLOR_KIND_D65;
	if (c->coloured.count)
		fx->colour = add_line(r, EFFECT_COLOUR, is_needed, "%s var%s with wavelength",
				      tally_names(&c->coloured, text), tally_verb(&c->coloured, "ies", "y"));
	else if (c->coloured_light.count)
		fx->colour = add_line(r, EFFECT_COLOUR, is_needed, "the light of %s is coloured",
				      tally_names(&c->coloured_light, text));
	else if (!one_shape)
		fx->colour = add_line(r, EFFECT_COLOUR, is_needed, "the emitters differ in spectrum");
	else
		fx->colour = add_line(r, EFFECT_COLOUR, is_needed,
				      "all materials are grey and all emitters have one spectrum");
}

/* Turns colour on because another effect that is forced on needs it. */
static void force_colour(struct effect_report *r, const char *by)
{
	struct effect_line *l = &r->fx->effect_lines[0];
	if (r->fx->colour)
		return;
	r->fx->colour = l->is_on = l->is_forced = true;
	snprintf(l->reason + strlen(l->reason), sizeof l->reason - strlen(l->reason), "; %s needs it", by);
}

static void decide_dispersion(struct effect_report *r, const struct census *c, bool rgb)
{
	char text[NAMES_MAX];
	bool is_needed = c->dispersive.count > 0, is_on;
	const struct tally *t = is_needed		     ? &c->dispersive
				: c->hidden_dispersive.count ? &c->hidden_dispersive
				: c->unused_dispersive.count ? &c->unused_dispersive
							     : &c->constant_eta;
	const char *name = t->count ? tally_names(t, text) : "";
	if (is_needed && rgb)
		is_on = add_line(r, EFFECT_DISPERSION, false,
				 "the index of %s varies with wavelength, but colours are rgb", name);
	else if (is_needed)
		is_on = add_line(r, EFFECT_DISPERSION, true,
				 "the index of %s varies with wavelength: paths that meet %s carry one", name,
				 tally_verb(t, "it", "them"));
	else if (t == &c->hidden_dispersive)
		is_on = add_line(r, EFFECT_DISPERSION, false, "%s disperse%s, but %s", name, tally_verb(t, "s", ""),
				 visibility_reason(c->why_hidden));
	else if (t == &c->unused_dispersive)
		is_on = add_line(r, EFFECT_DISPERSION, false, "%s disperse%s, but no shape uses %s", name,
				 tally_verb(t, "s", ""), tally_verb(t, "it", "them"));
	else if (t->count)
		is_on = add_line(r, EFFECT_DISPERSION, false, "%s %s constant eta", name, tally_verb(t, "has", "have"));
	else
		is_on = add_line(r, EFFECT_DISPERSION, false, "no material refracts");
	r->fx->dispersion = is_on;
}

static void decide_spectral_effects(struct effect_report *r, const struct census *c, bool rgb)
{
	decide_colour(r, c);
	bool wavelength = add_line(r, EFFECT_WAVELENGTH, r->fx->colour && !rgb, "paths carry %s",
				   !r->fx->colour ? "no wavelength"
				   : rgb	  ? "R, G and B"
						  : "wavelengths");
	decide_dispersion(r, c, rgb);
	if (wavelength)
		force_colour(r, "wavelength");
	if (r->fx->dispersion)
		force_colour(r, "dispersion");
}

/* Adds a line that names the objects in the tally, or the sentence `none` if there are none. */
static bool add_tally_line(struct effect_report *r, enum effect effect, const struct tally *t, const char *singular,
			   const char *plural, const char *none)
{
	char text[NAMES_MAX];
	return t->count ? add_line(r, effect, true, "%s %s", tally_names(t, text), tally_verb(t, singular, plural))
			: add_line(r, effect, false, "%s", none);
}

/* Adds a line that names the materials in the tally, or "no material ..." if there are none. */
static bool add_material_line(struct effect_report *r, enum effect effect, const struct tally *t, const char *singular,
			      const char *plural, const char *none)
{
	char text[NAMES_MAX];
	if (t->count)
		return add_line(r, effect, true, "%s %s", tally_names(t, text), tally_verb(t, singular, plural));
	return add_line(r, effect, false, "no material that light meets %s", none);
}

static void decide_lobes(struct effect_report *r, const struct census *c)
{
	struct effects *fx = r->fx;
	/* Half vectors are filled in below. */
	struct effect_line *half_vector_line = &fx->effect_lines[fx->effect_line_count++];
	if (!c->specular.count && c->hidden_specular.count) {
		char text[NAMES_MAX];
		fx->specular = add_line(r, EFFECT_SPECULAR, false, "%s %s specular, but %s",
					tally_names(&c->hidden_specular, text),
					tally_verb(&c->hidden_specular, "is", "are"), visibility_reason(c->why_hidden));
	} else {
		fx->specular = add_material_line(r, EFFECT_SPECULAR, &c->specular, "has exactly specular lobes",
						 "have exactly specular lobes", "has exactly specular lobes");
	}
	fx->glossy = add_material_line(r, EFFECT_GLOSSY, &c->glossy, "has rough lobes of finite width",
				       "have rough lobes of finite width", "has rough lobes of finite width");
	size_t end = fx->effect_line_count;
	fx->effect_line_count = (size_t)(half_vector_line - fx->effect_lines);
	bool is_needed = fx->specular || fx->glossy;
	add_line(r, EFFECT_HALF_VECTORS, is_needed, is_needed ? "lobes are narrow: %s" : "no lobe is narrow: %s",
		 fx->specular && fx->glossy ? "specular and glossy"
		 : fx->specular		    ? "specular"
		 : fx->glossy		    ? "glossy"
					    : "paths that are traced and joined are as likely to carry light");
	fx->effect_line_count = end;
	add_material_line(r, EFFECT_DIFFUSE, &c->diffuse, "scatters diffusely only", "scatter diffusely only",
			  "is diffuse only");
	add_material_line(r, EFFECT_TRANSMISSION, &c->transmission, "lets light through", "let light through",
			  "lets it through");
	fx->absorption = add_tally_line(r, EFFECT_ABSORPTION, &c->absorbing, "borders on a medium that absorbs",
					"border on a medium that absorbs", "no medium absorbs");
	fx->scattering = add_tally_line(r, EFFECT_SCATTERING, &c->scattering, "borders on a medium that scatters",
					"border on a medium that scatters", "no medium scatters");
}

static void decide_motion(struct effect_report *r, const struct world *w, const struct effects_source *src)
{
	char text[NAMES_MAX];
	struct tally moving = {0};
	for (uint32_t i = 0; i < w->shape_count; i++)
		if (surface_is_moving(&w->shapes[i]))
			count_object(&moving, src->shape_nodes[i], "");
	for (uint32_t i = 0; i < w->emitter_count; i++)
		if (w->emitters[i].motion && w->emitter_shapes[i] == UINT32_MAX)
			count_object(&moving, src->emitter_nodes[i], "");
	if (w->camera.motion)
		count_object(&moving, src->sensor, "");
	if (moving.count)
		r->fx->motion = add_line(r, EFFECT_MOTION, true, "%s move%s while the shutter is open",
					 tally_names(&moving, text), tally_verb(&moving, "s", ""));
	else
		r->fx->motion = add_line(r, EFFECT_MOTION, false, "%s",
					 w->settings.shutter_open < w->settings.shutter_close
						 ? "nothing moves while the shutter is open"
						 : "the exposure time is zero");
}

static void add_surface_lines(struct effect_report *r, const struct census *c, const struct world *w,
			      const struct effects_source *src)
{
	char text[NAMES_MAX], light_text[NAMES_MAX];
	if (c->textured.count && c->textured_light.count)
		add_line(r, EFFECT_TEXTURES, true, "%s and, among the emitters, %s are textured",
			 tally_names(&c->textured, text), tally_names(&c->textured_light, light_text));
	else if (c->textured.count + c->textured_light.count)
		add_line(r, EFFECT_TEXTURES, true, "textured: %s",
			 tally_names(c->textured.count ? &c->textured : &c->textured_light, text));
	else
		add_line(r, EFFECT_TEXTURES, false, "no material and no emitter has a texture");
	struct tally t = {0};
	uint64_t triangles = 0;
	for (uint32_t i = 0; i < w->shape_count; i++)
		if (displacement_property(src->shape_nodes[i])) {
			count_object(&t, src->shape_nodes[i], "");
			triangles += w->shapes[i].triangle_count;
		}
	if (t.count)
		add_line(r, EFFECT_DISPLACEMENT, true, "%s %s displaced: %llu triangles", tally_names(&t, text),
			 tally_verb(&t, "is", "are"), (unsigned long long)triangles);
	else
		add_line(r, EFFECT_DISPLACEMENT, false, "no shape is displaced");
	static const enum effect absent[] = {EFFECT_BUMP, EFFECT_ALPHA};
	for (size_t i = 0; i < sizeof absent / sizeof *absent; i++)
		add_line(r, absent[i], false, "%s", effect_table[absent[i]].refusal);
	if (w->sharing_shape_count)
		add_line(r, EFFECT_INSTANCING, true, "%u shapes are instances of %u meshes", w->sharing_shape_count,
			 w->shared_mesh_count);
	else if (w->instance_count)
		add_line(r, EFFECT_INSTANCING, false,
			 "no mesh is used twice, so what the %u instance%s show%s is copied", w->instance_count,
			 w->instance_count == 1 ? "" : "s", w->instance_count == 1 ? "s" : "");
	else
		add_line(r, EFFECT_INSTANCING, false, "no mesh is used in several places");
	decide_motion(r, w, src);
	const struct coincidence_notes *k = &w->coincidence_notes;
	if (k->pair_count > 1)
		add_line(r, EFFECT_COINCIDENCE, true, "%zu pairs of shapes coincide visibly", k->pair_count);
	else if (k->pair_count == 1)
		add_line(r, EFFECT_COINCIDENCE, true, "%s", k->text[0]);
	else if (w->coincidence)
		add_line(r, EFFECT_COINCIDENCE, true, "only opaque bodies touch");
	else
		add_line(r, EFFECT_COINCIDENCE, false, "no surfaces coincide");
}

static void decide_emitter_move(struct effect_report *r, const struct census *c)
{
	char text[NAMES_MAX];
	bool is_needed = c->area.count + c->environment.count > 0;
	if (is_needed)
		r->fx->emitter_move = add_line(r, EFFECT_EMITTER_MOVE, true, "%s %s many points or directions",
					       tally_names(c->area.count ? &c->area : &c->environment, text),
					       tally_verb(c->area.count ? &c->area : &c->environment, "has", "have"));
	else
		r->fx->emitter_move = add_line(r, EFFECT_EMITTER_MOVE, false,
					       c->delta.count	   ? "all emitters are single points or directions"
					       : c->emitting.count ? "only media shine"
								   : "nothing shines");
}

/* Decides whether connections pass these materials. Where media scatter this cannot be forced: edges cross the faces of
 * `null` anyway, and connections end at all other surfaces. */
static bool decide_shadows(struct effect_report *r, enum effect effect, const struct tally *t,
			   const char *scattering_reason, const char *singular, const char *plural)
{
	static const struct effects_override nothing;
	struct effect_report unforced = {r->fx, &nothing};
	return r->fx->scattering ? add_line(&unforced, effect, false, "%s", scattering_reason)
				 : add_material_line(r, effect, t, singular, plural, singular);
}

static void decide_depth(struct effect_report *r, const struct world *w, const struct effects_source *src,
			 const enum visibility *shape)
{
	uint32_t requested = src->max_depth ? src->max_depth : w->settings.max_depth,
		 bound = w->effects.scattering ? UINT32_MAX : visibility_bounds_depth(w, shape);
	uint32_t useful = bound < requested ? bound : requested;
	bool is_on;
	if (useful < requested)
		is_on = add_line(r, EFFECT_DEPTH, false,
				 "paths may have %u edges, but only up to %u can carry light: %s", requested, useful,
				 useful == 1 ? "nothing scatters" : "everything that scatters is in one plane");
	else
		is_on = add_line(r, EFFECT_DEPTH, true, "paths of up to %u edges can carry light", requested);
	r->fx->max_depth = is_on ? requested : useful;
}

void effects_analyse(struct world *w, const struct effects_source *src, const struct effects_override *forced,
		     enum visibility *shape)
{
	struct effects *fx = &w->effects;
	*fx = (struct effects){.effect_line_count = 0};
	visibility_bounds_shapes(w, src, src->max_depth ? src->max_depth : w->settings.max_depth, shape);
	struct census c = take_census(w, src, shape);
	struct effect_report r = {fx, forced};
	decide_spectral_effects(&r, &c, w->accuracy.colour > 0);
	if (w->settings.aperture_radius > 0)
		fx->aperture = add_line(&r, EFFECT_APERTURE, true, "a lens of radius %g, focused at a distance of %g",
					w->settings.aperture_radius, w->settings.focus_distance);
	else
		fx->aperture = add_line(&r, EFFECT_APERTURE, false, "the sensor is a pinhole");
	decide_emitter_move(&r, &c);
	decide_lobes(&r, &c);
	add_surface_lines(&r, &c, w, src);
	add_tally_line(&r, EFFECT_ENVIRONMENT, &c.environment, "is met by every ray that escapes", "",
		       "rays that escape meet nothing");
	add_tally_line(&r, EFFECT_AREA_LIGHT, &c.area, "shines from its surface", "shine from their surfaces",
		       "no surface shines");
	add_tally_line(&r, EFFECT_DELTA_LIGHT, &c.delta, "is a point or parallel light, which no path hits by chance",
		       "are points or parallel light, which no path hits by chance",
		       "no emitter is a point or parallel light");
	fx->medium_light = add_tally_line(&r, EFFECT_MEDIUM_LIGHT, &c.emitting, "borders on a medium that shines",
					  "border on a medium that shines", "no medium shines");
	fx->scattering = fx->scattering || fx->medium_light;
	fx->transparent_shadows = decide_shadows(&r, EFFECT_TRANSPARENT_SHADOWS, &c.see_through,
						 "where media scatter or shine, connections look through `null` alone",
						 "lets light straight through", "let light straight through");
	fx->refracted_shadows = decide_shadows(&r, EFFECT_REFRACTED_SHADOWS, &c.refracting,
					       "where media scatter or shine, connections are not refracted",
					       "refracts light exactly", "refract light exactly");
	fx->media = fx->absorption || fx->scattering;
	fx->has_joint_effects = fx->media || fx->dispersion || fx->transparent_shadows || fx->refracted_shadows;
	decide_depth(&r, w, src, shape);
}
