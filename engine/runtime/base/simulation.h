/* The data of a simulation.
 *
 * Each scene structure has a kernel: a constant table of sizes and functions (``tr_abi.h``, generated). A simulation is one
 * relocatable block: the struct ``tr_sim``, then its arrays at offsets. A copy of the block is a copy of the simulation. The
 * runtime allocates nothing, prints nothing and never exits.
 *
 * Terms in all comments: maps are reactions, rates and accelerations as affine functions of the multipliers
 * (``base/map_block_offsets.h``). The current state is the state whose maps were evaluated last. The solution consists of the
 * multipliers z that solve the equations of the current state in the modes in force. A pair is a friction pair; a freedom is one
 * direction in which a pair slides or turns, with one rate. ``base/debug_validity_checks.h`` lists the parts of a block that belong
 * to the current state. */
#ifndef TR_SIMULATION_H
#define TR_SIMULATION_H
#include "tr_abi.h"
#include "base/debug_validity_checks.h"

/* Whether an event kind belongs to end stops, latches and joints that only push. All other kinds belong to friction pairs. */
#define TR_IS_OF_STOP(kind) ((kind) == TR_EV_END_STOP_ENGAGED || (kind) == TR_EV_END_STOP_RELEASED || (kind) == TR_EV_LATCH || (kind) == TR_EV_UNLATCH || \
                             ((kind) >= TR_EV_CONTACT_OPENED && (kind) <= TR_EV_CONTACT_RESTS))

/* Times of the run and of its output rows. */
typedef struct tr_clock {
  double t;                /* time of the state `y`, s */
  double t_start, t_end;   /* start and end of the run, s */
  /* spacing of rows and time of the next row, s; every = 0: one row per step; every = −n: n rows per step */
  double every, row_next;
  long row_index, part;    /* number of rows written so far in the run, and in the present step (if `every` is at most 0) */
  int width;               /* doubles in a row, including time */
  int nbreaks;             /* number of breaks */
  /* times of the last break that the run has passed and of the next break, s; −INFINITY, INFINITY: none */
  double last_break, next_break;
  int status;              /* TR_OK while the run continues */
} tr_clock;

/* Level to which maps are formed for the current state. Maps are affine functions of the multipliers λ and η. RAW: as the kernel
 * writes them. OF_LOADS: also loads as functions of η, with λ eliminated. HELD: also accelerations of the sliding freedoms as
 * functions of η. OF_IMPULSES: like HELD, for an impulse step. */
enum { TR_MAPS_NONE, TR_MAPS_RAW, TR_MAPS_OF_LOADS, TR_MAPS_HELD, TR_MAPS_OF_IMPULSES };

/* The present step, and data that it leaves for the next step. */
typedef struct tr_stepping {
  double h;            /* size of the next trial step, s; 0: not yet chosen */
  double h_slip;       /* step size before a pair entered its proportional zone, s; reused when the pair leaves the zone; 0: none */
  double t0, size;     /* start and length of the last accepted step, s */
  double err_old;      /* error of the last accepted step in units of the tolerance; 0: no step yet */
  double jac_t;        /* time at which the Jacobian was evaluated, s */
  double works;        /* error of the works that columns need in the last accepted step, in units of the tolerance */
  double worked;       /* fraction of the last accepted step up to which works are integrated for rows */
  int parts;           /* whether the works of the last step are integrated in parts (``integrators/work_quadrature.c``) */
  int method;          /* number of the method in force; never that of method auto */
  int have_k1;         /* whether the first row of K is ẏ at the state `y` */
  int missed;          /* whether the last step was repeated to end at an event, but did not reach the event */
  int have_dense;      /* whether the dense output belongs to the last accepted step */
  int dense_rows;      /* number of rows of the dense output */
  int have_jac;        /* whether the Jacobian at jac_t is valid */
  double margin;       /* largest violation (tr_worst_violation) at the state `y`; NaN: unknown */
  double margin_end;   /* largest violation at the end of the last step, or at the last decision */
  int far_known;       /* whether the violations at the start of the step are stored (``events/event_outcome_margin.c``) */
  int mapped;          /* maps that exist for the current state: TR_MAPS_… */
  double mapped_t;     /* time of the current state, s; only with a kernel's recursion */
  int recursive;       /* whether the solution was found without maps; `acc` and NN then belong to the solution */
  int loads_known;     /* whether the loads that follow the multipliers in z are known (tr_stored_loads) */
  int watch;           /* whether tr_rhs calls tr_update_extremes at each stage */
  int recorded;        /* number of stages in `reserves` */
  int failure;         /* status of the last failed evaluation or projection */
  int stiff_count, nonstiff_count, kink_count; /* consecutive steps that favour a change of method (tr_choose_method) */
  const char *only;    /* marks of the pairs whose violations a search counts; null pointer: all pairs and stops */
  double *stage_z;     /* array of the host (TR_STAGES × nz) that receives the multipliers at each row of K; null pointer: none */
  double *begin_x;     /* array of the host (nx) that receives the external values at the start of the step; null pointer: none */
  double *impacts;     /* array of the host (tr_impact_length) that receives the impact at the end of the step; null pointer: none */
  double stiffness;    /* h |λ| of the last explicit trial step */
  double passed; /* largest change of a position in a curve or field over the last trial step, divided by the allowed change */
  /* rough: whether rows inside the accepted step are less accurate than its end (tr_is_limited_by_stability). judged: whether
   * `rough` is known. */
  int judged, rough;
  double moved_t;      /* time of the last progress, s (tr_is_stalled) */
  long moved;          /* number of trial steps when the run last progressed */
  int explicit_for_now; /* whether an explicit method replaces the stiff method (tr_use_explicit_for_now) */
  int phase;           /* TR_PHASE_… */
} tr_stepping;

