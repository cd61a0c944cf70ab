/* Parts of a block that belong to the current state: the state whose maps were evaluated last. In debug builds (-DTR_DEBUG),
 * TR_MADE marks parts as valid and TR_SPOILT marks parts as invalid. TR_NEED reports a required part that is invalid.
 * tr_failed_check (``base/debug_validity_checks.c``) returns the first failure. In other builds the macros do nothing. */
#ifndef TR_VALIDITY_H
#define TR_VALIDITY_H

enum {
  TR_HAS_MAPS = 1,       /* rates of the pairs, and the kernel's maps if `step.mapped` is not TR_MAPS_NONE */
  TR_HAS_FACTOR = 2,     /* factor of S, in the order `perm` */
  TR_HAS_LOADS = 4,      /* load maps, with λ eliminated: Np, T */
  TR_HAS_HELD = 8,       /* held maps: accelerations of the sliding freedoms by η, with λ eliminated: Q */
  TR_HAS_ROWS = 16,      /* kind of equation of each multiplier in the modes in force: row_kind, share */
  TR_HAS_LAW = 32,       /* values of the laws at the loads NN: law, dn, sliding */
  TR_HAS_SOLUTION = 64,  /* multipliers z that solve the equations in the modes in force */
  TR_HAS_CAPACITY = 128, /* capacity of each pair: hold */
  TR_HAS_DENSE = 256,    /* dense output of the last trial step: kstep */
  TR_HAS_JACOBIAN = 512, /* derivative of ẏ: jac */
  TR_LASTING = TR_HAS_ROWS | TR_HAS_SOLUTION | TR_HAS_DENSE | TR_HAS_JACOBIAN /* parts that stay valid in another state */
};

#ifdef TR_DEBUG
void tr_fail_check(const char *function, const char *part);
#define TR_MADE(s, parts) ((s)->valid |= (parts))
#define TR_SPOILT(s, parts) ((s)->valid &= ~(parts))
#define TR_NEW_STATE(s) ((s)->valid = ((s)->valid & TR_LASTING) | TR_HAS_MAPS)
#define TR_NEED(s, parts) ((~(s)->valid & (parts)) ? tr_fail_check(__func__, #parts) : (void)0)
#else
#define TR_MADE(s, parts) ((void)0)
#define TR_SPOILT(s, parts) ((void)0)
#define TR_NEW_STATE(s) ((void)0)
#define TR_NEED(s, parts) ((void)0)
#endif
#endif
