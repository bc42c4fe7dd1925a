/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Makes the map of brightness that all leases of a job share. It is sampled by bdpt, which finds all light that the
 * render finds, with about one sample a pixel, and in short renders with no more samples than their bootstrap has.
 *
 * -ENOMEM; -EDOM after an invalid floating-point operation. Nothing is left allocated then.
 */
#include "worker/render/path/brightness.h"
#include "worker/render/path/integrate_bdpt.h"
#include "worker/render/path/integrator.h"
#include "worker/render/render.h"

#include "common/base/mem.h"
#include "worker/render/math/fptrap.h"

enum { SAMPLES_LEAST = 1 << 12, SAMPLES_SHORT = 1 << 14, SAMPLES_MOST = 1 << 17 };

/* The nearest power of two. */
static uint64_t samples_of(const struct film_window *w, const struct plan *p)
{
	uint64_t n = SAMPLES_LEAST;
	double want = w->width * w->height;
	if (p->bootstrap < SAMPLES_SHORT)
		want = fmin(want, (double)p->bootstrap);
	while (n < SAMPLES_MOST && (double)n * M_SQRT2 < want)
		n *= 2;
	return n;
}

static int sample_map(struct brightness *map, struct path_context *c, const struct plan *p, struct error *e)
{
	jmp_buf back;
	if (setjmp(back))
		return error_set(e, EDOM,
				 "an invalid floating-point operation (SIGFPE) in the map of brightness for '%s'",
				 p->integrator);
	jmp_buf *caught = fptrap_catch(&back);
	int rc = brightness_of_samples(map, c, path_trace_both_ways, p->seed, RNG_BRIGHTNESS, 0,
				       samples_of(&c->window, p), e);
	fptrap_catch(caught);
	return rc;
}

int render_map_new(const struct world *w, const struct plan *p, struct brightness **out, struct error *e)
{
	uint64_t counters[BATCH_COUNTERS] = {0};
	const struct integrator *i = integrator_find(p->integrator);
	*out = NULL;
	if (!i)
		return error_set(e, EINVAL, "no integrator is called '%s'", p->integrator);
	if (!i->redistributes)
		return 0;
	struct brightness *map = mem_alloc(1, sizeof *map);
	struct path_context *c = mem_alloc(1, sizeof *c);
	int rc = map && c ? 0 : error_set(e, ENOMEM, "no memory for a map of brightness");
	if (!rc) {
		path_context_for_samples(c, w, p, counters);
		rc = sample_map(map, c, p, e);
	}
	mem_free(c);
	if (rc)
		render_map_free(map);
	else
		*out = map;
	return rc;
}

void render_map_free(struct brightness *map)
{
	if (map)
		brightness_fini(map);
	mem_free(map);
}
