/* Requests that lanes serve (``runtime/evaluate/lane_requests.c``): stages of explicit methods, ends of steps, states of rows and
 * of event searches. */
typedef void (*lane_combination)(int n, V h, const V *K, V *out);
struct lane_explicit {
  int stages, extra, errors, dense, ends_in_error;
  double stiff_at;
  const double *c, *lead;
  void (*argument)(int stage, int n, V h, const V *y, const V *K, V *out);
  void (*solution)(int n, V h, const V *y, const V *K, V *out);
  const lane_combination *error, *dense_row;
};

METHODS

/* Copy arrays of cases into lanes and back, four doubles at a time. n is rounded up to a multiple of WIDTH. The arrays have room
 * for this number. */
typedef double four __attribute__((vector_size(32), aligned(8)));
INLINE void turned(four *m) {
  const four a = __builtin_shufflevector(m[0], m[1], 0, 4, 2, 6), b = __builtin_shufflevector(m[0], m[1], 1, 5, 3, 7);
  const four c = __builtin_shufflevector(m[2], m[3], 0, 4, 2, 6), d = __builtin_shufflevector(m[2], m[3], 1, 5, 3, 7);
  m[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5), m[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  m[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7), m[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}
static_assert(WIDTH == 4, "gather and scatter transpose blocks of four lanes");
INLINE void gather(int n, double *const *from, V *to) {
  for (int i = 0; i < n; i += WIDTH) {
    four m[WIDTH];
    for (int l = 0; l < WIDTH; ++l) m[l] = *(const four *)(from[l] + i);
    turned(m);
    for (int l = 0; l < WIDTH; ++l) to[i + l].v = m[l];
  }
}
INLINE void scatter(int n, const V *from, double *const *to) {
  for (int i = 0; i < n; i += WIDTH) {
    four m[WIDTH];
    for (int l = 0; l < WIDTH; ++l) m[l] = from[i + l].v;
    turned(m);
    for (int l = 0; l < WIDTH; ++l) *(four *)(to[l] + i) = m[l];
  }
}
#define TAKE(n, field, to) { double *at[WIDTH]; for (int l = 0; l < WIDTH; ++l) at[l] = r[l]->field; gather(n, at, to); }
#define GIVE(n, from, field) { double *at[WIDTH]; for (int l = 0; l < WIDTH; ++l) at[l] = r[l]->field; scatter(n, from, at); }
/* Copy back as ``scatter`` does, but only for lanes that are good. The cases of other lanes keep their data. */
static void give_good(const Lanes &s, int n, const V *from, double *const *to) {
  const bool everywhere = !any(~s.good);
  if (everywhere) scatter(n, from, to);
  for (int l = 0; l < WIDTH && !everywhere; ++l)
    for (int i = 0; i < n && s.good[l]; ++i) to[l][i] = from[i].v[l];
}
#define GIVE_GOOD(n, from, field) { double *at[WIDTH]; for (int l = 0; l < WIDTH; ++l) at[l] = r[l]->field; give_good(s, n, from, at); }

/* ẏ at (t, y) and the powers, padded with zeros up to n. */
static void slope(Lanes &s, int n, V t, const V *y, V *dy) {
  s.x[0] = t;
  k_stage1(s.x, y, s.c, s.w, s.maps, dy, s.power);
#if NETA
  multipliers(s);
  watch(s);
  k_stage2(s.x, y, s.c, s.w, s.z, dy, s.power);
#elif ACTIVE
  factorise(s);
  solve(s, s.maps + ACTIVE * ACTIVE, s.z);
  for (int i = 0; i < ACTIVE; ++i) s.z[i] = -s.z[i];
  k_stage2(s.x, y, s.c, s.w, s.z, dy, s.power);
#endif
  for (int i = NY; i < n; ++i) dy[i] = 0.0;
  V sum[2] = {0.0, 0.0};
  for (int i = 0; i < s.nworks; ++i) dy[NY + i] = s.power[i];
  for (int i = 0; i < NPOWERS; ++i) sum[i >= NTAKEN] = sum[i >= NTAKEN] + s.power[i];
  dy[NY + s.nworks] = sum[0], dy[NY + s.nworks + 1] = sum[1];
}

#if NETA
/* Extrapolate η from earlier stages (`old`) to stage i. Newton's method starts from the result. */
INLINE void lead_on(const lane_explicit *m, int i, const V *old, V *eta) {
  const double *weight = m->lead + i * m->stages;
  for (int j = 0; j < NETA; ++j) {
    eta[j] = 0.0;
    for (int k = 0; k < i; ++k) eta[j] = eta[j] + weight[k] * old[j + k * NETA];
  }
}

/* Interpolate η at θ between the ends of the step. Newton's method starts from the result. */
INLINE void start_between(tr_request **r, V theta, V *eta) {
  for (int j = 0; j < NETA; ++j)
    for (int l = 0; l < WIDTH; ++l) eta[j].v[l] = (1.0 - theta.v[l]) * r[l]->zstart[ACTIVE + j] + theta.v[l] * r[l]->zend[ACTIVE + j];
}
#endif

/* Make a trial step: compute its stages, its end and its error estimates. */
static void step(Lanes &s, tr_request **r, const lane_explicit *m, int n, V t, V h, const V *y) {
  V K[(STAGES + 1) * MOST_WIDE], state[MOST_WIDE], error[MOST_WIDE];
  TAKE(n, K, K)
#if NETA
  V old[NETA * STAGES];
#endif
  for (int i = 1; i < m->stages; ++i) {
    m->argument(i, n, h, y, K, state);
#if NETA
    for (int j = 0; j < NETA; ++j) old[j + (i - 1) * NETA] = s.z[ACTIVE + j];
    lead_on(m, i, old, s.z + ACTIVE);
#endif
    slope(s, n, t + V(m->c[i]) * h, state, K + i * n);
    GIVE(n, K + i * n, K + i * n)
  }
  m->solution(n, h, y, K, state);
  if (m->ends_in_error) {
    slope(s, n, t + h, state, K + m->stages * n);
    GIVE(n, K + m->stages * n, K + m->stages * n)
  }
  GIVE(n, state, ynew)
  m->error[0](n, h, K, error);
  GIVE(n, error, first)
  if (m->errors < 2) return;
  m->error[1](n, h, K, error);
  GIVE(n, error, second)
}

/* Compute the extra stages for the dense output. */
static void dense(Lanes &s, tr_request **r, const lane_explicit *m, int n, V t, V h, const V *y) {
  V K[(STAGES + 1) * MOST_WIDE], state[MOST_WIDE];
  TAKE((m->stages + 1) * n, K, K)
  for (int i = m->stages + 1; i <= m->stages + m->extra; ++i) {
    m->argument(i, n, h, y, K, state);
#if NETA
    start_between(r, m->c[i], s.z + ACTIVE);
#endif
    slope(s, n, t + V(m->c[i]) * h, state, K + i * n);
    GIVE(n, K + i * n, K + i * n)
  }
}

/* Project the state y, and evaluate ẏ. */
static void end(Lanes &s, tr_request **r, int n, V t, V *y) {
  V dy[MOST_WIDE];
  for (int i = 0; i < NY; ++i) s.good &= finite(y[i]);
  s.x[0] = t;
#if ACTIVE
  project(s, y);
  for (int l = 0; l < WIDTH; ++l) r[l]->gap = s.gap.v[l], r[l]->projections = s.projections[l];
#else
  normalise(y);
#endif
  slope(s, n, t, y, dy);
  GIVE_GOOD(n, y, y) /* outside the lanes, a failed case continues from its old state */
  GIVE_GOOD(n, dy, slope)
}
