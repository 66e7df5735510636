/* Ends of a box for which a model can reach a level; quadratic_models.py. */
#ifndef CONTRACTION_H
#define CONTRACTION_H

#include "quadratic.h"

#define ROOT_SLACK 1e-12
#define LEAST_SIZE 1e-140 /* quadratic_models.py */

/* First and last t in [0, 1] with linear t + 1/2 quadratic t^2 >= need; last < first without one. */
static void roots(double linear, double quadratic, double need, double *first, double *last)
{
    int at_start = need <= 0, at_end = linear + 0.5 * quadratic >= need;
    *first = at_start ? 0.0 : 2.0, *last = at_end ? 1.0 : -1.0;
    if (at_start && at_end)
        return;
    double square = linear * linear + 2 * quadratic * need, root = sqrt(larger(square, 0.0));
    double small = linear >= 0 ? 2 * need / (linear + root) : (root - linear) / quadratic;
    double large = linear >= 0 ? -(linear + root) / quadratic : 2 * need / (linear - root);
    int peak = quadratic < 0 && linear > 0 && linear < -quadratic && linear * linear >= -2 * quadratic * need;
    small = smaller(larger(small, 0.0), 1.0);
    if (at_start)
        *last = quadratic < 0 || linear < 0 ? smaller(larger(large, 0.0), 1.0) : 1.0;
    else if (at_end)
        *first = small;
    else if (peak)
        *first = small, *last = smaller(larger(large, 0.0), 1.0);
}

static void keep(Box *x, int i, double low, double high, int reason)
{
    if (low > x->e_lo[i])
        x->e_lo[i] = low, x->why_lo[i] = reason;
    if (high < x->e_hi[i])
        x->e_hi[i] = high, x->why_hi[i] = reason;
}

/* Ends of the e_i for which a model can reach a level; sign H is the matrix of the model, not made symmetric yet. */
static void reach_quadratic(Box *x, double sign, double middle, const double *b, const double *H, const double *w,
                            double rounding, double level, int reason)
{
    int n = x->n;
    double total = middle + rounding, crossed = 0.0;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < i; j++)
            crossed += fabs(0.5 * (H[i * n + j] + H[j * n + i]));
        x->t[i] = largest_of(fabs(b[i]) + w[i], sign * H[i * n + i]);
        total += x->t[i];
    }
    total += crossed;
    for (int i = 0; i < n; i++) {
        double diagonal = sign * H[i * n + i], linear = b[i], need = level - (total - x->t[i]);
        double size = fabs(need) + fabs(linear) + w[i] + fabs(diagonal) + fabs(total) + fabs(level);
        need = need - (ROOT_SLACK * size + TINY);
        if (!(size > LEAST_SIZE && size < 1 / LEAST_SIZE))
            continue;
        if (need <= 0 && linear + w[i] + 0.5 * diagonal >= need && -linear + w[i] + 0.5 * diagonal >= need)
            continue;
        double right_first, right_last, left_first, left_last;
        roots(linear + w[i], diagonal, need, &right_first, &right_last);
        roots(-linear + w[i], diagonal, need, &left_first, &left_last);
        keep(x, i, left_last >= left_first ? -left_last : right_first,
             right_last >= right_first ? right_last : -left_first, reason);
    }
}

static void reach_affine(Box *x, int r, double sign, double level)
{
    int n = x->n;
    const double *a = x->a + r * n;
    double rad = 0.0, most = sign > 0 ? x->q[r] : -x->p[r];
    for (int i = 0; i < n; i++)
        rad += fabs(a[i]);
    double slack = most + x->s[r] + (fabs(x->c[r]) + rad + most + fabs(level)) * (64 * ULP) + TINY;
    for (int i = 0; i < n; i++) {
        double along = sign * a[i], needed = (level - sign * x->c[r] - slack - (rad - fabs(along))) / along;
        double margin = fabs(needed) * (8 * ULP);
        keep(x, i, along > 0 && needed > -1 ? needed - margin : -1.0, along < 0 && needed < 1 ? needed + margin : 1.0, r);
    }
}

static void reach_expression(Box *x, int r, double sign, double level)
{
    int n = x->n;
    const double *A = x->gA + r * n * n;
    double lost = 0.0, more = 0.0;
    int squares = x->squares && r < x->J;
    reach_affine(x, r, sign, level);
    for (int i = 0; i < n; i++) {
        int at = r * n + i;
        double p = sign > 0 ? x->gp[at] : -x->gq[at], q = sign > 0 ? x->gq[at] : -x->gp[at], across = 0.0;
        double low = 0.0, high = 0.0; /* the model's slopes are not used here */
        for (int j = 0; j < n; j++)
            across += fabs(A[i * n + j]);
        x->fb[i] = sign * x->gb[at];
        lost += finish_model(x->fb + i, x->fw + i, &low, &high, across, p, q, x->gs[at]);
        if (squares) {
            x->fw[i] += x->sw[at], more += x->sw[at];
            for (int j = 0; j < n; j++) {
                double h = x->sH[at * n + j];
                x->fH[i * n + j] = A[i * n + j] + h, more += fabs(h);
            }
        }
    }
    double rounding = 64 * ULP * (fabs(x->c[r]) + lost) + TINY + 64 * ULP * more;
    reach_quadratic(x, sign, sign * x->c[r] + x->s[r], x->fb, squares ? x->fH : A, x->fw, rounding, level, r);
}

#endif
