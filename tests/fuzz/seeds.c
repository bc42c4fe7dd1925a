/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/fuzz/seeds.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

bool seeds_are_requested(void)
{
	return getenv("HSLT_FUZZ_SEEDS") != NULL;
}

void seed_add_message(struct seed *s, uint8_t speaker, const Farm__Envelope *m, const void *payload, size_t size)
{
	s->size = script_add(s->bytes, s->size, sizeof s->bytes, speaker, m, payload, size);
}

void seed_add_raw(struct seed *s, uint8_t speaker, const char *text)
{
	struct step step = {.speaker = speaker, .header = (const uint8_t *)text, .header_size = strlen(text)};
	s->size += script_write(&step, 1, s->bytes + s->size, sizeof s->bytes - s->size);
}

void seed_write_file(const char *name, uint64_t number, const void *bytes, size_t size)
{
	char path[512];
	snprintf(path, sizeof path, "%s/seed-%s-%" PRIu64, getenv("HSLT_FUZZ_SEEDS"), name, number);
	FILE *f = fopen(path, "wb");
	if (!f || fwrite(bytes, 1, size, f) != size || fclose(f)) {
		perror(path);
		exit(1);
	}
}

void seed_write(struct seed *s, const char *name, uint64_t number)
{
	seed_write_file(name, number, s->bytes, s->size);
	s->size = 0;
}
