/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/tls_pair.h"

#include "common/net/authority.h"
#include "tests/support/folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>

const char *const pair_root = folder;
char pair_ours[128], pair_theirs[128];

const char *pair_at(const char *of, const char *name)
{
	static char paths[4][512];
	static unsigned next;
	char *path = paths[next++ % 4];
	snprintf(path, sizeof paths[0], "%s/%s", of, name);
	return path;
}

void pair_issue(const char *of, const char *name, enum tls_role role, double days)
{
	struct error e = {""};
	int rc = authority_issue(of, name, role, days, false, &e);
	if (rc)
		fail_msg("%s: %s", name, e.text);
}

int pair_make_folders(void **state)
{
	struct error e;
	if (folder_set_up(state))
		return -1;
	snprintf(pair_ours, sizeof pair_ours, "%s/ours", pair_root);
	snprintf(pair_theirs, sizeof pair_theirs, "%s/theirs", pair_root);
	if (authority_init(pair_ours, "ours", 10, &e) || authority_init(pair_theirs, "theirs", 10, &e))
		return -1;
	pair_issue(pair_ours, "farm", TLS_COORDINATOR, 5);
	pair_issue(pair_ours, "node", TLS_WORKER, 5);
	pair_issue(pair_ours, "ann", TLS_CLIENT, 5);
	pair_issue(pair_ours, "root", TLS_OPERATOR, 5);
	pair_issue(pair_theirs, "farm", TLS_COORDINATOR, 5);
	pair_issue(pair_theirs, "node", TLS_WORKER, 5);
	return 0;
}

int pair_remove_folders(void **state)
{
	return folder_tear_down(state);
}

void pair_open(struct pair_end *x, const char *of, bool listening)
{
	x->rc = 0;
	x->got_size = 0;
	x->e.text[0] = 0;
	int rc = tls_open(&x->tls, of, &x->e);
	if (rc)
		fail_msg("%s", x->e.text);
	assert_int_equal(tls_link_new(&x->link, x->tls, listening, &x->e), 0);
}

void pair_close(struct pair_end *x)
{
	tls_link_free(x->link);
	tls_close(x->tls);
}

void pair_read(struct pair_end *x)
{
	ssize_t n = 1;
	while (!x->rc && n > 0) {
		n = tls_link_read(x->link, x->got + x->got_size, sizeof x->got - x->got_size, &x->e);
		if (n > 0)
			x->got_size += (size_t)n;
		else if (n < 0)
			x->rc = (int)n;
	}
}

bool pair_carry(struct pair_end *from, struct pair_end *to, size_t piece)
{
	const unsigned char *bytes;
	size_t size = tls_link_output(from->link, &bytes);
	for (size_t i = 0; i < size && !to->rc; i += piece) {
		to->rc = tls_link_take(to->link, bytes + i, size - i < piece ? size - i : piece, &to->e);
		pair_read(to);
	}
	tls_link_output_taken(from->link);
	return size > 0;
}

struct pair_end pair_caller, pair_listener;

void pair_shake(const char *from, const char *to, size_t piece)
{
	pair_open(&pair_caller, from, false);
	pair_open(&pair_listener, to, true);
	pair_read(&pair_caller);
	while (pair_carry(&pair_caller, &pair_listener, piece) || pair_carry(&pair_listener, &pair_caller, piece))
		;
}

void pair_hang_up(void)
{
	pair_close(&pair_caller);
	pair_close(&pair_listener);
}
