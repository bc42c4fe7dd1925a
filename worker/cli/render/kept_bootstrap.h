/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What is kept of a render that is interrupted before its first round is complete: the finished leases of the
 * bootstrap, in a file beside the image, IMAGE.bootstrap. The same command continues from them, to the same bits, and
 * removes the file when its image is written. Another plan, other defines, different files or another numeric
 * fingerprint (a new build, or a machine with different rounding) make it another command: then the file is not used,
 * and replaced by the next interruption. One thread.
 *
 * The file, checked (common/base/checked_file.h), little endian:
 *
 * offset  bytes  contents
 * 0       8      magic number and version, HSLTBOO1
 * 8       4      CRC-32C of the scene's files, each with its name and a zero before it
 * 12      8      their bytes, without names
 * 20      4      N
 * 24      N      fingerprint, plan and defines, as text
 * 24 + N         the leases (bootstrap_save in common/estimate/merge.h)
 */
#ifndef WORKER_CLI_RENDER_KEPT_BOOTSTRAP_H
#define WORKER_CLI_RENDER_KEPT_BOOTSTRAP_H

#include "common/estimate/merge.h"
#include "worker/cli/base/options.h"
#include "worker/render/asset/asset.h"

enum { KEPT_PATH = 4096, KEPT_TEXT = 8192 };

struct kept_bootstrap {
	/* Where the scene is read from; checksum over names and contents of all files in order, and their bytes. */
	const struct asset_source *inner;
	uint32_t crc;
	uint64_t bytes;
	char path[KEPT_PATH]; /* "": it cannot be written anywhere */
	char text[KEPT_TEXT]; /* fingerprint, plan and defines */
	bool resumed;
	char said[KEPT_PATH + 256]; /* after a write, what to report: part of a sentence, or "" */
};

/* A source that passes on the files of `inner` and hashes them. Both must outlive it. */
struct asset_source kept_bootstrap_source(struct kept_bootstrap *k, const struct asset_source *inner);

/* Call when the plan is known; fingerprint: of this program (worker/render/fingerprint.h). */
void kept_bootstrap_begin(struct kept_bootstrap *k, const char *image, const char *fingerprint, const struct plan *p,
			  const struct render_arguments *a);
/* Adds the leases in the file; text: what to report, or "". */
void kept_bootstrap_resume(struct kept_bootstrap *k, struct bootstrap *b, char *text, size_t size);
void kept_bootstrap_write(struct kept_bootstrap *k, const struct bootstrap *b);
/* Call when the image is written: removes the file. */
void kept_bootstrap_end(const struct kept_bootstrap *k);

#endif
