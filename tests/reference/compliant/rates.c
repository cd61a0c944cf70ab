/* The rates of a compliant mechanism for many states, as equations_of_motion.py defines them. Sums have the order of groups of that
 * file. */

#include <math.h>
#include <string.h>

#include "rates.h"

static void cross(const double *a, const double *b, double *o) {
    o[0] = a[1] * b[2] - a[2] * b[1], o[1] = a[2] * b[0] - a[0] * b[2], o[2] = a[0] * b[1] - a[1] * b[0];
}
static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static void times(const double *A, const double *x, double *o) {
    for (int i = 0; i < 3; i++) o[i] = A[3 * i] * x[0] + A[3 * i + 1] * x[1] + A[3 * i + 2] * x[2];
}
static void back(const double *A, const double *x, double *o) {
    for (int i = 0; i < 3; i++) o[i] = A[i] * x[0] + A[3 + i] * x[1] + A[6 + i] * x[2];
}
static void column(const double *A, long k, double *o) { o[0] = A[k], o[1] = A[3 + k], o[2] = A[6 + k]; }
static double most(double a, double b) { return a > b ? a : b; }

static double slope(const Law *l, const Body *b, long i, double speed) {
    double mu = most(l->mu[b->t * l->n + i], 0), rest = most(l->rest[b->t * l->n + i], mu);
    double held = isinf(l->fall[i]) ? !l->slides[i] : exp(-(speed / l->fall[i]) * (speed / l->fall[i]));
    l->share[b->s * l->n + i] = speed / l->eps[i];
    return (l->viscous[i] ? 0 : (mu + (rest - mu) * held) / most(speed, l->eps[i])) + l->drag[i];
}

static void pair_of(const Sides *g, long i, const Body *b, Pair *o) {
    long one = g->one[i], two = g->two[i];
    double arm1[3], arm2[3], from1[3], a[3], c[3];
    times(b->R[one], g->x1 + 3 * i, arm1);
    times(b->R[two], g->x2 + 3 * i, arm2);
    for (int k = 0; k < 3; k++) o->p[k] = b->c[one][k] + arm1[k], o->q[k] = b->c[two][k] + arm2[k];
    for (int k = 0; k < 3; k++) from1[k] = o->q[k] - b->c[one][k], o->turn[k] = b->w[two][k] - b->w[one][k];
    cross(b->w[two], arm2, a);
    cross(b->w[one], from1, c);
    for (int k = 0; k < 3; k++) o->slide[k] = b->v[two][k] + a[k] - b->v[one][k] - c[k];
    for (int r = 0; r < 3; r++)
        for (int k = 0; k < 3; k++) {
            o->A[3 * r + k] = o->B[3 * r + k] = 0;
            for (int j = 0; j < 3; j++) {
                o->A[3 * r + k] += b->R[one][3 * r + j] * g->F1[9 * i + 3 * j + k];
                o->B[3 * r + k] += b->R[two][3 * r + j] * g->F2[9 * i + 3 * j + k];
            }
        }
}

static void push(Body *b, long body, const double *at, const double *F, const double *T, double sign) {
    double arm[3], m[3];
    for (int k = 0; k < 3; k++) arm[k] = at[k] - b->c[body][k];
    cross(arm, F, m);
    for (int k = 0; k < 3; k++) b->f[body][k] += sign * F[k], b->m[body][k] += sign * (m[k] + (T ? T[k] : 0));
}

/* Contacts: forces and torques on the pin, in its frame. */

