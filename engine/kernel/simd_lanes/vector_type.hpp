/* A vector with one number for each lane. Generated C, compiled as C++ with this type in place of `double`, computes several cases
 * at once. Lanes are independent. Truth values are 1 and 0. */
typedef double tr_lanes_of __attribute__((vector_size(8 * WIDTH), aligned(8)));
typedef long long tr_bits __attribute__((vector_size(8 * WIDTH), aligned(8)));
#define INLINE static inline __attribute__((always_inline))

struct V {
  tr_lanes_of v;
  V() = default;
  V(double a) : v{a, a, a, a} {}
  V(int a) : V((double)a) {}
};

INLINE V of(tr_lanes_of a) { V r; r.v = a; return r; }
INLINE V truth(tr_bits m) { return of((tr_lanes_of)(m & (tr_bits)(tr_lanes_of{} + 1.0))); }
INLINE V operator+(V a, V b) { return of(a.v + b.v); }
INLINE V operator-(V a, V b) { return of(a.v - b.v); }
INLINE V operator*(V a, V b) { return of(a.v * b.v); }
INLINE V operator/(V a, V b) { return of(a.v / b.v); }
INLINE V operator-(V a) { return of(-a.v); }
INLINE V operator<(V a, V b) { return truth(a.v < b.v); }
INLINE V operator<=(V a, V b) { return truth(a.v <= b.v); }
INLINE V operator>(V a, V b) { return truth(a.v > b.v); }
INLINE V operator==(V a, V b) { return truth(a.v == b.v); }
INLINE V operator!=(V a, V b) { return truth(a.v != b.v); }
INLINE V operator&&(V a, V b) { return truth((a.v != 0.0) & (b.v != 0.0)); }
INLINE V operator||(V a, V b) { return truth((a.v != 0.0) | (b.v != 0.0)); }

/* ``pick``: a in the lanes m, otherwise b. ``where``: a in the lanes where c is true; otherwise 0, even if a is NaN. */
INLINE V pick(tr_bits m, V a, V b) { return of((tr_lanes_of)((m & (tr_bits)a.v) | (~m & (tr_bits)b.v))); }
INLINE V where(V c, V a) { return of((tr_lanes_of)((c.v != 0.0) & (tr_bits)a.v)); }
INLINE bool any(tr_bits m) {
#ifdef __AVX__
  return __builtin_ia32_movmskpd256((tr_lanes_of)m) != 0;
#endif
  long long all = 0;
  for (int i = 0; i < WIDTH; ++i) all |= m[i];
  return all != 0;
}

INLINE V sqrt(V a) { return of(__builtin_elementwise_sqrt(a.v)); }
INLINE V fabs(V a) { return of(__builtin_elementwise_abs(a.v)); }
INLINE V floor(V a) { return of(__builtin_elementwise_floor(a.v)); }
INLINE V fmax(V a, V b) { return pick((a.v >= b.v) | (b.v != b.v), a, b); }
INLINE V fmin(V a, V b) { return pick((a.v <= b.v) | (b.v != b.v), a, b); }
INLINE V copysign(V a, V b) {
  const tr_bits sign = (tr_bits)(tr_lanes_of{} - 0.0);
  return of((tr_lanes_of)(((tr_bits)b.v & sign) | ((tr_bits)a.v & ~sign)));
}
INLINE tr_bits finite(V a) { return fabs(a).v < __builtin_inf(); }

/* Rarely used functions. The library evaluates such a function for one lane after another. */
#define EACH(name) \
  extern "C" double name(double); \
  static V name(V a) { V r; for (int i = 0; i < WIDTH; ++i) r.v[i] = name(a.v[i]); return r; }
#define EACH_OF_TWO(name) \
  extern "C" double name(double, double); \
  static V name(V a, V b) { V r; for (int i = 0; i < WIDTH; ++i) r.v[i] = name(a.v[i], b.v[i]); return r; }
