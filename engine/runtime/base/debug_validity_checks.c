/* Failed checks of debug builds (``base/debug_validity_checks.h``). */
#include "base/base.h"

#ifdef TR_DEBUG
static struct {
  const char *function, *part;
  long count;
} tr_failures;

void tr_fail_check(const char *function, const char *part) {
  if (!tr_failures.count++) tr_failures.function = function, tr_failures.part = part;
}

/* Number of failed checks since the last call of tr_forget_checks. *function and *part receive the place and the invalid part of
 * the first failure. */
long tr_failed_check(const char **function, const char **part) {
  *function = tr_failures.function, *part = tr_failures.part;
  return tr_failures.count;
}

void tr_forget_checks(void) {
  tr_failures.function = tr_failures.part = 0, tr_failures.count = 0;
}
#endif
