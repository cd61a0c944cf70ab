"""Numbers that several laws share."""

from trunnion.basics.number_declarations import POSITIVE, Bound, Number

OPPOSES = Bound(0.0, advice="friction opposes sliding by itself")

MU = Number("mu", "1", "coefficient of (sliding) friction", OPPOSES, "0.3", symbol="μ", varies=True, by_speed=True)
MU_STATIC = Number("mu_static", "1", "coefficient of static friction", OPPOSES, "0.4", not_below="mu", symbol="μ_s", varies=True)
VISCOSITY = Number("viscosity", "s/m", "friction coefficient per sliding speed", OPPOSES, "0.2 s/m", symbol="σ2")
V_STRIBECK = Number(
    "v_stribeck", "m/s", "sliding speed over which friction falls from mu_static to mu", POSITIVE, '"1 mm/s"', symbol="v_S"
)
V_EPS = Number("v_eps", "m/s", "sliding speed at which smoothed friction saturates", POSITIVE, '"1e-4 m/s"', default=1e-4)
