/* Rows of a step that a case makes several at once, as many as vectors have lanes (``ensemble.c``). It waits for nobody with them. */
#include "modes.h"

#define TR_FOURS 8 /* lanes there may be */

/* Whether the rows inside the step that waits may be made so: by its dense output, by nothing but multipliers and accelerations. */
static int tr_may_ask_rows(const tr_sim *s) {
  const tr_outputs *o = s->o;
  if (!s->lane || !s->lane->columns || !o || !tr_may_ask(s) || s->step.parts || s->clock.row_index == 0) return 0;
  if (tr_method_of(s)->kind == TR_IMPULSES || o->wants & (TR_WANTS_AUDIT | TR_WANTS_CONTRACTION)) return 0;
  return !(o->wants & TR_WANTS_SOLUTION && o->nkappa && s->k->active < s->k->rows); /* reactions that the loops leave open are chosen one by one */
}

/* How many rows there are in front of t_end, at most `room` and as many as there are lanes; their times. */
static int tr_times_ahead(const tr_sim *s, double t_end, long room, double *times) {
  const int width = s->lane->lanes->width;
  for (int i = 0; i < width; ++i) {
    times[i] = s->clock.start + (double)(s->clock.row_index + i) * s->clock.every;
    if (i >= room || times[i] >= t_end - tr_row_slack(t_end)) return i;
  }
  return width;
}

/* Rows from the next one on that are in front of t_end, one too: waiting takes as long. How many have been made. */
static int tr_rows_at_once(tr_sim *s, double t_end, double *rows, long room) {
  double times[TR_FOURS], extra[TR_DOUBLES(tr_extra) + s->k->nsliders + 1];
  if (!tr_may_ask_rows(s)) return 0;
  const int width = s->lane->lanes->width, wide = s->clock.width, count = tr_times_ahead(s, t_end, room, times);
  if (!count || !tr_have_dense(s)) return 0;
  tr_request of[TR_FOURS], *each[TR_FOURS];
  tr_fill_extra(s, TR_A(s, ynew), (tr_extra *)extra);
  of[0] = tr_request_of(s, TR_ASK_ROWS, times[0], TR_A(s, ynew));
  of[0].dense_rows = s->step.dense_rows, of[0].co = TR_A(s, co), of[0].extra = extra;
  of[0].solved = (s->o->wants & TR_WANTS_SOLUTION) != 0, of[0].columns = s->lane->columns;
  for (int i = 0; i < width; ++i) each[i] = of + (i < count ? i : 0);
  for (int i = 0; i < count; ++i) /* of the others it is the first that is looked at but for these */
    of[i].t = times[i], of[i].theta = (times[i] - s->step.t0) / s->step.size, of[i].row = rows + i * wide + 1,
    of[i].projections = of[i].iterations = 0;
  s->lane->lanes->serve(TR_ASK_ROWS, each);
  int made = 0;
  for (; made < count && of[made].ok; ++made) {
    double *row = rows + made * wide;
    row[0] = times[made];
    if (!tr_finite(s->o->nout, row + 1)) break; /* by itself it is told */
    tr_post_columns(s, row + 1);
    s->stats.outputs++, s->stats.projections += of[made].projections;
    s->stats.rhs_evaluations += of[0].solved, s->stats.newton_iterations += of[made].iterations;
  }
  return made;
}
