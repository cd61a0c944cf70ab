/* Rows of one case, one row in each lane: state from the dense output, projection, multipliers, columns. */

#define EACH_OF_FOUR _Pragma("clang loop unroll(full)")

/* Give the data of one case to all lanes. */
static void alike(Lanes &s, const tr_request &of) {
  s.nworks = of.nworks, s.length = of.length, s.rate = of.rate, s.good = tr_bits{} - 1;
  prepare_units(s);
  for (int i = 0; i < NX; ++i) s.x[i] = of.x[i];
  for (int i = 0; i < NC; ++i) s.c[i] = of.c[i];
  for (int i = 0; i < ACTIVE; ++i) s.d[i] = of.d[i];
#if NETA
  for (int i = 0; i < NETA; ++i) s.per_lever[i] = of.arm[i] > 0.0 ? 1.0 / of.arm[i] : 1.0;
  s.watches = s.iterations = tr_bits{};
#endif
}

/* y(θ) of the step's dense output (``tr_evaluate_dense``). */
INLINE void dense_state(const tr_request &of, V theta, V *__restrict y) {
  const V rest = V(1.0) - theta;
  const int n = of.n, last = of.dense_rows - 1;
  const double *yold = of.yold, *R = of.R;
  for (int i = 0; i < n; i += 4) {
    V a[4] = {0.0, 0.0, 0.0, 0.0};
    for (int q = last; q >= 0; --q) {
      const V factor = q & 1 ? rest : theta;
      const double *row = R + q * n + i;
      EACH_OF_FOUR for (int j = 0; j < 4; ++j) a[j] = (a[j] + row[j]) * factor;
    }
    EACH_OF_FOUR for (int j = 0; j < 4; ++j) y[i + j] = a[j] + yold[i + j];
  }
}

static void rows(tr_request **r) {
  const tr_request &of = *r[0];
  Lanes s;
  V y[MOST_WIDE], dy[MOST_WIDE], full[ROWS + NETA + 1], theta, t;
  alike(s, of);
  for (int l = 0; l < WIDTH; ++l) theta.v[l] = r[l]->theta, t.v[l] = r[l]->t;
  dense_state(of, theta, y);
  s.x[0] = t;
#if ACTIVE
  project(s, y);
  for (int l = 0; l < WIDTH; ++l) r[l]->projections = s.projections[l];
#else
  normalise(y);
#endif
  for (int i = 0; i < NY; ++i) s.good &= finite(y[i]);
  for (int i = 0; i < ROWS + NETA; ++i) full[i] = 0.0;
#if NETA
  for (int i = ACTIVE; i < ACTIVE + NETA; ++i) s.z[i] = (V(1.0) - theta) * of.zstart[i] + theta * of.zend[i];
#endif
  if (of.solved) {
    slope(s, of.n, t, y, dy);
    for (int i = 0; i < ACTIVE; ++i) full[k_active_rows[i]] = s.z[i];
    for (int i = 0; i < NETA; ++i) full[ROWS + i] = s.z[ACTIVE + i];
  }
  of.columns(r, (const double *)s.x, (const double *)y, (const double *)full, (const double *)(dy + NQ));
  for (int l = 0; l < WIDTH; ++l) r[l]->ok = s.good[l] != 0;
#if NETA
  for (int l = 0; l < WIDTH; ++l) r[l]->iterations = s.iterations[l];
#endif
}
