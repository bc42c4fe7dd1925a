/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Learns which emitters light which places.
 *
 * The points at which camera paths scatter (emitter_points.h) are sorted into cells: their box is halved repeatedly,
 * each time across the longest axis along which the points can be divided. Each cell has its own probabilities.
 *
 * If emitter e is chosen with probability p_e, the second moment of the estimate of a point's direct light is sum c_e^2
 * / p_e, where c_e is the light from e. Relative to all light at the point, and averaged over the points of a cell, it
 * is sum a_e / p_e, where a_e is the mean of the squared shares of e. The minimum is at p_e proportional to sqrt(a_e).
 * Because a cell has few points, a_e includes borrowed_points points of the enclosing cell, whose a_e in turn includes
 * points of the cell around it, up to the whole scene. Light sub-paths choose their emitter by the mean of two
 * probabilities, one by power and one by the shares of the whole scene. Cells use these probabilities in a fraction
 * defensive_fraction of all cases, so that light that reached none of the points is chosen, too, and weights stay
 * bounded.
 *
 * Fails only if out of memory. Where too few points get light along a straight line (as when all lamps shine at
 * mirrors), or there are too many emitters, power alone decides.
 */
#include "worker/render/world/emitter_choice.h"

#include "worker/render/math/search.h"
#include "worker/render/world/emitter_part.h"
#include "worker/render/world/emitter_points.h"

enum {
	SHARES_MAX = 1 << 21, /* most points times parts; within the following bounds there is one point per pixel */
	POINTS_MAX = 1 << 13,
	POINTS_MIN = 1 << 9,
	CELL_POINTS = 16,
};
static const double borrowed_points = 4, defensive_fraction = 0.1;

/* Nodes are numbered as in a heap: 1 is the whole scene, and 2 i and 2 i + 1 are the halves of i. */
struct emitter_choice {
	uint32_t first_cell; /* index of the first leaf; also the number of leaves */
	struct cut {
		unsigned axis;
		double position;
	} * cuts; /* cuts[i]: where node i is halved */
	uint32_t part_count;
	/* For each cell, part_count + 1 cumulative probabilities: part i is chosen between edges i and i + 1. */
	double *cdf;
};

struct choice_builder {
	const struct world *w;
	struct emitter_choice *choice;
	const struct emitter_points *points;
	double *sum;		   /* sums of squared shares, for each part and node */
	double *light_probability; /* probabilities of the parts if light sub-paths chose them */
};

static const double *cell_cdf(const struct emitter_choice *c, vec3 p)
{
	uint32_t node = 1;
	while (node < c->first_cell)
		node = 2 * node + (vec3_component(p, c->cuts[node].axis) >= c->cuts[node].position);
	return &c->cdf[(size_t)(node - c->first_cell) * (c->part_count + 1)];
}

static double part_probability(const double *cdf, uint32_t part)
{
	return cdf[part + 1] - cdf[part];
}

bool emitter_choice_pick(const struct world *w, vec3 p, const double u[3], struct emitter_pick *out)
{
	const struct emitter_choice *c = w->emitter_choice;
	if (!c) {
		*out = (struct emitter_pick){.emitter = world_pick_emitter(w, u[2]), .u = {u[0], u[1]}};
		if (out->emitter >= 0)
			out->density_ratio = w->emitter_pdf[out->emitter];
		return out->emitter >= 0;
	}
	const double *cdf = cell_cdf(c, p);
	uint32_t part = search_find_cell(cdf, c->part_count, u[2]);
	out->emitter = emitter_of_part(w, part);
	out->density_ratio = part_probability(cdf, part) * emitter_part_density_ratio(w, part);
	emitter_part_remap(w, part, u, out->u);
	return true;
}

double emitter_choice_density_ratio(const struct world *w, vec3 p, int32_t emitter, const struct emitter *em,
				    const struct emitter_point *y)
{
	const struct emitter_choice *c = w->emitter_choice;
	if (!c)
		return w->emitter_pdf[emitter];
	uint32_t part = emitter_part_of(w, emitter, em, y);
	return part_probability(cell_cdf(c, p), part) * emitter_part_density_ratio(w, part);
}

