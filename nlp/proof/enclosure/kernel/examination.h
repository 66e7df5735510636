/* The examination of one box.
 * Reference in NumPy: tests/reference/numpy_engine/bounding.py and tests/reference/numpy_engine/limb_models.py. */
#ifndef EXAMINATION_H
#define EXAMINATION_H

#include <Python.h>
#include "contraction.h"

#define WORTH 0.1
#define LINEAR 0.3

enum { OPEN, BOUNDED, INFEASIBLE, MONOTONE, EMPTIED };

/* Arrays of results for B boxes, as in nlp/proof/boxes/engine.py; the ends and reasons of variable i begin at i * B. */
typedef struct {
    Py_ssize_t B;
    const double *lower, *upper;
    int *verdict, *reason, *split, *cut_lower, *cut_upper;
    double *bound, *value, *left_lower, *left_upper, *centre;
    int shared;     /* number of variables that other limbs share, the first ones */
    double *models; /* models of the Lagrangian and of the function's gradient: write_model; NULL without them */
    const double *least; /* (B) value below which points are irrelevant; NULL if all points are relevant */
    const double *tilts; /* tilts of the limbs, for the common part: add_tilts; NULL without them */
} Report;

static Py_ssize_t rows_of_models(int n, int shared) { return 3 + 4 * n + n * n + 4 * shared; }

/* Writes row after row of a box's model: nlp/proof/boxes/engine.py reads them. */
static void write_model(const Form *form, const Box *x, Report *report, Py_ssize_t at, int defined)
{
    int n = x->n, J = x->J, R = x->R;
    double *to = report->models + at;
    const double *vectors[] = {x->qb, x->qw, x->qlo, x->qhi};
    Py_ssize_t B = report->B;
    int holds = 1; /* whether every condition is satisfied on the whole box */
    for (int r = J; r < R; r++)
        holds = holds && form->equation[r] != 1 && x->hi[r] < 0;
    *to = defined + 2 * holds, *(to += B) = x->q_middle, *(to += B) = x->q_rounding;
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < n; i++)
            *(to += B) = vectors[k][i];
    for (int i = 0; i < n * n; i++)
        *(to += B) = x->H[i];
    for (int i = 0; i < report->shared; i++) {
        double low = INFINITY, high = -INFINITY;
        int up = 0, down = 0;
        for (int r = 0; r < R; r++) {
            double least = x->grad_lo[r * n + i], most = x->grad_hi[r * n + i];
            if (r < J)
                low = smaller(low, least), high = larger(high, most);
            else if (form->depends[r * n + i] && !(x->hi[r] < 0))
                up |= form->equation[r] == 1 || !(most < 0), down |= form->equation[r] == 1 || !(least > 0);
        }
        *(to += B) = low, *(to += B) = high, *(to += B) = up, *(to += B) = down;
    }
}

/* Adds best + g e + 1/2 e'Q e, the sum of the limbs' tilts, to the form of the function. The rows of tilts are: best, the
 * sum of the absolute values of its terms, the rounding error of each sum in g and Q, then g and Q. */
static void add_tilts(Box *x, const Report *report, Py_ssize_t at)
{
    Py_ssize_t n = x->n, B = report->B;
    const double *best = report->tilts + at, *g = best + 3 * B, *Q = g + n * B;
    x->s[0] += 64 * ULP * (fabs(x->c[0]) + best[B]), x->c[0] += *best;
    for (int i = 0; i < n; i++, g += B) {
        double across = 0.0, sizes = fabs(x->gb[i]) + fabs(*g);
        for (int j = 0; j < n; j++, Q += B) {
            across += fabs(*Q), sizes += fabs(x->gA[i * n + j]) + fabs(*Q);
            x->gA[i * n + j] += *Q;
        }
        double margin = 64 * ULP * sizes + best[2 * B] + TINY;
        x->gb[i] += *g, x->gs[i] += margin;
        x->slope_lo[i] += *g - across - (margin + 64 * ULP * fabs(x->slope_lo[i]));
        x->slope_hi[i] += *g + across + (margin + 64 * ULP * fabs(x->slope_hi[i]));
    }
}

/* Result for a box from the ranges of its expressions and from an earlier pass. */
typedef struct {
    int defined, impossible; /* whether every function is defined; index of a violated condition, or -1 */
    double bound, value;
} Look;

static Look look_at(const Form *form, const Box *x, const Report *report, Py_ssize_t at, int passed)
{
    Look found = {1, -1, passed ? report->bound[at] : INFINITY, passed ? report->value[at] : INFINITY};
    for (int r = 0; r < x->R; r++)
        if (r < x->J) {
            found.defined = found.defined && x->s[r] < INFINITY;
            found.bound = smaller(found.bound, x->hi[r]);
            found.value = passed ? found.value : smaller(found.value, x->c[r] - x->s[r]);
        } else {
            if (found.impossible < 0 && (x->lo[r] > 0 || (form->equation[r] == 1 && x->hi[r] < 0)))
                found.impossible = r;
            if (!passed && !(x->c[r] + x->s[r] <= 0))
                found.value = -INFINITY;
        }
    return found;
}

/* Improves a bound by the bound of the Lagrangian, and keeps the Lagrangian's model in the box. */
static void weigh(const Form *form, Box *x, const Report *report, Py_ssize_t at, int passed, int first, Look *found)
{
    choose_multipliers(x, form->equation, first);
    combine(x);
    double lagrangian = report->models ? INFINITY : quadratic_bound(x);
    found->bound = lagrangian < found->bound ? lagrangian : found->bound;
    if (!found->defined)
        found->bound = passed ? report->bound[at] : INFINITY;
}

