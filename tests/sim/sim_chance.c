/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/sim/sim_private.h"

#include <stdarg.h>
#include <stdio.h>

uint64_t sim_mix(uint64_t x)
{
	x += UINT64_C(0x9e3779b97f4a7c15);
	x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
	x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
	return x ^ (x >> 31);
}

double sim_uniform(struct world *w)
{
	return (double)(sim_mix(w->seed * UINT64_C(0x100000001b3) + w->draws++) >> 11) * 0x1p-53;
}

uint32_t sim_below(struct world *w, uint32_t n)
{
	return (uint32_t)(sim_uniform(w) * n);
}

bool sim_chance(struct world *w, double p)
{
	return sim_uniform(w) < p;
}

__attribute__((format(printf, 2, 3))) void sim_wrong(struct world *w, const char *format, ...)
{
	if (*w->wrong)
		return;
	va_list ap;
	va_start(ap, format);
	vsnprintf(w->wrong, sizeof w->wrong, format, ap);
	va_end(ap);
}

/* ---- messages in the order of their times */

static bool is_earlier(const struct message *a, const struct message *b)
{
	return a->time < b->time || (!(b->time < a->time) && a->order < b->order);
}

void sim_push(struct world *w, struct message m)
{
	if (w->heap_count == MESSAGES) {
		sim_wrong(w, "too many messages under way");
		return;
	}
	m.order = w->order++;
	size_t i = w->heap_count++;
	for (; i > 0 && is_earlier(&m, &w->heap[(i - 1) / 2]); i = (i - 1) / 2)
		w->heap[i] = w->heap[(i - 1) / 2];
	w->heap[i] = m;
}

struct message sim_pop(struct world *w)
{
	struct message first = w->heap[0], last = w->heap[--w->heap_count];
	size_t i = 0;
	for (;;) {
		size_t k = 2 * i + 1;
		if (k >= w->heap_count)
			break;
		if (k + 1 < w->heap_count && is_earlier(&w->heap[k + 1], &w->heap[k]))
			k++;
		if (!is_earlier(&w->heap[k], &last))
			break;
		w->heap[i] = w->heap[k];
		i = k;
	}
	w->heap[i] = last;
	return first;
}

bool sim_is_calm(const struct world *w)
{
	return w->now >= w->calm;
}

/* Posts a message over the network. Before the world is calm it may be late, delivered twice or lost. */
void sim_post(struct world *w, struct message m)
{
	bool calm = sim_is_calm(w);
	if (!calm && sim_chance(w, w->drop))
		return;
	int copies = !calm && sim_chance(w, w->repeat) ? 2 : 1;
	for (int i = 0; i < copies; i++) {
		m.time = w->now + 0.001 + (calm ? 0.01 : w->delay * sim_uniform(w) * sim_uniform(w));
		if (!calm && sim_chance(w, 0.01))
			m.time += 200 * sim_uniform(w);
		sim_push(w, m);
	}
}
