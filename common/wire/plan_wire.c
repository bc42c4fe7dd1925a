/* SPDX-License-Identifier: Apache-2.0 */
#include "common/wire/plan_wire.h"

#include "common/base/text.h"

#include <string.h>

static size_t unseen_to_wire(const struct plan_unseen *u, double **out)
{
	union { /* casts const away: protobuf-c's structures have no const, but packing only reads them */
		const double *from;
		double *to;
	} borrowed = {u->mean_squares};
	*out = borrowed.to;
	for (size_t i = 0; i < PLAN_UNSEEN_COUNT; i++)
		if (u->mean_squares[i] > 0)
			return PLAN_UNSEEN_COUNT;
	return 0;
}

static int unseen_from_wire(const double *values, size_t count, struct plan_unseen *out, struct error *e)
{
	if (count && count != PLAN_UNSEEN_COUNT)
		return error_set(e, EBADMSG, "a plan with %zu numbers of unseen light", count);
	for (size_t i = 0; i < count; i++)
		out->mean_squares[i] = values[i];
	return 0;
}

void plan_to_wire(const struct plan *p, Farm__Plan *out)
{
	farm__plan__init(out);
	out->integrator = text_unconst(p->integrator);
	out->kind = (uint32_t)p->kind;
#define X(name) out->name = p->name;
	PLAN_NUMBERS(X)
#undef X
	out->mutations = text_unconst(p->mutations);
	out->accuracy = text_unconst(p->accuracy);
	out->effects = text_unconst(p->effects);
	out->n_unseen = unseen_to_wire(&p->unseen, &out->unseen);
}

static int kind_from_wire(uint32_t kind, const char *name, enum plan_kind *out, char integrator[16], struct error *e)
{
	if (kind != PLAN_SAMPLES && kind != PLAN_CHAINS)
		return error_set(e, EBADMSG, "a plan of unknown kind %u", kind);
	if (!envelope_text_is_valid(name, 15))
		return error_set(e, EBADMSG, "a plan whose integrator has no name of at most 15 bytes");
	*out = (enum plan_kind)kind;
	memset(integrator, 0, 16);
	memcpy(integrator, name, strlen(name));
	return 0;
}

static int mixture_from_wire(const char *text, char mixture[PLAN_MUTATIONS_MAX], struct error *e)
{
	if (strlen(text) >= PLAN_MUTATIONS_MAX || plan_strategy_count(text) < 0)
		return error_set(e, EBADMSG, "a plan whose mixture of mutations is none");
	memset(mixture, 0, PLAN_MUTATIONS_MAX);
	memcpy(mixture, text, strlen(text));
	return 0;
}

static int text_from_wire(const char *text, char *out, size_t size, struct error *e)
{
	size_t n = strlen(text);
	if (n >= size)
		return error_set(e, EBADMSG, "a plan whose settings or effects are a text of %zu bytes", n);
	memset(out, 0, size);
	memcpy(out, text, n);
	return plan_text_is_valid(out, size) ? 0 : error_set(e, EBADMSG, "a plan whose settings or effects are none");
}

int plan_from_wire(const Farm__Plan *m, struct plan *p, struct error *e)
{
	memset(p, 0, sizeof *p);
	int rc = m ? 0 : error_set(e, EBADMSG, "no plan");
	if (!rc)
		rc = kind_from_wire(m->kind, m->integrator, &p->kind, p->integrator, e);
	if (!rc)
		rc = mixture_from_wire(m->mutations, p->mutations, e);
	if (!rc)
		rc = text_from_wire(m->accuracy, p->accuracy, sizeof p->accuracy, e);
	if (!rc)
		rc = text_from_wire(m->effects, p->effects, sizeof p->effects, e);
	if (!rc)
		rc = unseen_from_wire(m->unseen, m->n_unseen, &p->unseen, e);
	if (rc)
		return rc;
#define X(name) p->name = m->name;
	PLAN_NUMBERS(X)
#undef X
	return plan_check(p, e);
}

void plan_request_to_wire(const struct plan_request *r, Farm__PlanRequest *out)
{
	farm__plan_request__init(out);
	out->integrator = text_unconst(r->integrator);
	out->kind = (uint32_t)r->kind;
#define X(name) out->name = r->name;
	PLAN_REQUEST_NUMBERS(X)
#undef X
	out->bootstrap_rays = r->rays.bootstrap;
	out->step_rays = r->rays.step;
	out->mixture = text_unconst(r->mixture);
	out->accuracy = text_unconst(r->accuracy);
	out->effects = text_unconst(r->effects);
	out->n_unseen = unseen_to_wire(&r->unseen, &out->unseen);
}

int plan_request_from_wire(const Farm__PlanRequest *m, struct plan_request *r, struct error *e)
{
	memset(r, 0, sizeof *r);
	int rc = m ? 0 : error_set(e, EBADMSG, "no plan request");
	if (!rc)
		rc = kind_from_wire(m->kind, m->integrator, &r->kind, r->integrator, e);
	if (!rc)
		rc = mixture_from_wire(m->mixture, r->mixture, e);
	if (!rc)
		rc = text_from_wire(m->accuracy, r->accuracy, sizeof r->accuracy, e);
	if (!rc)
		rc = text_from_wire(m->effects, r->effects, sizeof r->effects, e);
	if (!rc)
		rc = unseen_from_wire(m->unseen, m->n_unseen, &r->unseen, e);
	if (!rc && !(m->speed >= 0 && m->speed <= PLAN_SPEED_MAX))
		rc = error_set(e, EBADMSG, "a pilot of %g a second", m->speed);
	if (!rc && !(m->bootstrap_rays >= 0 && m->bootstrap_rays < 1e15 && m->step_rays >= 0 && m->step_rays < 1e15))
		rc = error_set(e, EBADMSG, "a pilot of %g and %g rays", m->bootstrap_rays, m->step_rays);
	if (rc)
		return rc;
#define X(name) r->name = m->name;
	PLAN_REQUEST_NUMBERS(X)
#undef X
	r->rays = (struct plan_rays){m->bootstrap_rays, m->step_rays};
	return 0;
}

void lease_key_to_wire(const struct lease_key *k, Farm__LeaseKey *out)
{
	farm__lease_key__init(out);
	out->job = k->job;
	out->kind = (uint32_t)k->kind;
	out->group = k->group;
	out->part = k->part;
	out->epoch = k->epoch;
}

int lease_key_from_wire(const Farm__LeaseKey *m, struct lease_key *k, struct error *e)
{
	memset(k, 0, sizeof *k);
	if (!m)
		return error_set(e, EBADMSG, "a lease without a key");
	if (m->kind != LEASE_BOOTSTRAP && m->kind != LEASE_RENDER)
		return error_set(e, EBADMSG, "a lease of unknown kind %u", m->kind);
	*k = (struct lease_key){m->job, (enum lease_kind)m->kind, m->group, m->part, m->epoch};
	return 0;
}
