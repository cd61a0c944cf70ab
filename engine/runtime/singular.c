/* Singular positions of loops on which joints rub. Beside one friction has poles and changes its root; a step that goes over it sees nothing
 * of that, neither at its stages nor in its error. So they are approached and left in steps of their distance. Where a row is given up, and
 * taken up again behind (``loops.c``), forces jump: a step over that is of order one, whatever its method. */
#include "modes.h"

#define INDEPENDENCE_LEAST 3.2e-5 /* √KEEP_PIVOT: nearer rows are given up */
#define APPROACH 4.0              /* factor by which independence is to change in a step, as it changed in the last one */
#define LEAP 8.0                  /* factor at a stage or at the end, with what is not foreseen: steps that exceed it are made shorter, */
#define SHORTER 2.0               /* by this factor, */
#define SHORTEST 1e-9             /* of 1/rate: but not below, as another order of the pivots may change the last one too */

/* How far the loops are from being singular: the root of the last pivot of the factor in place, 0 where a row is given up. */
static double tr_independence(const tr_sim *s) {
  const int r = s->loops.rank;
  if (s->loops.apart > 0.0) return s->loops.apart;
  return r && s->loops.rank_now >= r ? TR_A(s, S)[(r - 1) * (s->k->active + 1)] : 0.0;
}

/* The same of the state at hand, with those at which the stages of a step were evaluated. */
static void tr_watch_loops(tr_sim *s) { s->loops.least = fmin(s->loops.least, tr_independence(s)); }

/* Whether friction feels them. */
static inline int tr_rubs_on_loops(const tr_sim *s) { return s->k->active && s->k->neta && s->set.hfixed <= 0.0; }

/* Longest step from the state in `y`. */
static double tr_singular_step(tr_sim *s) {
  tr_loops *l = &s->loops;
  if (!tr_rubs_on_loops(s)) return INFINITY;
  if (!l->known) {
    tr_maps_at(s, s->clock.t, TR_A(s, y));
    if (!tr_narrow_ideal(s)) tr_factor(s);
    l->known = 1, l->begin = tr_independence(s), l->trend = 0.0;
  }
  if (l->begin <= INDEPENDENCE_LEAST || l->trend == 0.0) return INFINITY;
  return l->begin / fabs(l->trend) * (l->trend < 0.0 ? 1.0 - 1.0 / APPROACH : APPROACH - 1.0);
}

/* Error of the step just made, its end evaluated, 1 at the tolerance: where it leaps over a singular position, or forces jump in it. */
static double tr_singular_error(tr_sim *s, const tr_method *m, double h) {
  tr_loops *l = &s->loops;
  if (!tr_rubs_on_loops(s)) return 0.0;
  l->end = tr_independence(s), l->least = fmin(l->least, l->begin);
  if (h <= SHORTEST / s->set.rate) return 0.0;
  const double begin = fmax(l->begin, INDEPENDENCE_LEAST), least = fmax(l->least, INDEPENDENCE_LEAST);
  if (least * LEAP < begin || l->end > begin * LEAP) return pow(SHORTER, m->order);
  if (l->least > 0.0 || (l->begin == 0.0 && l->end == 0.0)) return 0.0;
  const int n = tr_width(s);
  const double *K = TR_A(s, K), *end = K + m->end * n;
  double *jump = TR_A(s, ytmp);
  for (int i = 0; i < n; ++i) jump[i] = h * (end[i] - K[i]);
  return pow(tr_size2(s, jump, TR_A(s, y), TR_A(s, ynew)), 0.5 * m->order);
}

/* After a whole step: how independence changed in it; the next one begins where it ended. */
static void tr_follow_loops(tr_sim *s) {
  tr_loops *l = &s->loops;
  l->trend = (l->end - l->begin) / s->step.size;
  l->known = 1, l->begin = l->end;
}
