/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/append_format.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

void append_format(char *text, size_t size, size_t *used, const char *format, ...)
{
	va_list ap;
	va_start(ap, format);
	int n = vsnprintf(text + *used, size - *used, format, ap);
	va_end(ap);
	assert_true(n >= 0 && (size_t)n < size - *used);
	*used += (size_t)n;
}
