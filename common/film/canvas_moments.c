/* SPDX-License-Identifier: Apache-2.0 */
#include "common/film/canvas_moments.h"

#include "common/base/mem.h"

#include <assert.h>
#include <math.h>

enum { SET_PREFIX, SET_OPEN, SETS = 3 };

/* First moments are times, at most the mutations made: 2^42 of them in one lease's chains fit. */
#define GRID 0x1p20
#define MUTATIONS_MOST (UINT64_C(1) << 42)

/* Moments are rounded to float once an epoch and then to the grid. What is smaller than this next to the mean is not
 * told from no spread at all: a film of one tile has every chain in it all the time. */
#define ROUNDING 0x1p-20

struct moments {
	struct plan plan;
	uint32_t per_lease, leases, tiles; /* sequences of a lease; leases of a round */
	int64_t *first;			   /* [set][lease][sequence][tile] */
	int64_t *second;		   /* [set][lease][tile] */
	struct exact_sum *time;		   /* [set][group][class] */
	struct exact_sum *bootstrap;	   /* [group][class] */
};

static size_t first_count(const struct moments *m)
{
	return (size_t)m->leases * m->per_lease * m->tiles;
}

static size_t second_count(const struct moments *m)
{
	return m->per_lease ? (size_t)m->leases * m->tiles : 0;
}

static size_t class_count(const struct moments *m)
{
	return (size_t)m->plan.groups * PATH_CLASSES;
}

int moments_new(struct moments **out, const struct plan *p, struct error *e)
{
	struct moments *m = mem_alloc(1, sizeof *m);
	*out = m;
	if (m) {
		m->plan = *p;
		m->per_lease = batch_sequences(p);
		m->leases = p->groups * p->parts;
		m->tiles = batch_film_tiles(p);
		m->first = mem_alloc(SETS * first_count(m), sizeof *m->first);
		m->second = mem_alloc(SETS * second_count(m), sizeof *m->second);
		m->time = mem_alloc(SETS * class_count(m), sizeof *m->time);
		m->bootstrap = mem_alloc(class_count(m), sizeof *m->bootstrap);
		if (m->first && m->second && m->time && m->bootstrap)
			return 0;
	}
	moments_free(m);
	*out = NULL;
	return error_set(e, ENOMEM, "no memory for the moments of chains");
}

void moments_free(struct moments *m)
{
	if (!m)
		return;
	mem_free(m->first);
	mem_free(m->second);
	mem_free(m->time);
	mem_free(m->bootstrap);
	mem_free(m);
}

int moments_fit(const struct moments *m, const struct lease_key *k, struct error *e)
{
	if (m->per_lease == 0 || k->kind != LEASE_RENDER)
		return 0;
	uint64_t chains = m->plan.chains / m->leases, epochs = MUTATIONS_MOST / chains / m->plan.epoch;
	if (k->epoch < epochs)
		return 0;
	return error_set(e, ERANGE, "after %llu rounds the moments of chains leave their range",
			 (unsigned long long)epochs);
}

static void add_grid(int64_t *to, const float *from, size_t count, int sign)
{
	for (size_t i = 0; i < count; i++)
		to[i] += sign * llrint((double)from[i] * GRID);
}

static void add_classes(struct exact_sum *to, const double classes[PATH_CLASSES], int sign)
{
	for (int k = 0; k < PATH_CLASSES; k++)
		if (classes[k] != 0) {
			bool finite = exact_sum_add(&to[k], sign * classes[k]);
			assert(finite); /* batch_check */
			(void)finite;
		}
}

static void add_render(struct moments *m, const struct batch *b, bool closed, int sign)
{
	const struct lease_key *k = &b->key;
	size_t group = (size_t)k->group * PATH_CLASSES, set = closed ? SET_PREFIX : SET_OPEN + k->epoch % 2;
	add_classes(m->time + set * class_count(m) + group, b->classes, sign);
	if (b->moment_count == 0)
		return;
	size_t lease = (size_t)k->group * m->plan.parts + k->part, own = (size_t)m->per_lease * m->tiles;
	add_grid(m->first + set * first_count(m) + lease * own, b->moments, own, sign);
	add_grid(m->second + set * second_count(m) + lease * m->tiles, b->moments + own, m->tiles, sign);
}

void moments_add(struct moments *m, const struct batch *b, bool closed)
{
	if (b->key.kind == LEASE_BOOTSTRAP)
		add_classes(m->bootstrap + (size_t)b->key.group * PATH_CLASSES, b->classes, 1);
	else
		add_render(m, b, closed, 1);
}

