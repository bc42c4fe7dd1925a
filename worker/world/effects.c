#include "worker/world/effects.h"

#include <stdarg.h>
#include <stdio.h>

__attribute__((format(printf, 4, 5))) static void line(struct effects *fx, const char *name, bool on, const char *why, ...)
{
	struct effect_line *l = &fx->lines[fx->line_count++];
	l->name = name;
	l->on = on;
	va_list ap;
	va_start(ap, why);
	vsnprintf(l->why, sizeof l->why, why, ap);
	va_end(ap);
}

struct census {
	size_t specular, glossy, diffuse, transmission, textured, coloured, dispersive, environment, area, delta, textured_light;
	size_t shape[3];
};

static struct census take(const struct bsdf *b, size_t bn, const struct emitter *em, size_t en)
{
	struct census c = {0};
	for (size_t i = 0; i < bn; i++) {
		c.specular += b[i].has_delta;
		c.glossy += b[i].has_smooth && isfinite(b[i].alpha);
		c.diffuse += b[i].has_smooth && !isfinite(b[i].alpha);
		c.transmission += (b[i].modes & BSDF_TRANSMIT) != 0;
		c.textured += b[i].textured;
		c.coloured += b[i].shape != COLOR_SHAPE_CONSTANT;
		c.dispersive += b[i].dispersive;
	}
	for (size_t i = 0; i < en; i++) {
		c.delta += em[i].delta;
		c.environment += em[i].infinite && !em[i].delta;
		c.area += !em[i].infinite && !em[i].delta;
		c.textured_light += em[i].textured;
		c.shape[em[i].shape]++;
	}
	return c;
}

static void colour(struct effects *fx, const struct census *c, size_t emitters)
{
	bool one_shape = c->shape[COLOR_SHAPE_OTHER] == 0 && (!c->shape[COLOR_SHAPE_CONSTANT] || !c->shape[COLOR_SHAPE_D65]);
	fx->colour = c->coloured > 0 || !one_shape;
	fx->illuminant = c->shape[COLOR_SHAPE_CONSTANT] ? COLOR_SHAPE_CONSTANT : COLOR_SHAPE_D65;
	if (c->coloured)
		line(fx, "colour", true, "%zu materials vary with wavelength", c->coloured);
	else if (!one_shape)
		line(fx, "colour", true, "the %zu emitters differ in spectrum or are coloured", emitters);
	else
		line(fx, "colour", false, "all materials are grey and all emitters have one spectrum: no wavelength is drawn");
}

void effects_analyse(struct effects *fx, const struct scene_settings *settings, const struct bsdf *bsdfs, size_t bsdf_count,
		     const struct emitter *emitters, size_t emitter_count)
{
	*fx = (struct effects){.max_depth = settings->max_depth};
	struct census c = take(bsdfs, bsdf_count, emitters, emitter_count);
	colour(fx, &c, emitter_count);
	fx->dispersion = c.dispersive > 0;
	if (fx->dispersion)
		line(fx, "dispersion", true, "%zu material%s by an index that varies with wavelength: paths that meet %s carry one",
		     c.dispersive, c.dispersive == 1 ? " refracts" : "s refract", c.dispersive == 1 ? "it" : "them");
	else
		line(fx, "dispersion", false, "no index of refraction varies with wavelength: wavelengths travel together");
	fx->aperture = settings->aperture_radius > 0;
	if (fx->aperture)
		line(fx, "aperture", true, "a lens of radius %g, focused at a distance of %g", settings->aperture_radius,
		     settings->focus_distance);
	else
		line(fx, "aperture", false, "the sensor is a pinhole");
	fx->specular = c.specular > 0;
	line(fx, "specular", fx->specular, "%zu materials have exactly specular lobes", c.specular);
	fx->glossy = c.glossy > 0;
	line(fx, "glossy", fx->glossy, "%zu materials have rough lobes of finite width", c.glossy);
	fx->diffuse = c.diffuse > 0;
	line(fx, "diffuse", fx->diffuse, "%zu materials scatter diffusely only", c.diffuse);
	fx->transmission = c.transmission > 0;
	line(fx, "transmission", fx->transmission, "%zu materials let light through", c.transmission);
	fx->textures = c.textured + c.textured_light > 0;
	line(fx, "textures", fx->textures, "%zu materials and %zu emitters are textured", c.textured, c.textured_light);
	fx->environment = c.environment > 0;
	line(fx, "environment", fx->environment, c.environment ? "rays that escape meet an emitter" : "rays that escape meet nothing");
	fx->area_light = c.area > 0;
	line(fx, "area-light", fx->area_light, "%zu surfaces emit", c.area);
	fx->delta_light = c.delta > 0;
	line(fx, "delta-light", fx->delta_light, "%zu emitters are points or parallel light, which no path hits by chance", c.delta);
	line(fx, "depth", settings->max_depth > 1, "paths have at most %u edges", settings->max_depth);
}

/* In threes, from the right. */
static const char *with_commas(uint64_t x, char text[32])
{
	char *p = text + 31;
	*p = 0;
	for (int digits = 0; x || !digits; digits++, x /= 10) {
		if (digits && digits % 3 == 0)
			*--p = ',';
		*--p = (char)('0' + x % 10);
	}
	return p;
}

void effects_add_displacement(struct effects *fx, size_t shapes, uint64_t triangles)
{
	char text[32];
	fx->displacement = shapes > 0;
	if (shapes)
		line(fx, "displacement", true, "%zu shapes are displaced: %s triangles", shapes, with_commas(triangles, text));
	else
		line(fx, "displacement", false, "no shape is displaced");
}
