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
	char first[112];
};

static void count(struct tally *t, const struct scene_node *n, const char *nameless)
{
	char place[NODE_PLACE_MAX];
	if (t->count++)
		return;
	if (!n)
		snprintf(t->first, sizeof t->first, "%s", nameless);
	else if (n->id)
		snprintf(t->first, sizeof t->first, "`%.40s`", n->id);
	else
		snprintf(t->first, sizeof t->first, "the %.24s%s in %s", n->type,
			 n->cls == PLUGIN_EMITTER ? " emitter" : "", node_place(n, place));
}

enum { NAMES_MAX = 144 };

/* Returns "`glass1`", or "`glass1` and 2 more". */
static const char *names_of(const struct tally *t, char text[NAMES_MAX])
{
	if (t->count > 1)
		snprintf(text, NAMES_MAX, "%s and %zu more", t->first, t->count - 1);
	else
		snprintf(text, NAMES_MAX, "%s", t->first);
	return text;
}

static const char *verb_of(const struct tally *t, const char *one, const char *many)
{
	return t->count == 1 ? one : many;
}

struct census {
	struct tally specular, glossy, diffuse, transmission, textured, coloured, dispersive, constant_eta;
	struct tally hidden_specular, hidden_dispersive,
		/* Materials that no path meets, and materials that no shape uses. */
		unused_dispersive;
	struct tally absorbing, scattering, shining;
	struct tally straight, refracting;
	struct tally environment, area, delta, textured_light, coloured_light;
	enum visibility why_hidden;
	size_t shape[3];
};

static void add_material(struct census *c, const struct bsdf *b, const struct scene_node *n)
{
	static const char nameless[] = "the default material";
	bool smooth = b->has_smooth;
	if (b->black)
		return;
	if (b->has_delta)
		count(&c->specular, n, nameless);
	if (smooth)
		count(isfinite(b->alpha) ? &c->glossy : &c->diffuse, n, nameless);
	if (b->modes & BSDF_TRANSMIT)
		count(&c->transmission, n, nameless);
	if (bsdf_is_passed(b))
		count(&c->straight, n, nameless);
	if (bsdf_refracts(b))
		count(&c->refracting, n, nameless);
	if (b->textured)
		count(&c->textured, n, nameless);
	if (b->shape != COLOR_SHAPE_CONSTANT)
		count(&c->coloured, n, nameless);
	if (b->dispersive)
		count(&c->dispersive, n, nameless);
	else if (b->eta != 1)
		count(&c->constant_eta, n, nameless);
}

static void add_hidden(struct census *c, const struct bsdf *b, const struct scene_node *n, enum visibility why)
{
	c->why_hidden = why;
	if (b->has_delta)
		count(&c->hidden_specular, n, "");
	if (b->dispersive)
		count(&c->hidden_dispersive, n, "");
}

/* For each BSDF: finds whether paths can reach one of its shapes, otherwise the reason for its last shape; YES if it
 * has no shape. One pass over the shapes, however many BSDFs there are. */
static void find_bsdf_visibility(const struct world *w, const enum visibility *shape, struct bsdf_visibility *of)
{
	for (uint32_t k = 0; k < w->bsdf_count; k++)
		of[k] = (struct bsdf_visibility){VISIBILITY_YES, false};
	for (uint32_t i = 0; i < w->shape_count; i++) {
		struct bsdf_visibility *r = &of[w->parts[i].bsdf];
		if (!r->has_shape || r->shapes != VISIBILITY_YES)
			*r = (struct bsdf_visibility){shape[i], true};
	}
}

static void add_unused(struct census *c, const struct world *w, const struct effects_source *src)
{
	for (uint32_t i = 0; i < src->scene->object_count; i++) {
		const struct scene_node *n = src->scene->objects[i];
		uint32_t k = 0;
		if (n->cls != PLUGIN_BSDF || !(ior_has_coefficients(n) || node_bool(n, "dispersion", false)))
			continue;
		while (k < w->bsdf_count && src->bsdf[k] != n)
			k++;
		if (k == w->bsdf_count)
			count(&c->unused_dispersive, n, "");
	}
}

static void add_emitter(struct census *c, const struct emitter *em, const struct scene_node *n)
{
	count(em->delta ? &c->delta : em->infinite ? &c->environment : &c->area, n, "");
	if (em->textured)
		count(&c->textured_light, n, "");
	if (em->shape == COLOR_SHAPE_OTHER)
		count(&c->coloured_light, n, "");
	c->shape[em->shape]++;
}

