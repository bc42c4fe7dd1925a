/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How a dielectric fibre scatters light: the factors, each a function of one angle, that the BSDF `hair` multiplies.
 * Lobe p is the light that has passed through the fibre p times: reflected (0), transmitted (1), reflected once inside
 * (2); lobe HAIR_LOBES - 1 is all light that was reflected inside more often.
 *
 * theta is the angle between a direction and the plane across the fibre, +-90 degrees along the fibre; phi is the
 * azimuth in that plane, relative to an arbitrary direction; gamma is the angle in that plane between the normal and a
 * direction. Lengths are in radii of the fibre. Pure; any thread; allocates nothing.
 */
#ifndef WORKER_RENDER_BSDF_HAIR_LOBES_H
#define WORKER_RENDER_BSDF_HAIR_LOBES_H

enum { HAIR_LOBES = 4 };

struct hair_angle {
	double sin, cos; /* of theta; cos >= 0 */
};

/* The fibre without its absorption. */
struct hair_fibre {
	double eta; /* index inside over the one outside */
	struct hair_lobe_width {
		double variance;      /* variance along the fibre */
		double normalization; /* 1 / (1 - exp(-2 / variance)), over variance */
		double exp_minus_2_over_variance;
	} longitudinal[HAIR_LOBES];
	struct hair_angle tilt[HAIR_LOBES]; /* angle by which the scales turn theta for lobe p */
	double azimuthal_width;		    /* width of the logistic distribution around the fibre */
	double logistic_tail;		    /* exp(-pi / azimuthal_width) */
};

/* Sets f. longitudinal_roughness, azimuthal_roughness: along and around the fibre, in [0,1]; values below
 * HAIR_ROUGHNESS_MIN count as HAIR_ROUGHNESS_MIN. tilt: angle of the scales, in radians. */
#define HAIR_ROUGHNESS_MIN 1e-3
void hair_fibre_init(struct hair_fibre *f, double eta, double longitudinal_roughness, double azimuthal_roughness,
		     double tilt);

/* How a ray enters the fibre, from the camera's side. */
struct hair_entry {
	double reflectance, transmittance; /* Fresnel's */
	double gamma_t;			   /* gamma inside the fibre; meaningless if nothing is transmitted */
	double passage_length;		   /* of one passage through the fibre */
};

/* x, z: components of a unit direction in the frame whose y axis runs along the fibre and whose z axis is the normal; z
 * > 0. gamma_i = -atan2(x, z). */
struct hair_entry hair_enter(const struct hair_fibre *f, double x, double z);

/* Computes A_p, the share of light in each lobe, where t in [0,1] is the transmittance of one passage. */
void hair_lobe_shares(const struct hair_entry *e, double t, double share[HAIR_LOBES]);

/* M_p: returns the density of sin theta_o for light from theta_i; hair_sample_longitudinal draws theta_o with that
 * density. */
double hair_longitudinal_pdf(const struct hair_fibre *f, int p, struct hair_angle theta_i, struct hair_angle theta_o);
struct hair_angle hair_sample_longitudinal(const struct hair_fibre *f, int p, struct hair_angle theta_i, double u0,
					   double u1);

/* N_p: returns the density of phi_o. offset: phi_o minus that of the ideal ray, hair_azimuth_change(). For
 * p < HAIR_LOBES - 1; the last lobe is uniform in phi_o. */
double hair_azimuthal_pdf(const struct hair_fibre *f, double offset);
double hair_sample_azimuthal(const struct hair_fibre *f, double u); /* within [-pi, pi] */
/* Returns phi_o - phi_i of lobe p in a smooth fibre. */
double hair_azimuth_change(int p, double gamma_i, double gamma_t);

/* Returns exp(-x) I0(x), with I0 the modified Bessel function and x >= 0; relative error below 1e-12. */
double hair_scaled_bessel_i0(double x);

#endif
