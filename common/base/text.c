#include "common/base/text.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void text_copy(char *out, size_t size, const char *from)
{
	size_t n = strlen(from);
	if (n >= size) {
		n = size - 1;
		while (n && ((unsigned char)from[n] & 0xC0) == 0x80)
			n--;
	}
	memmove(out, from, n);
	out[n] = 0;
}

void text_put(struct text *t, const char *format, ...)
{
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(t->at, t->left, format, ap);
	va_end(ap);
	size_t used = n < 0 ? 0 : (size_t)n;
	if (t->left && used >= t->left)
		used = t->left - 1;
	t->at += used;
	t->left -= used;
}

bool text_ratio(const char *text, double *ratio)
{
	char *end;
	double x = strtod(text, &end);
	if (end != text && *end == '%') {
		x /= 100;
		end++;
	}
	if (end == text || *end || !isfinite(x))
		return false;
	*ratio = x;
	return true;
}

bool text_share(const char *text, double *share)
{
	double x;
	if (!text_ratio(text, &x) || !(x >= 0 && x <= 1))
		return false;
	*share = x;
	return true;
}

char *text_borrow(const char *text)
{
	union {
		const char *from;
		char *to;
	} u = {text};
	return u.to;
}
