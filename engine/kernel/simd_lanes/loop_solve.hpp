/* Closed loops in lanes: factor of S, multipliers (``runtime/constraints/loop_solve.c``), projection
 * (``runtime/evaluate/projection.c``). All constraint rows must be independent. A lane with a small pivot is not `good`. Converged
 * lanes keep their results. */

/* Data of all lanes. */
struct Lanes {
  V x[NX + 8], c[NC + 8], d[ACTIVE + 8], w[NW + 8], maps[NMAPS + 8], power[NPOWERS + 8], z[ACTIVE + NETA + 8];
  V factor[ACTIVE * ACTIVE + 1];
  tr_bits order[ACTIVE + 1], good;
  V length, rate, gap, per_length, per_rate, per_speed;
  V T[ACTIVE * NETA + 8], N0[NN + 8], Ne[NN * NETA + 8], N[NN + 8], sliding[3 * NSLIDERS + 8], per_lever[NETA + 8]; /* friction */
  V least[NSLIDERS + 8], largest[NSLIDERS + 8], independence; /* extremes over the stages of a step */
  tr_bits watches, iterations;                                /* lanes that record extremes; number of Newton iterations so far */
  int projections[WIDTH], nworks;
};

/* Compute the reciprocals of the residuals' units. */
INLINE void prepare_units(Lanes &s) {
  s.per_length = V(1.0) / s.length, s.per_rate = V(1.0) / s.rate, s.per_speed = s.per_length * s.per_rate;
}

/* Scale the quaternions of y to norm 1. */
INLINE void normalise(V *y) {
  for (int i = 0; i < QUATERNIONS; ++i) {
    V *e = y + k_quat[i];
    const V n = V(1.0) / sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
    for (int j = 0; j < 4; ++j) e[j] = e[j] * n;
  }
}

/* The larger of two numbers; NaN if one of them is NaN. */
INLINE V most(V a, V b) { return pick((b.v <= a.v) | (a.v != a.v), a, b); }

/* Exchange a and b in the lanes m. */
INLINE void exchange(tr_bits m, V &a, V &b) {
  const V t = pick(m, b, a);
  b = pick(m, a, b), a = t;
}

#if ACTIVE <= 4
#define EACH_ROW _Pragma("clang loop unroll(full)")
#else
#define EACH_ROW
#endif

#if ACTIVE
/* Pivoted Cholesky factor of d S d, in the lower triangle. */
static void factorise(Lanes &s) {
  V *L = s.factor;
  EACH_ROW
  for (int j = 0; j < ACTIVE; ++j) {
    s.order[j] = tr_bits{} + j;
    EACH_ROW
    for (int i = j; i < ACTIVE; ++i) L[i + j * ACTIVE] = s.d[i] * s.d[j] * s.maps[i + j * ACTIVE];
  }
  EACH_ROW
  for (int k = 0; k < ACTIVE; ++k) {
    V pivot = L[k + k * ACTIVE];
    tr_bits at = tr_bits{} + k;
    EACH_ROW
    for (int i = k + 1; i < ACTIVE; ++i) {
      const tr_bits larger = L[i + i * ACTIVE].v > pivot.v;
      pivot = pick(larger, L[i + i * ACTIVE], pivot), at = (larger & (tr_bits{} + i)) | (~larger & at);
    }
    s.good &= pivot.v > KEEP_PIVOT;
    EACH_ROW
    for (int i = k + 1; i < ACTIVE; ++i) {
      const tr_bits m = at == i;
      EACH_ROW
      for (int q = 0; q < k; ++q) exchange(m, L[k + q * ACTIVE], L[i + q * ACTIVE]);
      EACH_ROW
      for (int q = k + 1; q < i; ++q) exchange(m, L[q + k * ACTIVE], L[i + q * ACTIVE]);
      EACH_ROW
      for (int q = i + 1; q < ACTIVE; ++q) exchange(m, L[q + k * ACTIVE], L[q + i * ACTIVE]);
      exchange(m, L[k + k * ACTIVE], L[i + i * ACTIVE]);
      const tr_bits a = s.order[k], b = s.order[i];
      s.order[k] = (m & b) | (~m & a), s.order[i] = (m & a) | (~m & b);
    }
    const V inverse = V(1.0) / sqrt(pivot);
    L[k + k * ACTIVE] = inverse;
    EACH_ROW
    for (int i = k + 1; i < ACTIVE; ++i) L[i + k * ACTIVE] = L[i + k * ACTIVE] * inverse;
    EACH_ROW
    for (int j = k + 1; j < ACTIVE; ++j)
      EACH_ROW
      for (int i = j; i < ACTIVE; ++i) L[i + j * ACTIVE] = L[i + j * ACTIVE] - L[i + k * ACTIVE] * L[j + k * ACTIVE];
  }
}

