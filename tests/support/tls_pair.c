/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/support/tls_pair.h"

#include "common/net/authority.h"
#include "tests/support/temporary_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>

const char *const tls_pair_root = temporary_folder;
char tls_pair_ours[128], tls_pair_theirs[128];

const char *tls_pair_path(const char *folder, const char *name)
{
	static char paths[4][512];
	static unsigned next;
	char *path = paths[next++ % 4];
	snprintf(path, sizeof paths[0], "%s/%s", folder, name);
	return path;
}

void tls_pair_issue(const char *folder, const char *name, enum tls_role role, double days)
{
	struct error e = {""};
	int rc = authority_issue(folder, name, role, days, false, &e);
	if (rc)
		fail_msg("%s: %s", name, e.text);
}

int tls_pair_set_up(void **state)
{
	struct error e;
	if (temporary_folder_set_up(state))
		return -1;
	snprintf(tls_pair_ours, sizeof tls_pair_ours, "%s/ours", tls_pair_root);
	snprintf(tls_pair_theirs, sizeof tls_pair_theirs, "%s/theirs", tls_pair_root);
	if (authority_create(tls_pair_ours, "ours", 10, &e) || authority_create(tls_pair_theirs, "theirs", 10, &e))
		return -1;
	tls_pair_issue(tls_pair_ours, "farm", TLS_COORDINATOR, 5);
	tls_pair_issue(tls_pair_ours, "node", TLS_WORKER, 5);
	tls_pair_issue(tls_pair_ours, "ann", TLS_CLIENT, 5);
	tls_pair_issue(tls_pair_ours, "root", TLS_OPERATOR, 5);
	tls_pair_issue(tls_pair_theirs, "farm", TLS_COORDINATOR, 5);
	tls_pair_issue(tls_pair_theirs, "node", TLS_WORKER, 5);
	return 0;
}

int tls_pair_tear_down(void **state)
{
	return temporary_folder_tear_down(state);
}

void tls_pair_end_open(struct tls_pair_end *x, const char *folder, bool listening)
{
	x->rc = 0;
	x->received_size = 0;
	x->e.text[0] = 0;
	int rc = tls_open(&x->tls, folder, &x->e);
	if (rc)
		fail_msg("%s", x->e.text);
	assert_int_equal(tls_link_new(&x->link, x->tls, listening, &x->e), 0);
}

void tls_pair_end_close(struct tls_pair_end *x)
{
	tls_link_free(x->link);
	tls_close(x->tls);
}

void tls_pair_end_read(struct tls_pair_end *x)
{
	ssize_t n = 1;
	while (!x->rc && n > 0) {
		n = tls_link_read(x->link, x->received + x->received_size, sizeof x->received - x->received_size,
				  &x->e);
		if (n > 0)
			x->received_size += (size_t)n;
		else if (n < 0)
			x->rc = (int)n;
	}
}

bool tls_pair_carry(struct tls_pair_end *source, struct tls_pair_end *target, size_t piece)
{
	const unsigned char *bytes;
	size_t size = tls_link_output(source->link, &bytes);
	for (size_t i = 0; i < size && !target->rc; i += piece) {
		target->rc = tls_link_receive(target->link, bytes + i, size - i < piece ? size - i : piece, &target->e);
		tls_pair_end_read(target);
	}
	tls_link_clear_output(source->link);
	return size > 0;
}

struct tls_pair_end tls_pair_caller, tls_pair_listener;

void tls_pair_handshake(const char *caller_folder, const char *listener_folder, size_t piece)
{
	tls_pair_end_open(&tls_pair_caller, caller_folder, false);
	tls_pair_end_open(&tls_pair_listener, listener_folder, true);
	tls_pair_end_read(&tls_pair_caller);
	while (tls_pair_carry(&tls_pair_caller, &tls_pair_listener, piece) ||
	       tls_pair_carry(&tls_pair_listener, &tls_pair_caller, piece))
		;
}

void tls_pair_close(void)
{
	tls_pair_end_close(&tls_pair_caller);
	tls_pair_end_close(&tls_pair_listener);
}
