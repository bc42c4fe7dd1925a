/*
 * A text file that is made in memory and put in place as a whole. Pieces that do not fit are noticed once, at the end. One
 * thread; zeroed memory is an empty page.
 */
#ifndef WORKER_CLI_PAGE_H
#define WORKER_CLI_PAGE_H

#include "common/base/buf.h"
#include "common/base/error.h"

struct page {
	struct buf text;
	bool full;
};

__attribute__((format(printf, 2, 3))) void page_put(struct page *p, const char *format, ...);
void page_bytes(struct page *p, const void *bytes, size_t count);
/* For XML and HTML: what has a meaning there is spelled out; what is no UTF-8 or no character of XML becomes '?'. */
void page_escaped(struct page *p, const char *text);
/* A field of comma-separated values, in quotes where it needs them. */
void page_field(struct page *p, const char *text);
void page_base64(struct page *p, const unsigned char *bytes, size_t count);
int page_write(const struct page *p, const char *path, struct error *e);
void page_fini(struct page *p);

/* Bytes of the character that `at` begins with, where it is UTF-8 that XML may hold; else 0. */
size_t page_character(const char *at);

#endif
