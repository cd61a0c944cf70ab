/* Friction in lanes. Newton's method on the complement equations finds η (``runtime/friction/newton.c``), after the elimination of
 * λ (``runtime/constraints/loop_solve.c``).
 *
 * Each lane iterates until it converges. A converged lane keeps its result while other lanes iterate. A lane without a root, or
 * with an unstable root, is not `good`. The case of such a lane searches other roots outside the lanes. No friction pair in lanes
 * is held at rest. */
#if NETA
#define MODES (2 + NSTOPS) /* offset of the modes in x, after the moment (two numbers) and the flags of stops */
#define MODE_NUMBERS 5
#define SLIDING_NUMBERS 3
#if NETA <= 4
#define EACH_SMALL _Pragma("clang loop unroll(full)")
#else
#define EACH_SMALL
#endif

/* Results of the friction laws at a given η. */
struct Law {
  V N[NN + 8], eta[NETA + 8], dn[NDN + 8], sliding[SLIDING_NUMBERS * NSLIDERS + 8];
};

INLINE void law(const Lanes &s, const V *eta, Law &at) {
  EACH_SMALL
  for (int i = 0; i < NN; ++i) {
    V sum = s.N0[i];
    EACH_SMALL
    for (int j = 0; j < NETA; ++j) sum = sum + s.Ne[i + j * NN] * eta[j];
    at.N[i] = sum;
  }
  k_laws(at.N, s.maps + MAP_RATES, s.x, s.c + C_LAWS, at.eta, at.dn, at.sliding);
}

/* Jacobian of η − law(N(η)) by η, with λ eliminated: J = E − dlaw/dN · Ne'. */
INLINE void jacobian(const Lanes &s, const Law &at, V *J) {
  EACH_SMALL
  for (int m = 0; m < NELEMENTS; ++m) {
    const tr_element &e = k_element[m];
    EACH_SMALL
    for (int j = 0; j < NETA; ++j)
      EACH_SMALL
      for (int r = 0; r < e.neta; ++r) {
        V sum = e.eta0 + r == j ? 1.0 : 0.0;
        EACH_SMALL
        for (int i = 0; i < e.needs; ++i) sum = sum - at.dn[e.dn0 + r + i * e.neta] * s.Ne[e.n0 + i + j * NN];
        J[e.eta0 + r + j * NETA] = sum;
      }
  }
}

#if NETA == 1
/* b ← A⁻¹ b. Returns whether A is regular. negative receives whether the determinant is negative. */
INLINE tr_bits solve_friction(V *A, V *b, tr_bits &negative) {
  b[0] = b[0] / A[0], negative = A[0].v < 0.0;
  return fabs(A[0]).v > NO_PIVOT;
}
#elif NETA == 3 && !ACTIVE
/* ``solve_friction`` for three unknowns, by cross products. (Without loops, the sign of the determinant is not needed.) */
INLINE tr_bits solve_friction(V *A, V *b, tr_bits &negative) {
  const V *x = A, *y = A + 3, *z = A + 6, r[3] = {b[0], b[1], b[2]};
  const V yz[3] = {y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]};
  const V rx[3] = {r[1] * x[2] - r[2] * x[1], r[2] * x[0] - r[0] * x[2], r[0] * x[1] - r[1] * x[0]};
  const V det = x[0] * yz[0] + x[1] * yz[1] + x[2] * yz[2], inverse = V(1.0) / det;
  b[0] = (r[0] * yz[0] + r[1] * yz[1] + r[2] * yz[2]) * inverse;
  b[1] = -(z[0] * rx[0] + z[1] * rx[1] + z[2] * rx[2]) * inverse;
  b[2] = (y[0] * rx[0] + y[1] * rx[1] + y[2] * rx[2]) * inverse;
  negative = tr_bits{};
  return fabs(det).v > NO_PIVOT;
}
#else
/* Exchange row k with row `at`, in the columns from k on and in b. `at` may differ between lanes. */
static void to_the_top(int k, tr_bits at, V *A, V *b) {
  for (int i = k + 1; i < NETA; ++i) {
    const tr_bits m = at == i;
    if (!any(m)) continue;
    for (int j = k; j < NETA; ++j) exchange(m, A[k + j * NETA], A[i + j * NETA]);
    exchange(m, b[k], b[i]);
  }
}

/* ``solve_friction`` by elimination with partial pivoting. */
static tr_bits solve_friction(V *A, V *b, tr_bits &negative) {
  V inverse[NETA];
  tr_bits there = tr_bits{} - 1;
  negative = tr_bits{};
  for (int k = 0; k < NETA; ++k) {
    V most = fabs(A[k + k * NETA]);
    tr_bits at = tr_bits{} + k;
    for (int i = k + 1; i < NETA; ++i) {
      const V size = fabs(A[i + k * NETA]);
      const tr_bits larger = size.v > most.v;
      most = pick(larger, size, most), at = (larger & (tr_bits{} + i)) | (~larger & at);
    }
    to_the_top(k, at, A, b);
    there &= most.v > NO_PIVOT, negative ^= (at != k) ^ (A[k + k * NETA].v < 0.0);
    inverse[k] = V(1.0) / A[k + k * NETA];
    for (int i = k + 1; i < NETA; ++i) {
      const V f = A[i + k * NETA] * inverse[k];
      for (int j = k + 1; j < NETA; ++j) A[i + j * NETA] = A[i + j * NETA] - f * A[k + j * NETA];
      b[i] = b[i] - f * b[k];
    }
  }
  for (int k = NETA - 1; k >= 0; --k) {
    for (int j = k + 1; j < NETA; ++j) b[k] = b[k] - A[k + j * NETA] * b[j];
    b[k] = b[k] * inverse[k];
  }
  return there;
}
#endif

