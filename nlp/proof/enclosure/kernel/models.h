/* Bounds of quadratic models over many boxes, and contraction by levels, for the search by limbs.
 * Reference in NumPy: tests/reference/numpy_engine/quadratic_models.py. */
#ifndef MODELS_H
#define MODELS_H

#include <Python.h>
#include "contraction.h"

/* Models of B boxes; entries of a vector or matrix are B places apart. */
typedef struct {
    Py_ssize_t B;
    int n;
    const double *middle, *b, *H, *w, *slope_lo, *slope_hi, *rounding;
    const double *level;  /* (B); NULL to compute bounds */
    double *bound;        /* (B) */
    double *low, *high;   /* (n, B) */
} Models;

/* Bounds models, or moves ends; without memory, only counts the memory that is needed. */
static void use_models(const Models *all, Room *room)
{
    int n = all->n;
    Box x = lay_box(n, 0, room);
    for (Py_ssize_t at = 0; room->at && at < all->B; at++) {
        for (int i = 0; i < n; i++) {
            Py_ssize_t place = i * all->B + at;
            double low = all->slope_lo[place], high = all->slope_hi[place];
            int known = !isnan(low) && !isnan(high);
            x.qb[i] = all->b[place], x.qw[i] = all->w[place], x.e_lo[i] = -1.0, x.e_hi[i] = 1.0;
            x.qlo[i] = known ? low : -INFINITY, x.qhi[i] = known ? high : INFINITY;
        }
        for (int i = 0; i < n * n; i++)
            x.H[i] = all->H[i * all->B + at];
        x.q_middle = all->middle[at], x.q_rounding = all->rounding[at];
        if (!all->level) {
            all->bound[at] = quadratic_bound(&x);
            continue;
        }
        reach_quadratic(&x, 1.0, x.q_middle, x.qb, x.H, x.qw, x.q_rounding, all->level[at], 0);
        for (int i = 0; i < n; i++)
            all->low[i * all->B + at] = x.e_lo[i], all->high[i * all->B + at] = x.e_hi[i];
    }
}

#endif
