/* Classical Runge-Kutta, fixed steps, LANES trajectories side by side so that the compiler can use vector registers.
   w' = A w + f - b chi(t) f(w[0]) in the reduced coordinates (w[0], w[1] = w[0]' first), one forcing harmonic.
   Arrays hold the lanes last: A (D*D, n), b (D, n), f0 (D, n), w (D, n). cosine and sine hold 2 * steps + 1 values,
   chi one value for every step. */
#include <math.h>
#ifndef D
#define D 2
#endif
#define LANES 64

typedef double lane[LANES];

static inline void slope(const lane *A, const lane *b, const lane *f0, const double *wave, double chi, const lane *w,
                         lane *k) {
    for (int l = 0; l < LANES; l++) {
        double z = w[0][l], force = chi * (z - fmin(fmax(z, -1.0), 1.0));
        k[0][l] = w[1][l];
        for (int i = 1; i < D; i++) {
            double sum = f0[i][l] - b[i][l] * force + (i == 1 ? wave[l] : 0.0);
            for (int j = i == 1 && D == 2 ? 1 : 0; j < D; j++) sum += A[i * D + j][l] * w[j][l];
            k[i][l] = sum;
        }
    }
}

void rk4(int n, int periods, int steps, const double *A_, const double *b_, const double *f0_, const double *f_cos,
         const double *f_sin, const double *omega, const double *chi, const double *cosine, const double *sine,
         double *w_) {
    for (int base = 0; base < n; base += LANES) {
        lane A[D * D], b[D], f0[D], w[D], u[D], k1[D], k2[D], k3[D], k4[D], h, wave[3];
        for (int l = 0; l < LANES; l++) {
            for (int i = 0; i < D * D; i++) A[i][l] = A_[i * n + base + l];
            for (int i = 0; i < D; i++) {
                b[i][l] = b_[i * n + base + l];
                f0[i][l] = f0_[i * n + base + l];
                w[i][l] = w_[i * n + base + l];
            }
            h[l] = 6.283185307179586 / omega[base + l] / steps;
        }
        for (int p = 0; p < periods; p++)
            for (int s = 0; s < steps; s++) {
                for (int m = 0; m < 3; m++)
                    for (int l = 0; l < LANES; l++)
                        wave[m][l] = f_cos[base + l] * cosine[2 * s + m] + f_sin[base + l] * sine[2 * s + m];
                slope(A, b, f0, wave[0], chi[s], w, k1);
                for (int i = 0; i < D; i++)
                    for (int l = 0; l < LANES; l++) u[i][l] = w[i][l] + 0.5 * h[l] * k1[i][l];
                slope(A, b, f0, wave[1], chi[s], u, k2);
                for (int i = 0; i < D; i++)
                    for (int l = 0; l < LANES; l++) u[i][l] = w[i][l] + 0.5 * h[l] * k2[i][l];
                slope(A, b, f0, wave[1], chi[s], u, k3);
                for (int i = 0; i < D; i++)
                    for (int l = 0; l < LANES; l++) u[i][l] = w[i][l] + h[l] * k3[i][l];
                slope(A, b, f0, wave[2], chi[s], u, k4);
                for (int i = 0; i < D; i++)
                    for (int l = 0; l < LANES; l++)
                        w[i][l] += h[l] / 6 * (k1[i][l] + 2 * k2[i][l] + 2 * k3[i][l] + k4[i][l]);
            }
        for (int i = 0; i < D; i++)
            for (int l = 0; l < LANES; l++) w_[i * n + base + l] = w[i][l];
    }
}
