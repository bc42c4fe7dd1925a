/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Seeds of the fuzzers of conversations, made from the present messages: a target that is started with
 * HSLT_FUZZ_SEEDS=FOLDER writes its seeds there and ends.
 */
#ifndef TESTS_FUZZ_SEEDS_H
#define TESTS_FUZZ_SEEDS_H

#include "tests/fuzz/messages.h"

#include <stdbool.h>
#include <stdlib.h>

struct seed {
	uint8_t bytes[1 << 16];
	size_t size;
};

bool seeds_are_requested(void);
void seed_add_message(struct seed *s, uint8_t speaker, const Farm__Envelope *m, const void *payload, size_t size);
void seed_add_raw(struct seed *s, uint8_t speaker, const char *text);
void seed_write(struct seed *s, const char *name, uint64_t number); /* writes the seed, and empties it */
void seed_write_file(const char *name, uint64_t number, const void *bytes, size_t size);

/* Adds a message without payload; the kind is given as the envelope's case and as its member. */
#define SEED_SAY(seed, who, KIND, kind, message)                   \
	do {                                                       \
		Farm__Envelope seed_m;                             \
		farm__envelope__init(&seed_m);                     \
		seed_m.body_case = FARM__ENVELOPE__BODY_##KIND;    \
		seed_m.kind = (message);                           \
		seed_add_message((seed), (who), &seed_m, NULL, 0); \
	} while (0)

#endif
