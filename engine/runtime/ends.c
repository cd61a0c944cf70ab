/* Where a step of Moreau's time stepping under error control should have ended: where a stop is reached or left, and where something that is
 * held is first asked for more than it can hold. No speed shows these two; all else the control of errors finds by itself. */
#include "modes.h"

#define AT_END 0.999999    /* of a step: a release behind it is one at its end */
#define EARLY 0.25         /* of a step that lets go what still holds: forces are those of the rates at its start, the earlier the longer it is */
#define AT_START 1e-3      /* of a step: a release before it is the one the step begins with; it is made shorter until the pair slips in it */

/* What time stepping found in a step made in two halves: the modes of all pairs at its start and its middle (those at its end are in
 * force). */
typedef struct tr_course {
  tr_mode *start, *middle;
  int steady; /* they are the same throughout, */
  int smooth; /* and where the step is made at once too */
  double let_go; /* where in it what slips in its first half was let go: at its begin (0), its end (1), or nobody knows (½) */
} tr_course;

/* Straight lines as the dense output of the step just made. */
static void tr_straight(tr_sim *s) {
  const double *y = TR_A(s, y), *ynew = TR_A(s, ynew);
  for (int i = 0; i < tr_width(s); ++i) TR_A(s, kstep)[i] = ynew[i] - y[i];
  s->step.dense_rows = 1;
}

/* Back to the start of the step, for another trial. */
static void tr_moreau_back(tr_sim *s, const tr_course *course) {
  tr_put_modes(s, course->start);
  memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * tr_nz(s));
}

/* Where in the step just made a stop is reached or left, or something that is held through it is first asked for more than it can hold; 1:
 * nowhere. */
static double tr_first_end(tr_sim *s, double h, const tr_course *course) {
  const int n = s->k->nsliders;
  double depth[s->k->nstops + 1], theta = 1.0;
  int held = 0, which = -1, hit = 0;
  for (int i = 0; i < n && course->steady; ++i) held |= tr_is_stuck(s, i) && tr_suspect(s, i);
  tr_depths(s, TR_A(s, ynew), depth);
  for (int i = n; i < tr_watched(s); ++i)
    if (tr_violation(s, i, depth) > 1.0) which = i, hit = 1;
  if ((!held && !hit) || !s->set.locate) return 1.0;
  s->step.t0 = s->clock.t, s->step.size = h, s->step.have_dense = 1;
  memcpy(TR_A(s, zstart), TR_A(s, z), sizeof(double) * tr_nz(s)), tr_note_end(s);
  int found = TR_NO_EVENT, worst = which;
  if (tr_rhs(s, s->clock.t + h, TR_A(s, ynew), TR_A(s, dy))) {
    s->step.margin = NAN, s->step.margin_end = tr_beyond(s, TR_A(s, ynew), &worst);
    if (!hit || worst < n) which = worst;
    found = tr_look_inside(s, held, &which, &theta);
  }
  memcpy(TR_A(s, z), TR_A(s, zend), sizeof(double) * tr_nz(s));
  return found == TR_FOUND && (hit || which >= n || tr_is_stuck(s, which)) ? theta : 1.0;
}

/* Whether a pair that is held where the step just made begins slips before it ends. */
static int tr_lets_go(const tr_sim *s, const tr_course *course) {
  for (int i = 0; i < s->k->nsliders && !course->steady; ++i)
    if (tr_is_set(s, i) && tr_flag(course->start + i) == TR_STUCK && (tr_flag(course->middle + i) != TR_STUCK || !tr_is_stuck(s, i))) return 1;
  return 0;
}

/* Where in the step just made, were its modes those of its start, something that is held there is first asked for more than it can hold; EARLY:
 * nowhere, its impulses let it go too soon; 1: where the step begins or ends (let_go), or something else ends there. Speeds, which grow from nothing,
 * do not tell when. */
static double tr_first_release(tr_sim *s, double h, tr_course *course) {
  const int n = tr_width(s), nz = tr_nz(s);
  tr_mode end[s->k->nsliders + 1];
  double made[n], z[nz + 1], theta = 1.0;
  int which = -1, found = TR_NO_EVENT;
  course->let_go = 0.5;
  if (!s->set.locate || h <= s->set.rtol / s->set.rate || !tr_lets_go(s, course)) return 1.0;
  tr_keep_modes(s, end), memcpy(made, TR_A(s, ynew), sizeof made), memcpy(z, TR_A(s, z), sizeof(double) * nz);
  tr_moreau_back(s, course);
  s->moreau.keeps = 1;
  if (tr_moreau_part(s, s->clock.t, TR_A(s, y), h, TR_A(s, ynew)) == TR_OK) {
    tr_straight(s);
    s->step.t0 = s->clock.t, s->step.size = h, s->step.have_dense = 1, s->step.margin = NAN;
    memcpy(TR_A(s, zstart), TR_A(s, zold), sizeof(double) * nz), tr_note_end(s);
    if (tr_rhs(s, s->clock.t + h, TR_A(s, ynew), TR_A(s, dy))) {
      s->step.margin_end = tr_beyond(s, TR_A(s, ynew), &which);
      found = tr_look_inside(s, 1, &which, &theta);
    }
    if (found != TR_FOUND) theta = found == TR_NO_EVENT ? EARLY : 1.0;
    else if (which >= s->k->nsliders || !tr_is_stuck(s, which)) theta = 1.0, found = TR_NO_EVENT;
  }
  s->moreau.keeps = 0;
  tr_put_modes(s, end), memcpy(TR_A(s, ynew), made, sizeof made), memcpy(TR_A(s, z), z, sizeof(double) * nz);
  tr_straight(s);
  if (found == TR_FOUND && (theta <= AT_START || theta > AT_END)) course->let_go = theta > AT_END;
  return theta <= AT_START ? 1.0 : theta;
}
