/* Placeholder seam of the L-stable method (filled in below the explicit ones have landed). */
#define TR_ROS_END 8
#define TR_ROS_ORDER 4
static double tr_step_rosenbrock(tr_sim *s, double h) { (void)h; s->status = TR_NEED_JACOBIAN; return NAN; }
static int tr_dense_rosenbrock(tr_sim *s) { (void)s; return 0; }
static void tr_choose(tr_sim *s) { (void)s; }