static void add_medium(struct census *c, const struct world *w, uint32_t number, const struct scene_node *owner,
		       const struct scene_node *medium)
{
	const struct medium *m = number ? &w->media[number - 1] : NULL;
	if (!m)
		return;
	if (m->absorbs)
		count(&c->absorbing, owner, "");
	if (m->scatters)
		count(&c->scattering, owner, "");
	if ((m->absorbs || m->scatters) && medium_is_coloured(m))
		count(&c->coloured, medium, "");
	if (!m->shines)
		return;
	count(&c->shining, owner, "");
	if (emission_shape(&m->emission) == COLOR_SHAPE_OTHER)
		count(&c->coloured_light, medium, "");
	c->shape[emission_shape(&m->emission)]++;
}

static struct census take_census(const struct world *w, const struct effects_source *src, const enum visibility *shape)
{
	struct census c = {.why_hidden = VISIBILITY_YES};
	find_bsdf_visibility(w, shape, src->visibility);
	for (uint32_t i = 0; i < w->bsdf_count; i++) {
		enum visibility r = src->visibility[i].shapes;
		if (r == VISIBILITY_YES)
			add_material(&c, &w->bsdfs[i], src->bsdf[i]);
		else
			add_hidden(&c, &w->bsdfs[i], src->bsdf[i], r);
	}
	for (uint32_t i = 0; i < w->emitter_count; i++)
		if (visibility_bounds_emitter(w, shape, i))
			add_emitter(&c, &w->emitters[i], src->emitter[i]);
	for (uint32_t i = 0; i < w->shape_count; i++)
		if (shape[i] == VISIBILITY_YES) {
			const struct scene_node *n = src->shape[i];
			add_medium(&c, w, w->parts[i].interior, n, node_ref(n, "interior"));
			add_medium(&c, w, w->parts[i].exterior, n, node_ref(n, "exterior"));
		}
	if (w->camera_medium)
		add_medium(&c, w, w->camera_medium, src->sensor, node_child(src->sensor, PLUGIN_MEDIUM, 0));
	add_unused(&c, w, src);
	return c;
}

/* ---- lines ---- */

struct report {
	struct effects *fx;
	const struct effects_choice *forced;
};

/* Adds the line of an effect. called: the scene needs it. Returns whether the effect is on. */
__attribute__((format(printf, 4, 5))) static bool line(struct report *r, enum effect which, bool called,
						       const char *why, ...)
{
	const struct effect_decl *d = &effect_table[which];
	int force = r->forced->of[which];
	struct effect_line *l = &r->fx->lines[r->fx->line_count++];
	*l = (struct effect_line){.name = d->name, .on = force ? force > 0 : called, .saves = d->saves};
	l->forced = force && l->on != called;
	l->other_scene = l->forced && called && (d->may & EFFECT_OF_THE_SCENE);
	va_list ap;
	va_start(ap, why);
	vsnprintf(l->why, sizeof l->why, why, ap);
	va_end(ap);
	text_clean(l->why);
	return l->on;
}

static const char *hidden_because(enum visibility r)
{
	switch (r) {
	case VISIBILITY_ENCLOSED:
		return "it is inside a closed opaque shape";
	case VISIBILITY_DARK:
		return "nothing shines";
	case VISIBILITY_DEPTH:
		return "paths of one edge do not scatter";
	case VISIBILITY_YES:
		break;
	}
	return "";
}

static void colour(struct report *r, const struct census *c)
{
	struct effects *fx = r->fx;
	char text[NAMES_MAX];
	bool one_shape =
		c->shape[COLOR_SHAPE_OTHER] == 0 && (!c->shape[COLOR_SHAPE_CONSTANT] || !c->shape[COLOR_SHAPE_D65]);
	bool called = c->coloured.count > 0 || !one_shape;
	fx->illuminant = c->shape[COLOR_SHAPE_CONSTANT] ? COLOR_SHAPE_CONSTANT : COLOR_SHAPE_D65;
	if (c->coloured.count)
		fx->colour = line(r, EFFECT_COLOUR, called, "%s var%s with wavelength", names_of(&c->coloured, text),
				  verb_of(&c->coloured, "ies", "y"));
	else if (c->coloured_light.count)
		fx->colour = line(r, EFFECT_COLOUR, called, "the light of %s is coloured",
				  names_of(&c->coloured_light, text));
	else if (!one_shape)
		fx->colour = line(r, EFFECT_COLOUR, called, "the emitters differ in spectrum");
	else
		fx->colour =
			line(r, EFFECT_COLOUR, called, "all materials are grey and all emitters have one spectrum");
}