static void shaft(const Model *M, Body *b, long i, RelativeMotion *s) {
    double r = M->radius[i], way = s->slide[0] * M->slides[i], rate = s->spin[0], k = M->each[i];
    long nj = M->fits.n;
    double grip = slope(&M->shaft, b, M->slot[i], hypot(way, r * rate)), load = M->preload[b->t * nj + i];
    for (int side = -1; side < 2; side += 2) {
        double at = s->ends + side * M->half[i];
        double N1 = k * (s->x[1] + s->turn[2] * at), N2 = k * (s->x[2] - s->turn[1] * at), f = sqrt(N1 * N1 + N2 * N2 + 1e-300);
        double F1 = N1 + grip * rate * r * N2, F2 = N2 - grip * rate * r * N1;
        load += f;
        s->F[1] += F1, s->F[2] += F2;
        s->T[1] += -at * F2 - grip * r * way * N2, s->T[2] += at * F1 + grip * r * way * N1;
    }
    double axial = k * s->x[0] * (1 - M->slides[i]), torque = grip * r * rate * (r * load + M->thrust[i] * fabs(axial));
    s->F[0] += grip * way * load + axial;
    s->T[0] += torque;
    b->taken += grip * way * way * load + torque * rate;
}

static void sleeve(const Model *M, Body *b, long i, RelativeMotion *s) {
    double way = s->slide[0], k = M->each[i], load = M->preload[b->t * M->fits.n + i];
    double grip = slope(&M->sleeve, b, M->slot[i], fabs(way)) * way;
    for (int side = -1; side < 2; side += 2) {
        double at = s->ends + side * M->half[i];
        double wide = k * (s->x[1] + s->turn[2] * at), high = k * (s->x[2] - s->turn[1] * at);
        s->F[1] += wide, s->F[2] += high;
        s->T[2] += at * wide + M->wide[i] * wide * grip, s->T[1] -= at * high + M->high[i] * high * grip;
        load += fabs(wide) + fabs(high);
    }
    double arm = most(M->wide[i], M->high[i]), couple = k * arm * s->turn[0];
    s->T[0] += couple * arm;
    load += fabs(couple);
    s->F[0] += grip * load;
    b->taken += grip * way * load;
}

static void ball(const Model *M, Body *b, long i, RelativeMotion *s) {
    double r = M->radius[i], N[3], across[3], twice[3];
    for (int k = 0; k < 3; k++) N[k] = M->each[i] * s->x[k];
    double f = sqrt(dot(N, N) + 1e-300);
    cross(s->spin, N, across);
    cross(N, across, twice);
    double speed = r * sqrt(dot(across, across)) / f, grip = slope(&M->ball, b, M->slot[i], speed);
    for (int k = 0; k < 3; k++) s->F[k] += N[k] - grip * r * across[k], s->T[k] += grip * r * r / f * twice[k];
    b->taken += grip * f * speed * speed;
}

static void given(const Model *M, Body *b, long i, RelativeMotion *s) {
    long g = M->given[i], at = b->t * M->turn.n + g;
    double way = s->slide[0], rate = s->spin[0], sign = M->sign[i];
    double T = rate * sign >= 0 ? M->torque[at] : M->back_torque[at], F = way * sign >= 0 ? M->force[at] : M->back_force[at];
    double torque = slope(&M->turn, b, g, fabs(rate)) * rate * T, force = slope(&M->way, b, g, fabs(way)) * way * F;
    s->T[0] += torque, s->F[0] += force;
    b->taken += torque * rate + force * way;
}

