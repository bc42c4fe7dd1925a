/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/daemon/lease_task.h"

#include "common/base/mem.h"
#include "worker/daemon/work.h"

#include <math.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

int lease_task_new(struct lease_task **out, struct grant *g, struct job_cache *b, struct error *e)
{
	struct lease_task *l = mem_alloc(1, sizeof *l);
	if (!l)
		return error_set(e, ENOMEM, "no memory for a lease");
	l->grant = *g;
	memset(g, 0, sizeof *g);
	l->bundle = b;
	b->users++;
	atomic_init(&l->stop, false);
	*out = l;
	return 0;
}

void lease_task_free(struct lease_task *l)
{
	l->bundle->users--;
	grant_fini(&l->grant);
	mem_free(l->frame);
	mem_free(l);
}

/* The smallest wrong that there is: the last bit of one number. */
static void lie(const struct batch *b)
{
	float *x = b->tile_count ? b->tiles[0].xyz : b->weight_count ? b->weights : NULL;
	uint32_t bits;
	if (!x)
		return;
	memcpy(&bits, x, sizeof bits);
	bits ^= 1;
	memcpy(x, &bits, sizeof bits);
}

/* As no light of a scene is. */
static void exaggerate(const struct batch *b)
{
	float *x = b->tile_count ? b->tiles[0].xyz : b->weight_count ? b->weights : NULL;
	if (x)
		*x = 1e30f;
}

static uint64_t next(uint64_t *state)
{
	uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
	z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
	z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
	return z ^ z >> 31;
}

/* Behind its id, so that it looks like the chain's: flipped bits, numbers that are none or huge or tiny, noise here and
 * there, the end cut off, noise throughout. The last two are no states of any plan (plainly); after the others one may
 * be, only not the chain's: in primary sample space most bits of a random number make another random number. */
static void spoil_state(struct chain_state *s, bool plainly, uint64_t *dice)
{
	enum { ID = 8, MUTATIONS = 8 };
	static const double numbers[] = {NAN, INFINITY, -INFINITY, 1e308, -1e308, 5e-324, 1e-310, -0.0};
	if (s->size <= ID + sizeof *numbers)
		return;
	uint64_t kind = plainly ? 3 + next(dice) % 2 : next(dice) % 5, left = s->size - ID;
	for (int i = 0; i < MUTATIONS; i++) {
		uint8_t *at = s->bytes + ID + next(dice) % left;
		if (kind == 0)
			*at ^= (uint8_t)(1u << next(dice) % 8);
		else if (kind == 1)
			memcpy(s->bytes + ID + next(dice) % (left / 8) * 8, &numbers[next(dice) % 8], sizeof *numbers);
		else if (kind == 2)
			*at = (uint8_t)next(dice);
	}
	for (uint64_t i = 0; kind == 4 && i < left; i++)
		s->bytes[ID + i] = (uint8_t)next(dice);
	if (kind == 3)
		s->size -= (uint32_t)(1 + next(dice) % (left - 1));
}

/* The first one plainly, or nobody could notice. */
static void spoil(const struct batch *b, uint64_t dice)
{
	for (uint32_t i = 0; i < b->state_count; i++)
		spoil_state(&b->states[i], i == 0, &dice);
}

/* Packed here, so that the loop's thread never encodes a film. */
static void run(struct task *t)
{
	struct lease_task *l = (struct lease_task *)t; /* its first member */
	struct batch batch = {0};
	struct lease_input in = {l->grant.chain_count, l->grant.seeds, l->grant.states};
	const struct plan *p = &l->bundle->plan;
	l->end = LEASE_STOPPED;
	work_begin(&l->grant.key, l->bundle->info.message->job_info->scene);
	if (l->crashes)
		raise(SIGSEGV);
	while (l->hangs)
		pause();
	if (!atomic_load(&l->stop))
		l->rc = render_lease(l->bundle->world, p, &l->grant.key, &in, &l->stop, &l->end, &batch, &l->error);
	if (!l->rc && l->end == LEASE_DONE) /* what the coordinator would refuse is the scene's fault, and is said
					       before it is sent */
		l->rc = batch_check(&batch, p, &l->error);
	if (l->rc)
		error_prefix(&l->error, l->rc, "%s", l->bundle->info.message->job_info->scene);
	if (!l->rc && l->end == LEASE_DONE && l->lie)
		lie(&batch);
	if (!l->rc && l->end == LEASE_DONE && l->large)
		exaggerate(&batch);
	if (!l->rc && l->end == LEASE_DONE && l->spoil)
		spoil(&batch, l->spoil);
	if (!l->rc && l->end == LEASE_DONE)
		l->rc = batch_pack(&batch, p, &l->frame, &l->frame_size, &l->error);
	batch_fini(&batch);
	work_end();
}

static void done(struct task *t)
{
	struct lease_task *l = (struct lease_task *)t;
	l->finished(l);
}

void lease_task_start(struct lease_task *l, struct thread_pool *c)
{
	l->state = LEASE_QUEUED;
	l->task.run = run;
	l->task.done = done;
	thread_pool_add(c, &l->task);
}
