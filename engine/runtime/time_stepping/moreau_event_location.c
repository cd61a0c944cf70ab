/* Location of the places where Moreau steps under error control must end. There, an end stop engages or releases, or a stuck pair
 * first exceeds its capacity. Speeds do not show these events; the error control detects all others. */
#include "time_stepping/time_stepping.h"

/* relative to the step: size of the next trial if a pair is released too early. (An early release can happen, because impulses use
 * the rates at the start of the step.) */
#define EARLY 0.25

/* Modes during a step that is made in two halves. */
typedef struct tr_moreau_course {
  tr_mode *start, *middle;
  int steady; /* whether the modes of start, middle and end are equal */
  int smooth; /* whether the whole step has these modes, too */
  double let_go; /* place of releases in the first half of the step: 0 at its start, 1 at its end, ½ unknown */
} tr_moreau_course;

/* Form a linear dense output of the last step. */
static void tr_form_dense_straight(tr_sim *s) {
  TR_MADE(s, TR_HAS_DENSE);
  const double *y = TR_A(s, y), *ynew = TR_A(s, ynew);
  for (int i = 0; i < tr_state_width(s); ++i) TR_A(s, kstep)[i] = ynew[i] - y[i];
  s->step.dense_rows = 1;
}

/* Restore modes and multipliers to those at the start of the step, for another trial. */
static void tr_moreau_rewind(tr_sim *s, const tr_moreau_course *course) {
  tr_restore_modes(s, course->start);
  memcpy(TR_A(s, z), TR_A(s, zold), sizeof(double) * tr_z_length(s));
}

/* Place (0…1) in the last step where an end stop engages or releases, or where a pair that is stuck throughout exceeds its
 * capacity. Returns 1 if there is none. */
static double tr_find_first_end(tr_sim *s, double h, const tr_moreau_course *course) {
  const int n = s->k->nsliders;
  double depth[s->k->nstops + 1], theta = 1.0;
  char suspect[tr_watched_count(s) + 1];
  int held = 0, which = -1, hit = 0;
  for (int i = 0; i < n; ++i) held |= course->steady && tr_is_stuck(s, i) && (tr_is_suspect(s, i) || tr_has_varying_load(s, i));
  tr_set_time(s, s->clock.t + h), tr_stop_depths(s, TR_A(s, ynew), depth);
  for (int i = n; i < tr_watched_count(s); ++i)
    if (tr_mode_violation(s, i, depth) > 1.0) which = i, hit = 1;
  s->step.t0 = s->clock.t, s->step.size = h, s->step.have_dense = 1;
  if (s->k->nstops && s->set.locate) held |= tr_mark_stops_with_events_inside(s, suspect + n);
  if ((!held && !hit) || !s->set.locate) return 1.0;
  memcpy(TR_A(s, zstart), TR_A(s, z), sizeof(double) * tr_z_length(s)), tr_store_end_multipliers(s);
  int found = TR_NO_EVENT, worst = which;
  if (tr_rhs(s, s->clock.t + h, TR_A(s, ynew), TR_A(s, dy))) {
    s->step.margin = NAN, s->step.margin_end = tr_worst_violation(s, TR_A(s, ynew), &worst);
    tr_copy_violations(s, TR_NOW, TR_AT_END);
    tr_mark_suspect_pairs(s, suspect);
    for (int i = 0; i < n; ++i) suspect[i] = suspect[i] && course->steady && tr_is_stuck(s, i) ? suspect[i] : 0;
    if (!hit || worst < n) which = worst;
    found = tr_search_step(s, held ? suspect : 0, &which, &theta);
  }
  memcpy(TR_A(s, z), TR_A(s, zend), sizeof(double) * tr_z_length(s));
  return found == TR_FOUND && (hit || which >= n || tr_is_stuck(s, which)) ? theta : 1.0;
}

/* Whether a pair that is stuck at the start of the last step slips before the end of the step. */
static int tr_has_released(const tr_sim *s, const tr_moreau_course *course) {
  for (int i = 0; i < s->k->nsliders && !course->steady; ++i)
    if (tr_is_set_valued(s, i) && tr_mode_flag(course->start + i) == TR_STUCK && (tr_mode_flag(course->middle + i) != TR_STUCK || !tr_is_stuck(s, i))) return 1;
  return 0;
}

/* Place in the last step where a pair exceeds its capacity, if the pair is stuck at the start of the step. The modes are those of
 * the start. Speeds do not show this place, because they grow from zero after the release. Returns EARLY if there is no such place:
 * the pair was then released too early. Returns 1 if the place is the start or end of the step (course->let_go), or if another
 * event is earlier. */