static void fits(const Model *M, Body *b) {
    for (long i = 0; i < M->fits.n; i++) {
        Pair o;
        RelativeMotion s = {0};
        double way[3], F[3], T[3], x[3], a0[3], b0[3], b1[3], third[3], bx[3];
        pair_of(&M->fits, i, b, &o);
        for (int k = 0; k < 3; k++) way[k] = o.q[k] - o.p[k];
        back(o.A, way, x);
        back(o.A, o.slide, s.slide);
        back(o.A, o.turn, s.spin);
        column(o.A, 0, a0), column(o.B, 0, b0), column(o.B, 1, b1);
        back(o.A, b0, bx);
        double col1[3];
        back(o.A, b1, col1);
        double tilt[3] = {M->loose[i] ? col1[2] : 0, -bx[2], bx[1]};
        for (int k = 0; k < 3; k++) {
            s.turn[k] = tilt[k] + M->delay * s.spin[k];
            s.x[k] = (x[k] + M->delay * s.slide[k]) * M->held[3 * i + k];
            s.F[k] = M->k[3 * i + k] * s.x[k];
            s.T[k] = M->crossed[i] ? 0 : M->kr[3 * i + k] * s.turn[k];
        }
        s.ends = -x[0] * M->ends[i];
        double at = M->crossed[i] ? 0 : s.ends; /* position of the springs along the axis, as for contacts with friction */
        s.F[1] += M->k[3 * i + 1] * at * s.turn[2], s.F[2] -= M->k[3 * i + 2] * at * s.turn[1];
        s.T[2] += at * s.F[1], s.T[1] -= at * s.F[2];
        if (M->kind[i] == 1) shaft(M, b, i, &s);
        if (M->kind[i] == 2) sleeve(M, b, i, &s);
        if (M->kind[i] == 3) ball(M, b, i, &s);
        if (M->given[i] >= 0) given(M, b, i, &s);
        times(o.A, s.F, F);
        times(o.A, s.T, T);
        if (M->crossed[i]) {
            cross(a0, b1, third);
            double skewed = M->kr[3 * i + 2] * (-dot(a0, b1) + M->delay * dot(o.turn, third));
            for (int k = 0; k < 3; k++) T[k] += skewed * third[k];
        }
        push(b, M->fits.one[i], o.q, F, T, 1);
        push(b, M->fits.two[i], o.q, F, T, -1);
    }
}

/* Couplings. */

typedef struct { double k[3], inner[3], outer[3], t1[3], t2[3], slip[3], apart[3]; } Row;

static void unit(double *x) {
    double n = sqrt(most(dot(x, x), 1e-30));
    for (int k = 0; k < 3; k++) x[k] /= n;
}

static void wheel_row(const Model *M, long i, const Pair *o, Row *r) {
    double a[3], b[3], p[3], g[3], r1 = M->r1[i], r2 = M->r2[i];
    column(o->A, 0, a), column(o->B, 0, b);
    for (int k = 0; k < 3; k++) p[k] = o->q[k] - o->p[k];
    double along = dot(p, a);
    for (int k = 0; k < 3; k++) p[k] -= along * a[k], r->t1[k] = r->t2[k] = 0, r->slip[k] = a[k];
    if (M->wheel_kind[i] == 1) { /* a rack */
        double over = dot(p, b);
        for (int k = 0; k < 3; k++) p[k] -= over * b[k];
        unit(p);
        for (int k = 0; k < 3; k++) r->k[k] = b[k], r->apart[k] = p[k], r->inner[k] = r->outer[k] = o->p[k] + r1 * p[k];
    } else if (M->wheel_kind[i] == 2) { /* cones */
        cross(a, b, r->k);
        double sine = sqrt(most(dot(r->k, r->k), 1e-30));
        for (int k = 0; k < 3; k++) {
            r->k[k] /= sine, g[k] = (r2 * a[k] + r1 * b[k]) / sine;
            r->inner[k] = o->p[k] + g[k], r->outer[k] = o->q[k] + g[k];
        }
        unit(g);
        cross(g, r->k, r->apart);
        double sign = dot(r->apart, b) < 0 ? -1 : 1;
        for (int k = 0; k < 3; k++) r->apart[k] *= sign, r->slip[k] = g[k];
    } else { /* parallel axes */
        double p2 = most(dot(p, p), 1e-30), sign = r1 + r2 < 0 ? -1 : 1;
        cross(a, p, r->k);
        for (int k = 0; k < 3; k++) {
            r->k[k] *= (r1 + r2) / p2, r->inner[k] = o->p[k], r->outer[k] = o->p[k] + p[k];
            r->t1[k] = -r1 * a[k], r->t2[k] = -r2 * a[k], r->apart[k] = sign * p[k] / sqrt(p2);
        }
    }
}

