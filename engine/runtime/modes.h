/* Modes of sliding pairs: where they are kept and what they mean. */
#ifndef TR_MODES_H
#define TR_MODES_H
#include <math.h>
#include <string.h>
#include "tr.h"
#include "tr_tables.h"

/* How the multiplier of a freedom is found: by its law; by the acceleration of a pair held at rest; zero, where the motion is
 * prescribed anyway; as its share of what a group of pairs holds together. */
enum { TR_ROW_LAW, TR_ROW_STILL, TR_ROW_FREE, TR_ROW_SHARE, TR_ROW_KEPT };

/* Whence the loads come that a small group at rest keeps: it keeps none, and shares by the rule; from a creep; from where they are in z. */
enum { TR_KEEPS_NONE, TR_KEEPS_CREEP, TR_KEEPS_PLACED };

/* Of a multiplier that is a share: whose, the pair that owns that one, and where that pair's derivative of the capacity begins. */
typedef struct tr_leader {
  int multiplier, pair, dhold;
} tr_leader;

/* A pair's way through the proportional zone of its law. */
typedef struct tr_zone {
  int inside;
  int ncontacts;       /* of `before` */
  double entered;      /* s */
  double direction[3]; /* of sliding when it was entered */
  double reversal;     /* time the sliding turned round, s; not a number: not yet */
  tr_contact before[TR_EVENT_CONTACTS]; /* contacts when it was entered */
} tr_zone;

/* What a column that is treated afterwards was last. */
typedef struct tr_memory {
  int known;
  double value;
} tr_memory;

#define ASK_AFTER 1e7 /* multiplications, a few milliseconds: 0.2 s are to be kept on slow machines too */

/* What a bounded step counts: maps formed beside evaluations are evaluations, solutions of decisions iterations, too. */
static inline long tr_evaluations(const tr_sim *s) { return s->stats.rhs_evaluations + s->stats.maps; }
static inline long tr_iterations(const tr_sim *s) { return s->stats.newton_iterations + s->stats.solutions; }

/* Whether a bounded step has done the work it may: then nothing is sought any more. */
static inline int tr_at_bound(tr_sim *s) {
  if (!s->bound.evaluations || (tr_evaluations(s) < s->bound.evaluations && tr_iterations(s) < s->bound.iterations)) return 0;
  return s->ask.stop = 1;
}

/* Whether to give up, so much work having been done since this was last looked at. */
static inline int tr_gives_up(tr_sim *s, double work) {
  if (tr_at_bound(s)) return 1;
  if (!s->ask.host || s->ask.stop || (s->ask.work += work) < ASK_AFTER) return s->ask.stop;
  s->ask.work = 0.0;
  return s->ask.stop = s->ask.host();
}

/* Copies n numbers of one of the block's arrays into another. Most are short: a call takes longer than they do. */
static inline void tr_copy(int n, const double *from, double *to) {
  int i = 0;
  for (; i + TR_LANES <= n; i += TR_LANES) *(tr_vec *)(to + i) = *(const tr_vec *)(from + i);
  for (; i < n; ++i) to[i] = from[i];
}

static inline const tr_pair *tr_pair_of(const tr_sim *s, int i) { return s->k->pair + i; }

/* Numbers of a solution: multipliers, and behind them the loads of a tree whose friction is found along the recursion (``recursive.c``). */
static inline int tr_nz(const tr_sim *s) { return s->k->active + s->k->neta + (s->k->begin ? s->k->nn : 0); }
static inline double *tr_loads(const tr_sim *s) { return TR_A(s, z) + s->k->active + s->k->neta; }

/* The method in force. */
static inline const tr_method *tr_method_of(const tr_sim *s) { return tr_methods + s->step.method; }

/* Whether the runtime is to choose the method. */
static inline int tr_chooses(const tr_sim *s) { return tr_methods[s->set.method].kind == TR_CHOSEN; }

/* The explicit method it begins with. */
static inline int tr_first_choice(const tr_sim *s) { return s->set.rtol > TR_AUTO_LOOSE_ABOVE ? TR_AUTO_LOOSE : TR_AUTO_TIGHT; }

/* The parts of x. */
static inline tr_moment *tr_moment_of(const tr_sim *s) { return (tr_moment *)TR_A(s, x); }
static inline tr_signal *tr_signal_of(const tr_sim *s, int table) { return (tr_signal *)(tr_moment_of(s) + 1) + table; }
static inline double *tr_stop_flag(const tr_sim *s, int stop) { return (double *)tr_signal_of(s, s->k->ntables) + stop; }
static inline tr_mode *tr_mode_of(const tr_sim *s, int i) { return (tr_mode *)tr_stop_flag(s, s->k->nstops) + i; }

