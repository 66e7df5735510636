/* The first pass over a box, by forms of second order of its expressions alone; first_pass.py. */
#ifndef FIRSTPASS_H
#define FIRSTPASS_H

#include "examination.h"

/* Weighted sum of the forms of second order: an upper model without a remainder along single variables. */
static void combine2(Box *x)
{
    int n = x->n, R = x->R;
    double middle = 0.0, size = 0.0;
    memset(x->qb, 0, (size_t)n * sizeof(double));
    memset(x->H, 0, (size_t)n * (size_t)n * sizeof(double));
    for (int r = 0; r < R; r++) {
        double weight = x->weights[r];
        if (weight == 0)
            continue;
        middle += x->c[r] * weight + (x->s[r] * fabs(weight) + (weight > 0 ? x->q[r] : x->p[r]) * weight);
        size += x->size[r] * fabs(weight);
        for (int i = 0; i < n; i++)
            x->qb[i] += x->gb[r * n + i] * weight;
        for (int i = 0; i < n * n; i++)
            x->H[i] += x->gA[r * n * n + i] * weight;
    }
    x->q_middle = middle, x->q_rounding = 64 * ULP * size + TINY;
    for (int i = 0; i < n; i++) {
        double across = 0.0, margin = 64 * ULP * size + TINY;
        for (int j = 0; j < n; j++)
            across += fabs(x->H[i * n + j]);
        x->qw[i] = 0.0, x->qlo[i] = x->qb[i] - across - margin, x->qhi[i] = x->qb[i] + across + margin;
    }
}

enum { FIRST, DEFINED_BEFORE, UNDEFINED_BEFORE };

/* Whether the box is closed; -1 where it is not and a function may be undefined. If not, the report holds what contraction leaves, in parts of the radius, and why; and
 * scores, unless NULL, how much the Lagrangian can change along each variable. After a pass over the same box, with
 * other rows of the functions, what that has found is kept where it is tighter. */
static int judge2(const Form *form, Box *x, const double *centre, Report *report, Py_ssize_t at, double threshold,
                  double *scores, int before)
{
    int n = x->n, J = x->J, R = x->R, defined = 1, impossible = -1;
    Py_ssize_t B = report->B;
    double bound = before ? report->bound[at] : INFINITY, value = before ? report->value[at] : INFINITY;
    for (int r = 0; r < R; r++) {
        x->high[r] = x->hi[r];
        if (r < J) {
            defined = defined && x->s[r] < INFINITY;
            bound = smaller(bound, x->hi[r]);
            value = before ? value : smaller(value, x->c[r] - x->s[r]);
        } else {
            if (impossible < 0 && (x->lo[r] > 0 || (form->equation[r] == 1 && x->hi[r] < 0)))
                impossible = r;
            if (!before && !(x->c[r] + x->s[r] <= 0))
                value = -INFINITY;
        }
    }
    choose_multipliers(x, form->equation, 0, x->s, 1);
    for (int r = 0; r < R; r++)
        x->size[r] = size_of_row(x, r);
    combine2(x);
    double lagrangian = quadratic_bound(x);
    bound = lagrangian < bound ? lagrangian : bound;
    bound = defined ? bound : before ? report->bound[at] : INFINITY;
    int closed = bound <= threshold || impossible >= 0;
    report->bound[at] = bound, report->value[at] = value, report->split[at] = 0;
    report->verdict[at] = bound <= threshold ? BOUNDED : impossible >= 0 ? INFEASIBLE : OPEN;
    report->reason[at] = bound <= threshold || impossible < 0 ? 0 : impossible;
    for (int i = 0; i < n && !before; i++) {
        x->e_lo[i] = -1.0, x->e_hi[i] = 1.0;
        x->why_lo[i] = x->why_hi[i] = -2;
    }
    if (!closed && defined) {
        double *none = x->fw;
        memset(none, 0, (size_t)n * sizeof(double));
        for (int r = 0; r < R; r++)
            for (int side = 1; side >= -1; side -= 2) {
                if ((r < J && side < 0) || (r >= J && side > 0 && form->equation[r] != 1))
                    continue;
                for (int i = 0; i < n; i++)
                    x->fb[i] = side * x->gb[r * n + i];
                double middle = side * x->c[r] + x->s[r] + (side > 0 ? x->q[r] : -x->p[r]);
                reach_quadratic(x, side, middle, x->fb, x->gA + r * n * n, none, 64 * ULP * x->size[r] + TINY,
                                r < J ? threshold : 0.0, r);
            }
        if (R > 1)
            reach_quadratic(x, 1.0, x->q_middle, x->qb, x->H, none, x->q_rounding, threshold, 0);
    }
    for (int i = 0; i < n && scores && before != DEFINED_BEFORE; i++) {
        scores[i] = LINEAR * fabs(x->qb[i]);
        for (int j = 0; j < n; j++)
            scores[i] += fabs(x->H[i * n + j]);
    }
    for (int i = 0; i < n; i++) {
        Py_ssize_t end = i * B + at;
        report->centre[end] = centre[i];
        report->left_lower[end] = closed ? report->lower[end] : x->e_lo[i];
        report->left_upper[end] = closed ? report->upper[end] : x->e_hi[i];
        report->cut_lower[end] = closed ? -2 : x->why_lo[i], report->cut_upper[end] = closed ? -2 : x->why_hi[i];
    }
    return closed ? 1 : defined ? 0 : -1;
}

#endif
