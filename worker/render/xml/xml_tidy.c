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
enum { LONGER = sizeof amp - 2 };

struct pass {
	const char *at, *end;
	char *out;
	bool begun; /* something other than comments and blanks has been copied */
	/* For each kind of markup: the rest of the text does not contain its closing, so it is not searched again. */
	bool endless[4];
};

/* Markup that is skipped or copied as a whole. */
enum kind { COMMENT, DECLARATION, CDATA, INSTRUCTION };
static const struct {
	const char *opening, *closing;
} markup[] = {{"<!--", "-->"}, {"<?xml ", "?>"}, {"<![CDATA[", "]]>"}, {"<?", "?>"}};

static bool starts(const struct pass *p, const char *with)
{
	size_t n = strlen(with);
	return (size_t)(p->end - p->at) >= n && memcmp(p->at, with, n) == 0;
}

/* Returns the position after the markup of this kind that begins here; NULL if none begins here or it has no end. */
static const char *end_of_markup(struct pass *p, enum kind kind)
{
	const char *closing = markup[kind].closing;
	size_t n = strlen(closing);
	if (p->endless[kind] || !starts(p, markup[kind].opening))
		return NULL;
	for (const char *q = p->at + strlen(markup[kind].opening); (size_t)(p->end - q) >= n; q++)
		if (memcmp(q, closing, n) == 0)
			return q + n;
	p->endless[kind] = true;
	return NULL;
}

static void copy_to(struct pass *p, const char *to, bool as_blanks)
{
	for (; p->at < to; p->at++)
		*p->out++ = as_blanks && *p->at != '\n' ? ' ' : *p->at;
}

static bool is_entity(const struct pass *p)
{
	static const char *const names[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&apos;", "&#"};
	for (size_t i = 0; i < sizeof names / sizeof *names; i++)
		if (starts(p, names[i]))
			return true;
	return false;
}

/* Copies one piece of markup or one character. */
static void step(struct pass *p)
{
	const char *to = end_of_markup(p, COMMENT);
	if (to) {
		copy_to(p, to, true);
		return;
	}
	bool blank = number_is_blank(*p->at);
	if (!p->begun && (to = end_of_markup(p, DECLARATION))) {
		copy_to(p, to, true);
	} else if ((to = end_of_markup(p, CDATA)) || (to = end_of_markup(p, INSTRUCTION))) {
		copy_to(p, to, false);
	} else if (*p->at == '&' && !is_entity(p)) {
		memcpy(p->out, amp, sizeof amp - 1);
		p->out += sizeof amp - 1;
		p->at++;
	} else {
		copy_to(p, p->at + 1, false);
	}
	p->begun |= !blank;
}

char *xml_tidy(const void *text, size_t *size)
{
	size_t ampersands = 0;
	const char *from = *size ? text : "";
	struct pass p = {.at = from, .end = from + *size};
	for (const char *q = p.at; q < p.end; q++)
		ampersands += *q == '&';
	char *bytes = mem_alloc(*size + ampersands * LONGER + 1, 1);
	if (!bytes)
		return NULL;
	p.out = bytes;
	/* A declaration at the beginning is kept, because it may state an encoding. UTF-16, recognised by a zero byte
	 * or a byte order mark, is copied unchanged. */
	bool wide = *size > 1 && (!p.at[0] || !p.at[1] || (unsigned char)p.at[0] >= 0xfe);
	p.begun = starts(&p, "<?xml") || starts(&p, "\xef\xbb\xbf");
	while (p.at < p.end && !wide)
		step(&p);
	copy_to(&p, p.end, false);
	*size = (size_t)(p.out - bytes);
	return bytes;
}