/* ``taken`` reads entry p of b, and ``put`` writes it. p may differ between lanes. */
INLINE V taken(const V *b, tr_bits p) {
  V r = b[0];
  EACH_ROW
  for (int i = 1; i < ACTIVE; ++i) r = pick(p == i, b[i], r);
  return r;
}
INLINE void put(V *b, tr_bits p, V v) {
  EACH_ROW
  for (int i = 0; i < ACTIVE; ++i) b[i] = pick(p == i, v, b[i]);
}

/* x = S⁻¹ b. Requires the factor. */
static void solve(const Lanes &s, const V *b, V *x) {
  V y[ACTIVE + 1];
  const V *L = s.factor;
  EACH_ROW
  for (int i = 0; i < ACTIVE; ++i) {
    V a = taken(s.d, s.order[i]) * taken(b, s.order[i]);
    EACH_ROW
    for (int k = 0; k < i; ++k) a = a - L[i + k * ACTIVE] * y[k];
    y[i] = a * L[i + i * ACTIVE];
  }
  EACH_ROW
  for (int i = ACTIVE - 1; i >= 0; --i) {
    V a = y[i];
    EACH_ROW
    for (int k = i + 1; k < ACTIVE; ++k) a = a - L[k + i * ACTIVE] * y[k];
    y[i] = a * L[i + i * ACTIVE];
    put(x, s.order[i], taken(s.d, s.order[i]) * y[i]);
  }
}

/* Largest scaled residuals of positions and of rates. */
static void residual(const Lanes &s, const V *h, V &position, V &rate) {
  position = rate = 0.0;
  EACH_ROW
  for (int i = 0; i < ACTIVE; ++i) {
    const int r = k_active_rows[i];
    const bool turns = k_row_kind[r] == TR_CONSTRAINS_TURNING;
    position = most(position, turns ? fabs(h[r]) : fabs(h[r]) * s.per_length);
    rate = most(rate, fabs(h[ROWS + r]) * (turns ? s.per_rate : s.per_speed));
  }
}

/* Prepare corrections of a state: maps, factor of S, and ẏ without impulses (`base`). */
static void prepare(Lanes &s, const V *y, V *base) {
  V none[ACTIVE + NETA + 8];
  for (int i = 0; i < ACTIVE + NETA; ++i) none[i] = 0.0;
  k_stage1(s.x, y, s.c, s.w, s.maps, base, s.power);
  factorise(s);
  k_stage2(s.x, y, s.c, s.w, none, base, s.power);
}

/* Call ``prepare`` for all lanes except those in `kept`. */
static void prepare_others(Lanes &s, tr_bits kept, const V *y, V *base) {
  V w[NW + 1], factor[ACTIVE * ACTIVE], last[MOST_WIDE];
  tr_bits order[ACTIVE];
  for (int i = 0; i < NW; ++i) w[i] = s.w[i];
  for (int i = 0; i < ACTIVE * ACTIVE; ++i) factor[i] = s.factor[i];
  for (int i = 0; i < ACTIVE; ++i) order[i] = s.order[i];
  for (int i = 0; i < NQ + NV; ++i) last[i] = base[i];
  const tr_bits good = s.good;
  prepare(s, y, base);
  for (int i = 0; i < NW; ++i) s.w[i] = pick(kept, w[i], s.w[i]);
  for (int i = 0; i < ACTIVE * ACTIVE; ++i) s.factor[i] = pick(kept, factor[i], s.factor[i]);
  for (int i = 0; i < ACTIVE; ++i) s.order[i] = (kept & order[i]) | (~kept & s.order[i]);
  for (int i = 0; i < NQ + NV; ++i) base[i] = pick(kept, last[i], base[i]);
  s.good = (kept & good) | (~kept & s.good);
}

