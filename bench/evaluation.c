/* Nanoseconds of the generated functions of a case, and of one floating-point operation. comparison/evaluation.py puts
 * the prefix of the case's names in the place of ID, in capitals in the place of BIG. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "ID.h"

#define POINTS 16
#define BLOCK 200

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

/* The smallest time of one call, over blocks of calls that last a given time together. */
#define BEST(result, calls, seconds, statement)                        \
    do {                                                               \
        const double end = now() + 1e9 * (seconds);                    \
        result = HUGE_VAL;                                             \
        while (now() < end) {                                          \
            const double began = now();                                \
            for (call = 0; call < (calls); ++call) statement;          \
            result = fmin(result, (now() - began) / (double)(calls));  \
        }                                                              \
    } while (0)

int main(int count, char **words) {
    static double k[BIG_K + 1], work[BIG_WORK + 1], x[POINTS][BIG_N + 1], gradient[BIG_N + 1], hessian[BIG_N * BIG_N + 1];
    const double seconds = count > 1 ? atof(words[1]) : 0.1;
    /* Sixteen chains of a product and a sum that do not wait for each other: as many as the units of a core take. */
    volatile double off = 1e-9;
    double a[16], of_F, of_gradient, of_hessian, of_operation, F = 0.0, sum = 0.0;
    int call, i, status = 0;
    if (ID_prepare(ID_parameter_defaults, k, work)) return 1;
    for (call = 0; call < POINTS; ++call)
        for (i = 0; i < BIG_N; ++i)
            x[call][i] = ID_variable_starts[i] + 1e-2 * call * (ID_variable_upper[i] - ID_variable_lower[i]) * (i % 2 ? 1 : -1);
    BEST(of_F, BLOCK, seconds, (status |= ID_F(x[call % POINTS], k, &F, work), sum += F));
    BEST(of_gradient, BLOCK, seconds, (status |= ID_F_gradient(x[call % POINTS], k, &F, gradient, work), sum += gradient[0]));
    BEST(of_hessian, BLOCK, seconds, (status |= ID_F_hessian(x[call % POINTS], k, &F, gradient, hessian, work), sum += hessian[0]));
    for (i = 0; i < 16; ++i) a[i] = 1.0 + i;
    {
        const double by = 1.0 - off, plus = off;
#define STEP(j) a[j] = a[j] * by + plus
        BEST(of_operation, 1000, seconds,
             (STEP(0), STEP(1), STEP(2), STEP(3), STEP(4), STEP(5), STEP(6), STEP(7), STEP(8), STEP(9), STEP(10), STEP(11),
              STEP(12), STEP(13), STEP(14), STEP(15)));
    }
    for (i = 0; i < 16; ++i) sum += a[i];
    printf("%.3f %.3f %.3f %.5f\n", of_F, of_gradient, of_hessian, of_operation / 32.0);
    return sum == sum && !status ? 0 : 1;
}
