/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/pilot_plan.h"

#include <stdio.h>
#include <string.h>

enum {
	SAMPLES_MIN = 1 << 12,
	LONG_SAMPLES_MAX = 1 << 18,
	SAMPLES_MAX = 1 << 20,
	SHORT_DIVISOR = 32,  /* a pilot has 1/32 of the render's samples, for each kind, up to PILOT_SAMPLES */
	LONG_DIVISOR = 128,  /* 1/128 from there to LONG_SAMPLES_MAX: the pilot has one thread, whereas the render may
				have many */
	HOURS_DIVISOR = 512, /* 1/512 beyond that */
	SAMPLES_PER_SECOND = 100000, /* assumed samples per second, for a render limited by time */
};

uint64_t pilot_samples(const struct plan_request *r, uint64_t pixels)
{
	uint64_t total = UINT64_MAX, n = SAMPLES_MIN;
	if (r->spp && r->spp < UINT64_MAX / pixels)
		total = r->spp * pixels;
	if (r->mutations && r->mutations < total)
		total = r->mutations;
	if (r->seconds > 0)
		total = (uint64_t)fmin((double)total, fmin(r->seconds * SAMPLES_PER_SECOND, 0x1p62));
	else if (!r->spp && !r->mutations)
		total = (uint64_t)PILOT_SAMPLES * SHORT_DIVISOR;
	double wanted =
		fmax(fmin((double)(total / SHORT_DIVISOR), PILOT_SAMPLES),
		     fmax(fmin((double)(total / LONG_DIVISOR), LONG_SAMPLES_MAX), (double)(total / HOURS_DIVISOR)));
	while (n < SAMPLES_MAX && (double)n * M_SQRT2 < wanted)
		n *= 2;
	return n;
}

int pilot_make_plan(const struct plan_request *r, struct plan *p, struct error *e)
{
	struct plan_request request = *r;
	memset(request.integrator, 0, sizeof request.integrator);
	memset(request.mixture, 0, sizeof request.mixture);
	snprintf(request.integrator, sizeof request.integrator, "path");
	request.kind = PLAN_SAMPLES;
	request.chains = 0;
	request.groups = request.parts = 1;
	request.target_error = 0;		/* only for renders with groups */
	if (!plan_request_is_bounded(&request)) /* plan_make needs some bound */
		request.spp = 1;
	int rc = plan_make(&request, p, e);
	p->crop_x = p->crop_y = 0;
	p->crop_width = p->width;
	p->crop_height = p->height;
	return rc;
}

bool pilot_scene_has(const struct render_summary *s, const char *effect)
{
	for (size_t i = 0; i < s->effect_line_count; i++)
		if (strcmp(s->effect_lines[i].name, effect) == 0)
			return s->effect_lines[i].is_on != s->effect_lines[i].is_forced;
	return true;
}
