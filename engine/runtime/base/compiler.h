/* Extensions of C11 that the runtime uses: vectors of four doubles, inlining. Exported sources get the same names in plain C
 * from ``portable.h`` (fmu/native). */
#ifndef TR_COMPILER_H
#define TR_COMPILER_H

/* Lanes of a vector; every array of a block is padded to whole vectors. */
#define TR_LANES 4
#define TR_NOUGHT {0.0}
typedef double tr_vec __attribute__((vector_size(32), aligned(8)));
#define TR_PAD(n) (((n) + 3) & ~3)

/* Compiled separately for each constant size at a call, without loops. */
#define TR_SIZED static inline __attribute__((always_inline))
#ifdef __clang__
#define TR_UNROLL _Pragma("clang loop unroll(full)")
#else
#define TR_UNROLL
#endif

/* Code of events, starts and failures is compiled for size. Inlined like the stepping loop, it would take most of the
 * compiler's time. */
#ifdef __clang__
#define TR_RARE _Pragma("clang attribute push(__attribute__((minsize, noinline)), apply_to = function)")
#define TR_OFTEN _Pragma("clang attribute pop")
#else
#define TR_RARE
#define TR_OFTEN
#endif

/* Part of the stepping loop with one caller, inlined there. Left to the compiler, steps take 1 to 2 percent longer. */
#define TR_INLINE static inline __attribute__((always_inline))

/* Never inlined, so that it does not affect the code of steps that do not call it. */
#define TR_APART static __attribute__((noinline))

/* a − b c with one rounding if the machine has it, as the compiler does in loops. In straight code the compiler would pair
 * products. */
static inline double tr_multiply_subtract(double a, double b, double c) {
#ifdef __FMA__
  return __builtin_fma(-b, c, a);
#else
  return a - b * c;
#endif
}
#endif