/* ---- making it ---- */

/* Sorts the axes by the side lengths of the nodes' box, the longest first. */
static void sort_axes(const struct point_tree_node *nodes, size_t count, unsigned axis[3])
{
	struct box box = box_empty();
	for (size_t i = 0; i < count; i++)
		box_grow(&box, nodes[i].p);
	vec3 side = vec3_sub(box.max, box.min);
	for (unsigned k = 0; k < 3; k++) {
		unsigned slot = k;
		for (; slot > 0 && vec3_component(side, axis[slot - 1]) < vec3_component(side, k); slot--)
			axis[slot] = axis[slot - 1];
		axis[slot] = k;
	}
}

static bool is_divided(const struct point_tree_node *nodes, size_t middle, unsigned axis)
{
	for (size_t i = 0; i < middle; i++)
		if (vec3_component(nodes[i].p, axis) >= vec3_component(nodes[middle].p, axis))
			return false;
	return true;
}

/* Partitions the nodes around nodes[middle] along the longest axis for which all nodes before `middle` are strictly
 * below it, and returns that axis. Along other axes a lookup would not find them: the points of a floor, for example,
 * all have the same height. */
static unsigned divide_nodes(struct point_tree_node *nodes, size_t count, size_t middle)
{
	unsigned axis[3];
	sort_axes(nodes, count, axis);
	for (int k = 0; k < 3; k++) {
		point_tree_partition(nodes, count, middle, axis[k]);
		if (is_divided(nodes, middle, axis[k]))
			return axis[k];
	}
	return axis[2];
}

static double *node_sums(const struct choice_builder *m, uint32_t node)
{
	return &m->sum[(size_t)node * m->choice->part_count];
}

/* Divides the points recursively and adds up the squares of their shares. */
static void halve_node(const struct choice_builder *m, uint32_t node, struct point_tree_node *nodes, size_t count)
{
	const uint32_t n = m->choice->part_count;
	double *sum = node_sums(m, node);
	if (node >= m->choice->first_cell) {
		for (size_t i = 0; i < count; i++)
			for (uint32_t e = 0; e < n; e++) {
				double share = (double)m->points->shares[(size_t)nodes[i].id * n + e];
				sum[e] += share * share;
			}
		return;
	}
	size_t middle = count / 2;
	unsigned axis = divide_nodes(nodes, count, middle);
	m->choice->cuts[node] = (struct cut){axis, vec3_component(nodes[middle].p, axis)};
	halve_node(m, 2 * node, nodes, middle);
	halve_node(m, 2 * node + 1, &nodes[middle], count - middle);
	for (uint32_t e = 0; e < n; e++)
		sum[e] = node_sums(m, 2 * node)[e] + node_sums(m, 2 * node + 1)[e];
}

/* Computes sqrt(a), scaled to a sum of 1 and mixed with the probabilities of light sub-paths. */
static void part_probabilities(const double *a, uint32_t n, const double *light_probability, double *out)
{
	double sum = 0;
	for (uint32_t e = 0; e < n; e++)
		sum += sqrt(a[e]);
	for (uint32_t e = 0; e < n; e++)
		out[e] = (1 - defensive_fraction) * (sqrt(a[e]) / sum) + defensive_fraction * light_probability[e];
}

/* Computes the cumulative probabilities. cdf[n] is 1, and parts of probability 0 are never chosen. */
static void compute_cdf(const double *probability, uint32_t n, double *cdf)
{
	double sum = 0;
	for (uint32_t e = 0; e < n; e++) {
		cdf[e] = sum;
		sum += probability[e];
	}
	for (uint32_t e = 0; e < n; e++)
		cdf[e] /= sum;
	cdf[n] = 1;
	for (uint32_t e = n; e > 0 && probability[e - 1] == 0; e--)
		cdf[e - 1] = 1;
}