/* The rate of the distance of two cones' apexes along k, due to the rotation of k with the axes of the cones. */
static double turning_rate(const Pair *o, const double *k, const double *w1, const double *w2) {
    double a[3], b[3], c[3], da[3], db[3], one[3], two[3], turns[3], across[3];
    column(o->A, 0, a), column(o->B, 0, b);
    cross(a, b, c), cross(w1, a, da), cross(w2, b, db), cross(da, b, one), cross(a, db, two);
    for (int j = 0; j < 3; j++) turns[j] = one[j] + two[j], across[j] = o->q[j] - o->p[j];
    return (dot(turns, across) - dot(k, turns) * dot(k, across)) / sqrt(most(dot(c, c), 1e-30));
}

static double point_rate(const Body *b, long body, const double *at, const double *k) {
    double arm[3], v[3];
    for (int j = 0; j < 3; j++) arm[j] = at[j] - b->c[body][j];
    cross(b->w[body], arm, v);
    return dot(k, b->v[body]) + dot(k, v);
}

static void wheels(const Model *M, Body *b, const double *rolled, double *rates) {
    for (long i = 0; i < M->wheels.n; i++) {
        Pair o;
        Row r;
        long one = M->wheels.one[i], two = M->wheels.two[i], slot = M->tooth_slot[i];
        pair_of(&M->wheels, i, b, &o);
        wheel_row(M, i, &o, &r);
        double rate = point_rate(b, two, r.outer, r.k) - point_rate(b, one, r.inner, r.k) + dot(r.t2, b->w[two]) + dot(r.t1, b->w[one]);
        if (M->wheel_kind[i] == 2) rate += turning_rate(&o, r.k, b->w[one], b->w[two]);
        double f = -M->wheel_k[i] * (rolled[i] + M->delay * rate), sliding = dot(o.turn, r.slip), torque = 0;
        if (slot >= 0) {
            double v = M->tooth_arm[i] * sliding;
            torque = slope(&M->teeth, b, slot, fabs(v)) * v * M->tooth_arm[i] * fabs(f) / cos(M->angle[i]);
        }
        double away = fabs(f) * tan(M->angle[i]), F2[3], F1[3], T2[3], T1[3];
        for (int k = 0; k < 3; k++) {
            F2[k] = f * r.k[k] + away * r.apart[k], F1[k] = -F2[k];
            T2[k] = f * r.t2[k] - torque * r.slip[k], T1[k] = f * r.t1[k] + torque * r.slip[k];
        }
        push(b, two, r.outer, F2, T2, 1);
        push(b, one, r.inner, F1, T1, 1);
        b->taken += torque * sliding;
        rates[i] = rate;
    }
}

static void screws(const Model *M, Body *b, const double *rolled, double *rates) {
    for (long i = 0; i < M->screws.n; i++) {
        Pair o;
        double a[3], F[3], T[3];
        pair_of(&M->screws, i, b, &o);
        column(o.A, 0, a);
        double spin = dot(o.turn, a), rate = dot(o.slide, a) - M->lead[i] * spin;
        double f = -M->screw_k[i] * (rolled[i] + M->delay * rate), force = f, torque = -M->lead[i] * f;
        if (M->screw_slot[i] >= 0) {
            long j = M->screw_slot[i];
            double c = cos(M->helix[i]), v = M->screw_radius[i] * spin / c;
            double load = fabs(f) / (cos(M->flank[i]) * c) + M->screw_preload[b->t * M->thread.n + j];
            double rub = slope(&M->thread, b, j, fabs(v)) * v * load;
            force -= rub * sin(M->helix[i]), torque -= rub * M->screw_radius[i] * c;
            b->taken += rub * v;
        }
        for (int k = 0; k < 3; k++) F[k] = force * a[k], T[k] = torque * a[k];
        push(b, M->screws.two[i], o.q, F, T, 1);
        push(b, M->screws.one[i], o.q, F, T, -1);
        rates[i] = rate;
    }
}