/* Turns colour on because another effect that is forced on needs it. */
static void force_colour(struct report *r, const char *by)
{
	struct effect_line *l = &r->fx->lines[0];
	if (r->fx->colour)
		return;
	r->fx->colour = l->on = l->forced = true;
	snprintf(l->why + strlen(l->why), sizeof l->why - strlen(l->why), "; %s needs it", by);
}

static void dispersion(struct report *r, const struct census *c, bool rgb)
{
	char text[NAMES_MAX];
	bool called = c->dispersive.count > 0, on;
	const struct tally *t = called			     ? &c->dispersive
				: c->hidden_dispersive.count ? &c->hidden_dispersive
				: c->unused_dispersive.count ? &c->unused_dispersive
							     : &c->constant_eta;
	const char *name = t->count ? names_of(t, text) : "";
	if (called && rgb)
		on = line(r, EFFECT_DISPERSION, false, "the index of %s varies with wavelength, but colours are rgb",
			  name);
	else if (called)
		on = line(r, EFFECT_DISPERSION, true,
			  "the index of %s varies with wavelength: paths that meet %s carry one", name,
			  verb_of(t, "it", "them"));
	else if (t == &c->hidden_dispersive)
		on = line(r, EFFECT_DISPERSION, false, "%s disperse%s, but %s", name, verb_of(t, "s", ""),
			  hidden_because(c->why_hidden));
	else if (t == &c->unused_dispersive)
		on = line(r, EFFECT_DISPERSION, false, "%s disperse%s, but no shape uses %s", name, verb_of(t, "s", ""),
			  verb_of(t, "it", "them"));
	else if (t->count)
		on = line(r, EFFECT_DISPERSION, false, "%s %s constant eta", name, verb_of(t, "has", "have"));
	else
		on = line(r, EFFECT_DISPERSION, false, "no material refracts");
	r->fx->dispersion = on;
}

static void spectral(struct report *r, const struct census *c, bool rgb)
{
	colour(r, c);
	bool wavelength = line(r, EFFECT_WAVELENGTH, r->fx->colour && !rgb, "paths carry %s",
			       !r->fx->colour ? "no wavelength"
			       : rgb	      ? "R, G and B"
					      : "wavelengths");
	dispersion(r, c, rgb);
	if (wavelength)
		force_colour(r, "wavelength");
	if (r->fx->dispersion)
		force_colour(r, "dispersion");
}

/* Adds a line that names the objects in the tally, or the sentence `none` if there are none. */
static bool add_tally_line(struct report *r, enum effect which, const struct tally *t, const char *one,
			   const char *many, const char *none)
{
	char text[NAMES_MAX];
	return t->count ? line(r, which, true, "%s %s", names_of(t, text), verb_of(t, one, many))
			: line(r, which, false, "%s", none);
}

/* Adds a line that names the materials in the tally, or "no material ..." if there are none. */
static bool materials(struct report *r, enum effect which, const struct tally *t, const char *one, const char *many,
		      const char *none)
{
	char text[NAMES_MAX];
	if (t->count)
		return line(r, which, true, "%s %s", names_of(t, text), verb_of(t, one, many));
	return line(r, which, false, "no material that light meets %s", none);
}

static void lobes(struct report *r, const struct census *c)
{
	struct effects *fx = r->fx;
	struct effect_line *at = &fx->lines[fx->line_count++]; /* half vectors: filled in below */
	if (!c->specular.count && c->hidden_specular.count) {
		char text[NAMES_MAX];
		fx->specular =
			line(r, EFFECT_SPECULAR, false, "%s %s specular, but %s", names_of(&c->hidden_specular, text),
			     verb_of(&c->hidden_specular, "is", "are"), hidden_because(c->why_hidden));
	} else {
		fx->specular = materials(r, EFFECT_SPECULAR, &c->specular, "has exactly specular lobes",
					 "have exactly specular lobes", "has exactly specular lobes");
	}
	fx->glossy = materials(r, EFFECT_GLOSSY, &c->glossy, "has rough lobes of finite width",
			       "have rough lobes of finite width", "has rough lobes of finite width");
	size_t end = fx->line_count;
	fx->line_count = (size_t)(at - fx->lines);
	bool called = fx->specular || fx->glossy;
	line(r, EFFECT_HALF_VECTORS, called, called ? "lobes are narrow: %s" : "no lobe is narrow: %s",
	     fx->specular && fx->glossy ? "specular and glossy"
	     : fx->specular		? "specular"
	     : fx->glossy		? "glossy"
					: "paths that are traced and joined are as likely to carry light");
	fx->line_count = end;
	materials(r, EFFECT_DIFFUSE, &c->diffuse, "scatters diffusely only", "scatter diffusely only",
		  "is diffuse only");
	materials(r, EFFECT_TRANSMISSION, &c->transmission, "lets light through", "let light through",
		  "lets it through");
	fx->absorption = add_tally_line(r, EFFECT_ABSORPTION, &c->absorbing, "borders on a medium that absorbs",
					"border on a medium that absorbs", "no medium absorbs");
	fx->scattering = add_tally_line(r, EFFECT_SCATTERING, &c->scattering, "borders on a medium that scatters",
					"border on a medium that scatters", "no medium scatters");
}

