/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How a dielectric fibre scatters light: the functions of one variable each that the BSDF `hair` multiplies. Lobe p is
 * the light that went through the fibre p times: reflected (0), through (1), reflected once inside (2); lobe
 * HAIR_LOBES - 1 is all that was reflected more often.
 *
 * theta is the angle to the plane across the fibre, so theta = +-90 degrees lies along it; phi is the angle in that
 * plane, against an arbitrary direction; gamma is the angle in that plane between the normal and a direction. Lengths
 * are in radii of the fibre. Pure; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_BSDF_HAIR_LOBES_H
#define WORKER_RENDER_BSDF_HAIR_LOBES_H

enum { HAIR_LOBES = 4 };

struct hair_angle {
	double sin, cos; /* of theta; cos >= 0 */
};

/* A fibre, without its colour. */
struct hair_fibre {
	double eta; /* index inside over the one outside */
	struct hair_lobe_width {
		double v;     /* variance along the fibre */
		double scale; /* 1 / (1 - exp(-2 / v)), over v */
		double from;  /* exp(-2 / v) */
	} along[HAIR_LOBES];
	struct hair_angle tilt[HAIR_LOBES]; /* by which scales turn theta before lobe p is formed */
	double s;			    /* width of the logistic distribution around the fibre */
	double end;			    /* exp(-pi / s) */
};

/* Roughness along and around, in [0,1]; those below HAIR_ROUGHNESS_MIN count as it. tilt: of the scales, radians. */
#define HAIR_ROUGHNESS_MIN 1e-3
void hair_fibre_set(struct hair_fibre *f, double eta, double along, double around, double tilt);

/* How a ray enters the fibre, from the camera's side. */
struct hair_entry {
	double reflected, transmitted; /* Fresnel's shares */
	double gamma_t;		       /* inside; meaningless if nothing is transmitted */
	double length;		       /* of one passage through the fibre */
};

/* x and z: of a unit direction in the frame with y along the fibre and the normal z; z > 0. gamma_i = -atan2(x, z). */
struct hair_entry hair_enter(const struct hair_fibre *f, double x, double z);

/* A_p: the share of the light in each lobe, of which a passage leaves t in [0,1]. */
void hair_shares(const struct hair_entry *e, double t, double share[HAIR_LOBES]);

/* M_p: density of sin theta_o for light from theta_i. */
double hair_along(const struct hair_fibre *f, int p, struct hair_angle from, struct hair_angle to);
struct hair_angle hair_along_sample(const struct hair_fibre *f, int p, struct hair_angle from, double u0, double u1);

/* N_p: density of phi_o; turn: phi_o less that of the ideal ray, hair_turn. p < HAIR_LOBES - 1, the last one is
 * uniform. */
double hair_around(const struct hair_fibre *f, double turn);
double hair_around_sample(const struct hair_fibre *f, double u); /* within [-pi, pi] */
/* phi_o - phi_i of a ray in a smooth fibre. */
double hair_turn(int p, double gamma_i, double gamma_t);

/* exp(-x) I0(x) of the modified Bessel function, x >= 0; relative error below 1e-12. */
double hair_bessel(double x);

#endif