/* Devices and loads. */

static double coordinate(const Model *M, long i, const Pair *o, double *axis) {
    double a0[3], a1[3], a2[3], b0[3], b1[3], way[3];
    if (M->second[i]) column(o->B, 1, axis);
    else column(o->A, M->axis[i], axis);
    if (!M->number[i]) return 0;
    for (int k = 0; k < 3; k++) way[k] = o->q[k] - o->p[k];
    if (!M->turns[i]) return dot(axis, way);
    column(o->A, 0, a0), column(o->A, 1, a1), column(o->A, 2, a2), column(o->B, 0, b0), column(o->B, 1, b1);
    double c[3];
    column(o->B, 2, c);
    double q = M->second[i] ? atan2(dot(a0, c), dot(a0, b0)) : atan2(dot(a2, b1), dot(a1, b1));
    return q + 2 * M_PI * rint((M->near[i] - q) / (2 * M_PI));
}

static void devices(const Model *M, Body *b) {
    long n = M->free.n;
    double q[n + 1], qd[n + 1], e[n + 1], axis[n + 1][3], at[n + 1][3];
    for (long i = 0; i < n; i++) {
        Pair o;
        long j = b->t * n + i;
        pair_of(&M->free, i, b, &o);
        q[i] = coordinate(M, i, &o, axis[i]);
        memcpy(at[i], o.q, sizeof o.q);
        qd[i] = dot(axis[i], M->turns[i] ? o.turn : o.slide);
        e[i] = M->effort[j] - M->spring[i] * (q[i] - M->rest[i]) - (M->damping[i] + M->slope[i]) * qd[i];
        e[i] -= M->kd[i] * (q[i] - M->wanted[j] + M->delay * (qd[i] - M->wanted_rate[j]));
        b->taken += M->damping[i] * qd[i] * qd[i];
    }
    for (long j = 0; j < M->stops; j++) {
        const double *s = M->stop + 4 * j;
        long i = M->stop_at[j];
        e[i] += s[0] * s[2] * most(s[0] * (s[1] - q[i]), 0) * most(1 - s[3] * s[0] * qd[i], 0);
    }
    for (long j = 0; j < M->mimics; j++) {
        const double *s = M->mimic + 3 * j;
        long i = M->mimic_at[2 * j], k = M->mimic_at[2 * j + 1];
        double gap = q[i] - s[0] * q[k] - s[1] + M->delay * (qd[i] - s[0] * qd[k]);
        e[i] -= s[2] * gap, e[k] += s[0] * s[2] * gap;
    }
    for (long i = 0; i < n; i++) {
        double F[3] = {0}, T[3] = {0};
        for (int k = 0; k < 3; k++) (M->turns[i] ? T : F)[k] = e[i] * axis[i][k];
        push(b, M->free.two[i], at[i], F, T, 1);
        push(b, M->free.one[i], at[i], F, T, -1);
    }
}

