/* Tangents along recorded steps: the variational equation, integrated with the explicit method of the run.
 *
 * A state with its tangents is one vector [y | derivatives by parameter 1 | by parameter 2 | …]. A step with inaccurate tangents is
 * divided into parts. Samples inside a step come from its dense output. The host handles events. */
#include "stepping/stepping.h"
#include "hosts/hosts.h"

#define TANGENT_ERROR 100.0       /* relative to the tolerance: largest error of tangents in a step, divided by their size */
/* relative to the unit of a state: if the state changes by less when the parameter changes by its whole magnitude, this change is
 * round-off */
#define NO_INFLUENCE 1e-9
#define EASY 1e-3 /* relative to TANGENT_ERROR: after a smaller error, the part of a step that is made at once is doubled */
#define LEAST_STEP_PART 0x1p-10   /* relative to a step: smallest part of a step that is made at once; all parts are powers of 2 */

/* Give each sliding pair of several components that is momentarily at rest the speed `slow` along its frozen direction. The
 * direction of the pair's friction is then the limit before rest, and the velocity perpendicular to this direction has zero
 * tangents. */
static void tr_keep_slip_direction(const tr_march *c, double *y, double *S) {
  const tr_tangents *g = c->g;
  for (int p = 0; p < g->turning; ++p) {
    const int *at = g->turn + 5 * p, n = at[1], *place = at + 2;
    const tr_mode *mode = (const tr_mode *)(c->x + at[0]);
    double size = 0.0, speed = 0.0;
    for (int i = 0; i < n; ++i) size += mode->direction[i] * mode->direction[i], speed += y[place[i]] * y[place[i]];
    size = sqrt(size);
    if (tr_mode_flag(mode) == TR_STUCK || !(size > 0.0) || !(sqrt(speed) < g->slow)) continue;
    for (int i = 0; i < n; ++i) y[place[i]] = g->slow * mode->direction[i] / size;
    for (int k = 0; k < g->m; ++k) {
      double *dy = S + (size_t)k * g->n, sum = 0.0;
      for (int i = 0; i < n; ++i) sum += mode->direction[i] / size * dy[place[i]];
      for (int i = 0; i < n; ++i) dy[place[i]] = mode->direction[i] / size * sum;
    }
  }
}

/* Set row i of K to the slopes, at time t, of the state with its tangents in c->now. stages: multipliers of the run at each row of
 * K; null pointer: unknown. Returns 0 on failure. */
static int tr_tangent_slopes(tr_march *c, int i, double t, const double *stages) {
  const tr_tangents *g = c->g;
  double *slopes = c->K + (size_t)i * c->width;
  memcpy(c->before, g->z, sizeof(double) * g->nz);
  if (stages) memcpy(g->z, stages + (size_t)i * g->nz, sizeof(double) * g->nz);
  else if (i && i < c->method->stages) tr_extrapolate_start(c->g->nz, c->g->z, c->method, i, c->old);
  tr_keep_slip_direction(c, c->now, c->now + g->n);
  if (!tr_tangents_at(c, t, c->now, c->now + g->n, stages != 0)) return 0;
  memcpy(c->old + (size_t)i * g->nz, g->z, sizeof(double) * g->nz);
  memcpy(slopes, c->f, sizeof(double) * g->n);
  for (int k = 0; k < g->m; ++k) memcpy(slopes + (size_t)(k + 1) * g->n, tr_derivatives_by(c, g->nz + k), sizeof(double) * g->n);
  return 1;
}

/* Step of length h from the state c->start at time t to c->end. */
static int tr_make_tangent_step(tr_march *c, double t, double h, const double *stages) {
  const tr_explicit *m = c->method;
  const int vectors = (int)(c->width / TR_LANES);
  memcpy(c->now, c->start, sizeof(double) * c->width);
  for (int i = 0; i < m->stages; ++i) {
    if (i) m->argument(i, vectors, h, (tr_vec *)c->start, (tr_vec *)c->K, (tr_vec *)c->now);
    if (!tr_tangent_slopes(c, i, t + m->c[i] * h, stages)) return 0;
  }
  m->solution(vectors, h, (tr_vec *)c->start, (tr_vec *)c->K, (tr_vec *)c->end);
  return 1;
}

/* Estimated error of the tangents in the step to c->end, relative to their size. Coordinates, rates with friction states, and
 * integrals count separately: integrals in the unit of energy, all others in the units of the run's tolerance. */
