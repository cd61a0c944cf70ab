/* Vectors of four doubles; every array of the state is padded to whole vectors. */
#ifndef TR_VEC_H
#define TR_VEC_H
typedef double tr_vec __attribute__((vector_size(32), aligned(8)));
#define TR_PAD(n) (((n) + 3) & ~3)
#endif
