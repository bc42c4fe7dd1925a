/* SPDX-License-Identifier: Apache-2.0 */
#include "coordinator/store/note.h"

#include "common/base/crc.h"
#include "common/base/mem.h"
#include "coordinator/store/ledger_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char mark[] = "\ncrc32c=";
enum { MARK_SIZE = sizeof mark - 1, DIGITS = 8, CHECKSUM_LINE_SIZE = MARK_SIZE + DIGITS };

static uint32_t note_checksum(const char *name, const char *text, size_t size)
{
	return crc32c(crc32c(0, name, strlen(name) + 1), text, size);
}

char *note_add_checksum(const char *name, const char *text)
{
	size_t size = strlen(text);
	char *stored = mem_alloc(size + CHECKSUM_LINE_SIZE + 1, 1);
	if (stored)
		snprintf(stored, size + CHECKSUM_LINE_SIZE + 1, "%s%s%08x", text, mark,
			 note_checksum(name, text, size));
	return stored;
}

enum note_rank note_rank(const char *name, const char *stored, size_t *size)
{
	size_t length = strlen(stored);
	*size = length;
	if (length < CHECKSUM_LINE_SIZE || memcmp(stored + length - CHECKSUM_LINE_SIZE, mark, MARK_SIZE) != 0)
		return NOTE_UNCHECKED;
	char *end;
	unsigned long stated = strtoul(stored + length - DIGITS, &end, 16);
	*size = length - CHECKSUM_LINE_SIZE;
	return *end == 0 && stated == note_checksum(name, stored, *size) ? NOTE_VALID : NOTE_DAMAGED;
}

static void rank_in_sql(sqlite3_context *c, int count, sqlite3_value **v)
{
	size_t size;
	(void)count;
	const char *name = (const char *)sqlite3_value_text(v[0]), *stored = (const char *)sqlite3_value_text(v[1]);
	sqlite3_result_int(c, name && stored ? (int)note_rank(name, stored, &size) : NOTE_DAMAGED);
}

int note_register(sqlite3 *db, struct error *e)
{
	int rc = sqlite3_create_function(db, "note_rank", 2, SQLITE_UTF8 | SQLITE_DETERMINISTIC, NULL, rank_in_sql,
					 NULL, NULL);
	return rc == SQLITE_OK ? 0 : ledger_file_set_error(db, e);
}
