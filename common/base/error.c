/* SPDX-License-Identifier: Apache-2.0 */
#include "common/base/error.h"

#include "common/base/text.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

int error_set(struct error *e, int errno_value, const char *format, ...)
{
	if (e) {
		va_list ap;
		va_start(ap, format);
		vsnprintf(e->text, sizeof e->text, format, ap);
		va_end(ap);
		text_clean(e->text);
	}
	return -errno_value;
}

int error_file(struct error *e, int errno_value, const char *path)
{
	return error_set(e, errno_value, "%s: %s", path, strerror(errno_value));
}

int error_prefix(struct error *e, int code, const char *format, ...)
{
	if (e) {
		char tail[sizeof e->text];
		memcpy(tail, e->text, sizeof tail);
		va_list ap;
		va_start(ap, format);
		int n = vsnprintf(e->text, sizeof e->text, format, ap);
		va_end(ap);
		if (n >= 0 && (size_t)n < sizeof e->text)
			snprintf(e->text + n, sizeof e->text - (size_t)n, ": %s", tail);
		text_clean(e->text);
	}
	return code;
}
