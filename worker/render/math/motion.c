/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Motion between keyframes. motion_make selects the keyframes that matter and decomposes each: the orthogonal factor,
 * by Newton's iteration, becomes a quaternion; the remaining factor is symmetric. motion_transform_at finds the two
 * keys around a time, interpolates and multiplies the factors. motion_bounds divides the motion between two keys into
 * parts and bounds how far a point moves within each.
 *
 * Nothing fails: keyframes without an inverse, or with one that exceeds the range of doubles, are refused where they
 * are read (worker/render/scene/animation.c), and the iteration ends after at most POLAR_STEPS steps.
 */
#include "worker/render/math/motion.h"

#include <string.h>

/* Newton's iteration at least halves the error: it takes some 20 steps for scales that differ by 2^16. */
enum { POLAR_STEPS = 100 };

static double norm3(const double a[3][3])
{
	double sum = 0;
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			sum += a[i][k] * a[i][k];
	return sqrt(sum);
}

/* Computes the inverse of the transpose. */
static void invert_transpose(const double a[3][3], double out[3][3])
{
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++) {
			int i1 = (i + 1) % 3, i2 = (i + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
			out[i][k] = a[i1][k1] * a[i2][k2] - a[i1][k2] * a[i2][k1];
		}
	double det = a[0][0] * out[0][0] + a[0][1] * out[0][1] + a[0][2] * out[0][2];
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			out[i][k] /= det;
}

/* Computes the orthogonal factor of a (Higham 1986, Computing the Polar Decomposition). */
static void orthogonal_factor(const double a[3][3], double q[3][3])
{
	double scale = 1 / norm3(a), change = INFINITY;
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			q[i][k] = scale * a[i][k];
	for (int step = 0; step < POLAR_STEPS && change > 0x1p-50; step++) {
		double inverse[3][3];
		invert_transpose((const double(*)[3])q, inverse);
		double g = change > 0.01 ? sqrt(norm3((const double(*)[3])inverse) / norm3((const double(*)[3])q)) : 1;
		change = 0;
		for (int i = 0; i < 3; i++)
			for (int k = 0; k < 3; k++) {
				double next = 0.5 * (g * q[i][k] + inverse[i][k] / g);
				change = fmax(change, fabs(next - q[i][k]));
				q[i][k] = next;
			}
	}
}

/* Converts a rotation to a quaternion. The largest component is computed first, so that the others are not
 * divided by a small number. */
static void quaternion_from_rotation(const double r[3][3], double q[4])
{
	double trace = r[0][0] + r[1][1] + r[2][2];
	int i = 0;
	for (int k = 1; k < 3; k++)
		i = r[k][k] > r[i][i] ? k : i;
	int j = (i + 1) % 3, l = (i + 2) % 3;
	if (trace >= r[i][i]) {
		q[0] = 1 + trace;
		q[1] = r[2][1] - r[1][2];
		q[2] = r[0][2] - r[2][0];
		q[3] = r[1][0] - r[0][1];
	} else {
		q[0] = r[l][j] - r[j][l];
		q[1 + i] = 1 + r[i][i] - r[j][j] - r[l][l];
		q[1 + j] = r[j][i] + r[i][j];
		q[1 + l] = r[l][i] + r[i][l];
	}
	double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
	for (int k = 0; k < 4; k++)
		q[k] /= length;
}

static void decompose_keyframe(const struct keyframe *keyframe, struct motion_key *k)
{
	double a[3][3], q[3][3];
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			a[i][j] = keyframe->transform.m[i][j];
	orthogonal_factor((const double(*)[3])a, q);
	double sign = mat4_det3(keyframe->transform) < 0 ? -1 : 1;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			q[i][j] *= sign;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j <= i; j++) {
			double s = 0;
			for (int l = 0; l < 3; l++)
				s += 0.5 * (q[l][i] * a[l][j] + q[l][j] * a[l][i]);
			k->stretch[i][j] = k->stretch[j][i] = s;
		}
	quaternion_from_rotation((const double(*)[3])q, k->rotation);
	k->translation = (vec3){keyframe->transform.m[0][3], keyframe->transform.m[1][3], keyframe->transform.m[2][3]};
	k->half_angle = 0;
}

