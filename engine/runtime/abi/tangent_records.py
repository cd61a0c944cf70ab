"""Record for the tangents of a run: a sensitivity unit, the directions of its parameters, and work space."""

from trunnion.runtime.abi.kernel_records import STATE
from trunnion.runtime.abi.record_definition import Record

OTHERS = "const double *z, const double *a, const double *extra, double *w"
HOST = "const double *x, const double *y, const double *S, double *z, double *f, double *df"
ALONG = f"{STATE}, {OTHERS}, int count, const double *seeds, size_t next, double *out, size_t next_out"

TANGENTS = Record("tr_tangents", "Derivatives of a run by m parameters. The unit of the motion computes f = [F; R; V; …]: rates of "
                  "states and integrals, residuals of the multipliers, rates of frictional joints. Its seeds are [y, z, p, t]. "
                  "The seeds of the columns are [y with integrals, z of all rows, accelerations, p, t]. `along` writes derivatives "
                  "along `count` seeds at the point of the last `point`.", f"""
int ny : states
int n : states and integrals
int nq : coordinates
int nv : rates
int nx : external values
int nz : multipliers
int nall : multipliers of all rows and of friction
int np : parameters and external inputs
int m : number of parameters of the derivatives
int nf : values of f
int residual : first residual in f
int rates : first rate of a frictional joint in f
int nrates : number of these rates
int columns : number of columns
int turning : number of sliding pairs with several rates and a set-valued law
const int *turn : five integers for each such pair: index of its mode in x, number of components, indices of the rates in y
const int *place : (nz) index of each multiplier among those of all rows and of friction
double regular : ratio of smallest to largest pivot above which the scaled ∂R/∂z is clearly regular
double slow : speed of a turning pair at the start or end of its sliding, rad/s or m/s
const double *dp : (m × np) derivatives of parameters and inputs
const double *magnitude : (m) magnitudes of the parameters
const double *c : constants of the motion
const double *co : constants of the columns
double *w : work space of the motion
double *wo : work space of the columns
const double *extra : values that only the runtime computes
double *z : (nz) multipliers of the last evaluation
double *S : (m × n) derivatives of states and integrals
double *speeds : (nrates) largest sizes of the rates of frictional joints
double *work : tr_tangents_work doubles
void (*point)({STATE}, {OTHERS}, double *f) : values of the motion
void (*along)({ALONG}) : derivatives of the motion
void (*column_point)({STATE}, {OTHERS}, double *out) : columns
void (*column_along)({ALONG}) : derivatives of the columns
int (*host)({HOST}) : finds z, f and df (m × nf) at a state without a clear solution; 0: failed
""")
