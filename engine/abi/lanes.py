"""Records of an ensemble: cases of a batch that make their steps together, each in a lane of the vectors."""

from __future__ import annotations

from engine.abi.records import Record

REQUEST = Record("tr_request", "What a case asks of the vectors, and what came of it.", """
int kind : TR_ASK_…
int method : number of the explicit method
int n : doubles of a row of the state, integrals included
int nworks : those that columns ask for
int naudit : those that the audit looks at
int ok : it has been done; 0: this case is to do it by itself
int projections : corrections of the loops' positions
int solved : multipliers and accelerations are asked for in rows
int dense_rows : of the dense output
int watch : the nearest that pairs come to the ends of their modes is to be noted
int iterations : of Newton's method
double t : of what is evaluated, s; of a step: of its start
double h : length of the step, s
double theta : of a row, its place in the step
double length : of the scene, m
double rate : of the scene, 1/s
double gap : of the loops after the projection, relative
double independence : of the loops, the least so far
double *x : signals
double *c : constants
double *d : row scales of the loops
double *y : the state; what is brought back onto the manifold
double *K : slopes of the stages
double *ynew : the state after the step
double *first : what its first estimator says
double *second : and its second
double *slope : of what is evaluated
double *z : multipliers, in and out; where Newton's method begins
double *zstart : those at the start of the step
double *zend : and at its end
double *arm : levers of frictions
double *smin : extremes over the stages of a step, a pair each
double *smax : and the largest
double *N : reaction components
double *sliding : a tr_sliding a pair
double *maps : all that stage 1 says
double *w : and keeps
double *S : factor of the loops' equations
int *perm : and the order of its pivots
double *T : what they make of frictions
double *Np : loads without friction and by it
double *law : frictions that the laws ask for
double *dn : and their derivative
double *yold : the state at the start of the step
double *R : the rows of its dense output
double *co : constants of the columns
double *extra : a tr_extra, and the state of every pair
double *row : the columns
void (*columns)(struct tr_request **r, const double *x, const double *y, const double *z, const double *a) : all of it lanes wide
""")

LANE = Record("tr_lane", "Where a case may ask.", """
int (*ask)(struct tr_lane *lane, tr_request *request) : waits until it is done, and tells whether it is
const struct tr_lanes *lanes : which a case fills by itself with rows
void (*columns)(tr_request **r, const double *x, const double *y, const double *z, const double *a) : 0: it makes rows one by one
""")

LANES = Record("tr_lanes", "What a kernel's lanes can do.", """
int abi : TR_ABI
int width : how many cases they take at once
void (*serve)(int kind, tr_request **request) : does what is asked, `width` requests of one kind (one may stand there repeatedly)
""")
