/* SPDX-License-Identifier: Apache-2.0 */
/* A note of the ledger as it is stored: its text and, since version 0.2, a line with the checksum of name and text.
 * Pure, except for the registration with SQLite; any thread. */
#ifndef COORDINATOR_STORE_NOTE_H
#define COORDINATOR_STORE_NOTE_H

#include "common/base/error.h"

#include <sqlite3.h>
#include <stddef.h>

enum note_rank { NOTE_DAMAGED, NOTE_UNCHECKED, NOTE_VALID };

/* Returns the text to be stored; mem_alloc'd. NULL: out of memory. */
char *note_add_checksum(const char *name, const char *text);
/* Judges a stored note by its checksum; UNCHECKED: it has none. *size: length of the text without the line of the
 * checksum. */
enum note_rank note_rank(const char *name, const char *stored, size_t *size);
/* Registers the SQL function note_rank(name, stored). */
int note_register(sqlite3 *db, struct error *e);

#endif
