/* mj_inverse state by state, without Python between them; only for measuring. */
#include <mujoco/mujoco.h>

void inverse(const mjModel *m, mjData *d, long n, const double *q, const double *qd, const double *qdd, double *tau)
{
    for (long i = 0; i < n; i++) {
        for (int j = 0; j < 2; j++) { d->qpos[j] = q[2 * i + j]; d->qvel[j] = qd[2 * i + j]; d->qacc[j] = qdd[2 * i + j]; }
        mj_inverse(m, d);
        for (int j = 0; j < 2; j++) tau[2 * i + j] = d->qfrc_inverse[j];
    }
}