static void motion(struct report *r, const struct world *w, const struct effects_source *src)
{
	char text[NAMES_MAX];
	struct tally moving = {0};
	for (uint32_t i = 0; i < w->shape_count; i++)
		if (surface_moves(&w->shapes[i]))
			count(&moving, src->shape[i], "");
	for (uint32_t i = 0; i < w->emitter_count; i++)
		if (w->emitters[i].moves && w->emitter_shape[i] == UINT32_MAX)
			count(&moving, src->emitter[i], "");
	if (w->camera.moves)
		count(&moving, src->sensor, "");
	if (moving.count)
		r->fx->motion = line(r, EFFECT_MOTION, true, "%s move%s while the shutter is open",
				     names_of(&moving, text), verb_of(&moving, "s", ""));
	else
		r->fx->motion = line(r, EFFECT_MOTION, false, "%s",
				     w->settings.shutter_open < w->settings.shutter_close
					     ? "nothing moves while the shutter is open"
					     : "the exposure time is zero");
}

static void surfaces(struct report *r, const struct census *c, const struct world *w, const struct effects_source *src)
{
	char text[NAMES_MAX], more[NAMES_MAX];
	if (c->textured.count && c->textured_light.count)
		line(r, EFFECT_TEXTURES, true, "%s and, among the emitters, %s are textured",
		     names_of(&c->textured, text), names_of(&c->textured_light, more));
	else if (c->textured.count + c->textured_light.count)
		line(r, EFFECT_TEXTURES, true, "textured: %s",
		     names_of(c->textured.count ? &c->textured : &c->textured_light, text));
	else
		line(r, EFFECT_TEXTURES, false, "no material and no emitter has a texture");
	struct tally t = {0};
	uint64_t triangles = 0;
	for (uint32_t i = 0; i < w->shape_count; i++)
		if (displacement_of(src->shape[i])) {
			count(&t, src->shape[i], "");
			triangles += w->shapes[i].triangle_count;
		}
	if (t.count)
		line(r, EFFECT_DISPLACEMENT, true, "%s %s displaced: %llu triangles", names_of(&t, text),
		     verb_of(&t, "is", "are"), (unsigned long long)triangles);
	else
		line(r, EFFECT_DISPLACEMENT, false, "no shape is displaced");
	static const enum effect absent[] = {EFFECT_BUMP, EFFECT_ALPHA};
	for (size_t i = 0; i < sizeof absent / sizeof *absent; i++)
		line(r, absent[i], false, "%s", effect_table[absent[i]].refuse);
	if (w->sharing_count)
		line(r, EFFECT_INSTANCING, true, "%u shapes are instances of %u meshes", w->sharing_count,
		     w->shared_mesh_count);
	else if (w->instance_count)
		line(r, EFFECT_INSTANCING, false, "no mesh is used twice, so what the %u instance%s show%s is copied",
		     w->instance_count, w->instance_count == 1 ? "" : "s", w->instance_count == 1 ? "s" : "");
	else
		line(r, EFFECT_INSTANCING, false, "no mesh is used in several places");
	motion(r, w, src);
	const struct render_coincident *k = &w->coincident;
	if (k->total > 1)
		line(r, EFFECT_COINCIDENCE, true, "%zu pairs of shapes coincide visibly", k->total);
	else if (k->total == 1)
		line(r, EFFECT_COINCIDENCE, true, "%s", k->text[0]);
	else if (w->coincidence)
		line(r, EFFECT_COINCIDENCE, true, "only opaque bodies touch");
	else
		line(r, EFFECT_COINCIDENCE, false, "no surfaces coincide");
}

