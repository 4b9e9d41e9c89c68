/* The closed loop, and the plant alone, in scalar C: what the rollouts are measured against.
 *
 * The same mathematics as the project's kernel and nothing left out: plant (1), (2) with full 6x6
 * matrices and a unit quaternion, the GVC law (16) to (21) inside every stage, ode5, set-points and
 * disturbance tabulated on the stage grid, and the figures of summary.json reduced in the loop.
 * The plant alone has a lag before it and is taken by rk4, every state is kept.
 * Equations: Herman 2018. SI units, body frame forward-starboard-down, 6x6 matrices row-major.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#define LARGEST 1e100 /* beyond it a run counts as diverged */

enum { STAGES = 6, POSITION = 0, ATTITUDE = 3, NU = 7, Z = 13, S = 19, STATES = 25 };
enum { PLANT = 13 }; /* states of the plant alone */

typedef struct {
    double M[36], M_inv[36], D_linear[36], D_quadratic[36];
    double hydrostatics[4]; /* W - B in N, then W r_G - B r_B in N m */
} Model;

typedef struct {
    Model plant, known;                     /* the truth, and what the law knows of it */
    double Upsilon[36], Upsilon_inv[36];    /* unit upper triangular, (4) */
    double N[6];                            /* (9) */
    double k_D[36], k_I[36], Lambda[36], Gamma[36];
} Loop;

typedef struct {
    Model plant;
    double follow[6]; /* share of the way to the command that the lag covers per step */
    double bias[6];   /* constant wrench */
} Variant;

typedef struct {
    double nu_d[6], nu_d_dot[6], F[6];
} Input; /* at one stage */

typedef struct {
    double energy[6];       /* mean of 1/2 N xi^2, (30) */
    double error_rms[6], error_max[6], settling[6];
    double lumped_rms[6], lumped_max[6];
    double delta_xi[6], delta_pi[6];
    double effort_rms[6], effort_max[6];
    double diverged; /* first sample beyond LARGEST or not a number, s */
} Figures;

typedef struct {
    double x[STATES], tau[6], f[6];
} Sample;

/* Dormand & Prince 1980, the fifth-order formula; the second weight is zero */
static const double A[STAGES][STAGES - 1] = {
    {0},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
};
static const double B[STAGES] = {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84};

static inline void mul(const double *restrict m, const double *restrict a, double *restrict out)
{
    for (int i = 0; i < 6; i++, m += 6)
        out[i] = m[0] * a[0] + m[1] * a[1] + m[2] * a[2] + m[3] * a[3] + m[4] * a[4] + m[5] * a[5];
}

static inline void upper(const double *restrict U, const double *restrict a, double *restrict out)
{
    out[0] = a[0] + U[1] * a[1] + U[2] * a[2] + U[3] * a[3] + U[4] * a[4] + U[5] * a[5];
    out[1] = a[1] + U[8] * a[2] + U[9] * a[3] + U[10] * a[4] + U[11] * a[5];
    out[2] = a[2] + U[15] * a[3] + U[16] * a[4] + U[17] * a[5];
    out[3] = a[3] + U[22] * a[4] + U[23] * a[5];
    out[4] = a[4] + U[29] * a[5];
    out[5] = a[5];
}

static inline void upper_T(const double *restrict U, const double *restrict a, double *restrict out)
{
    out[0] = a[0];
    out[1] = U[1] * a[0] + a[1];
    out[2] = U[2] * a[0] + U[8] * a[1] + a[2];
    out[3] = U[3] * a[0] + U[9] * a[1] + U[15] * a[2] + a[3];
    out[4] = U[4] * a[0] + U[10] * a[1] + U[16] * a[2] + U[22] * a[3] + a[4];
    out[5] = U[5] * a[0] + U[11] * a[1] + U[17] * a[2] + U[23] * a[3] + U[29] * a[4] + a[5];
}

