/* SPDX-License-Identifier: Apache-2.0 */
/*
 * If a render is interrupted before its first round is complete, the finished leases of the bootstrap are kept in a
 * file beside the image, IMAGE.bootstrap. The same command continues from them, to the same bits, and removes the file
 * when its image is written. The file is not used if the plan, the defines, the scene's files or the numeric
 * fingerprint differ (a new build, or a machine with different rounding); the next interruption then replaces it. One
 * thread.
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

enum { KEPT_PATH_SIZE = 4096, KEPT_TEXT_SIZE = 8192 };

struct kept_bootstrap {
	const struct asset_source *inner;   /* the source of the scene's files */
	uint32_t files_crc;		    /* of names and contents of the files, in the order of opening */
	uint64_t files_bytes;		    /* sum of the sizes of the files */
	char path[KEPT_PATH_SIZE];	    /* "": nothing can be kept */
	char identity_text[KEPT_TEXT_SIZE]; /* fingerprint, plan and defines */
	bool was_resumed;		    /* leases were added from the file */
	bool is_damaged;		    /* the file is a kept bootstrap, but damaged */
	char message[KEPT_PATH_SIZE + 256]; /* set by kept_bootstrap_write: the end of a sentence for the user */
};

/* Returns a source that opens the files of `inner` and adds them to the checksum. k and inner must outlive it. */
struct asset_source kept_bootstrap_source(struct kept_bootstrap *k, const struct asset_source *inner);

/* Determines the path and the identity text. Call when the plan is known and the scene has been read. fingerprint: of
 * this program (worker/render/fingerprint.h). */
void kept_bootstrap_begin(struct kept_bootstrap *k, const char *image, const char *fingerprint, const struct plan *p,
			  const struct render_arguments *a);
/* Adds the leases in the file, if there is one. text: a message for the user, or "". */
void kept_bootstrap_resume(struct kept_bootstrap *k, struct bootstrap *b, char *text, size_t size);
/* Writes the finished leases, if there are any, and sets k->message. */
void kept_bootstrap_write(struct kept_bootstrap *k, const struct bootstrap *b);
/* Removes the file, if leases were added from it or it is damaged; another command's file stays. Call when the image is
 * written. */
void kept_bootstrap_end(const struct kept_bootstrap *k);

#endif
