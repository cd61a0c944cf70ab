/* Copies of states, and states as bytes. The bytes are written with a checksum, which is verified when the bytes are read. */
#include <stdint.h>

#define SEAL_MARK "TRUNN-1" /* identifies this format */
#define SEAL_MIX 0x100000001b3u /* odd, so that every change of a single word changes the checksum */

/* Header of a serialized state. */
typedef struct fmu_seal {
  char mark[8];
  uint64_t sum; /* checksum of the state; the state follows the header */
} fmu_seal;

/* Checksum of all whole 8-byte words of the data. */
static uint64_t fmu_sum(const void *data, size_t bytes) {
  uint64_t sum = 0xcbf29ce484222325u, word;
  for (size_t at = 0; at + sizeof word <= bytes; at += sizeof word) {
    memcpy(&word, (const char *)data + at, sizeof word);
    sum = (sum ^ word) * SEAL_MIX;
    sum ^= sum >> 29;
  }
  return sum;
}

/* Whether a block of memory is a state of this FMU. */
static int fmu_is_state(const fmu_state *s, size_t bytes) {
  return s->bytes == bytes && !strncmp(s->guid, MODEL->guid, sizeof s->guid - 1);
}

static size_t fmu_sealed_size(const fmu_instance *m) { return sizeof(fmu_seal) + m->state->bytes; }

/* Clear the addresses in a run. */
static void fmu_forget_addresses(fmu_state *s) {
  tr_sim *sim = FMU_SIM(s);
  memset(&sim->k, 0, sizeof sim->k), memset(&sim->o, 0, sizeof sim->o), memset(&sim->j, 0, sizeof sim->j), memset(&sim->ask, 0, sizeof sim->ask);
  if (!MODEL->kernel->scene || !s->ready) return;
  memset(TR_A(sim, c), 0, sizeof(void *));
  memset(TR_A(sim, co), 0, sizeof(void *));
  memset(TR_A(sim, cj), 0, sizeof(void *));
}

/* Write a state with a checksum. The bytes do not contain addresses of this process, so that equal states give equal bytes. */
static void fmu_seal_state(const fmu_state *s, char *out) {
  fmu_seal seal = {.mark = SEAL_MARK};
  char *body = out + sizeof seal;
  memcpy(body, s, s->bytes);
  fmu_forget_addresses((fmu_state *)body);
  if (s->certified) fmu_swap((fmu_state *)body), fmu_forget_addresses((fmu_state *)body), fmu_swap((fmu_state *)body);
  seal.sum = fmu_sum(body, s->bytes);
  memcpy(out, &seal, sizeof seal);
}

static int fmu_refit(fmu_state *s) {
  return tr_refit(FMU_SIM(s), MODEL->kernel, MODEL->columns, MODEL->jacobian, MODEL->nbreaks, MODEL->ntables, MODEL->events);
}

/* Apply fmu_refit to the second run, if the model has one. Returns whether the contents of the second run are valid. */
static int fmu_refit_second(fmu_state *s) {
  if (!s->certified) return 1;
  if (!MODEL->erring || s->certified > 1 || s->certified < -1) return 0;
  fmu_swap(s);
  const int fits = fmu_refit(s);
  fmu_swap(s);
  return fits;
}

/* Set the offsets of a state. Returns whether mode, flags, times and runs of the state are valid. */
static int fmu_in_range(fmu_state *s) {
  fmu_state layout = {0};
  fmu_layout(&layout);
  s->settings = layout.settings, s->trial = layout.trial, s->inputs = layout.inputs, s->sources = layout.sources, s->row = layout.row, s->sim = layout.sim;
  s->ticks = layout.ticks, s->heard = layout.heard, s->given_up = layout.given_up;
  s->other = layout.other, s->errors = layout.errors, s->second = layout.second;
  const int flags = s->ready | s->known | s->has_stop | s->has_tolerance | s->moved | s->ticking | s->event | s->midway;
  return (flags & ~1) == 0 && s->mode >= FMU_INSTANTIATED && s->mode < FMU_MODES && (s->changed & ~FMU_NEW) == 0 && (s->deferred & ~(FMU_ROW | FMU_COSTLY)) == 0
      && isfinite(s->start) && isfinite(s->time) && isfinite(s->reached) && isfinite(s->point) && s->failed >= 0 && s->failed < TR_CASE_FAILED
      && fmu_refit(s) && fmu_refit_second(s);
}

/* Read a state into a block of the size that this FMU needs. Returns the error, or NULL. */
static const char *fmu_unseal_state(fmu_state *s, size_t room, const char *in, size_t bytes) {
  fmu_seal seal;
  if (bytes != sizeof seal + room) return "these bytes are not a state of this FMU: their number is wrong; the state must come from the same FMU";
  memcpy(&seal, in, sizeof seal);
  if (memcmp(seal.mark, SEAL_MARK, sizeof seal.mark)) return "these bytes are not a serialized state, or another version of Trunnion wrote them";
  if (seal.sum != fmu_sum(in + sizeof seal, room)) return "these bytes are a damaged state: the checksum is wrong; use an undamaged copy";
  memcpy(s, in + sizeof seal, room);
  if (!fmu_is_state(s, room)) return "these bytes are a state of another FMU, or of another export of this FMU";
  return fmu_in_range(s) ? NULL : "these bytes are not a valid state: it contains numbers that are out of range";
}

/* Copy the state of an instance to *out. If *out is NULL, memory is allocated. */
static fmu_status fmu_keep(fmu_instance *m, void **out) {
  FMU_NEED(out, "GetFMUState: the argument for the state is NULL");
  if (!*out) *out = fmu_allocate(m->state->bytes);
  FMU_NEED(*out, "out of memory");
  memcpy(*out, m->state, m->state->bytes);
  return FMU_OK;
}

/* Restore a copied state. */
static fmu_status fmu_go_back(fmu_instance *m, const void *in) {
  FMU_NEED(in && fmu_is_state(in, m->state->bytes), "SetFMUState: the argument is not a state of this FMU");
  memcpy(m->state, in, m->state->bytes);
  fmu_adopt(m->state);
  return FMU_OK;
}

static fmu_status fmu_forget(fmu_instance *m, void **in) {
  if (!in) return FMU_OK;
  fmu_free(*in);
  *in = NULL;
  return FMU_OK;
}

static fmu_status fmu_bytes_of(fmu_instance *m, const void *in, size_t *bytes) {
  FMU_NEED(in && bytes, "SerializedFMUStateSize: an argument is NULL");
  *bytes = fmu_sealed_size(m);
  return FMU_OK;
}

static fmu_status fmu_write(fmu_instance *m, const void *in, void *out, size_t bytes) {
  FMU_NEED(in && out && fmu_is_state(in, m->state->bytes), "SerializeFMUState: the first argument is not a state of this FMU, or the array is NULL");
  FMU_NEED(bytes >= fmu_sealed_size(m), "SerializeFMUState: the array has %zu bytes, but the state needs %zu", bytes, fmu_sealed_size(m));
  fmu_seal_state(in, out);
  return FMU_OK;
}

static fmu_status fmu_read(fmu_instance *m, const void *in, size_t bytes, void **out) {
  FMU_NEED(in && out, "DeserializeFMUState: an argument is NULL");
  fmu_state *s = fmu_allocate(m->state->bytes);
  FMU_NEED(s, "out of memory");
  const char *wrong = fmu_unseal_state(s, m->state->bytes, in, bytes);
  if (wrong) {
    fmu_free(s);
    return fmu_log(m, FMU_ERROR, "%s", wrong);
  }
  *out = s;
  return FMU_OK;
}