/* Replaces next->rotation by its negative, which is the same rotation, if that is nearer to k's, and
 * sets the angle between them. */
static void set_half_angle(struct motion_key *k, struct motion_key *next)
{
	double difference_squared = 0, sum_squared = 0;
	for (int i = 0; i < 4; i++) {
		difference_squared += (next->rotation[i] - k->rotation[i]) * (next->rotation[i] - k->rotation[i]);
		sum_squared += (next->rotation[i] + k->rotation[i]) * (next->rotation[i] + k->rotation[i]);
	}
	if (difference_squared > sum_squared)
		for (int i = 0; i < 4; i++)
			next->rotation[i] = -next->rotation[i];
	k->half_angle =
		2 * atan2(sqrt(fmin(difference_squared, sum_squared)), sqrt(fmax(difference_squared, sum_squared)));
}

static bool has_same_transform(const struct keyframe *a, const struct keyframe *b)
{
	return memcmp(&a->transform, &b->transform, sizeof a->transform) == 0;
}

/* Shorter exposures count as closed, because times in units of the exposure would not be finite. */
#define EXPOSURE_MIN 1e-30

bool motion_make(struct motion *m, const struct animation *a, double open, double close, struct motion_key *keys)
{
	uint32_t first = 0, last = a->count - 1;
	while (first < last && a->key[first + 1].time <= open)
		first++;
	while (last > first && a->key[last - 1].time >= close)
		last--;
	bool is_open = close - open > EXPOSURE_MIN, has_motion = false;
	double unit = is_open ? close - open : 1;
	*m = (struct motion){.count = last - first + 1, .key = keys, .pre_transform = mat4_identity()};
	for (uint32_t i = 0; i < m->count; i++) {
		const struct keyframe *keyframe = &a->key[first + i];
		decompose_keyframe(keyframe, &m->key[i]);
		m->key[i].time = (keyframe->time - open) / unit;
		if (i > 0)
			set_half_angle(&m->key[i - 1], &m->key[i]);
		has_motion |= i > 0 && !has_same_transform(keyframe - 1, keyframe) &&
			      a->key[first + i - 1].time < close && keyframe->time > open;
	}
	return has_motion && is_open;
}

void motion_rescale(struct motion *m, vec3 center, double scale)
{
	for (uint32_t i = 0; i < m->count; i++) {
		struct motion_key *k = &m->key[i];
		k->translation = vec3_scale(scale, vec3_sub(k->translation, center));
		for (int j = 0; j < 3; j++)
			for (int l = 0; l < 3; l++)
				k->stretch[j][l] *= scale;
	}
}

/* Returns the index of the last key that is not after that time; 0 if there is none. */
static uint32_t find_key(const struct motion *m, double time)
{
	uint32_t low = 0, high = m->count;
	while (high - low > 1) {
		uint32_t middle = low + (high - low) / 2;
		if (m->key[middle].time <= time)
			low = middle;
		else
			high = middle;
	}
	return low;
}

