/* What is asked of the compiler beyond C99: vectors of four doubles, what is inlined and what is not. Exported sources have ``portable.h``
 * (fmu/native) in its place: the same names in plain C. */
#ifndef TR_BEYOND_H
#define TR_BEYOND_H

/* Vectors; every array of the state is padded to whole ones. */
#define TR_LANES 4
#define TR_NOUGHT {0.0}
typedef double tr_vec __attribute__((vector_size(32), aligned(8)));
#define TR_PAD(n) (((n) + 3) & ~3)

/* Compiled for the size it is called with: a constant size leaves no loop. */
#define TR_SIZED static inline __attribute__((always_inline))
#ifdef __clang__
#define TR_UNROLL _Pragma("clang loop unroll(full)")
#else
#define TR_UNROLL
#endif

/* Code that runs at events, at the start or after failures, compiled for size: inlined like the stepping loop it would take most of the
 * compiler's time. */
#ifdef __clang__
#define TR_RARE _Pragma("clang attribute push(__attribute__((minsize, noinline)), apply_to = function)")
#define TR_OFTEN _Pragma("clang attribute pop")
#else
#define TR_RARE
#define TR_OFTEN
#endif

/* A part of the stepping loop that has a name for the reader only: called in one place, and compiled as if it were written out there
 * (left to the compiler, steps take 1 to 2 percent longer). */
#define TR_INLINE static inline __attribute__((always_inline))

/* Kept apart, so that steps that do not need it are compiled as if it were not there. */
#define TR_APART static __attribute__((noinline))

/* a − b c, rounded once where the machine can, as the compiler makes it in a loop: of a row of such it would pair the products. */
static inline double tr_less(double a, double b, double c) {
#ifdef __FMA__
  return __builtin_fma(-b, c, a);
#else
  return a - b * c;
#endif
}
#endif
