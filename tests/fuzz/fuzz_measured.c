/* SPDX-License-Identifier: Apache-2.0 */
/*
 * libFuzzer: files of measured materials of both kinds. A material that is read must scatter finite, non-negative light
 * everywhere.
 */
#include "tests/fuzz/seeds.h"
#include "tests/support/measured_file.h"
#include "tests/support/nodes.h"
#include "tests/support/polarized_file.h"
#include "worker/render/bsdf/bsdf.h"

#include <math.h>

static double smooth_value(double phi_d, double theta_d, double theta_h, double nm)
{
	return theta_h > 1 ? NAN : theta_d * nm + phi_d;
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
	(void)argc, (void)argv;
	if (!seeds_are_requested())
		return 0;
	for (unsigned i = 0; i < 8; i++) {
		const struct measured_file_material k = {.alpha_u = 0.5,
							 .alpha_v = 0.3,
							 .azimuths = i & 1 ? 3 : 1,
							 .symmetry = i & 2 ? 4 : 1,
							 .elevations = 2,
							 .normal_nodes = 5,
							 .color_nodes = 3,
							 .is_rgb = i & 4,
							 .is_absolute = i == 5};
		size_t size;
		unsigned char *bytes = measured_file_make(&k, &size);
		seed_write_file("measured", i, bytes, size);
		free(bytes);
	}
	size_t size;
	unsigned char *bytes = polarized_file_make(smooth_value, 3, 2, &size);
	seed_write_file("measured", 8, bytes, size);
	free(bytes);
	exit(0);
}

static void check_scattering(const struct bsdf *b, enum transport transport, bool rgb)
{
	const struct wavelengths w = {.nm = {360, 500, 600, 830}, .is_rgb = rgb};
	const struct bsdf_point p = {.wavelengths = &w, .transport = transport};
	static const double heights[] = {1, 0.9, 0.3, 1e-3, 1e-12, 0x1p-400};
	for (unsigned i = 0; i < 6 * 8; i++) {
		double z = heights[i % 6], s = sqrt((1 - z) * (1 + z)), phi = 0.7 * i;
		const double u[3] = {0.03 + 0.019 * i, fmod(0.37 * i, 1), 0.5};
		struct bsdf_sample out;
		if (b->ops->sample(b, &p, (vec3){s * cos(phi), s * sin(phi), z}, u, &out) &&
		    !(spectrum_is_valid(out.f) && out.pdf > 0 && isfinite(out.pdf)))
			abort();
	}
}

static void read_as(const char *text, const uint8_t *bytes, size_t size)
{
	const struct memory_file files[] = {{"m.bsdf", bytes, size}, {0}};
	const struct asset_source assets = memory_assets(files);
	struct arena arena = {.limit = 256 << 20};
	const struct bsdf_build build = {.arena = &arena, .assets = &assets};
	struct bsdf b;
	struct error e;
	if (!bsdf_create(&b, node_make_bsdf(&arena, text), &build, &e))
		for (int i = 0; i < 4; i++)
			check_scattering(&b, i % 2 ? TRANSPORT_RADIANCE : TRANSPORT_IMPORTANCE, i / 2);
	arena_fini(&arena);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
	read_as("measured filename=m.bsdf", bytes, size);
	read_as("measured_polarized filename=m.bsdf", bytes, size);
	return 0;
}