static double tr_tangent_error(const tr_march *c, double h) {
  const tr_tangents *g = c->g;
  const int vectors = (int)(c->width / TR_LANES), ends[] = {0, g->nq, g->ny, g->n};
  const double *unit = TR_A(c->s, scale);
  double worst = 0.0;
  c->method->error[0](vectors, h, (tr_vec *)c->K, (tr_vec *)c->now);
  c->method->error[1](vectors, h, (tr_vec *)c->K, (tr_vec *)c->sample);
  for (int part = 0; part < 3 * g->m; ++part) {
    const int k = part / 3;
    const double least = NO_INFLUENCE / g->magnitude[k];
    double first = 0.0, second = 0.0, size = least * least;
    for (int i = ends[part % 3]; i < ends[part % 3 + 1]; ++i) {
      const int at = (k + 1) * g->n + i;
      const double w = 1.0 / (i < g->ny ? unit[i] : c->s->set.energy), e = w * c->now[at], f = w * c->sample[at];
      first += e * e, second += f * f, size += w * w * fmax(c->start[at] * c->start[at], c->end[at] * c->end[at]);
    }
    worst = tr_max_or_nan(worst, tr_combine_estimators(first, second) / size);
  }
  return sqrt(worst);
}

/* -- samples ------------------------------------------------------------------------------------------------------------------- */

/* Like tr_tangents_at, at the state c->now. */
static int tr_tangents_of_state(tr_march *c, double t, int solved) {
  memcpy(c->before, c->g->z, sizeof(double) * c->g->nz);
  tr_keep_slip_direction(c, c->now, c->now + c->g->n);
  return tr_tangents_at(c, t, c->now, c->now + c->g->n, solved);
}

/* Append the columns and their derivatives at the state c->sample and time t. */
static int tr_append_sample(tr_march *c, double t) {
  const tr_tangents *g = c->g;
  const int wide = tr_column_width(g), nz = g->nz;
  const double *y = c->sample, *S = y + g->n;
  memcpy(c->now, c->sample, sizeof(double) * c->width);
  if (!tr_tangents_of_state(c, t, 0)) return 0;
  memset(c->all, 0, sizeof(double) * g->nall);
  memset(c->column_seeds, 0, sizeof(double) * wide * g->m);
  for (int j = 0; j < nz; ++j) c->all[g->place[j]] = g->z[j];
  for (int k = 0; k < g->m; ++k) {
    double *seed = c->column_seeds + (size_t)k * wide;
    const double *df = tr_derivatives_by(c, nz + k);
    memcpy(seed, S + (size_t)k * g->n, sizeof(double) * g->n);
    for (int j = 0; j < nz; ++j) seed[g->n + g->place[j]] = df[g->residual + j];
    memcpy(seed + g->n + g->nall, df + g->nq, sizeof(double) * g->nv);
    memcpy(seed + g->n + g->nall + g->nv, g->dp + (size_t)k * g->np, sizeof(double) * g->np);
  }
  g->column_point(c->x, y, g->co, c->all, c->f + g->nq, g->extra, g->wo, c->values);
  g->column_along(c->x, y, g->co, c->all, c->f + g->nq, g->extra, g->wo, g->m, c->column_seeds, wide, c->derivatives, g->columns);
  c->values += g->columns, c->derivatives += (size_t)g->m * g->columns;
  return 1;
}

/* Interpolate the multipliers at θ of a step from those at its ends and at the extra stages. These multipliers are as accurate as
 * the step. */
static void tr_interpolate_stages(const tr_march *c, double theta) {
  const tr_explicit *m = c->method;
  const int nz = c->g->nz, first = m->stages - 1, count = 2 + m->extra; /* node 0 is the start of the step, whose row of K is 0 */
  memset(c->g->z, 0, sizeof(double) * nz);
  for (int a = 0; a < count; ++a) {
    const double at = a ? m->c[first + a] : 0.0, *z = c->old + (a ? (size_t)(first + a) * nz : 0);
    double weight = 1.0;
    for (int b = 0; b < count; ++b)
      if (b != a) weight *= (theta - (b ? m->c[first + b] : 0.0)) / (at - (b ? m->c[first + b] : 0.0));
    for (int j = 0; j < nz; ++j) c->g->z[j] += weight * z[j];
  }
}

