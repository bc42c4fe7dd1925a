/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One pass copies the text. It blanks out comments, because "--" may occur in them, writes "&amp;" for an "&" that
 * begins no entity, and blanks out a declaration <?xml ...?> that is not at the beginning. The encoding stated by such
 * a declaration is lost: the file is read as UTF-8. The contents of <![CDATA[...]]> and <?...?> are kept.
 *
 * Returns NULL if out of memory. A comment without an end is copied, and expat reports it.
 */
#include "worker/render/xml/xml_tidy.h"

#include "common/base/mem.h"
#include "worker/render/text/number.h"

#include <stdbool.h>
#include <string.h>

static const char amp[] = "&amp;";
enum { AMP_GROWTH = sizeof amp - 2 };

struct tidy_pass {
	const char *cursor, *end;
	char *out;
	bool has_content; /* something other than comments and blanks has been copied */
	/* For each kind of markup: the rest of the text does not contain its closing, so it is not searched again. */
	bool is_unterminated[4];
};

/* Markup that is skipped or copied as a whole. */
enum markup_kind { COMMENT, DECLARATION, CDATA, INSTRUCTION };
static const struct {
	const char *opening, *closing;
} markup[] = {{"<!--", "-->"}, {"<?xml ", "?>"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}};

static bool starts_with(const struct tidy_pass *p, const char *prefix)
{
	size_t n = strlen(prefix);
	return (size_t)(p->end - p->cursor) >= n && memcmp(p->cursor, prefix, n) == 0;
}

/* Returns the position after the markup of this kind that begins here; NULL if none begins here or it has no end. */
static const char *find_markup_end(struct tidy_pass *p, enum markup_kind kind)
{
	const char *closing = markup[kind].closing;
	size_t n = strlen(closing);
	if (p->is_unterminated[kind] || !starts_with(p, markup[kind].opening))
		return NULL;
	for (const char *q = p->cursor + strlen(markup[kind].opening); (size_t)(p->end - q) >= n; q++)
		if (memcmp(q, closing, n) == 0)
			return q + n;
	p->is_unterminated[kind] = true;
	return NULL;
}

static void copy_until(struct tidy_pass *p, const char *end, bool as_blanks)
{
	for (; p->cursor < end; p->cursor++)
		*p->out++ = as_blanks && *p->cursor != '\n' ? ' ' : *p->cursor;
}

static bool is_entity(const struct tidy_pass *p)
{
	static const char *const names[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&apos;", "&#"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (starts_with(p, names[i]))
			return true;
	return false;
}

/* Copies one piece of markup or one character. */
static void copy_next(struct tidy_pass *p)
{
	const char *markup_end = find_markup_end(p, COMMENT);
	if (markup_end) {
		copy_until(p, markup_end, true);
		return;
	}
	bool is_blank = number_is_blank(*p->cursor);
	if (!p->has_content && (markup_end = find_markup_end(p, DECLARATION))) {
		copy_until(p, markup_end, true);
	} else if ((markup_end = find_markup_end(p, CDATA)) || (markup_end = find_markup_end(p, INSTRUCTION))) {
		copy_until(p, markup_end, false);
	} else if (*p->cursor == '&' && !is_entity(p)) {
		memcpy(p->out, amp, sizeof amp - 1);
		p->out += sizeof amp - 1;
		p->cursor++;
	} else {
		copy_until(p, p->cursor + 1, false);
	}
	p->has_content |= !is_blank;
}

char *xml_tidy(const void *text, size_t *size)
{
	size_t ampersands = 0;
	const char *source = *size ? text : "";
	struct tidy_pass p = {.cursor = source, .end = source + *size};
	for (const char *q = p.cursor; q < p.end; q++)
		ampersands += *q == '&';
	char *bytes = mem_alloc(*size + ampersands * AMP_GROWTH + 1, 1);
	if (!bytes)
		return NULL;
	p.out = bytes;
	/* A declaration at the beginning is kept, because it may state an encoding. UTF-16, recognised by a zero byte
	 * or a byte order mark, is copied unchanged. */
	bool is_utf16 = *size > 1 && (!p.cursor[0] || !p.cursor[1] || (unsigned char)p.cursor[0] >= 0xfe);
	p.has_content = starts_with(&p, "<?xml") || starts_with(&p, "\xef\xbb\xbf");
	while (p.cursor < p.end && !is_utf16)
		copy_next(&p);
	copy_until(&p, p.end, false);
	*size = (size_t)(p.out - bytes);
	return bytes;
}
