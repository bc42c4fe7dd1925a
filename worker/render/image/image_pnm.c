/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Portable maps: binary PGM and PPM (P5, P6) of 8 and 16 bits, and PFM (Pf, PF). PFM stores floats from the bottom row
 * up; the sign of its scale gives the byte order, and the floats are multiplied by the scale's absolute value.
 *
 * Failures: -EBADMSG for a malformed header, a file that ends too early, a sample above the stated maximum, and a float
 * that is not finite.
 */
#include "worker/render/image/image_decode.h"

#include "common/base/mem.h"
#include "worker/render/text/number.h"

#include <math.h>
#include <string.h>

enum { WORD_MAX = 32 };

struct pnm {
	const struct image_input *in;
	const unsigned char *cursor;
	int64_t width, height;
	double scale; /* of a PFM file; for PGM and PPM, the largest sample */
	uint32_t channels, sample_bytes;
	bool is_float, is_big_endian;
};

static int peek(const struct pnm *m)
{
	return m->cursor < m->in->bytes + m->in->size ? *m->cursor : -1;
}

static bool is_at_blank(const struct pnm *m)
{
	int c = peek(m);
	return c > 0 && number_is_blank((char)c);
}

/* Reads a word after any blanks and comments, which begin with '#', and consumes the one blank after the word. */
static bool next_word(struct pnm *m, char word[WORD_MAX])
{
	size_t n = 0;
	for (bool in_comment = false; in_comment || is_at_blank(m) || peek(m) == '#'; m->cursor++) {
		if (peek(m) < 0)
			return false;
		in_comment = peek(m) == '#' || (in_comment && peek(m) != '\n');
	}
	for (; peek(m) >= 0 && !is_at_blank(m); m->cursor++) {
		if (n == WORD_MAX - 1)
			return false;
		word[n++] = (char)*m->cursor;
	}
	word[n] = 0;
	if (n == 0 || !is_at_blank(m))
		return false;
	m->cursor++;
	return true;
}

static int read_header(struct pnm *m)
{
	char width[WORD_MAX], height[WORD_MAX], scale[WORD_MAX];
	char kind = (char)m->in->bytes[1];
	m->cursor = m->in->bytes + 2;
	m->is_float = kind == 'F' || kind == 'f';
	m->channels = kind == '6' || kind == 'F' ? 3 : 1;
	if (!next_word(m, width) || !next_word(m, height) || !next_word(m, scale) ||
	    !number_parse_int(width, &m->width) || !number_parse_int(height, &m->height) ||
	    !number_parse(scale, &m->scale) || m->width < 1 || m->height < 1)
		return error_set(m->in->error, EBADMSG, "portable map: needs a width, a height and a scale");
	bool is_valid_maximum = m->scale >= 1 && m->scale <= 65535 && m->scale == floor(m->scale);
	if (m->is_float ? m->scale == 0 : !is_valid_maximum)
		return error_set(m->in->error, EBADMSG,
				 m->is_float ? "portable map: a scale of 0"
					     : "portable map: the largest sample must be within [1, 65535]");
	m->is_big_endian = !m->is_float || m->scale > 0;
	m->sample_bytes = m->is_float ? 4 : m->scale < 256 ? 1 : 2;
	return 0;
}

static uint32_t next_sample(struct pnm *m)
{
	uint32_t x = 0;
	for (uint32_t i = 0; i < m->sample_bytes; i++)
		x |= (uint32_t)m->cursor[i] << 8 * (m->is_big_endian ? m->sample_bytes - 1 - i : i);
	m->cursor += m->sample_bytes;
	return x;
}

static int read_floats(struct pnm *m, struct image *out)
{
	size_t row = (size_t)out->width * out->channels;
	for (uint32_t y = out->height; y-- > 0;)
		for (size_t i = 0; i < row; i++) {
			uint32_t bits = next_sample(m);
			float x;
			memcpy(&x, &bits, sizeof x);
			x = (float)((double)x * fabs(m->scale));
			if (!isfinite(x))
				return error_set(m->in->error, EBADMSG, "portable map: a pixel that is not finite");
			out->pixels[row * y + i] = x;
		}
	return 0;
}

static int read_integers(struct pnm *m, struct image *out)
{
	uint32_t max = (uint32_t)m->scale;
	float *value = mem_alloc((size_t)max + 1, sizeof *value);
	if (!value)
		return error_set(m->in->error, ENOMEM, "out of memory");
	image_fill_sample_table(value, max, m->in->is_raw);
	int r = 0;
	for (size_t i = 0; i < (size_t)out->width * out->height * out->channels && !r; i++) {
		uint32_t x = next_sample(m);
		if (x > max)
			r = error_set(m->in->error, EBADMSG, "portable map: a sample above the stated maximum");
		else
			out->pixels[i] = value[x];
	}
	mem_free(value);
	return r;
}

static int decode(const struct image_input *in, struct image *out)
{
	struct pnm m = {.in = in};
	int r = read_header(&m);
	uint64_t w = r ? 0 : (uint64_t)m.width, h = r ? 0 : (uint64_t)m.height;
	bool is_bounded = w <= IMAGE_PIXELS_MAX && h <= IMAGE_PIXELS_MAX;
	uint64_t samples = is_bounded ? w * h * m.channels * m.sample_bytes : 0;
	if (!r)
		r = image_allocate(in, out, w, h, m.channels, samples);
	if (!r && (size_t)(in->bytes + in->size - m.cursor) < samples)
		r = error_set(in->error, EBADMSG, "portable map: the file ends too early");
	if (r)
		return r;
	return m.is_float ? read_floats(&m, out) : read_integers(&m, out);
}

const struct image_format image_format_pnm = {
	.signatures = {"P5", "P6", "PF", "Pf"},
	.decode = decode,
};
