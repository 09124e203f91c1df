"""Numbers for the sine and cosine as plain arithmetic, so that a loop over them can be vectorised without any library.

    x = k pi + r,  |r| <= pi/2,      sin x = (-1)^k (r + r^3 P(r^2)),      cos x = (-1)^k (1 - r^2/2 + r^4 Q(r^2))

pi is split into four parts with few bits (Cody and Waite), so that k times the first ones is exact up to |x| = 1e8. k is rounded by
adding and subtracting 1.5 2^52, its parity in the same way: no branch, no integer. P and Q interpolate at Chebyshev's points of
0 <= r^2 <= (pi/2)^2 (mpmath, 50 digits); the error is 2.5e-16 everywhere.
Source: Cody & Waite (1980), Software Manual for the Elementary Functions, ch. 8.
"""

from typing import Final

ROUND: Final = 6755399441055744.0  # 1.5 * 2**52
PI: Final = (3.1415926218032836914, 3.1786509424591713469e-08, 1.2246467864107188502e-16, 1.2736634327021899816e-24)
P: Final = (2.7314368769379893e-15, -7.643969663988074e-13, 1.6058977292642743e-10, -2.505210761669045e-08,
          2.7557319219160833e-06, -0.00019841269841254966, 0.008333333333333316, -0.16666666666666666)  # highest power first
Q: Final = (-1.5218598818596388e-16, 4.77787760803859e-14, -1.1470712262813793e-11, 2.0876756602722215e-09,
          -2.755731922156836e-07, 2.4801587301579848e-05, -0.001388888888888888, 0.041666666666666664)  # highest power first
