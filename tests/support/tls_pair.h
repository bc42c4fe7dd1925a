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

/* tls_pair_root is a temporary folder; the other two are folders in it with an authority each. Ours has issued the
 * folders farm (a coordinator), node (a worker), ann (a client) and root (an operator); theirs has issued farm and
 * node. */
extern const char *const tls_pair_root;
extern char tls_pair_ours[128], tls_pair_theirs[128];
int tls_pair_set_up(void **state); /* cmocka's set-up and tear-down of a group */
int tls_pair_tear_down(void **state);
void tls_pair_issue(const char *folder, const char *name, enum tls_role role, double days);
const char *tls_pair_path(const char *folder, const char *name); /* returns the path; valid for four calls */

struct tls_pair_end {
	struct tls *tls;
	struct tls_link *link;
	struct error e;
	int rc;
	unsigned char received[1 << 17];
	size_t received_size;
};
extern struct tls_pair_end tls_pair_caller, tls_pair_listener;

void tls_pair_end_open(struct tls_pair_end *x, const char *folder, bool listening);
void tls_pair_end_close(struct tls_pair_end *x);
void tls_pair_end_read(struct tls_pair_end *x);
/* Passes the output of `source` to `target`, `piece` bytes at a time. Returns false if there was none. */
bool tls_pair_carry(struct tls_pair_end *source, struct tls_pair_end *target, size_t piece);
/* Opens both ends and carries until neither has anything to send. */
void tls_pair_handshake(const char *caller_folder, const char *listener_folder, size_t piece);
void tls_pair_close(void);

#endif
