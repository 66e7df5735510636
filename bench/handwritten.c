/* F of the paper's Section 4.1 and its gradient written by hand, as one would for a controller: joints and twist
 * prepared, then the six legs in a loop. The yardstick for the generated functions; see embedding.py. */
#include <math.h>
#include <stdio.h>
#include <time.h>

#include "screwsynth_paper_4_1_helical.h"

#define LEGS 6
#define ROUNDS 15
#ifndef CALLS
#define CALLS 400000
#endif

typedef struct {
    double base[LEGS][3], platform[LEGS][3], omega[3], v[3];
} robot;

static void set_up(robot *r, const double *p) {
    const double third = 2.0943951023931953;
    int leg, i;
    for (leg = 0; leg < LEGS; ++leg) {
        double sign = leg % 2 ? 1.0 : -1.0, centre = third * (leg / 2);
        r->base[leg][0] = p[0] * cos(centre + sign * p[2]);
        r->base[leg][1] = p[0] * sin(centre + sign * p[2]);
        r->base[leg][2] = 0.0;
        r->platform[leg][0] = p[1] * cos(centre + sign * p[3]);
        r->platform[leg][1] = p[1] * sin(centre + sign * p[3]);
        r->platform[leg][2] = 0.0;
    }
    for (i = 0; i < 3; ++i) {
        r->omega[i] = p[SCREWSYNTH_PAPER_4_1_HELICAL_TWIST + i];
        r->v[i] = p[SCREWSYNTH_PAPER_4_1_HELICAL_TWIST + 3 + i];
    }
}

/* x: position, and the vector part of the unit quaternion of the rotation. */
static double by_hand(const robot *r, const double *x) {
    double q1 = x[3], q2 = x[4], q3 = x[5], q0 = sqrt(1.0 - (q1 * q1 + q2 * q2 + q3 * q3)), F = 0.0;
    double R[3][3] = {{1 - 2 * (q2 * q2 + q3 * q3), 2 * (q1 * q2 - q0 * q3), 2 * (q1 * q3 + q0 * q2)},
                      {2 * (q1 * q2 + q0 * q3), 1 - 2 * (q1 * q1 + q3 * q3), 2 * (q2 * q3 - q0 * q1)},
                      {2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), 1 - 2 * (q1 * q1 + q2 * q2)}};
    int leg, i;
    for (leg = 0; leg < LEGS; ++leg) {
        const double *b = r->base[leg], *a = r->platform[leg];
        double d[3], m[3], product = 0.0;
        for (i = 0; i < 3; ++i) d[i] = x[i] + R[i][0] * a[0] + R[i][1] * a[1] + R[i][2] * a[2] - b[i];
        m[0] = b[1] * d[2] - b[2] * d[1];
        m[1] = b[2] * d[0] - b[0] * d[2];
        m[2] = b[0] * d[1] - b[1] * d[0];
        for (i = 0; i < 3; ++i) product += m[i] * r->omega[i] + d[i] * r->v[i];
        F += product * product / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    }
    return F;
}

static void cross(const double *a, const double *b, double *c) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* With d = p + R a - b, g = v + omega x b and r = d . g: F is the sum of r^2 / d^2 and dF/dd = 2 s (g - s d), s = r / d^2. */
static double gradient_by_hand(const robot *r, const double *x, double *gradient) {
    const double *q = x + 3, q0 = sqrt(1.0 - (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]));
    double F = 0.0;
    int leg, i;
    for (i = 0; i < 6; ++i) gradient[i] = 0.0;
    for (leg = 0; leg < LEGS; ++leg) {
        const double *b = r->base[leg], *a = r->platform[leg];
        double qa[3], qqa[3], g[3], d[3], w[3], aw[3], qaw[3], wq[3], awq[3], rate = 0.0, square = 0.0, s, along = 0.0;
        cross(q, a, qa);
        cross(q, qa, qqa);
        cross(r->omega, b, g);
        for (i = 0; i < 3; ++i) {
            g[i] += r->v[i];
            d[i] = x[i] + a[i] + 2.0 * (q0 * qa[i] + qqa[i]) - b[i];
            rate += g[i] * d[i];
            square += d[i] * d[i];
        }
        s = rate / square;
        F += s * rate;
        for (i = 0; i < 3; ++i) {
            w[i] = 2.0 * s * (g[i] - s * d[i]);
            gradient[i] += w[i];
            along += qa[i] * w[i];
        }
        cross(a, w, aw);
        cross(qa, w, qaw);
        cross(w, q, wq);
        cross(a, wq, awq);
        for (i = 0; i < 3; ++i) gradient[3 + i] += 2.0 * (q0 * aw[i] + qaw[i] + awq[i] - along / q0 * q[i]);
    }
    return F;
}

static double since(clock_t begin) { return (double)(clock() - begin) / CLOCKS_PER_SEC / CALLS * 1e9; }

int main(void) {
    double k[SCREWSYNTH_PAPER_4_1_HELICAL_K], work[SCREWSYNTH_PAPER_4_1_HELICAL_WORK], F, off = 0.0, sum = 0.0;
    double hand = HUGE_VAL, generated = HUGE_VAL, hand_gradient = HUGE_VAL, gradient[6], theirs[6];
    robot r;
    int round, call, i;
    set_up(&r, screwsynth_paper_4_1_helical_parameter_defaults);
    if (screwsynth_paper_4_1_helical_prepare(screwsynth_paper_4_1_helical_parameter_defaults, k, work)) return 1;
    for (round = 0; round < ROUNDS; ++round) {
        /* Points that differ, so that nothing can be lifted out of the loop. */
        double x[16][6];
        clock_t begin;
        for (call = 0; call < 16; ++call) {
            for (i = 0; i < 3; ++i)
                x[call][i] = (i == 2 ? 35.0 : 0.0) + 10.0 * screwsynth_paper_4_1_helical_seeds[call][i];
            for (i = 3; i < 6; ++i) x[call][i] = 0.14 * screwsynth_paper_4_1_helical_seeds[call][i];
            screwsynth_paper_4_1_helical_F(x[call], k, &F, work);
            off = fmax(off, fabs(F / by_hand(&r, x[call]) - 1.0));
            screwsynth_paper_4_1_helical_F_gradient(x[call], k, &F, theirs, work);
            off = fmax(off, fabs(F / gradient_by_hand(&r, x[call], gradient) - 1.0));
            for (i = 0; i < 6; ++i) off = fmax(off, fabs(theirs[i] - gradient[i]) / (fabs(theirs[i]) + F));
        }
        begin = clock();
        for (call = 0; call < CALLS; ++call) sum += by_hand(&r, x[call % 16]);
        hand = fmin(hand, since(begin));
        begin = clock();
        for (call = 0; call < CALLS; ++call) {
            screwsynth_paper_4_1_helical_F(x[call % 16], k, &F, work);
            sum += F;
        }
        generated = fmin(generated, since(begin));
        begin = clock();
        for (call = 0; call < CALLS; ++call) {
            sum += gradient_by_hand(&r, x[call % 16], gradient);
            sum += gradient[0];
        }
        hand_gradient = fmin(hand_gradient, since(begin));
    }
    printf("F by hand %.1f ns, generated %.1f ns: %.2f times; they differ by %.1g at most\n", hand, generated,
           generated / hand, off);
    printf("F and its gradient by hand %.1f ns\n", hand_gradient);
    return sum == sum && off < 1e-13 ? 0 : 1;
}
