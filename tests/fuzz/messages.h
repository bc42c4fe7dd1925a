/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Shared by the fuzzers of conversations: an input is a script of steps, each of which has a speaker and a frame (an
 * Envelope and its payload). Any bytes are a script; the mutator keeps steps whole and changes the fields of their
 * messages by the schema, so that the results pass the parser. One thread.
 */
#ifndef TESTS_FUZZ_MESSAGES_H
#define TESTS_FUZZ_MESSAGES_H

#include "common/wire/envelope.h"

#include <stddef.h>
#include <stdint.h>

enum { SCRIPT_STEPS = 64 /* further steps are ignored */ };

/* In the input: speaker, u16 BE header size, u16 BE payload size, header, payload; a truncated part is as long as what
 * is there. */
struct step {
	uint8_t speaker;
	const uint8_t *header, *payload;
	size_t header_size, payload_size;
};

size_t script_read(const uint8_t *bytes, size_t size, struct step steps[SCRIPT_STEPS]);
/* Returns the size written; 0: it does not fit. */
size_t script_write(const struct step *steps, size_t count, uint8_t *bytes, size_t max_size);
/* Appends a step; returns the new size, or the old one if the step does not fit. */
size_t script_add(uint8_t *bytes, size_t size, size_t max_size, uint8_t speaker, const Farm__Envelope *m,
		  const void *payload, size_t payload_size);

/* For LLVMFuzzerCustomMutator: speakers are numbered below `speakers`. */
size_t script_mutate(uint8_t *bytes, size_t size, size_t max_size, unsigned seed, unsigned speakers);
/* Like script_mutate(), for one packed Envelope. */
size_t message_mutate(uint8_t *bytes, size_t size, size_t max_size, unsigned seed);

/* Provided by libFuzzer. */
size_t LLVMFuzzerMutate(uint8_t *bytes, size_t size, size_t max_size);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);
int LLVMFuzzerInitialize(int *argc, char ***argv);
size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t max_size, unsigned seed);

#endif
