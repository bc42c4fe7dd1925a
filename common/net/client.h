/* SPDX-License-Identifier: Apache-2.0 */
/*
 * The client's side of the conversation (hslt-submit, hslt-job): says hello, then sends and waits, one step at a time,
 * with a loop of its own. One thread.
 */
#ifndef COMMON_NET_CLIENT_H
#define COMMON_NET_CLIENT_H

#include "common/base/buf.h"
#include "common/net/conn.h"

struct client;

enum { CLIENT_NAME_BYTES = 240 };

struct client_message { /* fini with client_message_fini */
	struct envelope envelope;
	struct buf payload;
};

/* Connects and exchanges hello; tls: a folder (tls.h), NULL or "" for plaintext. -ECONNREFUSED when nobody is there
 * (also what is not one of ours: nothing else answers in time), -EPROTO when hello is refused, -EACCES when one side
 * does not accept the other's certificate or only one speaks TLS, -EPERM, -EIO when our own folder is no good. */
int client_open(struct client **cl, const char *host_port, const char *tls, bool insecure, const char *name,
		struct error *e);
void client_close(struct client *cl);
/* Tells the user on stderr that certificates expire soon, and what the coordinator says of itself, if there is anything
 * to tell. */
void client_print_notes(const struct client *cl, const char *program);

/* Sends and waits until it is with the kernel. */
int client_send(struct client *cl, const Farm__Envelope *m, const void *payload, size_t size, struct error *e);
/* The next message. -ETIMEDOUT after `seconds` without a word, heartbeats included (< 0: waits for ever), -ECONNRESET
 * when the connection is gone, -EPROTO when the coordinator found fault with us. */
int client_wait(struct client *cl, double seconds, struct client_message *m, struct error *e);
/* Sends, and waits for a message of this kind; any other is -EPROTO. */
int client_call(struct client *cl, const Farm__Envelope *m, Farm__Envelope__BodyCase want,
		struct client_message *answer, struct error *e);
void client_message_fini(struct client_message *m);

/* Fetches a job's result or log piece by piece into the file: temporary file beside it, then rename. -EIO: of the file
 * here. */
int client_fetch(struct client *cl, uint64_t job, Farm__What what, const char *path, struct error *e);
/* The same into the current folder, under the last part of the name that hslt-submit was given. That came over the
 * wire: -EEXIST when something has that name already, or when it is none that a file of somebody else's choice may have
 * (hidden, like an option). */
int client_fetch_here(struct client *cl, uint64_t job, Farm__What what, char name[CLIENT_NAME_BYTES], struct error *e);
/* The same, to a stream. */
int client_fetch_stream(struct client *cl, uint64_t job, Farm__What what, int fd, struct error *e);

/* The exit code for a failure of the functions above: 75 unreachable, 6 refused, else 1. */
int client_exit_code(int rc);
/* What went wrong with files here is neither the farm's doing nor its absence, whatever its number: -EIO instead of it.
 * 0 stays. */
int client_local(int rc);

#endif