/* Turns sums into means that include the borrowed points of the enclosing node. `count` points are in the node. */
static void fill_node(const struct choice_builder *m, uint32_t node, size_t count)
{
	const uint32_t n = m->choice->part_count;
	double *a = node_sums(m, node);
	const double *parent = node > 1 ? node_sums(m, node / 2) : NULL;
	for (uint32_t e = 0; e < n; e++)
		a[e] = parent ? (a[e] + borrowed_points * parent[e]) / ((double)count + borrowed_points)
			      : a[e] / (double)count;
	if (node >= m->choice->first_cell) {
		part_probabilities(a, n, m->light_probability, a);
		compute_cdf(a, n, &m->choice->cdf[(size_t)(node - m->choice->first_cell) * (n + 1)]);
		return;
	}
	fill_node(m, 2 * node, count / 2);
	fill_node(m, 2 * node + 1, count - count / 2);
}

/* Sets the probabilities of light sub-paths, and those of the parts that follow from them. */
static void set_light_probabilities(struct world *w, const struct choice_builder *m)
{
	const struct emitter_points *p = m->points;
	const uint32_t n = m->choice->part_count;
	for (uint32_t e = 0; e < w->emitter_count; e++)
		w->emitter_pdf[e] /= 2;
	for (size_t i = 0; i < (size_t)p->count * n; i++)
		w->emitter_pdf[emitter_of_part(w, (uint32_t)(i % n))] += (double)p->shares[i] / 2 / p->count;
	compute_cdf(w->emitter_pdf, w->emitter_count, w->emitter_cdf);
	for (uint32_t e = 0; e < w->emitter_count; e++)
		w->emitter_pdf[e] = part_probability(w->emitter_cdf, e);
	for (uint32_t i = 0; i < n; i++)
		m->light_probability[i] = emitter_part_emits(w, i) ? w->emitter_pdf[emitter_of_part(w, i)] /
									     emitter_part_density_ratio(w, i)
								   : 0;
}

static int build_choice(struct world *w, struct arena *scratch, uint32_t part_count, uint32_t max_points)
{
	struct emitter_points points;
	int rc = emitter_points_find(w, max_points, scratch, &points);
	if (rc || points.count < CELL_POINTS)
		return rc;
	struct emitter_choice *c = arena_alloc(&w->arena, 1, sizeof *c);
	struct choice_builder m = {.w = w,
				   .choice = c,
				   .points = &points,
				   .light_probability = arena_alloc(scratch, part_count, sizeof *m.light_probability)};
	if (!c || !m.light_probability)
		return -ENOMEM;
	c->part_count = part_count;
	for (c->first_cell = 1; 2 * c->first_cell * CELL_POINTS <= points.count;)
		c->first_cell *= 2;
	c->cuts = arena_alloc(&w->arena, c->first_cell, sizeof *c->cuts);
	c->cdf = arena_alloc(&w->arena, c->first_cell * (part_count + (size_t)1), sizeof *c->cdf);
	m.sum = arena_alloc(scratch, 2 * c->first_cell * (size_t)part_count, sizeof *m.sum);
	if (!c->cuts || !c->cdf || !m.sum)
		return -ENOMEM;
	halve_node(&m, 1, points.nodes, points.count);
	set_light_probabilities(w, &m);
	fill_node(&m, 1, points.count);
	w->emitter_choice = c;
	return 0;
}

int emitter_choice_make(struct world *w)
{
	uint32_t emitting_parts = 0, part_count = emitter_part_count(w);
	for (uint32_t i = 0; i < part_count; i++)
		emitting_parts += emitter_part_emits(w, i);
	if (emitting_parts < 2 || w->emitter_count > EMITTER_CHOICE_EMITTERS_MAX ||
	    w->accuracy.emitter_choice != SETTING_BY_PLACE)
		return 0;
	uint32_t max_points = SHARES_MAX / part_count;
	uint64_t pixels = (uint64_t)w->settings.width * w->settings.height;
	max_points = max_points < pixels ? max_points : (uint32_t)pixels;
	max_points = max_points > POINTS_MAX ? POINTS_MAX : max_points < POINTS_MIN ? POINTS_MIN : max_points;
	struct arena scratch = {0};
	int rc = build_choice(w, &scratch, part_count, max_points);
	arena_fini(&scratch);
	return rc;
}