/* C(nu) x + D(nu) x + g of (1) */
static inline void terms(const Model *restrict model, const double *restrict nu,
                         const double *restrict x, const double *restrict down, double *restrict out)
{
    double m[6], drag[6], linear[6], quadratic[6];
    const double *h = model->hydrostatics;
    mul(model->M, nu, m);
    for (int i = 0; i < 6; i++)
        drag[i] = fabs(nu[i]) * x[i];
    mul(model->D_linear, x, linear);
    mul(model->D_quadratic, drag, quadratic);
    out[0] = m[2] * x[4] - m[1] * x[5] - h[0] * down[0];
    out[1] = m[0] * x[5] - m[2] * x[3] - h[0] * down[1];
    out[2] = m[1] * x[3] - m[0] * x[4] - h[0] * down[2];
    out[3] = m[2] * x[1] - m[1] * x[2] + m[5] * x[4] - m[4] * x[5] + h[3] * down[1] - h[2] * down[2];
    out[4] = m[0] * x[2] - m[2] * x[0] + m[3] * x[5] - m[5] * x[3] + h[1] * down[2] - h[3] * down[0];
    out[5] = m[1] * x[0] - m[0] * x[1] + m[4] * x[3] - m[3] * x[4] + h[2] * down[0] - h[1] * down[1];
    for (int i = 0; i < 6; i++)
        out[i] += linear[i] + quadratic[i];
}

/* Third row of R(q) */
static inline void gravity(const double *restrict q, double *restrict down)
{
    down[0] = 2 * (q[1] * q[3] - q[0] * q[2]);
    down[1] = 2 * (q[2] * q[3] + q[0] * q[1]);
    down[2] = 1 - 2 * (q[1] * q[1] + q[2] * q[2]);
}

/* tau and f of (16); the rates of the law's integrals z and S */
static inline void law(const Loop *restrict loop, const double *restrict x, const double *restrict down,
                       const Input *restrict in, double *restrict tau, double *restrict f,
                       double *restrict nu_err, double *restrict s_xi)
{
    const double *nu = x + NU;
    double Lambda_z[6], Lambda_err[6], nu_r[6], nu_r_dot[6], s[6], xi_r_dot[6];
    double k_I_z[6], k_D_s[6], Gamma_S[6], body[6], pi[6], f_xi[6];
    mul(loop->Lambda, x + Z, Lambda_z);
    for (int i = 0; i < 6; i++) {
        nu_err[i] = in->nu_d[i] - nu[i]; /* (17) */
        nu_r[i] = in->nu_d[i] + Lambda_z[i];
        s[i] = nu_r[i] - nu[i];
    }
    mul(loop->Lambda, nu_err, Lambda_err);
    for (int i = 0; i < 6; i++)
        nu_r_dot[i] = in->nu_d_dot[i] + Lambda_err[i];
    upper(loop->Upsilon_inv, s, s_xi);            /* (19) */
    upper(loop->Upsilon_inv, nu_r_dot, xi_r_dot); /* (20) */
    terms(&loop->known, nu, nu_r, down, body);
    mul(loop->k_I, x + Z, k_I_z);
    for (int i = 0; i < 6; i++)
        body[i] += k_I_z[i];
    upper_T(loop->Upsilon, body, pi); /* (10), (11), (12) */
    mul(loop->k_D, s_xi, k_D_s);
    mul(loop->Gamma, x + S, Gamma_S);
    for (int i = 0; i < 6; i++) {
        f_xi[i] = loop->N[i] * Gamma_S[i]; /* (21), integrated */
        pi[i] += loop->N[i] * (xi_r_dot[i] + k_D_s[i]) + f_xi[i];
    }
    upper_T(loop->Upsilon_inv, pi, tau); /* (14) */
    upper_T(loop->Upsilon_inv, f_xi, f);
}

