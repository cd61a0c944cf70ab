/* Extensions of C11 that the runtime uses: vectors of four doubles, and inlining. In exported sources,
 * ``portable_compiler_settings.h`` (fmu/native) defines the same names in plain C. */
#ifndef TR_COMPILER_H
#define TR_COMPILER_H

/* Number of doubles in a SIMD vector. Every array of a block is padded to whole vectors. */
#define TR_LANES 4
#define TR_NOUGHT {0.0}
typedef double tr_vec __attribute__((vector_size(32), aligned(8)));
#define TR_PAD(n) (((n) + 3) & ~3)

/* Marks a function that is compiled separately for each constant size at its calls, with unrolled loops. */
#define TR_SIZED static inline __attribute__((always_inline))
#ifdef __clang__
#define TR_UNROLL _Pragma("clang loop unroll(full)")
#else
#define TR_UNROLL
#endif

/* Code between TR_RARE and TR_OFTEN (events, starts, failures) is compiled for size, because inlining it would take most of the
 * compile time. */
#ifdef __clang__
#define TR_RARE _Pragma("clang attribute push(__attribute__((minsize, noinline)), apply_to = function)")
#define TR_OFTEN _Pragma("clang attribute pop")
#else
#define TR_RARE
#define TR_OFTEN
#endif

/* Marks a part of the stepping loop that is inlined in its only caller. Without this attribute, steps take 1 to 2 percent
 * longer. */
#define TR_INLINE static inline __attribute__((always_inline))

/* Marks a function that is never inlined. The function then does not change the machine code of the steps that never call it. */
#define TR_APART static __attribute__((noinline))

/* a − b c. If the machine has a fused multiply-add, the result is rounded once, as in compiled loops. Without this function, the
 * compiler might fuse other products in straight-line code. */
static inline double tr_multiply_subtract(double a, double b, double c) {
#ifdef __FMA__
  return __builtin_fma(-b, c, a);
#else
  return a - b * c;
#endif
}
#endif
