/* Contraction: ends of the part of a box in which a model can reach a level.
 * Reference in NumPy: tests/reference/numpy_engine/quadratic_models.py. */
#ifndef CONTRACTION_H
#define CONTRACTION_H

#include "quadratic.h"

#define ROOT_SLACK 1e-12
#define LEAST_SIZE 1e-140 /* tests/reference/numpy_engine/quadratic_models.py */

/* First and last t in [0, 1] with linear t + 1/2 quadratic t^2 >= need; last < first if there is none. */
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

/* Ends of the e_i for which a model can reach a level; the symmetric part of sign H is the matrix of the model. */
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

/* Moves the ends to exclude points where sign times a row cannot reach a level. */
static void reach_row(Box *x, int r, double sign, double level)
{
    int n = x->n;
    const double *A = x->gA + r * n * n;
    double middle = sign * x->c[r] + x->s[r], lost = x->is_second ? size_of_row(x, r) : fabs(x->c[r]);
    if (x->is_second)
        middle += sign > 0 ? x->q[r] : -x->p[r];
    for (int i = 0; i < n; i++) {
        int at = r * n + i;
        double p = sign > 0 ? x->gp[at] : -x->gq[at], q = sign > 0 ? x->gq[at] : -x->gp[at], across = 0.0;
        double low = 0.0, high = 0.0; /* the model's slopes are not used here */
        x->fb[i] = sign * x->gb[at], x->fw[i] = 0.0;
        if (x->is_second)
            continue;
        for (int j = 0; j < n; j++)
            across += fabs(A[i * n + j]);
        lost += finish_model(x->fb + i, x->fw + i, &low, &high, across, p, q, x->gs[at], 0.0);
    }
    reach_quadratic(x, sign, middle, x->fb, A, x->fw, 64 * ULP * lost + TINY, level, r);
}

/* Moves the ends to exclude points where a function (without tilts) or the Lagrangian cannot reach the threshold, or where
 * a condition is violated. */
static void contract(const Form *form, Box *x, double threshold, int tilted)
{
    for (int r = 0; r < x->R; r++)
        for (int side = 1; side >= -1; side -= 2)
            if (r < x->J ? side > 0 && !tilted : side < 0 || form->equation[r] == 1)
                reach_row(x, r, side, r < x->J ? threshold : 0.0);
    if (x->R > 1 || tilted)
        reach_quadratic(x, 1.0, x->q_middle, x->qb, x->H, x->qw, x->q_rounding, threshold, 0);
}

#endif