/* A trial step. */
typedef struct tr_trial {
  double h, end;    /* size and end time of the step, s */
  int last;         /* whether the step ends at the limit */
  double err;       /* error, in units of the tolerance; NaN: the step is unusable */
  int found, which; /* result of the event search; index of the event's pair or stop */
  double theta;     /* place of the event, as a fraction of the step */
  int cuts;         /* number of times the step was repeated to end at the event */
  double whole;     /* size before the first repetition, s; 0: not repeated */
  int corners;      /* number of times the step was repeated to end at a corner */
  double most;      /* largest growth factor of the next step; 1 after a refused or repeated step */
} tr_trial;

/* Largest number of parts of an impact that a record holds. */
enum { TR_IMPACT_PARTS = 6 };

/* Phases of a step (``stepping/trial_step.c``). A case of SIMD lanes waits before STAGES and before END. */
enum { TR_PHASE_BEGIN, TR_PHASE_STAGES, TR_PHASE_END };

/* Kinds of accepted step. An accepted step waits until its rows are written; then tr_complete_step completes it. */
enum { TR_NOTHING, TR_WHOLE_STEP, TR_STEP_TO_EVENT, TR_IMPULSE_STEP };
typedef struct tr_waiting {
  int kind;      /* TR_NOTHING, … */
  int which;     /* pair or stop of the event */
  int captured;  /* whether the step ends a pair's sliding (tr_make_capture_step) */
  int cut;       /* whether the time limit of the call, not the error control, determined the step length */
  int noted;     /* whether the reversals inside the step are recorded */
  double theta;  /* end of the waiting step, as a fraction of the trial step; 1: the whole step */
  double t;      /* end of the waiting step, s */
  double h;      /* length of the trial step, s */
  double grow;   /* factor for the length of the next step */
} tr_waiting;

/* Rank of the loop equations, and distance of the loops from singular positions. */
typedef struct tr_loops {
  int rank;            /* largest rank found at accurate states */
  int rank_now;        /* rank of the factor of S */
  int sparse;          /* whether the factor of S is sparse (``constraints/loop_solve.c``) */
  int open;            /* number of open directions with reactions that friction determines (``constraints/internal_forces.c``) */
  double least_pivot;  /* smallest pivot within `rank`, at the state that determined `rank` */
  double recursive_pivot; /* root of the recursion's smallest pivot (``friction/newton_recursive.c``); 0: S is factorised */
  /* with many loops: residual that a correction hardly reduced, because the residual is round-off of points far from the origin */
  double round_off;
  int known;           /* whether `begin` is valid (`stepping/singular_step_limits.c`) */
  double begin, end;   /* independence (tr_loop_independence) at the start and at the end of the step */
  double least, trend; /* smallest independence at the stages of the step; change of independence in the last step, 1/s */
} tr_loops;

/* TR_PAST_ENDS: number of step ends with stored speeds (``events/capture_at_end_of_sliding.c``). TR_WORK_NODES: nodes of the
 * quadrature of works. TR_MIDDLE_ROW: row of K that receives the powers in the middle of a stiff step; the dense output does not
 * use this row. TR_AUDIT_SUMS: sums of the audit (energy taken, energy given). */
