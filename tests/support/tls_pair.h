/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Two ends of a TLS connection in memory, and two authorities with certificates. One pair per process; failures end the
 * test.
 */
#ifndef TESTS_SUPPORT_TLS_PAIR_H
#define TESTS_SUPPORT_TLS_PAIR_H

#include "common/net/tls.h"

#include <stdbool.h>
#include <stddef.h>

/* pair_root is a temporary folder; the other two are folders in it with an authority each. Ours has issued the
 * folders farm (a coordinator), node (a worker), ann (a client) and root (an operator); theirs has issued farm and
 * node. */
extern const char *const pair_root;
extern char pair_ours[128], pair_theirs[128];
int pair_make_folders(void **state); /* cmocka's set-up and tear-down of a group */
int pair_remove_folders(void **state);
void pair_issue(const char *folder, const char *name, enum tls_role role, double days);
const char *pair_at(const char *folder, const char *name); /* returns the path; valid for four calls */

struct pair_end {
	struct tls *tls;
	struct tls_link *link;
	struct error e;
	int rc;
	unsigned char got[1 << 17]; /* bytes received */
	size_t got_size;
};
extern struct pair_end pair_caller, pair_listener;

void pair_open(struct pair_end *x, const char *folder, bool listening);
void pair_close(struct pair_end *x);
void pair_read(struct pair_end *x);
/* Passes the output of `from` to `to`, `piece` bytes at a time. Returns false if there was none. */
bool pair_carry(struct pair_end *from, struct pair_end *to, size_t piece);
/* Opens both ends and carries until neither has anything to send. */
void pair_shake(const char *from, const char *to, size_t piece);
void pair_hang_up(void);

#endif
