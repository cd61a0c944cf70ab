/* Evaluation of the expressions that compute dependent numbers of the model from parameters of the scene. */

static double fmu_least(double a, double b) { return b < a ? b : a; }
static double fmu_most(double a, double b) { return b > a ? b : a; }

/* The value of the expression whose stack code extends from `code` to `end`. settings: values of the parameters. */
static double fmu_expression(const double *code, const double *end, const double *settings) {
  double stack[FMU_STACK], *top = stack - 1;
  while (code < end) {
    switch ((int)*code++) {
      case FMU_VALUE: *++top = *code++; break;
      case FMU_SETTING: *++top = settings[(int)*code++]; break;
      case FMU_ADD: --top, top[0] = top[0] + top[1]; break;
      case FMU_SUBTRACT: --top, top[0] = top[0] - top[1]; break;
      case FMU_MULTIPLY: --top, top[0] = top[0] * top[1]; break;
      case FMU_DIVIDE: --top, top[0] = top[0] / top[1]; break;
      case FMU_POWER: --top, top[0] = pow(top[0], top[1]); break;
      case FMU_ATAN2: --top, top[0] = atan2(top[0], top[1]); break;
      case FMU_MIN: --top, top[0] = fmu_least(top[0], top[1]); break;
      case FMU_MAX: --top, top[0] = fmu_most(top[0], top[1]); break;
      case FMU_NEGATE: *top = -*top; break;
      case FMU_SIN: *top = sin(*top); break;
      case FMU_COS: *top = cos(*top); break;
      case FMU_TAN: *top = tan(*top); break;
      case FMU_ASIN: *top = asin(*top); break;
      case FMU_ACOS: *top = acos(*top); break;
      case FMU_ATAN: *top = atan(*top); break;
      case FMU_SQRT: *top = sqrt(*top); break;
      case FMU_EXP: *top = exp(*top); break;
      case FMU_LOG: *top = log(*top); break;
      case FMU_TANH: *top = tanh(*top); break;
      case FMU_ABS: *top = fabs(*top); break;
    }
  }
  return *top;
}

/* Compute all dependent numbers of the model. */
static void fmu_follow(double *settings) {
  for (int i = 0; i < MODEL->followers; ++i)
    settings[MODEL->settings - MODEL->followers + i] =
        fmu_expression(MODEL->code + MODEL->begin[i], MODEL->code + MODEL->begin[i + 1], settings);
}
