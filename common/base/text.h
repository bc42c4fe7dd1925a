/* Short texts in fixed arrays. Any thread. */
#ifndef COMMON_BASE_TEXT_H
#define COMMON_BASE_TEXT_H

#include <stddef.h>

/* Copies, cutting what does not fit, never in the middle of a UTF-8 sequence. */
void text_copy(char *out, size_t size, const char *from);

#endif
