/* Dips of capacities. Where the load of a contact passes near zero, pairs at rest lose their capacity for a short time. Such a dip
 * has two straight sides: a capacity is a sum of norms of loads, and loads are smooth. (The friction ratio has a sharp peak there,
 * which parabolas miss.) A sum of norms is convex. Between two points, the reserve therefore lies above the extended lines through
 * the points on either side. */
#include "events/events.h"

/* relative to a step: only one of two closer points is used. Stages of low order lie close together; a line through two of them
 * would magnify their errors. */
#define LEAST_APART 0.08
#define FEWEST_STAGES 4 /* smallest number of points from which lines can exclude a dip; with fewer points, the step is searched */
/* relative to the fall of the reserve along a line: error of the line, because the sides of a dip are not exactly straight. The
 * stages of a step are farther apart than the points of a search. */
#define BENT 0.1
#define BENT_BETWEEN_STAGES 0.25
#define DIP_STEPS 12 /* largest number of points evaluated in one dip; each point squares the error of the place */
#define SHORTLY_BESIDE 1e-6 /* relative to the spacing of the points: finite difference that gives the slope of a reserve */
#define INSET 1e-3   /* relative to an interval: least distance of a new point from the ends of the interval */

/* A point beside a dip: its place, the reserve at this place, and the slope towards the next point away from the dip. The slope is
 * NaN if there is no next point. */
typedef struct tr_arm {
  double x, reserve, slope;
} tr_arm;

static inline double tr_slope_between(double x0, double r0, double x1, double r1) { return (r1 - r0) / (x1 - x0); }

/* Whether the reserve may fall to zero between two points, judged by the lines through these points. *at receives the probable
 * place of the minimum. bent: BENT or BENT_BETWEEN_STAGES. */
static int tr_may_reach_zero(const tr_arm *left, const tr_arm *right, double bent, double *at) {
  const double fall = left->slope, rise = right->slope;
  if (fall >= 0.0 || rise <= 0.0 || (fall != fall && rise != rise)) return 0;
  if (fall != fall) *at = left->x;
  else if (rise != rise) *at = right->x;
  else *at = (right->reserve - left->reserve + fall * left->x - rise * right->x) / (fall - rise);
  *at = fmin(fmax(*at, left->x), right->x);
  const double drop_left = fall * (left->x - *at), drop_right = rise * (right->x - *at);
  const double least = fmin(fmin(left->reserve, right->reserve), fmax(left->reserve - drop_left, right->reserve - drop_right));
  return least < bent * fmax(drop_left, drop_right); /* fmax ignores NaN */
}

/* Points of the reserve of pair i in the last step: its start, then the recorded stages in the order of time. Returns their
 * number. */
static int tr_list_reserves(const tr_sim *s, int i, tr_arm *points) {
  int n = 0;
  if (s->step.far_known) points[n++] = (tr_arm){0.0, tr_reserves_at(s, TR_AT_START)[i], NAN};
  for (int q = s->step.recorded - 1; q >= 0; --q) { /* the later of two stages that are close is more accurate */
    const double *from = TR_A(s, reserves) + q * (1 + s->k->nsliders), x = (from[0] - s->step.t0) / s->step.size;
    int at = n;
    while (at > 0 && points[at - 1].x > x) --at;
    if ((at > 0 && x - points[at - 1].x < LEAST_APART) || (at < n && points[at].x - x < LEAST_APART)) continue;
    for (int p = n++; p > at; --p) points[p] = points[p - 1];
    points[at] = (tr_arm){x, from[1 + i], NAN};
  }
  return n;
}

/* Whether the capacity of pair i, at rest, may dip below its friction between the stages of the last step. */
static int tr_may_dip(const tr_sim *s, int i) {
  tr_arm p[TR_RECORDS + 3];
  double at;
  int n = tr_list_reserves(s, i, p);
  if (n < FEWEST_STAGES) return 1;
  for (int q = 0; q + 1 < n; ++q) {
    tr_arm left = p[q], right = p[q + 1];
    if (q > 0) left.slope = tr_slope_between(p[q - 1].x, p[q - 1].reserve, left.x, left.reserve);
    if (q + 2 < n) right.slope = tr_slope_between(right.x, right.reserve, p[q + 2].x, p[q + 2].reserve);
    if (tr_may_reach_zero(&left, &right, BENT_BETWEEN_STAGES, &at)) return 1;
  }
  return 0;
}