static double tr_find_first_release(tr_sim *s, double h, tr_moreau_course *course) {
  const int n = tr_state_width(s), nz = tr_z_length(s);
  tr_mode end[s->k->nsliders + 1];
  char suspect[tr_watched_count(s) + 1];
  double made[n], z[nz + 1], theta = 1.0;
  int which = -1, found = TR_NO_EVENT;
  course->let_go = 0.5;
  if (!s->set.locate || h <= s->set.rtol / s->set.rate || !tr_has_released(s, course)) return 1.0;
  tr_save_modes(s, end), memcpy(made, TR_A(s, ynew), sizeof made), memcpy(z, TR_A(s, z), sizeof(double) * nz);
  tr_moreau_rewind(s, course);
  s->moreau.keeps = 1;
  if (tr_moreau_substep(s, s->clock.t, TR_A(s, y), h, TR_A(s, ynew)) == TR_OK) {
    tr_form_dense_straight(s);
    s->step.t0 = s->clock.t, s->step.size = h, s->step.have_dense = 1, s->step.margin = NAN;
    memcpy(TR_A(s, zstart), TR_A(s, zold), sizeof(double) * nz), tr_store_end_multipliers(s);
    if (tr_rhs(s, s->clock.t + h, TR_A(s, ynew), TR_A(s, dy))) {
      s->step.margin_end = tr_worst_violation(s, TR_A(s, ynew), &which);
      tr_copy_violations(s, TR_NOW, TR_AT_END);
      memset(suspect, 1, sizeof suspect);
      found = tr_search_step(s, suspect, &which, &theta);
    }
    if (found != TR_FOUND) theta = found == TR_NO_EVENT ? EARLY : 1.0;
    else if (which >= s->k->nsliders || !tr_is_stuck(s, which)) theta = 1.0, found = TR_NO_EVENT;
  }
  s->moreau.keeps = 0;
  tr_restore_modes(s, end), memcpy(TR_A(s, ynew), made, sizeof made), memcpy(TR_A(s, z), z, sizeof(double) * nz);
  tr_form_dense_straight(s);
  if (found == TR_FOUND && (theta <= STEP_START || theta > STEP_END)) course->let_go = theta > STEP_END;
  return theta <= STEP_START ? 1.0 : theta;
}

/* Whether pair i is stuck throughout the last step. */
static int tr_stays_stuck(const tr_sim *s, int i, const tr_moreau_course *course) {
  return tr_is_stuck(s, i) && tr_mode_flag(course->start + i) == TR_STUCK && tr_mode_flag(course->middle + i) == TR_STUCK;
}

/* Place in one half of the last step where a pair marked in `stays` exceeds its capacity, as a fraction of this half. ynew: end of
 * the step. Returns 1 if there is none. */
static double tr_find_release_in_half(tr_sim *s, double h, int half, const char *stays, const double *ynew) {
  const int n = tr_state_width(s);
  double end[n], theta = 1.0, *from = TR_A(s, yold), *rows = TR_A(s, kstep);
  char suspect[tr_watched_count(s) + 1];
  int which = -1, found = TR_NO_EVENT;
  memset(suspect, 0, sizeof suspect), memcpy(suspect, stays, s->k->nsliders);
  for (int i = 0; i < n; ++i) {
    rows[i] = 0.5 * (ynew[i] - TR_A(s, y)[i]);
    from[i] = TR_A(s, y)[i] + half * rows[i], end[i] = from[i] + rows[i];
  }
  s->step.dense_rows = 1, s->step.have_dense = 1, s->step.margin = NAN;
  s->step.t0 = s->clock.t + 0.5 * half * h, s->step.size = 0.5 * h;
  tr_evaluate_maps_at(s, s->step.t0 + s->step.size, end);
  tr_set_row_kinds(s);
  s->step.only = stays;
  if (tr_rhs(s, s->step.t0 + s->step.size, end, TR_A(s, dy))) {
    s->step.margin_end = tr_worst_violation(s, end, &which);
    tr_copy_violations(s, TR_NOW, TR_AT_END);
    memcpy(TR_A(s, zstart), TR_A(s, z), sizeof(double) * tr_z_length(s)), tr_store_end_multipliers(s);
    found = tr_search_step(s, suspect, &which, &theta);
  }
  s->step.only = 0;
  return found == TR_FOUND ? theta : 1.0;
}

/* Place in the last step where a pair that is stuck throughout exceeds its capacity, although another pair changes its mode. Each
 * half of the step is searched in its own modes. Returns 1 if there is none. */
static double tr_find_release_beside_change(tr_sim *s, double h, const tr_moreau_course *course) {
  const int pairs = s->k->nsliders, n = tr_state_width(s), nz = tr_z_length(s);
  char stays[pairs + 1];
  int any = 0;
  for (int i = 0; i < pairs; ++i) any |= stays[i] = tr_stays_stuck(s, i, course) && (tr_is_suspect(s, i) || tr_has_varying_load(s, i));
  if (course->steady || !any || !s->set.locate || h <= s->set.rtol / s->set.rate) return 1.0;
  tr_mode end[pairs + 1];
  double made[n], z[nz + 1], place = 1.0;
  tr_save_modes(s, end), memcpy(made, TR_A(s, ynew), sizeof made), memcpy(z, TR_A(s, z), sizeof(double) * nz);
  for (int half = 0; half < 2 && place == 1.0; ++half) {
    tr_restore_modes(s, half ? end : course->middle);
    const double theta = tr_find_release_in_half(s, h, half, stays, made);
    if (theta < 1.0) place = 0.5 * (half + theta);
  }
  tr_restore_modes(s, end), memcpy(TR_A(s, ynew), made, sizeof made), memcpy(TR_A(s, z), z, sizeof(double) * nz);
  memcpy(TR_A(s, yold), TR_A(s, y), sizeof made);
  tr_form_dense_straight(s);
  s->step.t0 = s->clock.t, s->step.size = h, s->step.have_dense = 1;
  return place;
}
