/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/pictures.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void to_rgbe(const double rgb[3], unsigned char out[4])
{
	double largest = fmax(rgb[0], fmax(rgb[1], rgb[2]));
	int exponent = 0;
	memset(out, 0, 4);
	if (largest <= 0)
		return;
	frexp(largest, &exponent);
	for (int k = 0; k < 3; k++) {
		double m = ldexp(rgb[k], 8 - exponent);
		assert(m == floor(m));
		out[k] = (unsigned char)m;
	}
	out[3] = (unsigned char)(exponent + 128);
}

void pictures_add(struct pictures *p, uint32_t width, uint32_t height, const double *rgb)
{
	char head[128];
	int n = snprintf(head, sizeof head, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %u +X %u\n", height, width);
	struct picture_file *f = &p->file[p->count++];
	f->size = (size_t)n + 4 * (size_t)width * height;
	f->bytes = malloc(f->size);
	assert(f->bytes);
	memcpy(f->bytes, head, (size_t)n);
	for (size_t i = 0; i < (size_t)width * height; i++)
		to_rgbe(rgb + 3 * i, f->bytes + n + 4 * i);
}

static int open_picture(void *user, const char *name, struct asset *out, struct error *e)
{
	const struct pictures *p = user;
	int i = *name == 'p' ? atoi(name + 1) : -1;
	if (i < 0 || i >= p->count)
		return error_set(e, ENOENT, "%s: no such file", name);
	*out = (struct asset){.bytes = p->file[i].bytes, .size = p->file[i].size};
	return 0;
}

static void close_picture(void *user, struct asset *a)
{
	(void)user, (void)a;
}

struct asset_source pictures_source(struct pictures *p)
{
	return (struct asset_source){.user = p, .open = open_picture, .close = close_picture};
}

void pictures_fini(struct pictures *p)
{
	for (int i = 0; i < p->count; i++)
		free(p->file[i].bytes);
	*p = (struct pictures){.count = 0};
}
