/* SPDX-License-Identifier: Apache-2.0 */
/* Frames as a connection sends them, for tests that write to sockets themselves. */
#ifndef TESTS_SUPPORT_CHECKSUMMED_FRAME_H
#define TESTS_SUPPORT_CHECKSUMMED_FRAME_H

#include "common/wire/envelope.h"

#include <stddef.h>

/* Adds the checksum to a frame in one piece, as made by envelope_pack. The result is allocated with malloc() and
 * never NULL. A hello and its answer, the first frames in their directions, stay as they are. */
unsigned char *checksummed_frame(const unsigned char *frame, size_t size, size_t *out_size);
/* Like checksummed_frame(), for a header and a payload, which need not be valid. first: the frame is the first in
 * its direction, and a hello or its answer gets the checksum of its bytes. */
unsigned char *checksummed_frame_from_parts(const void *header, size_t header_size, const void *payload,
					    size_t payload_size, bool first, size_t *out_size);
/* Like checksummed_frame(), for a message. */
unsigned char *checksummed_frame_from_message(const Farm__Envelope *m, const void *payload, size_t payload_size,
					      size_t *out_size);

#endif
