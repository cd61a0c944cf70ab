/* The numbers of a compliant mechanism, which compiled_rates.py fills in by the names of the fields.
 * Quantities that depend on time have a row for each time; instant: the number of each state's row. */

#ifndef RATES_H
#define RATES_H

#define MOST 64 /* largest number of bodies, including the ground */

typedef struct { long n; const long *one, *two; const double *x1, *F1, *x2, *F2; } Sides;
typedef struct { long n; const double *eps, *fall, *drag, *mu, *rest; const long *viscous, *slides; double *share; } Law;

typedef struct {
    const long *instant;
    long nb, size, at_q, at_v, at_w, at_rolled, at_taken;
    double delay;
    const double *mass, *inertia, *inverse, *weight;
    Sides fits;
    const double *held, *k, *kr, *each;
    const long *loose, *crossed, *kind, *slot, *given;
    const double *sign, *ends, *radius, *half, *wide, *high, *thrust, *slides, *preload;
    Law shaft, sleeve, ball, turn, way;
    const double *torque, *back_torque, *force, *back_force;
    Sides wheels;
    const long *wheel_kind;
    const double *r1, *r2, *wheel_k, *angle, *tooth_arm;
    const long *tooth_slot;
    Law teeth;
    Sides screws;
    const double *lead, *screw_k, *screw_radius, *helix, *flank, *screw_preload;
    const long *screw_slot;
    Law thread;
    Sides free;
    const long *turns, *axis, *second, *number;
    const double *near, *spring, *rest, *damping, *slope, *effort, *kd, *wanted, *wanted_rate;
    long stops;
    const long *stop_at;
    const double *stop;
    long mimics;
    const long *mimic_at;
    const double *mimic;
    long singles;
    const long *single_at;
    const double *single_x, *single_value;
    long springs;
    const long *spring_at;
    const double *spring_x, *spring_data;
} Model;

typedef struct { double R[MOST][9], c[MOST][3], v[MOST][3], w[MOST][3], f[MOST][3], m[MOST][3], taken; long s, t; } Body; /* s, t: the numbers of its state and of its time */
typedef struct { double A[9], B[9], p[3], q[3], slide[3], turn[3]; } Pair;
typedef struct { double x[3], turn[3], slide[3], spin[3], ends, F[3], T[3]; } RelativeMotion;

#endif