/* Examines a box by first-order forms of its gradients. After a first pass, the report holds the results of that pass.
 *
 * With scores of the variables from the first pass, x contains only the functions, and the call returns whether the
 * gradients of the conditions are needed too: this is the case if the functions increase along a variable. */
static int judge(const Form *form, Box *x, Report *report, Py_ssize_t at, double threshold, int passed, const double *scores)
{
    int n = x->n, J = x->J, R = x->R, verdict = OPEN, reason = 0;
    Py_ssize_t B = report->B;
    Look found = look_at(form, x, report, at, passed);
    int defined = found.defined, impossible = found.impossible;
    for (int i = 0; i < n && defined && scores; i++) {
        int rises = report->upper[i * B + at] > report->lower[i * B + at], falls = rises;
        for (int r = 0; r < J; r++)
            rises = rises && x->grad_lo[r * n + i] > 0, falls = falls && x->grad_hi[r * n + i] < 0;
        if (rises || falls)
            return 1;
    }
    if (report->tilts)
        add_tilts(x, report, at);
    weigh(form, x, report, at, passed, report->tilts ? 0 : report->shared, &found);
    if (report->models)
        write_model(form, x, report, at, defined);
    for (int i = 0; i < n; i++) {
        Py_ssize_t end = i * B + at;
        x->e_lo[i] = passed ? report->left_lower[end] : -1.0, x->e_hi[i] = passed ? report->left_upper[end] : 1.0;
        x->why_lo[i] = passed ? report->cut_lower[end] : -2, x->why_hi[i] = passed ? report->cut_upper[end] : -2;
        report->left_lower[end] = report->lower[end], report->left_upper[end] = report->upper[end];
        report->cut_lower[end] = report->cut_upper[end] = -2;
        report->centre[end] = x->centre[i];
    }
    /* Monotonicity. */
    for (int i = report->shared; i < n && defined; i++)
        for (int side = 1; side >= -1; side -= 2) {
            Py_ssize_t end = i * B + at;
            int applies = report->upper[end] > report->lower[end] && verdict == OPEN;
            for (int r = 0; r < R && applies; r++) {
                double low = x->grad_lo[r * n + i], high = x->grad_hi[r * n + i];
                if (r < J)
                    applies = side > 0 ? low > 0 : high < 0;
                else if (form->depends[r * n + i] && !(x->hi[r] < 0) && r != impossible)
                    applies = form->equation[r] != 1 && (side > 0 ? high < 0 : low > 0);
            }
            if (!applies)
                continue;
            double whole = side > 0 ? form->high[i] : form->low[i];
            if ((side > 0 ? report->upper[end] : report->lower[end]) != whole)
                verdict = MONOTONE, reason = i;
            else if (side > 0)
                report->left_lower[end] = whole, report->cut_lower[end] = -1;
            else
                report->left_upper[end] = whole, report->cut_upper[end] = -1;
        }
    if (defined)
        contract(form, x, threshold, report->tilts != NULL);
    int emptied = -1;
    for (int i = 0; i < n && defined; i++) {
        Py_ssize_t end = i * B + at;
        double *lo = report->left_lower + end, *hi = report->left_upper + end;
        double worth = WORTH * (*hi - *lo), centre = x->centre[i], radius = x->radius[i];
        double margin = (fabs(centre) + radius) * (4 * ULP);
        double new_lo = centre + radius * x->e_lo[i] - margin, new_hi = centre + radius * x->e_hi[i] + margin;
        int collapsed = report->cut_lower[end] == -1 || report->cut_upper[end] == -1;
        if (x->why_lo[i] >= 0 && !collapsed && new_lo - *lo > worth)
            *lo = new_lo, report->cut_lower[end] = x->why_lo[i];
        if (x->why_hi[i] >= 0 && !collapsed && *hi - new_hi > worth)
            *hi = new_hi, report->cut_upper[end] = x->why_hi[i];
        if (emptied < 0 && *lo > *hi)
            emptied = i;
    }
    if (emptied >= 0)
        verdict = EMPTIED, reason = emptied;
    if (impossible >= 0)
        verdict = INFEASIBLE, reason = impossible;
    if (found.bound <= threshold && !report->tilts)
        verdict = BOUNDED, reason = 0;
    /* The variable to bisect next. */
    double most = -1.0;
    int split = 0, finite = 1, flat = 1;
    for (int i = 0; i < n; i++) {
        Py_ssize_t end = i * B + at;
        double sum = x->qw[i], width = report->upper[end] - report->lower[end];
        double left = report->left_upper[end] - report->left_lower[end];
        for (int j = 0; j < n; j++)
            sum += fabs(x->H[j * n + i]);
        sum = scores ? scores[i] + x->qw[i] : LINEAR * fabs(x->qb[i]) + sum;
        x->left[i] = sum * (left / (width > 0 ? width : 1.0));
        finite = finite && isfinite(x->left[i]);
        flat = flat && !(x->left[i] > 0);
    }
    for (int i = 0; i < n; i++) {
        double left = report->left_upper[i * B + at] - report->left_lower[i * B + at];
        double score = finite && !flat ? x->left[i] : left / (form->high[i] - form->low[i]);
        x->left[i] = score = left > 0 ? score : -1.0;
        most = score > most ? score : most;
    }
    /* The first of the largest up to rounding, as in tests/reference/numpy_engine/bounding.py. */
    for (int i = n - 1; i >= 0; i--)
        if (x->left[i] >= (1 - TIE) * most)
            split = i;
    report->verdict[at] = verdict, report->reason[at] = reason, report->split[at] = split;
    report->bound[at] = found.bound, report->value[at] = found.value;
    return 0;
}

#endif
