/* The functions of <math.h> and <string.h> for NVIDIA's processors. The compiler provides memory copies and the functions that are
 * single instructions. libdevice provides all other functions. Its names begin with __nv_, and it may be linked without copyright
 * restrictions. */
#include <stddef.h>

#define UNARY(name) double __nv_##name(double);
#define BINARY(name) double __nv_##name(double, double);
UNARY(sin) UNARY(cos) UNARY(tan) UNARY(asin) UNARY(acos) UNARY(atan) UNARY(tanh) UNARY(cbrt) UNARY(exp) UNARY(log) UNARY(round)
BINARY(atan2) BINARY(pow) BINARY(fmod) BINARY(hypot)
double __nv_frexp(double, int *);
double __nv_ldexp(double, int);

#define sin __nv_sin
#define cos __nv_cos
#define tan __nv_tan
#define asin __nv_asin
#define acos __nv_acos
#define atan __nv_atan
#define tanh __nv_tanh
#define cbrt __nv_cbrt
#define exp __nv_exp
#define log __nv_log
#define round __nv_round
#define atan2 __nv_atan2
#define pow __nv_pow
#define fmod __nv_fmod
#define hypot __nv_hypot
#define frexp __nv_frexp
#define ldexp __nv_ldexp
#define sqrt __builtin_sqrt
#define fabs __builtin_fabs
#define fmax __builtin_fmax
#define fmin __builtin_fmin
#define floor __builtin_floor
#define ceil __builtin_ceil
#define copysign __builtin_copysign
#define isnan __builtin_isnan
#define isfinite __builtin_isfinite
#define isinf __builtin_isinf
#define signbit __builtin_signbit
#define INFINITY __builtin_inf()
#define NAN __builtin_nan("")
#define memcpy __builtin_memcpy
#define memmove __builtin_memmove
#define memset __builtin_memset

static inline int memcmp(const void *a, const void *b, size_t n) {
  const unsigned char *p = a, *q = b;
  for (size_t i = 0; i < n; ++i)
    if (p[i] != q[i]) return p[i] < q[i] ? -1 : 1;
  return 0;
}

static inline size_t strlen(const char *s) {
  size_t n = 0;
  while (s[n]) ++n;
  return n;
}

static inline char *strncpy(char *to, const char *from, size_t n) {
  size_t i = 0;
  for (; i < n && from[i]; ++i) to[i] = from[i];
  for (; i < n; ++i) to[i] = 0;
  return to;
}
