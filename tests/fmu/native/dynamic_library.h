/* Functions of all plain C hosts: loading a library and measuring the used memory, on Linux and Windows. On Windows, the host is
 * built without the compiler's start files. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#define OPEN(f) LoadLibraryA(f)
#define FIND(h, n) ((void *)GetProcAddress(h, n))
int main(int argc, char **argv);
int _configure_narrow_argv(int mode);
int *__p___argc(void);
char ***__p___argv(void);
void __main(void) {}
/* The entry point on Windows. It replaces the compiler's start files, which take a minute to build. */
void mainCRTStartup(void) {
  _configure_narrow_argv(1);
  exit(main(*__p___argc(), *__p___argv()));
}
static long resident(void) { return 0; }
#else
#include <dlfcn.h>
#define OPEN(f) dlopen(f, RTLD_NOW | RTLD_LOCAL)
#define FIND(h, n) dlsym(h, n)
static long resident(void) {
  long all = 0, here = 0;
  FILE *f = fopen("/proc/self/statm", "r");
  if (f && fscanf(f, "%ld %ld", &all, &here) != 2) here = 0;
  if (f) fclose(f);
  return here * 4;
}
#endif

#define NEED(condition) \
  if (!(condition)) return fputs("failed: " #condition "\n", stderr), 1