/* Append the samples inside the step of length h from c->start at time t to c->end. */
static int tr_append_samples(tr_march *c, double t, double h, const double *stages) {
  const tr_explicit *m = c->method;
  const int vectors = (int)(c->width / TR_LANES), nz = c->g->nz;
  if (!c->inside || !(*c->times < t + h)) return 1;
  memcpy(c->now, c->end, sizeof(double) * c->width);
  for (int i = m->stages; i <= m->stages + m->extra; ++i) {
    if (i > m->stages) m->argument(i, vectors, h, (tr_vec *)c->start, (tr_vec *)c->K, (tr_vec *)c->now);
    if (!tr_tangent_slopes(c, i, t + m->c[i] * h, stages)) return 0;
  }
  const int rows = tr_form_dense_rows(m, vectors, h, (tr_vec *)c->K, (tr_vec *)c->start, (tr_vec *)c->end, (tr_vec *)c->dense);
  for (; c->inside && *c->times < t + h; --c->inside, ++c->times) {
    const double theta = (*c->times - t) / h;
    tr_evaluate_dense_rows((int)c->width, rows, c->dense, c->start, theta, c->sample);
    tr_interpolate_stages(c, theta);
    if (!tr_project(c->s, *c->times, c->sample) || !tr_append_sample(c, *c->times)) return 0;
  }
  memcpy(c->g->z, c->old + (size_t)m->stages * nz, sizeof(double) * nz);
  return 1;
}

/* Integrate the tangents over a recorded step of length h from time t and state y, with the samples inside. */
static int tr_march_step(tr_march *c, double t, double h, const double *y, const double *stages) {
  const tr_tangents *g = c->g;
  memcpy(c->start, y, sizeof(double) * g->n);
  memcpy(c->start + g->n, g->S, sizeof(double) * g->n * g->m);
  for (double done = 0.0; done < 1.0;) {
    const double from = t + done * h;
    const double *known = c->part == 1.0 ? stages : 0;
    if (!tr_make_tangent_step(c, from, c->part * h, known)) return 0;
    const double error = tr_tangent_error(c, c->part * h) / (TANGENT_ERROR * c->s->set.rtol);
    if (!(error <= 1.0) && c->part > LEAST_STEP_PART) {
      c->part = fmax(c->part * exp2(-ceil(log2(error) / tr_method_of(c->s)->order)), LEAST_STEP_PART);
      continue;
    }
    if (!(error < INFINITY)) return 0;
    if (!tr_append_samples(c, from, c->part * h, known)) return 0;
    memcpy(c->start, c->end, sizeof(double) * c->width);
    for (int i = 0; i < g->nrates; ++i) g->speeds[i] = fmax(g->speeds[i], fabs(c->f[g->rates + i]));
    done += c->part;
    if (error < EASY && c->part < 1.0 && fmod(done, 2.0 * c->part) == 0.0) c->part *= 2.0;
  }
  memcpy(g->S, c->end + g->n, sizeof(double) * g->n * g->m);
  return 1;
}

static void tr_begin_march(tr_march *c) {
  const tr_tangents *g = c->g;
  const int wide = tr_seed_width(g), rows = g->nz + g->m;
  tr_divide_work(c, g->work);
  c->method = tr_method_of(c->s)->explicit;
  memset(c->K, 0, sizeof(double) * c->width * TR_STAGES), memset(c->start, 0, sizeof(double) * c->width);
  memset(c->seeds, 0, sizeof(double) * wide * rows);
  for (int j = 0; j < g->nz; ++j) c->seeds[(size_t)j * wide + g->ny + j] = 1.0;
  for (int k = 0; k < g->m; ++k) memcpy(c->seeds + (size_t)(g->nz + k) * wide + g->ny + g->nz, g->dp + (size_t)k * g->np, sizeof(double) * g->np);
}

/* Set the external values of an evaluation. */
static void tr_set_external(const tr_march *c, const double *x, double inside) {
  memcpy(c->x, x, sizeof(double) * c->g->nx);
  ((tr_moment *)c->x)->inside = inside;
}

/* Like tr_evaluate_tangents. Returns 2 if the host found the solution. */
static int tr_evaluate_state(tr_march *c, double t, const double *y, const double *x, int solved) {
  const tr_tangents *g = c->g;
  memcpy(c->x, x, sizeof(double) * g->nx);
  memcpy(c->now, y, sizeof(double) * g->n);
  memcpy(c->now + g->n, g->S, sizeof(double) * g->n * g->m);
  return tr_tangents_of_state(c, t, solved) ? 2 - (c->solved || !g->nz) : 0;
}

