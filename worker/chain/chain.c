#include "worker/chain/chain.h"

#include "common/base/mem.h"

#include <string.h>

void chain_count(struct chain *c, bool accepted)
{
	uint64_t *counters = c->context->counters;
	if (accepted) {
		counters[COUNT_ACCEPTED]++;
		c->rejected_run = 0;
		return;
	}
	c->rejected_run++;
	if (c->rejected_run > counters[COUNT_LONGEST_STUCK])
		counters[COUNT_LONGEST_STUCK] = c->rejected_run;
}

void chain_put64(uint8_t *p, uint64_t v)
{
	for (int i = 0; i < 8; i++)
		p[i] = (uint8_t)(v >> (8 * i));
}

uint64_t chain_get64(const uint8_t *p)
{
	uint64_t v = 0;
	for (int i = 0; i < 8; i++)
		v |= (uint64_t)p[i] << (8 * i);
	return v;
}

void chain_put_head(const struct chain *c, uint8_t *bytes)
{
	chain_put64(bytes, c->id);
	chain_put64(bytes + 8, c->step);
	chain_put64(bytes + 16, c->rejected_run);
}

bool chain_get_head(struct chain *c, const uint8_t *bytes, size_t size)
{
	if (size < CHAIN_STATE_HEAD || chain_get64(bytes) != c->id)
		return false;
	c->step = chain_get64(bytes + 8);
	c->rejected_run = chain_get64(bytes + 16);
	return true;
}

int chain_give(const uint8_t *bytes, size_t size, struct chain_state *out)
{
	out->size = (uint32_t)size;
	out->bytes = mem_alloc(size, 1);
	if (!out->bytes)
		return -ENOMEM;
	memcpy(out->bytes, bytes, size);
	return 0;
}
