/* Enclosures of a tape's results over many boxes, for other searches than that of a whole box; first_order.py. */
#ifndef ENCLOSED_H
#define ENCLOSED_H

#include "blocks.h"

typedef struct {
    const double *lower, *upper;  /* (n, B) */
    double *c, *p, *q, *s, *lo, *hi, *a; /* (R, B), a: (R, n, B), or (R, n + n (n + 1) / 2, B) for forms of second order */
    Py_ssize_t B;
    int order;
} Enclosed;

static void enclose_all(const Tape *tape, int n, Enclosed *found, double *memory)
{
    Py_ssize_t B = found->B;
    Run run = prepare(tape, n, found->order, memory);
    size_t terms = terms_of_order(n, found->order);
    for (Py_ssize_t start = 0; start < B; start += LANES) {
        run_block(&run, found->lower, found->upper, B, NULL, start, B);
        Py_ssize_t lanes_used = B - start < LANES ? B - start : LANES;
        for (int k = 0; k < tape->outputs; k++) {
            Value *v = value_of(run.out, k);
            const Lane *a = terms_of(v);
            size_t at = (size_t)(k * B + start), bytes = (size_t)lanes_used * sizeof(double);
            memcpy(found->c + at, v->c, bytes), memcpy(found->p + at, v->p, bytes);
            memcpy(found->q + at, v->q, bytes), memcpy(found->s + at, v->s, bytes);
            memcpy(found->lo + at, v->lo, bytes), memcpy(found->hi + at, v->hi, bytes);
            for (size_t i = 0; i < terms; i++)
                memcpy(found->a + ((size_t)k * terms + i) * (size_t)B + start, a[i], bytes);
        }
    }
}

#endif