static void loads(const Model *M, Body *b) {
    for (long i = 0; i < M->nb; i++)
        for (int k = 0; k < 3; k++) b->f[i][k] += M->weight[3 * i + k];
    for (long j = 0; j < M->singles; j++) {
        long body = M->single_at[3 * j];
        double v[3], arm[3], m[3];
        memcpy(v, M->single_value + 3 * (b->t * M->singles + j), sizeof v);
        if (M->single_at[3 * j + 2]) times(b->R[body], M->single_value + 3 * (b->t * M->singles + j), v);
        times(b->R[body], M->single_x + 3 * j, arm);
        cross(arm, v, m);
        for (int k = 0; k < 3; k++) {
            if (M->single_at[3 * j + 1]) b->m[body][k] += v[k];
            else b->f[body][k] += v[k], b->m[body][k] += m[k];
        }
    }
    for (long j = 0; j < M->springs; j++) {
        long one = M->spring_at[2 * j], two = M->spring_at[2 * j + 1];
        const double *x = M->spring_x + 6 * j, *s = M->spring_data + 3 * j;
        double a[3], c[3], p[3], q[3], along[3], F[3];
        times(b->R[one], x, a), times(b->R[two], x + 3, c);
        for (int k = 0; k < 3; k++) p[k] = b->c[one][k] + a[k], q[k] = b->c[two][k] + c[k], along[k] = q[k] - p[k];
        double length = sqrt(dot(along, along));
        unit(along);
        double rate = point_rate(b, two, q, along) - point_rate(b, one, p, along), pull = s[0] * (length - s[2]) + s[1] * rate;
        for (int k = 0; k < 3; k++) F[k] = pull * along[k];
        push(b, one, p, F, 0, 1);
        push(b, two, q, F, 0, -1);
        b->taken += s[1] * rate * rate;
    }
}

static void place(const Model *M, const double *y, Body *b) {
    memset(b, 0, sizeof *b);
    for (long i = 0; i < M->nb; i++) {
        const double *q = y + M->at_q + 4 * i;
        double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), w = q[0] / n, x = q[1] / n, v = q[2] / n, z = q[3] / n;
        double R[9] = {1 - 2 * (v * v + z * z), 2 * (x * v - w * z), 2 * (x * z + w * v), 2 * (x * v + w * z), 1 - 2 * (z * z + x * x),
                       2 * (v * z - w * x), 2 * (x * z - w * v), 2 * (v * z + w * x), 1 - 2 * (x * x + v * v)};
        memcpy(b->R[i], R, sizeof R);
        for (int k = 0; k < 3; k++) b->c[i][k] = y[3 * i + k], b->v[i][k] = y[M->at_v + 3 * i + k], b->w[i][k] = y[M->at_w + 3 * i + k];
    }
    b->R[M->nb][0] = b->R[M->nb][4] = b->R[M->nb][8] = 1;
}

static void accelerate(const Model *M, const double *y, const Body *b, double *out) {
    for (long i = 0; i < M->nb; i++) {
        const double *q = y + M->at_q + 4 * i, *w = b->w[i];
        double spin[3], L[3], gyro[3], T[3], local[3], turn[3], *dq = out + M->at_q + 4 * i;
        back(b->R[i], w, spin);
        times(M->inertia + 9 * i, spin, L);
        cross(spin, L, gyro);
        back(b->R[i], b->m[i], T);
        for (int k = 0; k < 3; k++) T[k] -= gyro[k];
        times(M->inverse + 9 * i, T, local);
        times(b->R[i], local, out + M->at_w + 3 * i);
        cross(w, q + 1, turn);
        dq[0] = -0.5 * dot(w, q + 1);
        for (int k = 0; k < 3; k++) {
            dq[1 + k] = 0.5 * (q[0] * w[k] + turn[k]);
            out[3 * i + k] = b->v[i][k];
            out[M->at_v + 3 * i + k] = b->f[i][k] / M->mass[i];
        }
    }
}

void rates(const Model *M, long count, const double *states, double *out) {
    Body b;
    for (long s = 0; s < count; s++) {
        const double *y = states + s * M->size;
        double *o = out + s * M->size;
        place(M, y, &b);
        b.s = s, b.t = M->instant[s];
        fits(M, &b);
        wheels(M, &b, y + M->at_rolled, o + M->at_rolled);
        screws(M, &b, y + M->at_rolled + M->wheels.n, o + M->at_rolled + M->wheels.n);
        devices(M, &b);
        loads(M, &b);
        accelerate(M, y, &b, o);
        o[M->at_taken] = b.taken;
    }
}