enum { TR_PAST_ENDS = 4, TR_WORK_NODES = 9, TR_MIDDLE_ROW = 1, TR_AUDIT_SUMS = 2 };

/* Pairs under set-valued laws. */
typedef struct tr_friction {
  int held;            /* number of pairs held at rest */
  int shared;          /* whether pairs at rest share their load as a group */
  int reserve;         /* whether large groups share their load again, with the largest possible reserve */
  int stored;          /* TR_STORES_…: whether groups of any size store loads, because the sharing rule has no solution */
  int from_anywhere;   /* whether Newton's method may use all starts, because the run would otherwise end */
  double faint;        /* N: a smaller friction is round-off of the capacities evaluated last */
  double eased;        /* fraction of friction that the equations omit (``friction/newton_restarts.c``) */
  double searched;     /* last time at which all starts were tried, s */
  int failed;          /* pair of the event whose decision failed; -1: none */
  double folded;       /* time of the last fold, s */
  int folds;           /* number of folds in close succession */
  double resumed_t;    /* time of the last failure that the run overcame, s */
  int resumed;         /* number of failures that the run overcame at that time */
  int redecide;        /* whether the last decision of contacts failed, so that a remedy of friction must repeat this decision */
  int impending_laws;  /* whether balls in stuck groups share loads by the friction that they would have in the impending motion */
  double pace;         /* highest frequency of harmonic signals and of prescribed rotations, Hz */
  long work;           /* iteration count at which the present decision about many pairs is given up; 0: unlimited */
  int undecided;       /* whether the last decision found no solution and could not prove that none exists */
  int freed;           /* pair whose friction is removed as a trial (tr_find_obstructing_pair); -1: none */
  int cutting_pair;    /* sliding pair whose change of direction has shortened steps; -1: none */
  int capture;         /* pair whose sliding ends in the next step; -1: none */
  double capture_h;    /* length of the step that ends the sliding of `capture`, s */
  int steady;          /* whether the captured pair stops in a steady direction (tr_find_steady_stop) */
  double past_t[TR_PAST_ENDS]; /* end times of the last steps, newest first, s; NaN: no such step since the last event */
} tr_friction;

/* Impulse steps, and how method auto uses them. */
typedef struct tr_moreau {
  double h;            /* length of the step whose impulses are being solved, s; otherwise 0 */
  double decides;      /* longest impulse step that may decide all modes again, s */
  int keeps;           /* whether modes stay unchanged in impulse steps, even if this violates laws */
  int frozen;          /* whether directions of fast sliding with several components are frozen over a step */
  double burst_t;      /* start of the time window in which events are counted, s */
  double first_t;      /* time at which method auto first used impulse steps, s; -1: never */
  double failed_t;     /* last time at which no step was possible, s */
  long burst_events;   /* number of events before this window */
  /* number of impulse steps since the last change of method; number of successive impulse steps without a mode change */
  int steps, calm;
} tr_moreau;

/* Which sliding pairs keep the directions of their rates in an impulse problem: none, those of one rate, or also those of several. */
enum { TR_SLIDES_NONE, TR_SLIDES_ONE_WAY, TR_SLIDES_ALL };

/* Impacts of joints that only push. solving: whether maps describe impulses alone, over the time `h`, s. slides: which sliding pairs
 * keep their direction. from: rates of all pairs from which pairs of one rate take this direction; 0: the present rates. */
typedef struct tr_impact {
  int solving, slides;
  double h;
  const double *from;
} tr_impact;

/* A joint that only pushes. In an impact: if `given` is 1, `multiplier` is the joint's multiplier; otherwise `shift` is the
 * required change of the gap's rate, divided by −h. rebound: speed after the joint's last impact, m/s; 0: none since the contact
 * closed. now: speed after the present impact if this impact is the last one of its series, m/s; otherwise INFINITY. unloaded: 1
 * while the joint is open and closed contacts keep its gap 0. */
typedef struct tr_touch {
  double given, multiplier, shift, rebound, now, unloaded;
} tr_touch;

/* Events that the host has not read yet, and the last event. */
typedef struct tr_events {
  int count, capacity; /* number of records in the buffer; size of the buffer */
  int chatter;         /* number of consecutive events at nearly the same time */
  double chatter_t;    /* time of the last event that `chatter` counts, s */
  double margin;       /* margin of the next event (``events/event_outcome_margin.c``) */
  int unsure;          /* whether `margin` is below the run's error, or whether a slow crossing makes the event's time inaccurate */
  tr_last last;
} tr_events;