/* Add the step r to η in the lanes m. step receives the largest component of r, size that of η, as surface forces, or NaN. */
INLINE void take_step(const Lanes &s, tr_bits m, const V *r, V *eta, V &step, V &size) {
  step = size = 0.0;
  for (int i = 0; i < NETA; ++i) {
    eta[i] = pick(m, eta[i] + r[i], eta[i]);
    step = most(step, fabs(r[i]) * s.per_lever[i]), size = most(size, fabs(eta[i]) * s.per_lever[i]);
  }
}

/* Newton's method, starting from the present η. */
static void newton(Lanes &s) {
  V *eta = s.z + ACTIVE, last = __builtin_inf(), step, size, J[NETA * NETA], r[NETA];
  tr_bits goes = s.good, away = tr_bits{}, negative;
  Law at;
  for (int it = 0; it < NEWTON_MAX && any(goes); ++it) {
    law(s, eta, at);
    jacobian(s, at, J);
    for (int i = 0; i < NETA; ++i) r[i] = at.eta[i] - eta[i];
    const tr_bits there = solve_friction(J, r, negative);
    take_step(s, goes, r, eta, step, size);
    for (int i = 0; i < NN; ++i) s.N[i] = pick(goes, at.N[i], s.N[i]);
    for (int i = 0; i < SLIDING_NUMBERS * NSLIDERS; ++i) s.sliding[i] = pick(goes, at.sliding[i], s.sliding[i]);
    away = (goes & negative) | (~goes & away), s.iterations -= goes;
    const tr_bits lost = goes & ~(there & (step.v < __builtin_inf()));
    s.good &= ~lost, goes &= ~lost;
    goes &= ~((step.v <= NEWTON_EXACT * size.v) | ((step.v <= NEWTON_QUADRATIC * size.v) & (step.v <= NEWTON_SHRINKS * last.v)) | (size.v == 0.0));
    last = step;
  }
  s.good &= ~goes;
#if ACTIVE
  s.good &= ~away;
#endif
}

/* Multipliers of the state whose maps were evaluated last. Newton's method starts from the present multipliers. */
static void multipliers(Lanes &s) {
  V *lam = s.z, *eta = s.z + ACTIVE;
  for (int i = 0; i < NN; ++i) s.N0[i] = s.maps[MAP_N0 + i];
  for (int i = 0; i < NN * NETA; ++i) s.Ne[i] = s.maps[MAP_NE + i];
#if ACTIVE
  V *T = s.T, first[ACTIVE];
  const V *Nl = s.maps + MAP_N0 + NN;
  factorise(s);
  solve(s, s.maps + ACTIVE * (ACTIVE + NETA), first);
  for (int j = 0; j < NETA; ++j) solve(s, s.maps + ACTIVE * (ACTIVE + j), T + j * ACTIVE);
  for (int j = 0; j < ACTIVE; ++j)
    for (int i = 0; i < NN; ++i) {
      s.N0[i] = s.N0[i] - Nl[i + j * NN] * first[j];
      for (int q = 0; q < NETA; ++q) s.Ne[i + q * NN] = s.Ne[i + q * NN] - Nl[i + j * NN] * T[j + q * ACTIVE];
    }
#endif
  newton(s);
#if ACTIVE
  for (int i = 0; i < ACTIVE; ++i) {
    lam[i] = -first[i];
    for (int j = 0; j < NETA; ++j) lam[i] = lam[i] - T[i + j * ACTIVE] * eta[j];
  }
#endif
}

/* Violation of the mode (sliding or spinning) of pair i with a set-valued law, in units of the tolerance. */
INLINE V set_violation(const Lanes &s, int i) {
  const V *now = s.sliding + SLIDING_NUMBERS * i, stop = tr_stick_overshoot(now[0], s.length * s.rate), cone = now[2] / TOL_CONE;
  if (!k_pair[i].cone) return stop;
  return pick(s.x[MODES + MODE_NUMBERS * i].v == (double)TR_CONE, cone, fmax(stop, -cone));
}

/* Update the extremes over the stages of a step (``tr_update_extremes``), in the lanes `s.watches`. */
INLINE void watch(Lanes &s) {
  for (int i = 0; i < NSLIDERS; ++i) {
    const V *now = s.sliding + SLIDING_NUMBERS * i;
    V least = s.least[i], largest = s.largest[i];
    if (k_pair[i].kind == TR_KIND_SET) {
      const V far = set_violation(s, i);
      least = fmin(least, far), largest = fmax(largest, far);
    } else if (k_pair[i].kind == TR_KIND_TURN) {
      largest = fmax(largest, tr_stick_overshoot(now[0], s.length * s.rate));
    } else {
      least = fmin(least, now[0] - now[1]), largest = fmax(largest, fmax(now[0] - now[1], -now[0] - now[1]));
    }
    s.least[i] = pick(s.watches, least, s.least[i]), s.largest[i] = pick(s.watches, largest, s.largest[i]);
  }
#if ACTIVE
  s.independence = pick(s.watches, fmin(s.independence, V(1.0) / s.factor[ACTIVE * ACTIVE - 1]), s.independence);
#endif
}
#endif

