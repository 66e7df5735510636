/* Runs of a tape over many boxes, LANES at once.
 * Reference in NumPy: tests/reference/numpy_engine/first_order.py and tests/reference/numpy_engine/second_order.py. */
#ifndef RUNS_H
#define RUNS_H

#include <Python.h>
#include "forms.h"

/* A tape, and its memory for LANES boxes: registers and results, the boxes, and the terms of an operation. */
typedef struct {
    const Tape *tape;
    int n, order;
    Store work, out;
    Lane *box[4], *terms; /* centre, radius, lower and upper ends; terms */
} Run;

/* Allocates a run in the working memory. */
static Run prepare(const Tape *tape, int n, int order, Room *room)
{
    size_t terms = terms_of_order(n, order), stride = sizeof(Value) / sizeof(double) + terms * LANES;
    Run x = {.tape = tape, .n = n, .order = order};
    x.work = (Store){carve(room, (size_t)tape->registers * stride), stride};
    x.out = (Store){carve(room, (size_t)tape->outputs * stride), stride};
    for (int i = 0; i < 4; i++)
        x.box[i] = (Lane *)carve(room, (size_t)n * LANES);
    x.terms = (Lane *)carve(room, terms * LANES);
    return x;
}

/* Runs a tape over LANES of B boxes with these ends, with indices list[start], list[start + 1], ... or, without a list,
 * from index start on; if there are fewer boxes, the last one before finish is repeated. */
static void run_block(const Run *x, const double *lower, const double *upper, Py_ssize_t B, const Py_ssize_t *list,
                      Py_ssize_t start, Py_ssize_t finish)
{
    EACH
    {
        Py_ssize_t place = start + l < finish ? start + l : finish - 1, at = list ? list[place] : place;
        for (int i = 0; i < x->n; i++, at += B) {
            double lo = lower[at], hi = upper[at], middle = 0.5 * lo + 0.5 * hi;
            middle = smaller(larger(middle, lo), hi);
            double half = larger(hi - middle, middle - lo);
            x->box[LOWER][i][l] = lo, x->box[UPPER][i][l] = hi, x->box[CENTRE][i][l] = middle;
            half = half > 0 ? half * (1 + ULP) + TINY : 0.0;
            x->box[RADIUS][i][l] = larger(-lo, hi) < LARGEST ? half : INFINITY;
        }
    }
    (x->order > 1 ? run2 : run1)(x->tape, x->n, x->work, x->out, x->box, x->terms);
}

/* Forms middle + a e + [-rest, rest] of a tape's results over B boxes. */
typedef struct {
    const double *lower, *upper; /* (n, B) */
    double *middle, *a, *rest;   /* (R, B), a: (R, n, B), or (R, n + n (n + 1) / 2, B) for second-order forms */
    Py_ssize_t B;
    int order;
} Forms;

/* Writes forms; without memory, only counts the memory that is needed. */
static void enclose_all(const Tape *tape, int n, const Forms *found, Room *room)
{
    Py_ssize_t B = found->B;
    Run run = prepare(tape, n, found->order, room);
    size_t terms = terms_of_order(n, found->order);
    for (Py_ssize_t start = 0; room->at && start < B; start += LANES) {
        run_block(&run, found->lower, found->upper, B, NULL, start, B);
        size_t count = (size_t)(B - start < LANES ? B - start : LANES);
        for (int k = 0; k < tape->outputs; k++) {
            const Value *v = value_of(run.out, k);
            double *to = found->middle + k * B + start, *rest = found->rest + k * B + start;
            for (size_t l = 0; l < count; l++) {
                double middle = 0.5 * (v->p[l] + v->q[l]), half = 0.5 * (v->q[l] - v->p[l]);
                to[l] = v->c[l] + middle;
                rest[l] = half + v->s[l] + 4 * ULP * (half + fabs(v->c[l]) + fabs(middle));
            }
            for (size_t i = 0; i < terms; i++)
                memcpy(found->a + ((size_t)k * terms + i) * (size_t)B + start, terms_of(v)[i], count * sizeof(double));
        }
    }
}

#endif
