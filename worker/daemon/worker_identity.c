/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/worker_identity.h"

#include "common/base/disk.h"
#include "common/blob/blob.h"

#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { PATH_BYTES = 4096 + 64, SEED_BYTES = 16, SEED_HEX = 2 * SEED_BYTES + 1, LINE_BYTES = 96 };

static void make_seed(char seed[SEED_HEX])
{
	unsigned char bytes[SEED_BYTES];
	if (getentropy(bytes, sizeof bytes))
		memset(bytes, 0, sizeof bytes);
	for (int i = 0; i < SEED_BYTES; i++)
		snprintf(seed + 2 * i, 3, "%02x", bytes[i]);
}

static void read_start_count(const char *path, char seed[SEED_HEX], uint64_t *count)
{
	char line[LINE_BYTES];
	int fd = disk_open(path, O_RDONLY | O_CLOEXEC, 0);
	ssize_t n = fd < 0 ? 0 : disk_read(fd, line, sizeof line - 1);
	if (fd >= 0)
		disk_close(fd);
	line[n > 0 ? n : 0] = 0;
	if (sscanf(line, "%32[0-9a-f] %" SCNu64, seed, count) == 2 && strlen(seed) == SEED_HEX - 1 &&
	    *count < UINT64_MAX / 2)
		return;
	make_seed(seed);
	*count = 0;
}

static int write_start_count(const char *folder, const char *path, const char *seed, uint64_t count, struct error *e)
{
	char line[LINE_BYTES];
	int n = snprintf(line, sizeof line, "%s %" PRIu64 "\n", seed, count);
	int rc = disk_replace(path, line, (size_t)n, 0600, e);
	return rc ? rc : disk_sync_folder(folder, e);
}

int worker_identity_count_start(struct worker_identity *l, const char *folder, const char *name, struct error *e)
{
	char path[PATH_BYTES], seed[SEED_HEX] = "", text[SEED_HEX + 64], host[64] = "", hex[BLOB_HEX_SIZE];
	struct blob_hash h;
	*l = (struct worker_identity){"", 0};
	snprintf(path, sizeof path, "%s/%s", folder, name);
	read_start_count(path, seed, &l->restarts);
	l->restarts++;
	int rc = write_start_count(folder, path, seed, l->restarts, e);
	gethostname(host, sizeof host - 1);
	snprintf(text, sizeof text, "%s %s", seed, host);
	if (!rc)
		rc = blob_hash_bytes(text, strlen(text), &h, e);
	if (rc)
		return rc;
	blob_hash_to_hex(&h, hex);
	memcpy(l->home, hex, WORKER_IDENTITY_HOME_SIZE - 1);
	return 0;
}
