/* Bounds of quadratic models over many boxes, and ends that reach levels, for the search by limbs; quadratic_models.py. */
#ifndef MODELS_H
#define MODELS_H

#include "contraction.h"

/* Models of B boxes; the entries of a vector or matrix follow each other in steps of B. */
typedef struct {
    Py_ssize_t B;
    int n;
    const double *middle, *b, *H, *w, *slope_lo, *slope_hi, *rounding;
    const double *level;  /* (B) */
    double *bound;        /* (B) */
    double *low, *high;   /* (n, B) */
} Models;

static size_t memory_for_models(int n) { return 16 * (size_t)n + 2 * (size_t)n * (size_t)n; }

/* Lays a box with room for one model over memory. */
static Box box_of_model(int n, double *memory)
{
    Box x = {.n = n};
    double *rest = memory;
    double **vectors[] = {&x.qb, &x.qw, &x.qlo, &x.qhi, &x.sign, &x.fb, &x.fw, &x.diagonal, &x.t, &x.gradient,
                          &x.e_lo, &x.e_hi};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++, rest += n)
        *vectors[i] = rest;
    x.why_lo = (int *)rest, rest += n, x.why_hi = (int *)rest, rest += n;
    x.H = rest, x.fH = rest + n * n;
    return x;
}

static void read_model(Box *x, const Models *all, Py_ssize_t at)
{
    int n = all->n;
    for (int i = 0; i < n; i++)
        x->qb[i] = all->b[i * all->B + at], x->qw[i] = all->w[i * all->B + at];
    for (int i = 0; i < n * n; i++)
        x->H[i] = all->H[i * all->B + at];
    x->q_middle = all->middle[at], x->q_rounding = all->rounding[at];
}

static void bound_models(const Models *all, double *memory)
{
    Box x = box_of_model(all->n, memory);
    for (Py_ssize_t at = 0; at < all->B; at++) {
        read_model(&x, all, at);
        for (int i = 0; i < all->n; i++) {
            double low = all->slope_lo[i * all->B + at], high = all->slope_hi[i * all->B + at];
            int known = !isnan(low) && !isnan(high);
            x.qlo[i] = known ? low : -INFINITY, x.qhi[i] = known ? high : INFINITY;
        }
        all->bound[at] = quadratic_bound(&x);
    }
}

static void reach_models(const Models *all, double *memory)
{
    Box x = box_of_model(all->n, memory);
    for (Py_ssize_t at = 0; at < all->B; at++) {
        read_model(&x, all, at);
        for (int i = 0; i < all->n; i++)
            x.e_lo[i] = -1.0, x.e_hi[i] = 1.0;
        reach_quadratic(&x, 1.0, x.q_middle, x.qb, x.H, x.qw, x.q_rounding, all->level[at], 0);
        for (int i = 0; i < all->n; i++)
            all->low[i * all->B + at] = x.e_lo[i], all->high[i * all->B + at] = x.e_hi[i];
    }
}

#endif