void moments_take_back(struct moments *m, const struct batch *b, bool closed)
{
	add_render(m, b, closed, -1);
}

/* What is 0 is left alone, so that its page stays untouched. */
static void move_grid(int64_t *to, int64_t *from, size_t count)
{
	for (size_t i = 0; i < count; i++)
		if (from[i]) {
			to[i] += from[i];
			from[i] = 0;
		}
}

void moments_close_round(struct moments *m, uint64_t round)
{
	size_t set = SET_OPEN + round % 2;
	struct exact_sum *time = m->time + set * class_count(m);
	move_grid(m->first, m->first + set * first_count(m), first_count(m));
	move_grid(m->second, m->second + set * second_count(m), second_count(m));
	for (size_t i = 0; i < class_count(m); i++) {
		exact_sum_merge(&m->time[i], &time[i]);
		time[i] = (struct exact_sum){0};
	}
}

/* ---- files */

/* Runs of a film's tiles, or of a group's classes; one of zeros is a byte. */
static int save_runs(struct checked_file *out, const void *bytes, size_t run, size_t count, struct error *e)
{
	const unsigned char *p = bytes;
	int rc = 0;
	for (size_t i = 0; i < count && !rc; i++, p += run) {
		unsigned char any = 0;
		for (size_t k = 0; k < run && !any; k++)
			any = p[k] != 0;
		rc = checked_file_write(out, &any, 1, e);
		if (!rc && any)
			rc = checked_file_write(out, p, run, e);
	}
	return rc;
}

static int load_runs(struct checked_file *in, void *bytes, size_t run, size_t count, struct error *e)
{
	unsigned char *p = bytes;
	int rc = 0;
	for (size_t i = 0; i < count && !rc; i++, p += run) {
		unsigned char any;
		rc = checked_file_read(in, &any, 1, e);
		if (!rc && any)
			rc = checked_file_read(in, p, run, e);
	}
	return rc;
}

int moments_save(const struct moments *m, struct checked_file *out, struct error *e)
{
	size_t film = m->tiles * sizeof *m->first, sum = sizeof *m->time;
	uint32_t shape[4] = {m->per_lease, m->leases, m->tiles, PATH_CLASSES};
	int rc = checked_file_write(out, shape, sizeof shape, e);
	if (!rc)
		rc = save_runs(out, m->first, film, SETS * first_count(m) / m->tiles, e);
	if (!rc)
		rc = save_runs(out, m->second, film, SETS * second_count(m) / m->tiles, e);
	if (!rc)
		rc = save_runs(out, m->time, sum, SETS * class_count(m), e);
	return rc ? rc : save_runs(out, m->bootstrap, sum, class_count(m), e);
}

int moments_load(struct moments *m, struct checked_file *in, struct error *e)
{
	size_t film = m->tiles * sizeof *m->first, sum = sizeof *m->time;
	uint32_t shape[4];
	int rc = checked_file_read(in, shape, sizeof shape, e);
	if (!rc &&
	    (shape[0] != m->per_lease || shape[1] != m->leases || shape[2] != m->tiles || shape[3] != PATH_CLASSES))
		rc = error_set(e, EBADMSG, "moments of other chains");
	if (!rc)
		rc = load_runs(in, m->first, film, SETS * first_count(m) / m->tiles, e);
	if (!rc)
		rc = load_runs(in, m->second, film, SETS * second_count(m) / m->tiles, e);
	if (!rc)
		rc = load_runs(in, m->time, sum, SETS * class_count(m), e);
	return rc ? rc : load_runs(in, m->bootstrap, sum, class_count(m), e);
}

/* ---- tiles */

/* Over sequences of one tile: mean and variance of their means, and the mean variance of a mutation within one. */
struct spread {
	double mean, between, within;
};

static double r_hat(const struct spread *s, double n)
{
	if (!(s->mean > 0) || isnan(s->between) || n < 2)
		return NAN;
	bool same = s->between <= (ROUNDING * s->mean) * (ROUNDING * s->mean);
	if (s->within <= ROUNDING * s->mean)
		return same ? 1 : INFINITY;
	return sqrt((n - 1) / n + s->between / s->within);
}

static void find_spread(const struct moments *m, uint32_t tile, double n, struct spread *s)
{
	size_t sequences = (size_t)m->leases * m->per_lease;
	double count = (double)sequences, square = 0, second = 0;
	*s = (struct spread){0, 0, 0};
	for (size_t i = 0; i < sequences; i++)
		s->mean += (double)m->first[i * m->tiles + tile];
	s->mean /= GRID * n * count;
	for (size_t i = 0; i < sequences; i++) {
		double p = (double)m->first[i * m->tiles + tile] / (GRID * n), d = p - s->mean;
		s->between += d * d;
		square += p * p;
	}
	for (size_t i = 0; i < m->leases; i++)
		second += (double)m->second[i * m->tiles + tile];
	s->between = sequences > 1 ? s->between / (count - 1) : NAN;
	s->within = n > 1 ? (second / (GRID * n * count) - square / count) * n / (n - 1) : NAN;
}

