/* Functions that a Windows library needs but the Universal C Runtime (part of Windows 10 and newer) lacks. The libraries of
 * compilers also have these functions, but must first be built from hundreds of files. */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>

/* Entry point of the library; no initialization is necessary. */
int __stdcall DllMainCRTStartup(void *library, unsigned reason, void *reserved) {
  (void)library, (void)reason, (void)reserved;
  return 1;
}

/* The compiler calls this function when the variables of a function need more than a page of the stack. The size of the variables
 * is in rax. Windows allocates the pages of a stack in order, so each page must be accessed before the next one. All registers keep
 * their values. */
#if defined __aarch64__ /* on this processor, the function is __chkstk, the size is 16 * x15, and x16 and x17 may change */
#include <fenv.h>
__asm__(
    ".globl __chkstk\n"
    "__chkstk:\n"
    "  mov x17, sp\n"
    "  sub x16, x17, x15, lsl #4\n"
    "1:\n"
    "  sub x17, x17, #4096\n"
    "  cmp x17, x16\n"
    "  b.ls 2f\n"
    "  ldr xzr, [x17]\n"
    "  b 1b\n"
    "2:\n"
    "  ldr xzr, [x16]\n"
    "  ret\n");

/* The floating-point environment: the control register FPCR and the status register FPSR. */
const fenv_t __mingw_fe_dfl_env = {0, 0};
int fegetenv(fenv_t *e) {
  unsigned long long control, status;
  __asm__ volatile("mrs %0, fpcr\n mrs %1, fpsr" : "=r"(control), "=r"(status));
  e->_Fe_ctl = (unsigned long)control, e->_Fe_stat = (unsigned long)status;
  return 0;
}
int fesetenv(const fenv_t *e) {
  __asm__ volatile("msr fpcr, %0\n msr fpsr, %1" : : "r"((unsigned long long)e->_Fe_ctl), "r"((unsigned long long)e->_Fe_stat));
  return 0;
}
#else
__asm__(
    ".globl ___chkstk_ms\n"
    "___chkstk_ms:\n"
    "  push %rcx\n"
    "  push %rax\n"
    "  lea 24(%rsp), %rcx\n"
    "1:\n"
    "  cmp $4096, %rax\n"
    "  jbe 2f\n"
    "  sub $4096, %rcx\n"
    "  testb $0, (%rcx)\n"
    "  sub $4096, %rax\n"
    "  jmp 1b\n"
    "2:\n"
    "  sub %rax, %rcx\n"
    "  testb $0, (%rcx)\n"
    "  pop %rax\n"
    "  pop %rcx\n"
    "  ret\n");
#endif

/* isnan of math.h calls this function. */
int __isnan(double x) { return x != x; }

/* The floating-point class of x, from its bits. */
int __fpclassify(double x) {
  union { double x; unsigned long long bits; } u = {x};
  unsigned long long exponent = u.bits >> 52 & 0x7ff, fraction = u.bits & 0xfffffffffffffULL;
  if (exponent == 0x7ff) return fraction ? FP_NAN : FP_INFINITE;
  if (exponent == 0) return fraction ? FP_SUBNORMAL : FP_ZERO;
  return FP_NORMAL;
}

/* The compiler would replace a sine and a cosine of the same angle by a call of sincos. The volatile pointers prevent the
 * replacement. */
static double (*const volatile sine)(double) = sin;
static double (*const volatile cosine)(double) = cos;
void sincos(double x, double *s, double *c) { *s = sine(x), *c = cosine(x); }

/* Formatted output. The system's function has an argument for options; option 2 requests the return value of the C standard. */
int __stdio_common_vsprintf(unsigned long long options, char *text, size_t size, const char *form, void *locale, va_list arguments);
int vsnprintf(char *text, size_t size, const char *form, va_list arguments) {
  return __stdio_common_vsprintf(2, text, size, form, NULL, arguments);
}
int snprintf(char *text, size_t size, const char *form, ...) {
  va_list arguments;
  va_start(arguments, form);
  int written = vsnprintf(text, size, form, arguments);
  va_end(arguments);
  return written;
}