EACH(tan) EACH(asin) EACH(acos) EACH(atan) EACH(exp) EACH(log) EACH(tanh)
EACH_OF_TWO(pow) EACH_OF_TWO(atan2) EACH_OF_TWO(fmod) EACH_OF_TWO(hypot)

#if defined __FMA__ || defined __ARM_FEATURE_FMA
/* Sine and cosine with an error below one unit in the last place. The nearest multiple of pi/2 is subtracted in three parts, the
 * first two of which are doubles (W. J. Cody, W. Waite 1980, with fused products). The remainder is a sum of two doubles. The
 * polynomials are minimax over |r| <= pi/4 (coefficients of Sun's fdlibm, k_sin.c and k_cos.c). For angles above LARGE_ANGLE, the
 * functions of the library are used instead. */
#define LARGE_ANGLE 1e5
extern "C" double sin(double);
extern "C" double cos(double);
INLINE tr_lanes_of fused(tr_lanes_of a, tr_lanes_of b, tr_lanes_of c) { return __builtin_elementwise_fma(a, b, c); }
INLINE tr_lanes_of all(double a) { return V(a).v; }
template <int N> INLINE tr_lanes_of polynomial(tr_lanes_of z, const double (&c)[N]) {
  tr_lanes_of sum = all(c[N - 1]);
  _Pragma("clang loop unroll(full)")
  for (int i = N - 2; i >= 0; --i) sum = fused(z, sum, all(c[i]));
  return sum;
}
static const double SINE[] = {8.33333333332248946124e-03, -1.98412698298579493134e-04, 2.75573137070700676789e-06,
                              -2.50507602534068634195e-08, 1.58969099521155010221e-10};
static const double COSINE[] = {4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
                                -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11};

__attribute__((noinline)) static V far_away(V a, int quarter) {
  V r;
  for (int i = 0; i < WIDTH; ++i) r.v[i] = quarter ? cos(a.v[i]) : sin(a.v[i]);
  return r;
}

/* sin(a + quarter · pi/2). */
template <int quarter> INLINE V circular(V a) {
#pragma clang fp contract(off)
  const double SHIFT = 6755399441055744.0; /* 1.5 * 2^52: in x + SHIFT, the low bits contain the rounded integer */
  const tr_lanes_of x = a.v, shifted = fused(x, all(0.63661977236758134308), all(SHIFT)), n = shifted - SHIFT;
  tr_bits turns = (tr_bits)shifted + quarter;
  const tr_lanes_of near = fused(-n, all(1.57079632679489655800e+00), x), part = n * 6.12323399573676603587e-17, r = near - part;
  /* rounding error of r, exact by Knuth's formula for a sum */
  const tr_lanes_of moved = r - near, lost = (near - (r - moved)) - (part + moved);
  const tr_lanes_of rest = fused(-n, all(-1.49738490485916983e-33), lost - fused(n, all(6.12323399573676603587e-17), -part));
  const tr_lanes_of z = r * r, cube = z * r, half = 0.5 * z, left = 1.0 - half;
  const tr_lanes_of sine = r - ((z * (0.5 * rest - cube * polynomial(z, SINE)) - rest) + cube * 1.66666666666666324348e-01);
  const tr_lanes_of cosine = left + (((1.0 - left) - half) + (z * (z * polynomial(z, COSINE)) - r * rest));
  V out = pick((turns & 1) != 0, of(cosine), of(sine));
  out = of((tr_lanes_of)((tr_bits)out.v ^ ((turns & 2) << 62)));
  const tr_bits beyond = ~(fabs(a).v < LARGE_ANGLE);
  return __builtin_expect(any(beyond), 0) ? pick(beyond, far_away(a, quarter), out) : out;
}
INLINE V sin(V a) { return circular<0>(a); }
INLINE V cos(V a) { return circular<1>(a); }
#else
EACH(sin) EACH(cos)
#endif