/* Whether a stop is the hook of a latch: what it does at its end is another event. */
static inline int tr_is_hook(const tr_sim *s, int stop) { return stop >= s->k->nstops - s->k->nlatches; }

/* Whether a stop is pressed, or the hook of a latch is down: of a ratchet its flag says on which tooth, from 1. */
static inline int tr_pressed(const tr_sim *s, int stop) { return (int)*tr_stop_flag(s, stop) >= TR_STOP_PRESSED; }

/* How deep each stop is pressed at y, m or rad (hooks: ``recursion/latches.py``), and how far it is from letting go inside its reach
 * (pushes: not asked for). */
static inline void tr_depths_pushes(const tr_sim *s, const double *y, double *depth, double *pushes) {
  const int n = s->k->nstops;
  double both[2 * n + 1];
  if (n) s->k->events(TR_A(s, x), y, TR_A(s, c) + s->k->c_events, both);
  for (int i = 0; i < n; ++i) depth[i] = both[i];
  for (int i = 0; i < n && pushes; ++i) pushes[i] = both[n + i];
}

/* The first of these alone. */
static inline void tr_depths(const tr_sim *s, const double *y, double *depth) { tr_depths_pushes(s, y, depth, 0); }

/* Which stop says whether the latch with this hook is pressed. */
static inline int tr_pressed_by(const tr_sim *s, int hook) { return s->k->presses[hook - (s->k->nstops - s->k->nlatches)]; }
static inline int tr_flag(const tr_mode *m) { return (int)m->flag; }
/* Not stuck, or (a law with a kink) saturated. */
static inline int tr_slides(const tr_sim *s, int i) { return tr_flag(tr_mode_of(s, i)) != TR_STUCK; }
static inline int tr_is_set(const tr_sim *s, int i) { return tr_pair_of(s, i)->kind == TR_KIND_SET; }
static inline int tr_is_turn(const tr_sim *s, int i) { return tr_pair_of(s, i)->kind == TR_KIND_TURN; }
static inline int tr_is_stuck(const tr_sim *s, int i) { return tr_is_set(s, i) && !tr_slides(s, i); }

/* The modes of all pairs, for safe keeping (n: nsliders). */
static inline void tr_keep_modes(const tr_sim *s, tr_mode *kept) { memcpy(kept, tr_mode_of(s, 0), sizeof(tr_mode) * s->k->nsliders); }
static inline void tr_put_modes(tr_sim *s, const tr_mode *kept) { memcpy(tr_mode_of(s, 0), kept, sizeof(tr_mode) * s->k->nsliders); }

static inline tr_sliding *tr_sliding_of(const tr_sim *s, int i) { return (tr_sliding *)TR_A(s, sliding) + i; }
static inline tr_hold *tr_hold_of(const tr_sim *s, int i) { return (tr_hold *)TR_A(s, hold) + i; }
static inline tr_zone *tr_zone_of(const tr_sim *s, int i) { return (tr_zone *)TR_A(s, zone) + i; }
static inline int *tr_row_kinds(const tr_sim *s) { return (int *)TR_A(s, rowk); }
static inline int *tr_bound(const tr_sim *s) { return (int *)TR_A(s, bound); }
static inline int *tr_ends(const tr_sim *s) { return (int *)TR_A(s, ends); }
static inline tr_leader *tr_leaders(const tr_sim *s) { return (tr_leader *)TR_A(s, lead); }

/* Units of a constraint row (rad or m) and of a rate (rad or m, to be multiplied by the rate scale). */
static inline double tr_row_unit(const tr_sim *s, int row) { return s->k->row_kind[row] == TR_CONSTRAINS_TURNING ? 1.0 : s->set.length; }
static inline double tr_rate_unit(const tr_sim *s, int rate) { return s->k->vkind[rate] == TR_COORDINATE_LENGTH ? s->set.length : 1.0; }

/* A table's record: at the offset that is written first. */
static inline double *tr_table_of(const tr_sim *s, int table) { return TR_A(s, tables) + (int)TR_A(s, tables)[table]; }

/* How far apart two times may be and still be the same: round-off of sums of steps, of the time but at least of 1 s. */
#define TURN 6.283185307179586 /* rad */
#define SAME_TIME 1e-13
static inline double tr_same_time(double t) { return SAME_TIME * fmax(1.0, fabs(t)); }

/* Unit of sliding speed, m/s. */
static inline double tr_speed_unit(const tr_sim *s) { return s->set.length * s->set.rate; }
#endif
