/* The floating-point environment during a call. Hosts may trap exceptions, round in another direction, or flush subnormal numbers
 * to zero. Each function that a host calls saves the host's environment and sets the default environment. Before it returns, it
 * restores the host's environment and exception flags. The functions exist for x86-64 and 64-bit ARM; on other machines they do
 * nothing. */
#ifndef TR_ENVIRONMENT_H
#define TR_ENVIRONMENT_H
#if defined __x86_64__ || defined _M_X64
# include <xmmintrin.h>
typedef unsigned tr_environment;
#define TR_DEFAULT_ENVIRONMENT 0x1f80u /* MXCSR: all exceptions masked, no flags, round to nearest, subnormal numbers kept */
static tr_environment tr_enter(void) {
  const tr_environment host = _mm_getcsr();
  _mm_setcsr(TR_DEFAULT_ENVIRONMENT);
  return host;
}
static void tr_leave(tr_environment host) { _mm_setcsr(host); }
#elif defined __aarch64__ || defined _M_ARM64
# include <fenv.h>
typedef fenv_t tr_environment;
static tr_environment tr_enter(void) {
  tr_environment host;
  fegetenv(&host);
  fesetenv(FE_DFL_ENV);
  return host;
}
static void tr_leave(tr_environment host) { fesetenv(&host); }
#else
typedef int tr_environment;
static tr_environment tr_enter(void) { return 0; }
static void tr_leave(tr_environment host) { (void)host; }
#endif
#endif
