/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/bench/relay.h"

#include "common/base/mem.h"
#include "tests/bench/bench.h"

#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

struct relay {
	int listener;
	uint16_t target;
	pthread_t thread;
	atomic_ullong sent_bytes;
};

static struct sockaddr_in loopback(uint16_t port)
{
	return (struct sockaddr_in){
		.sin_family = AF_INET, .sin_port = htons(port), .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
}

/* Returns the number of bytes passed on; 0: the stream has ended, or the other side is gone. */
static size_t pass_bytes(int from, int to)
{
	char piece[1 << 16];
	ssize_t n = recv(from, piece, sizeof piece, 0);
	for (ssize_t done = 0; done < n;) {
		ssize_t m = send(to, piece + done, (size_t)(n - done), MSG_NOSIGNAL);
		if (m <= 0)
			return 0;
		done += m;
	}
	return n > 0 ? (size_t)n : 0;
}

/* Passes bytes on until one side hangs up. */
static void serve_connection(struct relay *r, int client, int coordinator)
{
	struct pollfd ends[2] = {{client, POLLIN, 0}, {coordinator, POLLIN, 0}};
	for (;;) {
		if (poll(ends, 2, -1) < 0)
			return;
		for (int k = 0; k < 2; k++)
			if (ends[k].revents) {
				size_t n = pass_bytes(ends[k].fd, ends[!k].fd);
				if (n == 0)
					return;
				if (k == 0)
					atomic_fetch_add(&r->sent_bytes, n);
			}
	}
}

static void *run_relay(void *user)
{
	struct relay *r = user;
	struct sockaddr_in to = loopback(r->target);
	for (int client; (client = accept(r->listener, NULL, NULL)) >= 0; close(client)) {
		int coordinator = socket(AF_INET, SOCK_STREAM, 0);
		if (coordinator >= 0 && connect(coordinator, (struct sockaddr *)&to, sizeof to) == 0)
			serve_connection(r, client, coordinator);
		if (coordinator >= 0)
			close(coordinator);
	}
	return NULL;
}

struct relay *relay_start(uint16_t target, uint16_t *port)
{
	struct relay *r = bench_alloc(1, sizeof *r);
	struct sockaddr_in at = loopback(0);
	socklen_t size = sizeof at;
	r->listener = socket(AF_INET, SOCK_STREAM, 0);
	r->target = target;
	if (r->listener < 0 || bind(r->listener, (struct sockaddr *)&at, size) || listen(r->listener, 8) ||
	    getsockname(r->listener, (struct sockaddr *)&at, &size) || pthread_create(&r->thread, NULL, run_relay, r)) {
		perror("bench: relay");
		exit(1);
	}
	*port = ntohs(at.sin_port);
	return r;
}

uint64_t relay_sent_bytes(const struct relay *r)
{
	return atomic_load(&r->sent_bytes);
}

void relay_stop(struct relay *r)
{
	shutdown(r->listener, SHUT_RDWR);
	pthread_join(r->thread, NULL);
	close(r->listener);
	mem_free(r);
}
