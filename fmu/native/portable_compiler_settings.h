/* Replacement of ``base/compiler.h`` in exported sources, in plain C99. Fused multiply-add is switched off, so that results are the
 * same on all machines. */
#ifndef TR_COMPILER_H
#define TR_COMPILER_H
#if defined __clang__
#pragma STDC FP_CONTRACT OFF
#elif defined _MSC_VER
#pragma fp_contract(off)
#endif
#if defined _MSC_VER && (!defined __STDC_VERSION__ || __STDC_VERSION__ < 201112L)
#define TR_RESTRICT __restrict
#else
#define TR_RESTRICT restrict
#endif

/* Length of an array. The minimum is 16. C has no empty arrays, and a smaller minimum would give warnings. Compilers also analyse
 * code for elements that a mechanism lacks, such as ball joints. In this code, compilers would find indices beyond the end of a
 * shorter array. */
#define TR_ROOM(n) ((n) > 16 ? (n) : 16)
#define TR_LARGER(a, b) ((a) > (b) ? (a) : (b))

#define TR_LANES 1
#define TR_NOUGHT 0.0
typedef double tr_vec;
#define TR_PAD(n) (((n) + 3) & ~3)
#define TR_SIZED static
#define TR_UNROLL
#define TR_RARE
#define TR_OFTEN
#define TR_INLINE static
#define TR_APART static

#define tr_multiply_subtract(a, b, c) ((a) - (b) * (c))
#endif
