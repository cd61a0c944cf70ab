/* Positions in curves and fields (theory, "Error control"). Each position changes over a step by at most half a piece of its curve,
 * or half the declared width of its field. The error estimate alone misses a force that acts only between two stages. */
#include "events/events.h"

#define PIECE_PART 0.5    /* largest change of a position over a step, in pieces */
#define NEXT_PART 0.9 /* relative to the largest change: change over the next step, if the motion continues as in the last step */
#define POSITION_PARTS 8  /* number of parts of a step; positions are compared at the ends of these parts */

/* Positions at (t, y). */
static void tr_curve_positions(tr_sim *s, double t, const double *y, double *position) {
  const int behind = 2 * s->k->nstops;
  double all[behind + s->k->npositions + 1];
  tr_set_time(s, t);
  s->k->events(TR_A(s, x), y, TR_A(s, c) + s->k->c_events, all);
  tr_copy(s->k->npositions, all + behind, position);
}

/* Largest change of a position in the last step up to its fraction `most`, in pieces. Requires the dense output. */
static double tr_largest_position_change(tr_sim *s, double most) {
  const int n = s->k->npositions;
  double low[n + 1], high[n + 1], now[n + 1], y[tr_state_width(s)], change = 0.0;
  for (int q = 0; q <= POSITION_PARTS; ++q) {
    const double theta = most * q / POSITION_PARTS;
    tr_evaluate_dense(s, theta, y);
    tr_curve_positions(s, s->step.t0 + theta * s->step.size, y, now);
    for (int i = 0; i < n; ++i) {
      low[i] = q ? fmin(low[i], now[i]) : now[i], high[i] = q ? fmax(high[i], now[i]) : now[i];
      change = fmax(change, high[i] - low[i]);
    }
  }
  return change;
}

static double tr_position_error(tr_sim *s, double most) {
  const int failure = s->step.failure;
  s->step.passed = 0.0;
  if (!s->k->npositions || s->set.hfixed > 0.0) return 0.0;
  double kept[tr_solution_size(s)];
  tr_save_solution(s, kept);
  if (tr_ensure_dense(s)) s->step.passed = tr_largest_position_change(s, most) / PIECE_PART;
  s->step.failure = failure;
  tr_set_time(s, s->step.t0 + s->step.size);
  tr_restore_solution(s, kept);
  return s->step.passed > 1.0 ? pow(s->step.passed, tr_method_of(s)->order) : 0.0;
}

static double tr_position_growth(const tr_sim *s) { return s->step.passed > 0.0 ? NEXT_PART / s->step.passed : INFINITY; }
