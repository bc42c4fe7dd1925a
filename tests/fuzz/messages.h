/* SPDX-License-Identifier: Apache-2.0 */
/*
 * What the fuzzers of conversations share: an input is a script of steps, each of which is said by somebody and is a
 * frame (an Envelope and its payload). Any bytes are a script; the mutator keeps steps whole and changes the fields of
 * their messages by the schema, so that what comes out gets through the parser. One thread.
 */
#ifndef TESTS_FUZZ_MESSAGES_H
#define TESTS_FUZZ_MESSAGES_H

#include "common/wire/envelope.h"

#include <stddef.h>
#include <stdint.h>

enum { SCRIPT_STEPS = 64 /* more are not read */ };

/* In the input: who, u16 BE header size, u16 BE payload size, header, payload; what is cut off is as long as it is. */
struct step {
	uint8_t who;
	const uint8_t *header, *payload;
	size_t header_size, payload_size;
};

size_t script_read(const uint8_t *bytes, size_t size, struct step steps[SCRIPT_STEPS]);
/* 0: it does not fit. */
size_t script_write(const struct step *steps, size_t count, uint8_t *bytes, size_t room);
/* Behind what is there already; new size, or the old one when it does not fit. */
size_t script_add(uint8_t *bytes, size_t size, size_t room, uint8_t who, const Farm__Envelope *m, const void *payload,
		  size_t payload_size);

/* For LLVMFuzzerCustomMutator: who is below `speakers`. */
size_t script_mutate(uint8_t *bytes, size_t size, size_t room, unsigned seed, unsigned speakers);
/* The same for one packed Envelope. */
size_t message_mutate(uint8_t *bytes, size_t size, size_t room, unsigned seed);

/* libFuzzer's. */
size_t LLVMFuzzerMutate(uint8_t *bytes, size_t size, size_t room);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);
int LLVMFuzzerInitialize(int *argc, char ***argv);
size_t LLVMFuzzerCustomMutator(uint8_t *bytes, size_t size, size_t room, unsigned seed);

#endif
