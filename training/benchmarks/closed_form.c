/* The torque of the two-link arm, model `constant`, by hand, as a compiler vectorises it best: what one core can do at all.
   Written anew from physics.md's sections on kinematics, drag, inertia and the rigid body; only for measuring. */

/* sin and cos for |x| < 1e5 by reduction to |r| <= pi/2: arithmetic alone, so that the loop below becomes vectors (glibc's sincos does not) */
static inline __attribute__((always_inline)) void sincos_(double x, double *s, double *c)
{
    const double big = 6755399441055744.0, k = (x * 0.3183098861837907 + big) - big, odd = k - 2 * ((0.5 * k + big) - big);
    const double r = ((x - k * 3.1415926218032836914) - k * 3.1786509424591713469e-08) - k * 1.2246467864107188502e-16, z = r * r;
    const double sign = 1 - 2 * odd * odd;
    *s = sign * (r + r * z * (-0.16666666666666666 + z * (0.008333333333333316 + z * (-0.00019841269841254966 + z * (2.7557319219160833e-06
         + z * (-2.505210761669045e-08 + z * (1.6058977292642743e-10 + z * (-7.643969663988074e-13 + z * 2.7314368769379893e-15))))))));
    *c = sign * (1 - 0.5 * z + z * z * (0.041666666666666664 + z * (-0.001388888888888888 + z * (2.4801587301579848e-05
         + z * (-2.755731922156836e-07 + z * (2.0876756602722215e-09 + z * (-1.1470712262813793e-11 + z * (4.77787760803859e-14
         + z * -1.5218598818596388e-16))))))));
}

/* k: L1 L2 | rho D C_D / 2 of both | rho pi D^2/4 C_M of both | h1 h2 | J1 J2 | m2 */
void torque(long n, const double *restrict q, const double *restrict qd, const double *restrict qdd, const double *restrict u0,
            const double *restrict du0, const double *restrict k, double *restrict tau)
{
    const double L1 = k[0], L2 = k[1], d1 = k[2], d2 = k[3], a1 = k[4], a2 = k[5], h1 = k[6], h2 = k[7], J1 = k[8], J2 = k[9], m2 = k[10];
    for (long i = 0; i < n; i++) {
        double s1, c1, s2, c2;
        sincos_(q[2 * i], &s1, &c1);
        sincos_(q[2 * i + 1], &s2, &c2);
        const double c12 = c1 * c2 - s1 * s2, s12 = s1 * c2 + c1 * s2;
        const double w1 = qd[2 * i], w2 = w1 + qd[2 * i + 1], e1 = qdd[2 * i], e2 = e1 + qdd[2 * i + 1], u = u0[i], du = du0[i];
        const double b1 = u * c1, b2 = L1 * w1 * c2 + u * c12;
        const double n1 = du * c1 - u * w1 * s1, n2 = L1 * (e1 * c2 - w1 * (w2 - w1) * s2) + du * c12 - u * w2 * s12;
        const double t1 = b1 + w1 * L1, t2 = b2 + w2 * L2;
        const double p1 = b1 * t1, p2 = b2 * t2, q1 = 1 / (b1 - t1), q2 = 1 / (b2 - t2);
        const double x1 = p1 < 0 ? L1 * b1 * q1 : 0, x2 = p2 < 0 ? L2 * b2 * q2 : 0;
        const double y1 = p1 < 0 ? t1 : b1 + t1, y2 = p2 < 0 ? t2 : b2 + t2;
        const double g1 = __builtin_copysign(d1, y1), g2 = __builtin_copysign(d2, y2);
        const double M1 = g1 * (p1 < 0 ? t1 * t1 * (L1 - x1) * (3 * L1 + x1) - b1 * b1 * x1 * x1
                                            : L1 * L1 * (b1 * b1 + 2 * b1 * t1 + 3 * t1 * t1)) / 12;
        const double M2 = g2 * (p2 < 0 ? t2 * t2 * (L2 - x2) * (3 * L2 + x2) - b2 * b2 * x2 * x2
                                            : L2 * L2 * (b2 * b2 + 2 * b2 * t2 + 3 * t2 * t2)) / 12;
        const double F2 = g2 * (p2 < 0 ? t2 * t2 * (L2 - x2) - b2 * b2 * x2 : L2 * (b2 * b2 + b2 * t2 + t2 * t2)) / 3;
        const double I1 = a1 * L1 * L1 * (e1 * L1 / 3 + n1 / 2), I2 = a2 * L2 * L2 * (e2 * L2 / 3 + n2 / 2);
        const double G2 = a2 * L2 * (e2 * L2 / 2 + n2);
        const double outer = J2 * e2 + h2 * (L1 * (e1 * c2 + w1 * w1 * s2) + du * c12) + M2 + I2;
        tau[2 * i + 1] = outer;
        tau[2 * i] = outer + (J1 + m2 * L1 * L1) * e1 + h2 * L1 * (e2 * c2 - w2 * w2 * s2) + du * (h1 + m2 * L1) * c1 + M1 + I1
                     + L1 * c2 * (F2 + G2);
    }
}