int tr_evaluate_tangents(tr_sim *s, const tr_tangents *g, double t, const double *y, const double *x, double *f, double *df) {
  tr_march c = {.s = s, .g = g};
  tr_begin_march(&c);
  const int found = tr_evaluate_state(&c, t, y, x, 0);
  memcpy(f, c.f, sizeof(double) * g->nf);
  memcpy(df, tr_derivatives_by(&c, g->nz), sizeof(double) * g->nf * g->m);
  return found;
}

int tr_cross_event(tr_sim *s, const tr_tangents *g, double t, const double *y, const double *x, const double *x1, const double *z1, double *f,
                   double *df, double *flow, double *after) {
  tr_march c = {.s = s, .g = g};
  const int nz = g->nz, wide = tr_seed_width(g);
  tr_begin_march(&c);
  memcpy(c.old, g->z, sizeof(double) * nz);
  if (z1) memcpy(g->z, z1, sizeof(double) * nz);
  if (!tr_evaluate_state(&c, t, y, x1, z1 != 0)) return 0;
  memcpy(after, c.f, sizeof(double) * g->n);
  memcpy(c.old + nz, g->z, sizeof(double) * nz), memcpy(g->z, c.old, sizeof(double) * nz);
  c.solved = 0;
  const int found = tr_evaluate_state(&c, t, y, x, 0);
  memcpy(g->z, c.old + nz, sizeof(double) * nz);
  memcpy(f, c.f, sizeof(double) * g->nf);
  memcpy(df, tr_derivatives_by(&c, nz), sizeof(double) * g->nf * g->m);
  if (found != 1) return found;
  double *seed = c.seeds + (size_t)nz * wide;
  memset(seed, 0, sizeof(double) * wide);
  memcpy(seed, f, sizeof(double) * g->ny);
  seed[wide - 1] = 1.0;
  g->along(c.x, c.now, g->c, c.old, 0, 0, g->w, 1, seed, 0, tr_derivatives_by(&c, nz), 0);
  if (nz) tr_eliminate_multipliers(&c, nz);
  memcpy(flow, tr_derivatives_by(&c, nz), sizeof(double) * g->nf);
  return 1;
}

/* Like tr_march_tangents, from the state of `c`. `x` and the friction of the block change. */
static int tr_march_steps(tr_march *c, int count, const double *t, const double *y, size_t next, const double *x, const double *after,
                          const double *stages, const int *marks) {
  const tr_tangents *g = c->g;
  for (int k = 0; k < count; ++k, marks += 4) {
    const int stops = marks[0], sampled = marks[2], solved = marks[3];
    tr_set_external(c, x + (size_t)k * g->nx, 0.5 * (t[k] + t[k + 1]));
    memcpy(TR_A(c->s, x), c->x, sizeof(double) * g->nx); /* samples are projected with the contacts of this step */
    c->inside = marks[1];
    if (!tr_march_step(c, t[k], t[k + 1] - t[k], y + k * next, solved ? stages + (size_t)k * TR_STAGES * g->nz : 0)) return -1;
    if (stops) return k + 1;
    if (!sampled) continue;
    tr_set_external(c, after + (size_t)(k + 1) * g->nx, t[k + 1] + JUST_AFTER);
    memcpy(c->sample, y + (k + 1) * next, sizeof(double) * g->n);
    memcpy(c->sample + g->n, g->S, sizeof(double) * g->n * g->m);
    if (!tr_append_sample(c, t[k + 1])) return -1;
    ++c->times;
  }
  return count;
}

int tr_march_tangents(tr_sim *s, const tr_tangents *g, int count, const double *t, const double *y, size_t next, const double *x, const double *after,
                      const double *stages, const int *marks, const double *times, double *values, double *derivatives) {
  tr_march c = {.s = s, .g = g, .times = times, .values = values, .derivatives = derivatives, .part = 1.0};
  const int held = s->friction.held;
  double last[g->nx];
  memcpy(last, TR_A(s, x), sizeof last);
  tr_begin_march(&c);
  s->friction.held = 0; /* the pairs that rest at the end of the run may slide here */
  const int made = tr_march_steps(&c, count, t, y, next, x, after, stages, marks);
  s->friction.held = held;
  memcpy(TR_A(s, x), last, sizeof last);
  return made;
}