/* Certificates and energy balance of the run, and the reason of its failure. */
typedef struct tr_audit {
  double contraction, complement; /* largest contraction factor and largest residual of the complement equations so far */
  double open_t;       /* time of the first decision that had several solutions, s; -1: none */
  double dead_t;       /* time at which a driven motion first passes a dead centre, s; -1: none */
  int open_pair;       /* pair of the decision at open_t */
  int fail_detail;     /* component or constraint row of the failure; -1: none */
  double fail_number;  /* smallest pivot of the loop rows, or depth of a penetration, m; -1: neither caused the failure */
  double energy0;      /* energy.residual at the start, J */
  int known;           /* whether the works of every step so far are integrated */
  double begin;        /* kinetic + potential energy − works at the start, J, plus allowed changes */
  double kinetic, potential, taken, given; /* energies and works at the last balance, J */
  double lost, jump;   /* unexplained energy at the last balance, and its largest change between two balances, J */
  double seen;         /* time of the last balance, s */
  double most, terms;  /* largest kinetic energy; largest sum of absolute energy terms, which is the scale of round-off, J */
  double power;        /* largest power of a pair's friction, W */
  double gap;          /* relative position residual of the loops after the last projection */
  /* for each law of the audit: largest violation in the present trial step, and the pair with this violation */
  double size[TR_LAWS], pair[TR_LAWS];
  tr_judgement all;    /* judgement of all accepted steps */
} tr_audit;

/* Offsets of the arrays, in doubles from the end of the struct (tr_lay_out). "Per pair" means for every friction pair. */
typedef struct tr_places {
  int p, c, co, cj; /* parameters; constants of the kernel, of the unit of columns, of the Jacobian unit */
  int x;            /* signals: moment, tables, stop flags, modes */
  int y, ynew, yold, ytmp, yout, dy; /* states at `t`, after and before the step, of a stage, of a row or probe; ẏ evaluated last */
  int event_y;      /* state at an event; also work space for the directions of open reactions */
  int K, kstep;     /* slopes (ẏ) of the stages; rows of the dense output */
  int power, work;  /* powers evaluated last; works from the start of the step to a row inside the step */
  int part_power, impulse_work; /* powers of the last part of an impulse step; impulse works before and after the step */
  int w, maps;      /* results of stage 1 of the kernel: values for stage 2; affine maps (``base/map_block_offsets.h``) */
  int dy_unforced;  /* ẏ without impulses, at the state to which impulses were last applied */
  int z, zold;      /* present multipliers; multipliers at the start of the step, for use after a refused trial */
  int zstart, zend; /* multipliers at the start and at the end of the last trial step (tr_interpolate_multipliers) */
  int zbeyond;      /* multipliers at the end of the last trial step, computed in the modes before the step's event */
  int scale;        /* unit of the error tolerance of each state */
  int d, S, perm;   /* loop equations: row scales, dense factor of S, pivot order; the pivots of `lu` follow in perm */
  int sparse, whole_S; /* sparse factor of S: inverse pivots, then the entries below them; S with its structural zeros */
  int T, Np, NN;    /* T = S⁺ Se; load maps N0' and Ne' of N = N0' + Ne' η; the loads N */
  int law, dn, sliding; /* results of the laws: η, ∂η/∂N, tr_sliding per pair */
  int lu, r;        /* Newton's method on the complement equations: matrix, residual */
  int smin, smax;   /* smallest and largest values over the stages of a step, per pair (tr_update_extremes) */
  int zone;         /* tr_zone per pair */
  int loop_error;   /* residuals of the loop positions, then of the loop rates */
  int ev, breaks, tables; /* event records; break times; tables of signals */
  int open_lambda, gram, open_kappa; /* open reactions: directions of λ, work space, scaled reactions */
  int light_S, light_Z, light_D, light_P; /* light freedoms, S = [S' C; Cᵀ D]: S', Z = S'⁻¹ C, factor of D − Cᵀ Z, its pivots */
  int openV, openQ, openN, openG; /* open directions in loops whose joints have friction: λ, spring loads Q, loads N, QᵀQ */
  int open_amounts, openY; /* amount of each open direction; derivatives of these amounts by η */
  /* equations of the amounts of open directions: matrix, pivots; Qᵀ ∂δ/∂N; ∂N/∂η with these amounts included */
  int openF, openP, openB, openE;
  int more, dmore;  /* δ, the change of contact-spring loads by friction (constraints/internal_forces.c); ∂δ/∂N, ∂δ/∂η */
  int post_memory;  /* tr_memory for each column with post-processing */
  int Q, row_kind, leaders, share; /* q̈ = Q0 + Qe η of the sliding freedoms; for each multiplier: TR_ROW_…, tr_leader, share */
  int pair_class, class_rates; /* class of coupled pairs (int per pair: 0, or 1 + multiplier of the class); rates of the class */
  int yeval, dyeval; /* the current state, and ẏ there; for the recursion (``friction/newton_recursive.c``) */
  int moves, dlaw, pivots, less, borne, acc; /* inputs and outputs of the kernel's recursion */
  int end_acc;      /* accelerations and sums of their absolute terms, from the check of the last step's end, for the audit */
  int impending_law, impending_dlaw; /* balls of groups at rest: η that the laws give in the impending motion; ∂η/∂N */
  int impending;    /* unit axis of the impending motion of each ball of a group at rest, at the offsets of the ball's rates */
  int hold, dhold;  /* tr_hold per pair; derivatives of the capacities by N */
  int past_speeds, stopping; /* speeds at the ends of the last steps; int for each pair: whether it stops with the captured pair */
  int lever, capture_tried; /* levers of the multipliers; for each pair: speed at the last failed capture, m/s */
  int speed_errors; /* speed errors of each pair, m/s: of the last trial step, then sums over all steps */
  /* violations of pairs and stops, then reserves of pairs at rest: present, at the start of the step, at the end of the step */
  int violations;
  int reserves;     /* for each recorded stage of a step: its time, s, then the reserve of each pair at rest (tr_reserve) */
  int contacts, contact_peaks; /* contacts at the last accepted state; peak force of each contact, N, decaying with time */
  int indicators, end_speed, saved_modes; /* model exchange: indicators, counts; speeds at the end of sliding; old modes */
  int touch, raw_rows; /* tr_touch of each joint that only pushes; rows of these joints as the kernel wrote them */
  /* stiff method: Jacobian, multiplier part, work space of the Jacobian unit, matrix, pivots; second Jacobian */
  int jac, jw, jp, W, wperm, choice_jac;
} tr_places;