/* (2), and (1) under a wrench tau - F */
static inline void motion(const Model *restrict plant, const double *restrict x, const double *restrict down,
                          const double *restrict wrench, double *restrict rate)
{
    const double *q = x + ATTITUDE, *nu = x + NU;
    const double w = q[0], a = q[1], b = q[2], c = q[3];
    double body[6], net[6];
    rate[0] = (1 - 2 * (b * b + c * c)) * nu[0] + 2 * (a * b - w * c) * nu[1] + 2 * (a * c + w * b) * nu[2];
    rate[1] = 2 * (a * b + w * c) * nu[0] + (1 - 2 * (a * a + c * c)) * nu[1] + 2 * (b * c - w * a) * nu[2];
    rate[2] = down[0] * nu[0] + down[1] * nu[1] + down[2] * nu[2];
    rate[3] = -0.5 * (a * nu[3] + b * nu[4] + c * nu[5]);
    rate[4] = 0.5 * (w * nu[3] + b * nu[5] - c * nu[4]);
    rate[5] = 0.5 * (w * nu[4] + c * nu[3] - a * nu[5]);
    rate[6] = 0.5 * (w * nu[5] + a * nu[4] - b * nu[3]);
    terms(plant, nu, nu, down, body);
    for (int i = 0; i < 6; i++)
        net[i] = wrench[i] - body[i];
    mul(plant->M_inv, net, rate + NU);
}

static inline void rates(const Loop *restrict loop, const double *restrict x, const Input *restrict in,
                         double *restrict rate, double *restrict tau, double *restrict f)
{
    double down[3], wrench[6];
    gravity(x + ATTITUDE, down);
    law(loop, x, down, in, tau, f, rate + Z, rate + S);
    for (int i = 0; i < 6; i++)
        wrench[i] = tau[i] - in->F[i];
    motion(&loop->plant, x, down, wrench, rate);
}

static inline void normalise(double *q)
{
    const double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int i = 0; i < 4; i++)
        q[i] /= norm;
}

/* Whether every number is one and of a size that a run may have */
static inline int good(const double *restrict a, int count)
{
    int all = 1;
    for (int i = 0; i < count; i++)
        all &= fabs(a[i]) < LARGEST;
    return all;
}

static inline double larger(double a, double b) { return a > b ? a : b; }

static inline void reduce(const Loop *restrict loop, const double *restrict nu, const Input *restrict in,
                          const double *restrict tau, const double *restrict f, double t, double step,
                          int late, const double *restrict band, Figures *restrict sum)
{
    double xi[6], pi[6];
    upper(loop->Upsilon_inv, nu, xi);
    upper_T(loop->Upsilon, tau, pi);
    for (int i = 0; i < 6; i++) {
        const double error = in->nu_d[i] - nu[i], lumped = f[i] - in->F[i];
        sum->energy[i] += xi[i] * xi[i];
        sum->error_rms[i] += error * error;
        sum->lumped_rms[i] += lumped * lumped;
        sum->effort_rms[i] += tau[i] * tau[i];
        sum->delta_xi[i] = larger(sum->delta_xi[i], fabs(xi[i] - nu[i]));
        sum->delta_pi[i] = larger(sum->delta_pi[i], fabs(pi[i] - tau[i]));
        sum->effort_max[i] = larger(sum->effort_max[i], fabs(tau[i]));
        if (late) {
            sum->error_max[i] = larger(sum->error_max[i], fabs(error));
            sum->lumped_max[i] = larger(sum->lumped_max[i], fabs(lumped));
        }
        if (fabs(error) > band[i])
            sum->settling[i] = t + step;
    }
}

static void finish(const Loop *loop, long last, double step, Figures *sum)
{
    const double samples = (double)(last + 1);
    for (int i = 0; i < 6; i++) {
        sum->energy[i] *= 0.5 * loop->N[i] / samples;
        sum->error_rms[i] = sqrt(sum->error_rms[i] / samples);
        sum->lumped_rms[i] = sqrt(sum->lumped_rms[i] / samples);
        sum->effort_rms[i] = sqrt(sum->effort_rms[i] / samples);
        if (sum->settling[i] > ((double)last + 0.5) * step) /* it ends outside its band */
            sum->settling[i] = NAN;
    }
}

static void record(const double *x, const double *tau, const double *f, Sample *sample)
{
    memcpy(sample->x, x, sizeof sample->x);
    memcpy(sample->tau, tau, sizeof sample->tau);
    memcpy(sample->f, f, sizeof sample->f);
}

