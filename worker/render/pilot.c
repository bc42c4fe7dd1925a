/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/pilot.h"

#include <stdio.h>
#include <string.h>

enum {
	SAMPLES_LEAST = 1 << 12,
	SAMPLES_LONG = 1 << 18,
	SAMPLES_MOST = 1 << 20,
	SHARE_SHORT = 32, /* a pilot has 1/32 of the render's samples, for each kind, up to PILOT_SAMPLES */
	SHARE_LONG =
		128, /* 1/128 from there to SAMPLES_LONG: the pilot has one thread, whereas the render may have many */
	SHARE_HOURS = 512, /* 1/512 beyond that */
	A_SECOND = 100000, /* assumed samples per second, for a render limited by time */
};

uint64_t pilot_samples(const struct plan_request *r, uint64_t pixels)
{
	uint64_t total = UINT64_MAX, n = SAMPLES_LEAST;
	if (r->spp && r->spp < UINT64_MAX / pixels)
		total = r->spp * pixels;
	if (r->mutations && r->mutations < total)
		total = r->mutations;
	if (r->seconds > 0)
		total = (uint64_t)fmin((double)total, fmin(r->seconds * A_SECOND, 0x1p62));
	else if (!r->spp && !r->mutations)
		total = (uint64_t)PILOT_SAMPLES * SHARE_SHORT;
	double share = fmax(fmin((double)(total / SHARE_SHORT), PILOT_SAMPLES),
			    fmax(fmin((double)(total / SHARE_LONG), SAMPLES_LONG), (double)(total / SHARE_HOURS)));
	while (n < SAMPLES_MOST && (double)n * M_SQRT2 < share)
		n *= 2;
	return n;
}

int pilot_film(const struct plan_request *r, struct plan *p, struct error *e)
{
	struct plan_request of = *r;
	memset(of.integrator, 0, sizeof of.integrator);
	memset(of.mixture, 0, sizeof of.mixture);
	snprintf(of.integrator, sizeof of.integrator, "path");
	of.kind = PLAN_SAMPLES;
	of.chains = 0;
	of.groups = of.parts = 1;
	of.target_error = 0;		   /* only for renders with groups */
	if (!plan_request_is_bounded(&of)) /* plan_make needs some bound */
		of.spp = 1;
	int rc = plan_make(&of, p, e);
	p->crop_x = p->crop_y = 0;
	p->crop_width = p->width;
	p->crop_height = p->height;
	return rc;
}

bool pilot_scene_has(const struct render_summary *s, const char *effect)
{
	for (size_t i = 0; i < s->line_count; i++)
		if (strcmp(s->lines[i].name, effect) == 0)
			return s->lines[i].on != s->lines[i].forced;
	return true;
}
