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

double sim_uniform(struct sim_world *w)
{
	return (double)(sim_mix(w->seed * UINT64_C(0x100000001b3) + w->draw_count++) >> 11) * 0x1p-53;
}

uint32_t sim_uniform_below(struct sim_world *w, uint32_t n)
{
	return (uint32_t)(sim_uniform(w) * n);
}

bool sim_chance(struct sim_world *w, double p)
{
	return sim_uniform(w) < p;
}

__attribute__((format(printf, 2, 3))) void sim_report_violation(struct sim_world *w, const char *format, ...)
{
	if (*w->violation)
		return;
	va_list ap;
	va_start(ap, format);
	vsnprintf(w->violation, sizeof w->violation, format, ap);
	va_end(ap);
}

/* ---- messages in the order of their times */

static bool is_earlier(const struct sim_message *a, const struct sim_message *b)
{
	return a->time < b->time || (!(b->time < a->time) && a->order < b->order);
}

void sim_push_message(struct sim_world *w, struct sim_message m)
{
	if (w->heap_count == MESSAGES_MAX) {
		sim_report_violation(w, "too many messages under way");
		return;
	}
	m.order = w->order++;
	size_t i = w->heap_count++;
	for (; i > 0 && is_earlier(&m, &w->message_heap[(i - 1) / 2]); i = (i - 1) / 2)
		w->message_heap[i] = w->message_heap[(i - 1) / 2];
	w->message_heap[i] = m;
}

struct sim_message sim_pop_message(struct sim_world *w)
{
	struct sim_message first = w->message_heap[0], last = w->message_heap[--w->heap_count];
	size_t i = 0;
	for (;;) {
		size_t k = 2 * i + 1;
		if (k >= w->heap_count)
			break;
		if (k + 1 < w->heap_count && is_earlier(&w->message_heap[k + 1], &w->message_heap[k]))
			k++;
		if (!is_earlier(&w->message_heap[k], &last))
			break;
		w->message_heap[i] = w->message_heap[k];
		i = k;
	}
	w->message_heap[i] = last;
	return first;
}

bool sim_is_calm(const struct sim_world *w)
{
	return w->now >= w->calm_from;
}

/* Posts a message over the network. Before the world is calm it may be late, delivered twice or lost. */
void sim_post_message(struct sim_world *w, struct sim_message m)
{
	bool calm = sim_is_calm(w);
	if (!calm && sim_chance(w, w->drop_rate))
		return;
	int copies = !calm && sim_chance(w, w->repeat_rate) ? 2 : 1;
	for (int i = 0; i < copies; i++) {
		m.time = w->now + 0.001 + (calm ? 0.01 : w->max_delay * sim_uniform(w) * sim_uniform(w));
		if (!calm && sim_chance(w, 0.01))
			m.time += 200 * sim_uniform(w);
		sim_push_message(w, m);
	}
}