static void rollout(const Loop *restrict loop, const double *restrict start,
                    const Input (*restrict grid)[STAGES], long last, double step, long transient,
                    const double *restrict band, Figures *restrict figures, Sample *restrict log)
{
    double x[STATES], trial[STATES], k[STAGES][STATES], tau[6], f[6], unused[2][6];
    memcpy(x, start, sizeof x);
    memset(figures, 0, sizeof *figures);
    figures->diverged = INFINITY;
    for (long n = 0; n <= last; n++) {
        rates(loop, x, &grid[n][0], k[0], tau, f);
        reduce(loop, x + NU, &grid[n][0], tau, f, n * step, step, n >= transient, band, figures);
        if (!(good(x, STATES) & good(tau, 6) & good(f, 6) & good(grid[n][0].F, 6)) && n * step < figures->diverged)
            figures->diverged = n * step;
        if (log)
            record(x, tau, f, log + n);
        if (n == last)
            break;
        for (int s = 1; s < STAGES; s++) {
            for (int i = 0; i < STATES; i++) {
                double total = x[i];
                for (int j = 0; j < s; j++)
                    total += step * A[s][j] * k[j][i];
                trial[i] = total;
            }
            rates(loop, trial, &grid[n][s], k[s], unused[0], unused[1]);
        }
        for (int i = 0; i < STATES; i++)
            x[i] += step * (B[0] * k[0][i] + B[2] * k[2][i] + B[3] * k[3][i] + B[4] * k[4][i] + B[5] * k[5][i]);
        normalise(x + ATTITUDE);
    }
    finish(loop, last, step, figures);
}

/* `count` closed loops one after the other. start (STATES,), grid (last + 1, STAGES), band (6,),
 * transient: first sample of the late maxima; figures (count,); log (last + 1,) of the last loop or
 * NULL. */
void rollouts(const Loop *loops, long count, const double *start, const Input (*grid)[STAGES], long last,
              double step, long transient, const double *band, Figures *figures, Sample *log)
{
    for (long i = 0; i < count; i++)
        rollout(loops + i, start, grid, last, step, transient, band, figures + i, log);
}

static void alone(const Variant *restrict variant, const double *restrict start,
                  const double (*restrict commands)[6], long steps, double step,
                  double (*restrict states)[PLANT])
{
    static const double NODE[4] = {0, 0.5, 0.5, 1}; /* rk4: stage s begins with the rate of s - 1 */
    double x[PLANT], trial[PLANT], k[4][PLANT], applied[6], wrench[6], down[3];
    memcpy(x, start, sizeof x);
    memcpy(applied, commands[0], sizeof applied);
    for (long n = 0; n < steps; n++) {
        for (int i = 0; i < 6; i++) {
            applied[i] += variant->follow[i] * (commands[n][i] - applied[i]);
            wrench[i] = applied[i] + variant->bias[i];
        }
        gravity(x + ATTITUDE, down);
        motion(&variant->plant, x, down, wrench, k[0]);
        for (int s = 1; s < 4; s++) {
            for (int i = 0; i < PLANT; i++)
                trial[i] = x[i] + step * NODE[s] * k[s - 1][i];
            gravity(trial + ATTITUDE, down);
            motion(&variant->plant, trial, down, wrench, k[s]);
        }
        for (int i = 0; i < PLANT; i++)
            x[i] += step / 6 * (k[0][i] + 2 * (k[1][i] + k[2][i]) + k[3][i]);
        normalise(x + ATTITUDE);
        memcpy(states[n], x, sizeof x);
    }
}

/* `count` plants under the commands of each of some segments, one after the other. start (PLANT,),
 * commands (segments, steps), held over each step; states (count, segments, steps). */
void open_loops(const Variant *variants, long count, const double *start, const double (*commands)[6],
                long segments, long steps, double step, double (*states)[PLANT])
{
    for (long i = 0; i < count; i++)
        for (long s = 0; s < segments; s++, states += steps)
            alone(variants + i, start, commands + s * steps, steps, step, states);
}