static void rotation_from_quaternion(const double q[4], double r[3][3])
{
	double w = q[0], x = q[1], y = q[2], z = q[3];
	const double m[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
				{2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
				{2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
	memcpy(r, m, sizeof m);
}

static void interpolate_rotation(const struct motion_key *a, const struct motion_key *b, double s, double q[4])
{
	double sine = sin(a->half_angle), weight_a = 1, weight_b = 0;
	if (sine > 0) {
		weight_a = sin((1 - s) * a->half_angle) / sine;
		weight_b = sin(s * a->half_angle) / sine;
	}
	for (int i = 0; i < 4; i++)
		q[i] = weight_a * a->rotation[i] + weight_b * b->rotation[i];
}

/* Returns the transform between two keys, without `pre_transform`. */
static mat4 interpolate_transform(const struct motion_key *a, const struct motion_key *b, double s)
{
	double q[4], r[3][3];
	interpolate_rotation(a, b, s, q);
	rotation_from_quaternion(q, r);
	mat4 m = mat4_identity();
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++) {
			double sum = 0;
			for (int l = 0; l < 3; l++)
				sum += r[i][l] * ((1 - s) * a->stretch[l][k] + s * b->stretch[l][k]);
			m.m[i][k] = sum;
		}
	m.m[0][3] = (1 - s) * a->translation.x + s * b->translation.x;
	m.m[1][3] = (1 - s) * a->translation.y + s * b->translation.y;
	m.m[2][3] = (1 - s) * a->translation.z + s * b->translation.z;
	return m;
}

mat4 motion_transform_at(const struct motion *m, double time)
{
	uint32_t i = find_key(m, time);
	const struct motion_key *a = &m->key[i], *b = i + 1 < m->count ? a + 1 : a;
	double s = b > a && time > a->time ? fmin((time - a->time) / (b->time - a->time), 1) : 0;
	return mat4_mul(interpolate_transform(a, b, s), m->pre_transform);
}

/* The motion is bounded in parts that turn by at most this angle. */
#define PART_ANGLE_MAX (M_PI / 32)

struct sweep {
	const mat4 *pre_transform;
	vec3 middle, half;   /* the box */
	double max_distance; /* largest distance of its points from the origin, after `pre_transform` */
	vec3 box_min, box_max;
};

static void grow_sweep(struct sweep *w, const mat4 *m, double margin)
{
	vec3 c = mat4_point(m, w->middle);
	const double center[3] = {c.x, c.y, c.z}, half[3] = {w->half.x, w->half.y, w->half.z};
	double *low[3] = {&w->box_min.x, &w->box_min.y, &w->box_min.z},
	       *high[3] = {&w->box_max.x, &w->box_max.y, &w->box_max.z};
	for (int i = 0; i < 3; i++) {
		double r = margin;
		for (int k = 0; k < 3; k++)
			r += fabs(m->m[i][k]) * half[k];
		*low[i] = fmin(*low[i], center[i] - r);
		*high[i] = fmax(*high[i], center[i] + r);
	}
}

/* Bounds the motion from s = begin to end between two keys. A point is p = R q + c, where q = S x and c are
 * linear in s. Over a part in which R turns by f and q changes by dq, |p''| <= f^2 |q| + 2 f |dq| with s in
 * units of that part, so p is off the chord between its ends by at most an eighth of that. The chord is in the
 * hull of the boxes at the ends. */
static void sweep_between(struct sweep *w, const struct motion_key *a, const struct motion_key *b, double begin,
			  double end)
{
	double turned = 2 * a->half_angle * (end - begin), parts = fmax(ceil(turned / PART_ANGLE_MAX), 1);
	double change[3][3], f = turned / parts;
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 3; k++)
			change[i][k] = b->stretch[i][k] - a->stretch[i][k];
	double q = w->max_distance * fmax(norm3((const double(*)[3])a->stretch), norm3((const double(*)[3])b->stretch)),
	       dq = w->max_distance * norm3((const double(*)[3])change) * (end - begin) / parts;
	double margin = (f * f * q + 2 * f * dq) / 8;
	for (int i = 0; i <= (int)parts; i++) {
		mat4 m = mat4_mul(interpolate_transform(a, b, begin + (end - begin) * i / parts), *w->pre_transform);
		grow_sweep(w, &m, margin);
	}
}

void motion_bounds(const struct motion *m, vec3 low, vec3 high, vec3 *all_low, vec3 *all_high)
{
	struct sweep w = {.pre_transform = &m->pre_transform,
			  .half = vec3_scale(0.5, vec3_sub(high, low)),
			  .box_min = {INFINITY, INFINITY, INFINITY},
			  .box_max = {-INFINITY, -INFINITY, -INFINITY}};
	w.middle = vec3_add(low, w.half);
	for (int k = 0; k < 8; k++) {
		vec3 corner = {k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z};
		w.max_distance = fmax(w.max_distance, vec3_length(mat4_point(&m->pre_transform, corner)));
	}
	if (m->count == 1)
		sweep_between(&w, m->key, m->key, 0, 0);
	for (uint32_t i = 0; i + 1 < m->count; i++) {
		const struct motion_key *a = &m->key[i], *b = a + 1;
		double length = b->time - a->time;
		if (!(length > 0)) { /* both times round to the same value */
			sweep_between(&w, a, b, 0, 1);
			continue;
		}
		sweep_between(&w, a, b, fmin(fmax(-a->time / length, 0), 1), fmin(fmax((1 - a->time) / length, 0), 1));
	}
	*all_low = w.box_min;
	*all_high = w.box_max;
}
