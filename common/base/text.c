#include "common/base/text.h"

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