/* dv: the change of rates that corrects the residual h, by impulses along the constraint rows. */
static void correction(Lanes &s, const V *y, const V *h, const V *base, V *dv) {
  V b[ACTIVE + 1], impulse[ACTIVE + 1], given[ACTIVE + NETA + 8], moved[MOST_WIDE], big = 0.0, size = 0.0, gain = 0.0;
  for (int i = 0; i < ACTIVE; ++i) b[i] = -h[k_active_rows[i]];
  solve(s, b, impulse);
  for (int i = 0; i < ACTIVE; ++i) big = fmax(big, fabs(impulse[i]));
  for (int i = ACTIVE; i < ACTIVE + NETA; ++i) given[i] = 0.0;
  const V up = pick(big.v > 0.0, V(1.0) / big, V(0.0));
  for (int i = 0; i < NV; ++i) size = fmax(size, fabs(base[NQ + i]));
  for (int i = 0; i < ACTIVE; ++i) gain = fmax(gain, fabs(impulse[i]) * up / (s.d[i] * s.d[i]));
  const V by = pick(gain.v > 0.0, up * fmax(V(1.0), size / gain), up), inverse = pick(by.v > 0.0, V(1.0) / by, V(0.0));
  for (int i = 0; i < ACTIVE; ++i) given[i] = impulse[i] * by;
  k_stage2(s.x, y, s.c, s.w, given, moved, s.power);
  for (int i = 0; i < NV; ++i) dv[i] = (moved[NQ + i] - base[NQ + i]) * inverse;
}

/* Project the rates of y in lanes where their residual exceeds round-off. h, rate: residuals at y. near: lanes whose maps and
 * factor belong to a state close to y. */
static void project_rates(Lanes &s, V *y, V *h, V rate, tr_bits near, V *base) {
  V p, r, dv[NV + 1];
  tr_bits goes = rate.v > LOOP_CLOSED;
  for (int it = 0; it < CLOSURE_RATE_STEPS && any(goes); ++it) {
    const V was = rate;
    if (any(goes & ~near)) prepare_others(s, near, y, base);
    near |= goes;
    correction(s, y, h + ROWS, base, dv);
    for (int i = 0; i < NV; ++i) y[NQ + i] = pick(goes, y[NQ + i] + dv[i], y[NQ + i]);
    k_closure(s.x, y, s.c + C_CLOSURE, h);
    residual(s, h, p, r);
    rate = pick(goes, r, rate);
    goes &= (rate.v > LOOP_CLOSED) & ~(rate.v > CLOSURE_SHRINKS * was.v);
  }
}

/* Project the state y. */
static void project(Lanes &s, V *y) {
  V h[2 * ROWS + 4], position, rate, p, r, before = 0.0, dv[NV + 1], dq[NQ + 8], moved[NQ + 1], base[MOST_WIDE];
  tr_bits goes = tr_bits{} - 1, near = tr_bits{};
  for (int i = 0; i < WIDTH; ++i) s.projections[i] = 0;
  normalise(y);
  k_closure(s.x, y, s.c + C_CLOSURE, h);
  residual(s, h, position, rate);
  for (int it = 0; it < CLOSURE_STEPS; ++it) {
    s.good &= finite(position);
    goes &= ~(position.v <= LOOP_CLOSED);
    if (it > 1) goes &= ~(position.v > CLOSURE_SHRINKS * before.v);
    if (!any(goes)) break;
    before = pick(goes, position, before);
    prepare_others(s, ~goes, y, base);
    near = (goes & (position.v <= LOOP_NEARLY_CLOSED)) | (~goes & near);
    correction(s, y, h, base, dv);
    k_qdot(y, dv, s.c, dq);
    for (int i = 0; i < NQ; ++i) moved[i] = y[i] + dq[i];
    normalise(moved);
    for (int i = 0; i < NQ; ++i) y[i] = pick(goes, moved[i], y[i]);
    for (int i = 0; i < WIDTH; ++i) s.projections[i] -= (int)goes[i];
    k_closure(s.x, y, s.c + C_CLOSURE, h);
    residual(s, h, p, r);
    position = pick(goes, p, position), rate = pick(goes, r, rate);
  }
  s.gap = position, s.good &= ~(position.v > LOOP_OPEN);
  project_rates(s, y, h, rate, near, base);
}
#endif
