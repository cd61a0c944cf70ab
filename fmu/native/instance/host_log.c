/* Messages to the host. Each message has a category: a status, an event, or the progress of the run. */

/* The categories: all messages, one category for each status, events, and progress. */
enum { FMU_SAYS_ALL, FMU_SAYS_EVENTS = 5, FMU_SAYS_PROGRESS, FMU_CATEGORIES };
static const char *const fmu_category[FMU_CATEGORIES] = {"logAll", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal",
                                                         "logEvents", "logProgress"};
#define FMU_EVERYTHING ((1 << FMU_CATEGORIES) - 1)

/* Whether the host selected a category. */
static int fmu_wants(const fmu_instance *m, int category) { return m->host.say && m->logging & (1 << category | 1 << FMU_SAYS_ALL); }

#if defined FMU_ALONE /* a plain library logs nothing */
static void fmu_say(const fmu_instance *m, fmu_status status, int category, const char *form, va_list a) {
  (void)m, (void)status, (void)category, (void)form, (void)a;
}
#else
#include <stdio.h>
/* Send a message of a category. Warnings and errors are sent even when logging is off. */
static void fmu_say(const fmu_instance *m, fmu_status status, int category, const char *form, va_list a) {
  char text[2048];
  if (!m->host.say || (status == FMU_OK && !fmu_wants(m, category))) return;
  vsnprintf(text, sizeof text, form, a);
  m->host.say(&m->host, m->name, status, fmu_category[category], text);
}
#endif

/* Send a message to the host and return the status. */
static fmu_status fmu_log(const fmu_instance *m, fmu_status status, const char *form, ...) {
  va_list a;
  va_start(a, form);
  fmu_say(m, status, (int)status, form, a);
  va_end(a);
  return status;
}

/* Send a message of a category, if the host selected this category. */
static void fmu_tell(const fmu_instance *m, int category, const char *form, ...) {
  va_list a;
  va_start(a, form);
  fmu_say(m, FMU_OK, category, form, a);
  va_end(a);
}

/* Switch the n named categories on or off; if n = 0, switch all categories. Returns whether all names exist. */
static int fmu_choose_log(fmu_instance *m, int on, size_t n, const char *const *name) {
  int chosen = n ? 0 : FMU_EVERYTHING, known = 1;
  for (size_t i = 0; i < n; ++i) {
    int c = 0;
    while (c < FMU_CATEGORIES && strcmp(fmu_category[c], name[i])) ++c;
    if (c < FMU_CATEGORIES) chosen |= 1 << c;
    known = known && c < FMU_CATEGORIES;
  }
  m->logging = on ? m->logging | chosen : m->logging & ~chosen;
  return known;
}

/* Log the events since the last call with their times. Tick the clocks of these events that no look-ahead has ticked. */
static void fmu_tell_events(const fmu_instance *m) {
  tr_sim *sim = FMU_SIM(m->state);
  const tr_event *e = (const tr_event *)tr_array(sim, TR_ARRAY_EVENTS);
  const int n = tr_events_take(sim);
  for (int i = 0; MODEL->clocks && i < n; ++i)
    if (!fmu_is_heard(m->state, e + i)) fmu_tick_now(m->state, e + i);
  if (!fmu_wants(m, FMU_SAYS_EVENTS)) return;
  for (int i = 0; i < n; ++i) {
    const int kind = (int)e[i].kind, of_stop = TR_IS_OF_STOP(kind);
    const char *joint = MODEL->joint_of[(of_stop ? MODEL->kernel->nsliders : 0) + (int)e[i].index];
    fmu_tell(m, FMU_SAYS_EVENTS, "event at t = %.12g s: %s in joint %s", e[i].time, MODEL->event[kind], joint);
  }
}

/* Log the progress at each tenth of the time between start and stop time. */
static void fmu_tell_progress(const fmu_instance *m) {
  fmu_state *s = m->state;
  const tr_stats *c = &FMU_SIM(s)->stats;
  const int tenth = s->has_stop ? (int)(10.0 * (s->time - s->start) / (s->stop - s->start) + SAME_POINT) : 0;
  if (tenth <= s->tenths) return;
  s->tenths = tenth;
  fmu_tell(m, FMU_SAYS_PROGRESS, "t = %.9g s, %d of 100: %ld steps, %ld rejected, %ld events", s->time, 10 * tenth, c->steps, c->rejected, c->events);
}