static void emitter_moves(struct report *r, const struct census *c)
{
	char text[NAMES_MAX];
	bool called = c->area.count + c->environment.count > 0;
	if (called)
		r->fx->emitter_move = line(r, EFFECT_EMITTER_MOVE, true, "%s %s many points or directions",
					   names_of(c->area.count ? &c->area : &c->environment, text),
					   verb_of(c->area.count ? &c->area : &c->environment, "has", "have"));
	else
		r->fx->emitter_move = line(r, EFFECT_EMITTER_MOVE, false,
					   c->delta.count     ? "all emitters are single points or directions"
					   : c->shining.count ? "only media shine"
							      : "nothing shines");
}

/* Decides whether connections pass these materials. Where media scatter this cannot be forced: edges cross the faces of
 * `null` anyway, and connections end at all other surfaces. */
static bool shadows(struct report *r, enum effect effect, const struct tally *t, const char *scattered, const char *one,
		    const char *many)
{
	static const struct effects_choice nothing;
	struct report unforced = {r->fx, &nothing};
	return r->fx->scattering ? line(&unforced, effect, false, "%s", scattered)
				 : materials(r, effect, t, one, many, one);
}

static void depth(struct report *r, const struct world *w, const struct effects_source *src,
		  const enum visibility *shape)
{
	uint32_t asked = src->max_depth ? src->max_depth : w->settings.max_depth,
		 bound = w->effects.scattering ? UINT32_MAX : visibility_bounds_depth(w, shape);
	uint32_t useful = bound < asked ? bound : asked;
	bool on;
	if (useful < asked)
		on = line(r, EFFECT_DEPTH, false, "paths may have %u edges, but only up to %u can carry light: %s",
			  asked, useful, useful == 1 ? "nothing scatters" : "everything that scatters is in one plane");
	else
		on = line(r, EFFECT_DEPTH, true, "paths of up to %u edges can carry light", asked);
	r->fx->max_depth = on ? asked : useful;
}

void effects_analyse(struct world *w, const struct effects_source *src, const struct effects_choice *forced,
		     enum visibility *shape)
{
	struct effects *fx = &w->effects;
	*fx = (struct effects){.line_count = 0};
	visibility_bounds_shapes(w, src, src->max_depth ? src->max_depth : w->settings.max_depth, shape);
	struct census c = take_census(w, src, shape);
	struct report r = {fx, forced};
	spectral(&r, &c, w->accuracy.colour > 0);
	if (w->settings.aperture_radius > 0)
		fx->aperture = line(&r, EFFECT_APERTURE, true, "a lens of radius %g, focused at a distance of %g",
				    w->settings.aperture_radius, w->settings.focus_distance);
	else
		fx->aperture = line(&r, EFFECT_APERTURE, false, "the sensor is a pinhole");
	emitter_moves(&r, &c);
	lobes(&r, &c);
	surfaces(&r, &c, w, src);
	add_tally_line(&r, EFFECT_ENVIRONMENT, &c.environment, "is met by every ray that escapes", "",
		       "rays that escape meet nothing");
	add_tally_line(&r, EFFECT_AREA_LIGHT, &c.area, "shines from its surface", "shine from their surfaces",
		       "no surface shines");
	add_tally_line(&r, EFFECT_DELTA_LIGHT, &c.delta, "is a point or parallel light, which no path hits by chance",
		       "are points or parallel light, which no path hits by chance",
		       "no emitter is a point or parallel light");
	fx->medium_light = add_tally_line(&r, EFFECT_MEDIUM_LIGHT, &c.shining, "borders on a medium that shines",
					  "border on a medium that shines", "no medium shines");
	fx->scattering = fx->scattering || fx->medium_light;
	fx->transparent_shadows = shadows(&r, EFFECT_TRANSPARENT_SHADOWS, &c.straight,
					  "where media scatter or shine, connections look through `null` alone",
					  "lets light straight through", "let light straight through");
	fx->refracted_shadows = shadows(&r, EFFECT_REFRACTED_SHADOWS, &c.refracting,
					"where media scatter or shine, connections are not refracted",
					"refracts light exactly", "refract light exactly");
	fx->media = fx->absorption || fx->scattering;
	fx->joints = fx->media || fx->dispersion || fx->transparent_shadows || fx->refracted_shadows;
	depth(&r, w, src, shape);
}
