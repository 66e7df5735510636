/* F of the paper's Section 4.1 written by hand, as one would for a controller: joints and twist prepared, then the six
 * legs in a loop. The yardstick for the generated function; see embedding.py. */
#include <math.h>
#include <stdio.h>
#include <time.h>

#include "screwsynth_paper_4_1_helical.h"

#define LEGS 6
#define ROUNDS 15
#define CALLS 400000

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

static double since(clock_t begin) { return (double)(clock() - begin) / CLOCKS_PER_SEC / CALLS * 1e9; }

int main(void) {
    double k[SCREWSYNTH_PAPER_4_1_HELICAL_K], work[SCREWSYNTH_PAPER_4_1_HELICAL_WORK], F, off = 0.0, sum = 0.0;
    double hand = HUGE_VAL, generated = HUGE_VAL;
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
    }
    printf("F by hand %.1f ns, generated %.1f ns: %.2f times; they differ by %.1g at most\n", hand, generated,
           generated / hand, off);
    return sum == sum && off < 1e-13 ? 0 : 1;
}
