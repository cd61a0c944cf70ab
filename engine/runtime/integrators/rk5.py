"""Dormand and Prince's method of order 5(4), with Shampine's dense output of order 4 (Hairer, Nørsett, Wanner I, II.5, II.6)."""

from trunnion.runtime.integrators.runge_kutta_tableau import Tableau

A = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
)
B = (35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
C = (0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1)
E = (71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
D = (
    (
        -12715105075 / 11282082432, 0, 87487479700 / 32700410799, -10690763975 / 1880347072, 701980252875 / 199316789632,
        -1453857185 / 822651844, 69997945 / 29380423,
    ),
)

RK5 = Tableau(
    "rk5", "Dormand and Prince, order 5(4)", order=5, error_orders=(4,), dense_order=4, first_same_as_last=True,
    A=A, B=B, C=C, E=(E,), D=D,
    led=((), (0,), (0, 1), (1, 2), (0, 2, 3), (0, 2, 4)),
)  # fmt: skip
