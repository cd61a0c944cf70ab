/* Record of a run, step by step. Tangents are integrated along this record (``hosts/tangent_integration.c``). */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

size_t tr_impact_length(const tr_sim *s) {
  const tr_kernel *k = s->k;
  return 1 + s->ny + s->nworks + TR_IMPACT_PARTS * ((size_t)k->nx + k->active + k->neta + 2 * k->nunilateral);
}

int tr_record_steps(tr_sim *s, double target, int most, double *rows, long capacity, long *written, double *t, double *y, double *begin, double *x,
                    double *stages, int *solved, double *impacts, int *made) {
  const int width = s->ny + s->nworks, nz = s->k->active + s->k->neta;
  *made = 0;
  for (int i = 0; i < most; ++i) {
    const double before = s->clock.t;
    const long whole = s->stats.of_method[s->step.method];
    long count;
    s->step.stage_z = stages + (size_t)*made * TR_STAGES * nz;
    s->step.begin_x = begin + (size_t)*made * s->k->nx;
    if (s->k->nunilateral) s->step.impacts = impacts + *made * tr_impact_length(s), s->step.impacts[0] = 0.0;
    const int code = tr_advance(s, target, 1, rows + *written * s->clock.width, capacity - *written, &count);
    *written += count, s->events.count = 0;
    /* whether a second impact follows at the same instant */
    const int twice = s->step.impacts && s->step.impacts[0] > 0.0 && !(s->clock.t > before);
    if (s->clock.t > before) {
      t[*made] = s->clock.t;
      memcpy(y + (size_t)*made * width, TR_A(s, y), sizeof(double) * width);
      memcpy(x + (size_t)*made * s->k->nx, TR_A(s, x), sizeof(double) * s->k->nx);
      memcpy(s->step.stage_z + (size_t)tr_method_of(s)->end * nz, TR_A(s, zend), sizeof(double) * nz);
      solved[*made] = s->stats.of_method[s->step.method] > whole;
      ++*made;
    }
    s->step.stage_z = s->step.begin_x = s->step.impacts = 0;
    if (twice) return TR_FAIL_STALLED;
    if (code != TR_MORE && code != TR_EVENTS_FULL && code != TR_OK) return code;
  }
  return TR_MORE;
}
