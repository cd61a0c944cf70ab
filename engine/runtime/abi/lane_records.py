"""Records of requests to the SIMD lanes, which step cases of a batch together."""

from trunnion.runtime.abi.record_definition import Record

REQUEST = Record("tr_request", "Request of a case to the lanes, and its results.", """
int kind : TR_ASK_…
int method : number of the explicit method
int n : doubles of a state, including integrals
int nworks : works that columns need
int ok : 1: the lanes served the request; 0: the case takes the ordinary path
int projections : corrections of positions
int solved : whether rows need multipliers and accelerations
int dense_rows : rows of the dense output
int watch : whether to update the extremes of each pair's sliding
int iterations : iterations of Newton's method
double t : time of the evaluation, or start of the step, s
double h : length of the step, s
double theta : time of a row as a fraction of the step
double length : length scale of the scene, m
double rate : rate scale of the scene, 1/s
double gap : relative residual of the loops after the projection
double independence : smallest independence of the loop rows so far
double *x : signals
double *c : constants
double *d : row scales of the loops
double *y : the state, projected in place
double *K : slopes of the stages
double *ynew : the state after the step
double *first : first error estimate
double *second : second error estimate
double *slope : derivative at the state
double *z : multipliers: start of Newton's method, then the solution
double *zstart : multipliers at the start of the step
double *zend : multipliers at the end of the step
double *arm : levers of frictions
double *smin : minima over the stages of a step, one for each pair
double *smax : maxima over the stages, one for each pair
double *N : reaction components
double *sliding : one tr_sliding for each pair
double *maps : affine maps by stage 1
double *w : values of stage 1 for stage 2
double *S : factor of S
int *perm : order of the pivots of S
double *T : S⁺Se
double *Np : loads without friction, then their derivative by η
double *law : η by the laws
double *dn : derivative of law by N
double *yold : the state at the start of the step
double *R : rows of the dense output
double *co : constants of the columns
double *extra : a tr_extra, and the state of every pair
double *row : the columns
void (*columns)(struct tr_request **r, const double *x, const double *y, const double *z, const double *a) : columns of rows
""")

LANE = Record("tr_lane", "Lane of a case.", """
tr_request request : the last request of the case
int state : TR_LANE_…
const struct tr_lanes *lanes : lanes that a case running alone fills with its output rows
void (*columns)(tr_request **r, const double *x, const double *y, const double *z, const double *a) : 0: one row at a time
""")

LANES = Record("tr_lanes", "Lanes of a kernel.", """
int abi : TR_ABI
int width : number of lanes
void (*serve)(int kind, tr_request **request) : serves `width` requests of one kind (a request may occur repeatedly)
""")