static int make_tiles(const struct moments *m, double n, struct canvas_image *img, struct error *e)
{
	img->r_hat = mem_alloc(m->tiles, sizeof *img->r_hat);
	img->tile_error = mem_alloc(m->tiles, sizeof *img->tile_error);
	img->tile_share = mem_alloc(m->tiles, sizeof *img->tile_share);
	double *mean = mem_alloc(m->tiles, sizeof *mean), all = 0;
	int rc = img->r_hat && img->tile_error && img->tile_share && mean ? 0
									  : error_set(e, ENOMEM, "no memory for tiles");
	for (uint32_t t = 0; t < m->tiles && rc == 0; t++) {
		struct spread s;
		find_spread(m, t, n, &s);
		img->r_hat[t] = (float)r_hat(&s, n);
		img->tile_error[t] =
			(float)(s.mean > 0 ? sqrt(s.between / ((double)m->leases * m->per_lease)) / s.mean : NAN);
		mean[t] = s.mean;
		all += s.mean;
	}
	for (uint32_t t = 0; t < m->tiles && rc == 0; t++)
		img->tile_share[t] = (float)(all > 0 ? mean[t] / all : 0);
	mem_free(mean);
	return rc;
}

/* ---- classes */

/* Mean of the groups' values and its standard error. */
static double mean_of(const double *x, uint32_t groups, double *error)
{
	double mean = 0, square = 0;
	for (uint32_t g = 0; g < groups; g++)
		mean += x[g] / groups;
	for (uint32_t g = 0; g < groups; g++)
		square += (x[g] - mean) * (x[g] - mean);
	*error = groups > 1 ? sqrt(square / groups / (groups - 1)) : NAN;
	return mean;
}

static double chains_time(const struct moments *m, uint32_t group, size_t class, bool open_rounds)
{
	struct exact_sum sum = {0};
	for (size_t set = 0; set < (open_rounds ? SETS : SET_OPEN); set++)
		exact_sum_merge(&sum, &m->time[set * class_count(m) + (size_t)group * PATH_CLASSES + class]);
	return exact_sum_value(&sum);
}

static void make_class(const struct moments *m, const struct moments_group *groups, size_t class, bool open_rounds,
		       struct path_class_energy *out)
{
	uint32_t count = m->plan.groups;
	double bootstrap[PLAN_MAX_GROUPS], chains[PLAN_MAX_GROUPS], difference[PLAN_MAX_GROUPS], error;
	for (uint32_t g = 0; g < count; g++) {
		const struct moments_group *of = &groups[g];
		double sum = exact_sum_value(&m->bootstrap[(size_t)g * PATH_CLASSES + class]);
		double time = of->mutations ? chains_time(m, g, class, open_rounds) : 0;
		bootstrap[g] = of->bootstrap ? sum / (double)of->bootstrap : 0;
		chains[g] = of->mutations ? of->b * time / (double)of->mutations : 0;
		difference[g] = chains[g] - bootstrap[g];
	}
	out->bootstrap = mean_of(bootstrap, count, &out->bootstrap_error);
	out->chains = mean_of(chains, count, &out->chains_error);
	double mean = mean_of(difference, count, &error);
	bool compared = m->per_lease && (out->bootstrap > 0 || out->chains > 0);
	out->difference_t = compared && !(mean == 0 && error == 0) ? mean / error : NAN;
}

int moments_image(const struct moments *m, const struct moments_group *groups, uint64_t rounds, bool open_rounds,
		  struct canvas_image *img, struct error *e)
{
	const struct plan *p = &m->plan;
	img->tiles_across = (p->crop_width + TILE_SIZE - 1) / TILE_SIZE;
	img->tiles_down = (p->crop_height + TILE_SIZE - 1) / TILE_SIZE;
	for (size_t k = 0; k < PATH_CLASSES; k++)
		make_class(m, groups, k, open_rounds, &img->classes[k]);
	if (m->per_lease == 0 || open_rounds || rounds == 0)
		return 0;
	double chains = (double)(p->chains / m->leases / m->per_lease);
	return make_tiles(m, chains * (double)p->epoch * (double)rounds, img, e);
}
