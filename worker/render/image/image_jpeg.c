/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/render/image/image_decode.h"

#include "common/base/mem.h"

#include <stdio.h>

#include <jpeglib.h>
#include <jerror.h>

#include <setjmp.h>

enum { SCANS_MAX = 200 }; /* limit for a progressive file: each scan costs a pass over all pixels */

/* State that survives the longjmp. errors and progress extend libjpeg's structures. */
struct state {
	struct jpeg_error_mgr errors;
	struct jpeg_progress_mgr progress;
	struct jpeg_decompress_struct jpeg;
	jmp_buf jump_target;
	const struct image_input *in;
	struct image *out;
	unsigned char *row;
	float sample_table[256];
	int error_code;
};

static struct state *jpeg_state(j_common_ptr jpeg)
{
	return jpeg->client_data;
}

static void on_error(j_common_ptr jpeg)
{
	struct state *s = jpeg_state(jpeg);
	char text[JMSG_LENGTH_MAX];
	jpeg->err->format_message(jpeg, text);
	s->error_code = error_set(s->in->error, EBADMSG, "JPEG: %s", text);
	longjmp(s->jump_target, 1);
}

/* libjpeg replaces missing data with grey and only warns; here that is an error. Surplus bytes and unusual versions
 * are harmless. */
static void on_message(j_common_ptr jpeg, int level)
{
	int code = jpeg->err->msg_code;
	bool is_harmless = code == JWRN_EXTRANEOUS_DATA || code == JWRN_JFIF_MAJOR || code == JWRN_ADOBE_XFORM;
	if (level < 0 && !is_harmless)
		on_error(jpeg);
}

static void on_progress(j_common_ptr jpeg)
{
	struct state *s = jpeg_state(jpeg);
	if (s->jpeg.input_scan_number > SCANS_MAX) {
		s->error_code = error_set(s->in->error, E2BIG, "JPEG with more than %d scans", SCANS_MAX);
		longjmp(s->jump_target, 1);
	}
}

static int read_header(struct state *s)
{
	struct jpeg_decompress_struct *j = &s->jpeg;
	jpeg_mem_src(j, s->in->bytes, s->in->size);
	jpeg_read_header(j, TRUE);
	uint32_t channels = j->jpeg_color_space == JCS_GRAYSCALE ? 1 : 3;
	if (j->num_components == 4 || j->jpeg_color_space == JCS_CMYK || j->jpeg_color_space == JCS_YCCK)
		return error_set(s->in->error, EINVAL, "a JPEG for printing (CMYK); supported: grey and RGB");
	if (j->arith_code)
		return error_set(s->in->error, EINVAL, "JPEG with arithmetic coding is not supported");
	j->out_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
	/* A block of 8 x 8 pixels takes at least one bit. */
	return image_allocate(s->in, s->out, j->image_width, j->image_height, channels,
			      (uint64_t)j->image_width * j->image_height / 512);
}

static int read_pixels(struct state *s)
{
	struct jpeg_decompress_struct *j = &s->jpeg;
	jpeg_start_decompress(j);
	size_t n = (size_t)j->output_width * (size_t)j->output_components;
	if (j->output_width != s->out->width || j->output_height != s->out->height ||
	    (uint32_t)j->output_components != s->out->channels)
		return error_set(s->in->error, EBADMSG, "JPEG: its header and its image differ in size");
	s->row = mem_alloc(n, 1);
	if (!s->row)
		return error_set(s->in->error, ENOMEM, "out of memory");
	while (j->output_scanline < j->output_height) {
		float *out = s->out->pixels + n * j->output_scanline;
		JSAMPROW rows[1] = {s->row};
		if (jpeg_read_scanlines(j, rows, 1) != 1)
			return error_set(s->in->error, EBADMSG, "JPEG ends too early");
		for (size_t i = 0; i < n; i++)
			out[i] = s->sample_table[s->row[i]];
	}
	jpeg_finish_decompress(j);
	return 0;
}

static void read_guarded(struct state *s)
{
	if (setjmp(s->jump_target))
		return;
	jpeg_create_decompress(&s->jpeg);
	s->jpeg.progress = &s->progress;
	s->error_code = read_header(s);
	if (!s->error_code)
		s->error_code = read_pixels(s);
}

static int decode(const struct image_input *in, struct image *out)
{
	struct state *s = mem_alloc(1, sizeof *s);
	if (!s)
		return error_set(in->error, ENOMEM, "out of memory");
	s->in = in;
	s->out = out;
	s->jpeg.err = jpeg_std_error(&s->errors);
	s->errors.error_exit = on_error;
	s->errors.emit_message = on_message;
	s->progress.progress_monitor = on_progress;
	s->jpeg.client_data = s;
	image_fill_sample_table(s->sample_table, 255, in->is_raw);
	read_guarded(s);
	int r = s->error_code;
	jpeg_destroy_decompress(&s->jpeg);
	mem_free(s->row);
	mem_free(s);
	return r;
}

const struct image_format image_format_jpeg = {
	.signatures = {"\xff\xd8\xff"},
	.decode = decode,
	.alpha_support = IMAGE_ALPHA_NONE,
};