/* Cancellation by the host. The runtime asks the host every few milliseconds of work. */
typedef int tr_asked_host(void);
typedef struct tr_asking {
  tr_asked_host *host; /* function that returns 1 to cancel; null pointer: no host */
  double work;       /* multiplications since the host was last asked */
  int cancelled;     /* whether the run is cancelled; every search then ends without a result */
} tr_asking;

/* Bounds on the statistics of a bounded step (``stepping/realtime_steps.c``). */
typedef struct tr_bounding {
  long evaluations, iterations; /* largest allowed counts; 0: no bound */
  long index;                   /* number of bounded steps since the start of the run */
  int overrun;                  /* outcome of the last bounded step: TR_OVERRUN_… */
} tr_bounding;

/* Followers without friction whose force a host watches (``events/follower_pulls.c``). The host owns the arrays. */
typedef struct tr_pulls {
  int count;
  const int *slot;     /* index of each follower's λ among the active rows */
  const double *sense; /* sign of a λ that pushes */
  double *last, *peak; /* force at the end of the last step, and largest force so far, N; positive for a push */
  double *time;        /* first instant of a pull, s; NaN: none */
} tr_pulls;

typedef struct tr_sim {
  size_t bytes; /* size of the whole block */
  const tr_kernel *k;
  const tr_outputs *o;  /* null pointer: no columns */
  const tr_jacobian *j; /* null pointer: not attached */
  int ny;               /* nq + nv + nb: doubles in the state without integrals */
  int nworks;           /* number of integrals that columns need; in the state, the audit's sums follow these integrals */
  tr_settings set;
  tr_clock clock;
  tr_stepping step;
  tr_trial trial;
  tr_waiting pending;
  tr_loops loops;
  tr_friction friction;
  tr_moreau moreau;
  tr_impact impact;
  tr_events events;
  tr_audit audit;
  tr_stats stats;
  tr_asking ask;
  tr_bounding bound;
  tr_pulls pulls;
  tr_lane *lane; /* lane that serves the requests of this simulation; null pointer: none */
#ifdef TR_DEBUG
  int valid; /* parts that belong to the current state: TR_HAS_… */
#endif
  tr_places at;
} tr_sim;

/* Bytes before the arrays. If the block is aligned to the size of a SIMD vector, each array is aligned, too. */
#define TR_HEAD ((sizeof(tr_sim) + 63) / 64 * 64)
/* An array of the block. */
#define TR_A(s, field) ((double *)((char *)(s) + TR_HEAD) + (s)->at.field)
#endif
