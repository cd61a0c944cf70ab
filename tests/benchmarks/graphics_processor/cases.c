/* Cases of one mechanism: thread i runs cases i, i + threads, … with its own struct of the C library. On an ordinary processor, one
 * thread runs all cases. LIBRARY is the prefix of the library, LIBRARY_HEADER its header. */
#include LIBRARY_HEADER

#define JOINED(a, b) a##_##b
#define NAMED(a, b) JOINED(a, b)
#define CALL(function) NAMED(LIBRARY, function)
enum { WARNING = 1 }; /* a run with a higher status has ended */

#ifdef __NVPTX__
#define KERNEL __attribute__((device_kernel))
static long this_thread(void) {
  return (long)__nvvm_read_ptx_sreg_ctaid_x() * __nvvm_read_ptx_sreg_ntid_x() + __nvvm_read_ptx_sreg_tid_x();
}
static long all_threads(void) { return (long)__nvvm_read_ptx_sreg_nctaid_x() * __nvvm_read_ptx_sreg_ntid_x(); }
#else
#define KERNEL
static long this_thread(void) { return 0; }
static long all_threads(void) { return 1; }
#endif

/* values: for each case, the numbers of the variables to set. out: for each case, status, reached time and the outputs that are
 * read. structs: one struct for each thread. until: end of the runs, s. */
KERNEL void cases(long count, int inputs, const int *set, const double *values, int outputs, const int *read, double *out,
                  struct LIBRARY *structs, double until) {
  struct LIBRARY *m = structs + this_thread();
  for (long i = this_thread(); i < count; i += all_threads()) {
    double *o = out + i * (outputs + 2);
    int status = CALL(init)(m);
    for (int j = 0; j < inputs && status <= WARNING; ++j) status = CALL(set)(m, set[j], values[i * inputs + j]);
    if (status <= WARNING) status = CALL(start)(m, 0.0);
    if (status <= WARNING) status = CALL(step)(m, until);
    o[0] = status, o[1] = CALL(time)(m);
    for (int j = 0; j < outputs; ++j) o[2 + j] = CALL(get)(m, read[j]);
  }
}
