/*
 * What the strategies of a mixture did, for people and programs: names of the counters, a table, a sentence on chains that
 * did not move. Pure; any thread.
 */
#ifndef COMMON_FILM_STRATEGY_H
#define COMMON_FILM_STRATEGY_H

#include "common/film/canvas.h"

/* "proposed", "accepted", ... and the reasons of failures: "outside", "missed", ... */
const char *strategy_counter_name(enum strategy_counter c);

/* One row a strategy: proposals, accepted, rays a proposal, walks, iterations a walk, the way back, failures in % of the
 * proposals. Lines end with '\n'; empty where the plan has no mixture or nothing was counted. A text that does not fit is
 * cut. STRATEGY_TABLE bytes are enough. */
enum { STRATEGY_TABLE = 4096 };
void strategy_table(const char *mixture, const struct canvas_counts *n, char *text, size_t size);

/* "3 of 8,192 epochs of chains (1,024 chains, 8 rounds) passed without an accepted mutation; longest run: 5,210 rejections";
 * empty: none did. */
void strategy_stuck(const struct plan *p, uint64_t rounds, const struct canvas_counts *n, char *text, size_t size);

#endif
