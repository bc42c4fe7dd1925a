/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/cli/base/text_file.h"

#include "common/base/text.h"
#include "common/exr/image_file.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { PAGE_MAX = 1 << 28 };

void text_file_put_bytes(struct text_file *p, const void *bytes, size_t count)
{
	p->text.limit = PAGE_MAX;
	p->has_failed = p->has_failed || !buf_append(&p->text, bytes, count);
}

void text_file_put(struct text_file *p, const char *format, ...)
{
	char line[2048];
	va_list args;
	va_start(args, format);
	int n = vsnprintf(line, sizeof line, format, args);
	va_end(args);
	if (n < 0 || (size_t)n >= sizeof line)
		p->has_failed = true;
	else
		text_file_put_bytes(p, line, (size_t)n);
}

size_t text_file_character_length(const char *at)
{
	const unsigned char *c = (const unsigned char *)at;
	size_t n = text_utf8_length(c);
	bool is_noncharacter = n == 3 && c[0] == 0xef && c[1] == 0xbf && c[2] >= 0xbe; /* U+FFFE and U+FFFF */
	bool control = n == 1 && (*c == 0x7f || (*c < 0x20 && *c != '\t' && *c != '\n'));
	return is_noncharacter || control ? 0 : n;
}

void text_file_put_escaped(struct text_file *p, const char *text)
{
	while (*text) {
		size_t n = text_file_character_length(text);
		const char *replacement = *text == '&'	 ? "&amp;"
					  : *text == '<' ? "&lt;"
					  : *text == '>' ? "&gt;"
					  : *text == '"' ? "&quot;"
					  : n		 ? NULL
							 : "?";
		if (replacement)
			text_file_put_bytes(p, replacement, strlen(replacement));
		else
			text_file_put_bytes(p, text, n);
		text += n ? n : 1;
	}
}

void text_file_put_field(struct text_file *p, const char *text)
{
	if (!strpbrk(text, ",\"\n\r")) {
		text_file_put(p, "%s", text);
		return;
	}
	text_file_put(p, "\"");
	for (; *text; text++) {
		text_file_put_bytes(p, text, 1);
		if (*text == '"')
			text_file_put_bytes(p, text, 1);
	}
	text_file_put(p, "\"");
}

void text_file_put_base64(struct text_file *p, const unsigned char *bytes, size_t count)
{
	static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
	for (size_t i = 0; i < count; i += 3) {
		size_t remaining = count - i;
		unsigned v = (unsigned)bytes[i] << 16 | (remaining > 1 ? (unsigned)bytes[i + 1] << 8 : 0) |
			     (remaining > 2 ? bytes[i + 2] : 0u);
		char four[4] = {digits[v >> 18], digits[v >> 12 & 63], remaining > 1 ? digits[v >> 6 & 63] : '=',
				remaining > 2 ? digits[v & 63] : '='};
		text_file_put_bytes(p, four, 4);
	}
}

int text_file_write(const struct text_file *p, const char *path, struct error *e)
{
	if (p->has_failed)
		return error_set(e, ENOMEM, "%s: no memory for the text", path);
	return image_file_write(path, p->text.bytes, p->text.size, e);
}

void text_file_fini(struct text_file *p)
{
	buf_fini(&p->text);
	p->has_failed = false;
}
