/* Replacement of math.h of a bare-metal C library. Its declarations suffice to compile for a target whose C library is not
 * installed. */
#ifndef BARE_MATH_H
#define BARE_MATH_H
#define INFINITY __builtin_inff()
#define NAN __builtin_nanf("")
#define isfinite(x) __builtin_isfinite(x)
#define isnan(x) __builtin_isnan(x)
double acos(double), asin(double), atan(double), atan2(double, double), cbrt(double), ceil(double), copysign(double, double), cos(double);
double exp(double), fabs(double), floor(double), fmax(double, double), fmin(double, double), fmod(double, double), hypot(double, double);
double log(double), log2(double), nextafter(double, double), pow(double, double), round(double), sin(double), sqrt(double), tan(double);
double tanh(double), ldexp(double, int), frexp(double, int *), log10(double), rint(double), sinh(double), cosh(double), cbrt(double);
#endif
