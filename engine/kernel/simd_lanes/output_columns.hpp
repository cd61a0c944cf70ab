/* Columns of the rows of one case, one row in each lane. Data of the case are equal in all lanes. */
extern "C" void l_columns(tr_request **r, const double *x, const double *y, const double *z, const double *a) {
  V c[NCO + 1], extra[NEXTRA + 1], out[NOUT + 1];
  for (int i = 0; i < NCO; ++i) c[i] = r[0]->co[i];
  for (int i = 0; i < NEXTRA; ++i) extra[i] = r[0]->extra[i];
  o_eval((const V *)x, (const V *)y, c, (const V *)z, (const V *)a, extra, out);
  for (int l = 0; l < WIDTH; ++l)
    for (int i = 0; i < NOUT; ++i) r[l]->row[i] = out[i].v[l];
}
