/* The first pass over a box, by second-order forms of its expressions without gradients.
 * Reference in NumPy: tests/reference/numpy_engine/first_pass.py. */
#ifndef FIRSTPASS_H
#define FIRSTPASS_H

#include "examination.h"
#include "tangents.h"

enum { FIRST, DEFINED_BEFORE, UNDEFINED_BEFORE };

/* Returns 1 if the box is closed, 0 if it is open, and -1 if it is open and a function may be undefined. For an open box
 * the report gets the contracted ends, relative to the radius, with their reasons; and scores, unless NULL, the possible
 * change of the Lagrangian along each variable. After an earlier pass over the same box, with other rows of the
 * functions, tighter results of that pass are kept. */
static int pass_over(const Form *form, Box *x, Report *report, Py_ssize_t at, double threshold, double *scores, int before)
{
    int n = x->n;
    Look found = look_at(form, x, report, at, before);
    weigh(form, x, report, at, before, 0, &found);
    int bounded = found.bound <= threshold, closed = bounded || found.impossible >= 0;
    report->bound[at] = found.bound, report->value[at] = found.value, report->split[at] = 0;
    report->verdict[at] = bounded ? BOUNDED : closed ? INFEASIBLE : OPEN;
    report->reason[at] = bounded || !closed ? 0 : found.impossible;
    for (int i = 0; i < n && !before; i++) {
        x->e_lo[i] = -1.0, x->e_hi[i] = 1.0;
        x->why_lo[i] = x->why_hi[i] = -2;
    }
    if (!closed && found.defined)
        contract(form, x, threshold, 0);
    for (int i = 0; i < n && scores && before != DEFINED_BEFORE; i++) {
        scores[i] = LINEAR * fabs(x->qb[i]);
        for (int j = 0; j < n; j++)
            scores[i] += fabs(x->H[i * n + j]);
    }
    for (int i = 0; i < n; i++) {
        Py_ssize_t end = i * report->B + at;
        report->centre[end] = x->centre[i];
        report->left_lower[end] = closed ? report->lower[end] : x->e_lo[i];
        report->left_upper[end] = closed ? report->upper[end] : x->e_hi[i];
        report->cut_lower[end] = closed ? -2 : x->why_lo[i], report->cut_upper[end] = closed ? -2 : x->why_hi[i];
    }
    return closed ? 1 : found.defined ? 0 : -1;
}

/* The first pass over a box, and a second one with tangents to its squares if it is still open; returns whether the box
 * is open after that. */
static int pass_first(const Form *form, Box *x, Report *report, Py_ssize_t at, double threshold, double *scores)
{
    int closed = pass_over(form, x, report, at, threshold, scores, FIRST);
    if (closed <= 0 && form->tangents && take_tangents(form, x))
        closed = pass_over(form, x, report, at, threshold, scores, closed ? UNDEFINED_BEFORE : DEFINED_BEFORE);
    return closed <= 0;
}

#endif