/* Mark pairs at rest whose capacity may dip below their friction inside the last step. Returns 1 if there are any. */
static int tr_mark_dips(const tr_sim *s, char *suspect) {
  int any = 0;
  for (int i = 0; i < s->k->nsliders && !s->bound.evaluations; ++i) {
    const int varies = tr_is_stuck(s, i) && TR_A(s, smin)[i] + ROUND_OFF_FRICTION / TOL_RELEASE < TR_A(s, smax)[i];
    if (varies && !suspect[i]) any |= suspect[i] = tr_may_dip(s, i);
  }
  return any;
}

/* Reserve of pair i at the place x. The evaluated point also narrows the bracket. Returns NaN if there is no solution, or if a
 * violation is positive; the search then ends. */
static double tr_reserve_inside(tr_sim *s, const tr_samples *at, int i, double x, tr_bracket *b) {
  int w = i;
  const tr_point found = tr_point_at(s, at, i, x, &w);
  if (!(found.all == found.all)) return NAN;
  tr_narrow_bracket(b, &found, w);
  return found.all > 0.0 ? NAN : tr_reserves_at(s, TR_NOW)[i];
}

/* Next place of a search between two points. x: place where the lines through the points meet. If x is at one of the points, the
 * line through the other point is inaccurate. The next place is then slightly beyond the zero of the line through the near point.
 * (At the zero itself, the search for the first root would end at once, although an earlier root may exist.) */
static double tr_next_dip_place(const tr_arm *left, const tr_arm *right, double x) {
  const double width = right->x - left->x, inset = INSET * width, beyond = 1.0 + BENT;
  if (x - left->x < inset) x = left->x + fmax(inset, fmin(0.5 * width, -beyond * left->reserve / left->slope));
  else if (right->x - x < inset) x = right->x - fmax(inset, fmin(0.5 * width, beyond * right->reserve / right->slope));
  return x;
}

/* Search for a dip of pair i between two points. */
static void tr_find_dip(tr_sim *s, const tr_samples *at, int i, tr_arm left, tr_arm right, tr_bracket *b) {
  const double shortly = SHORTLY_BESIDE * (right.x - left.x);
  double least = fmin(left.reserve, right.reserve), change = 0.0, x;
  for (int it = 0; it < DIP_STEPS; ++it) {
    const int reaches = tr_may_reach_zero(&left, &right, BENT, &x), begins = left.slope != left.slope, ends = right.slope != right.slope;
    if (!(reaches || change > TOP_SURE * least) || right.x - left.x < 4.0 * shortly) return;
    x = begins ? left.x : ends ? right.x - shortly : tr_next_dip_place(&left, &right, x);
    const double reserve = begins ? left.reserve : tr_reserve_inside(s, at, i, x, b);
    const double beside = ends && !begins ? right.reserve : reserve == reserve ? tr_reserve_inside(s, at, i, x + shortly, b) : NAN;
    const double slope = (beside - reserve) / shortly;
    if (slope != slope) return;
    if (begins || (!ends && slope < 0.0)) left = (tr_arm){x + shortly, beside, slope};
    else right = (tr_arm){x, reserve, slope};
    change = least - fmin(reserve, beside), least = fmin(least, fmin(reserve, beside));
  }
}

/* Search for dips of pair i between the points q − 2 and q − 1. If the search ends at q, also search between q − 1 and q. */
static void tr_search_dips(tr_sim *s, const tr_samples *at, int i, int q, tr_bracket *b) {
  const int n = s->k->nsliders, ends = q == tr_sample_count(s) || at->all[q] > 0.0;
  const double *x = at->x, *r = at->reserve + i;
  for (int left = q - 2; left < (ends ? q : q - 1); ++left) {
    tr_arm a = {x[left], r[left * n], NAN}, c = {x[left + 1], r[(left + 1) * n], NAN};
    if (left > 0) a.slope = tr_slope_between(x[left - 1], r[(left - 1) * n], a.x, a.reserve);
    if (left + 2 <= q) c.slope = tr_slope_between(c.x, c.reserve, x[left + 2], r[(left + 2) * n]);
    if (a.reserve == a.reserve && c.reserve == c.reserve && !(b->right.x <= a.x)) tr_find_dip(s, at, i, a, c, b);
  }
}
