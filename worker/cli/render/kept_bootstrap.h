/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What a render that is interrupted before its first round is complete leaves: the leases of the bootstrap that are
 * done, in a file beside the image, IMAGE.bootstrap. The same command goes on with them, to the same bits, and removes
 * the file when its image is written. Another plan, other defines, files that differ, or another numeric fingerprint (a
 * new build, or a machine that rounds otherwise) make it another command: then the file is left alone, and replaced by
 * the next interruption. One thread.
 */
#ifndef WORKER_CLI_RENDER_KEPT_BOOTSTRAP_H
#define WORKER_CLI_RENDER_KEPT_BOOTSTRAP_H

#include "common/estimate/merge.h"
#include "worker/cli/base/options.h"
#include "worker/render/scene/asset.h"

enum { KEPT_PATH = 4096, KEPT_TEXT = 8192 };

struct kept_bootstrap {
	/* Of all files that the scene was read from: their names and bytes, one after the other. */
	const struct asset_source *inner;
	uint32_t crc;
	uint64_t bytes;
	char path[KEPT_PATH]; /* "": there is no place for one */
	char text[KEPT_TEXT]; /* fingerprint, plan and defines */
	bool resumed;
	char said[KEPT_PATH + 256]; /* after a write, what to tell: a half sentence, or "" */
};

/* A source that passes on what `inner` has, and takes note of it. Both must outlive it. */
struct asset_source kept_bootstrap_source(struct kept_bootstrap *k, const struct asset_source *inner);

/* When the plan is known; fingerprint: of this program here (worker/render/fingerprint.h). */
void kept_bootstrap_begin(struct kept_bootstrap *k, const char *image, const char *fingerprint, const struct plan *p,
			  const struct render_arguments *a);
/* Adds what the file has; text: what to tell of it, or "". */
void kept_bootstrap_resume(struct kept_bootstrap *k, struct bootstrap *b, char *text, size_t size);
void kept_bootstrap_write(struct kept_bootstrap *k, const struct bootstrap *b);
/* The image is written. */
void kept_bootstrap_end(const struct kept_bootstrap *k);

#endif
