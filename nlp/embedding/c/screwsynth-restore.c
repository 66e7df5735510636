/* Search for a feasible point: minimises f = 1/2 sum (violation / first violation)^2 within the bounds of the variables.
 *
* f has second derivatives where the set of violated constraints does not change, so that the search ends in few steps: at
 * a feasible point, or at an infeasible point from which no small step reduces f.
 */
#include <math.h>

#include "screwsynth-sqp.h"

/* Program of the search, with the values at the last point: constraints, gradients, multipliers. */
typedef struct {
    const screwsynth_SQP_problem *p;
    double *gradient, *g, *rows, *multipliers;
    double objective, size;
} restoration;

/* Violation of constraint j relative to the first largest one, negative below the lower bound. */
static double violated(const restoration *of, int j) {
    double off = screwsynth_SQP_outside(of->p, j, of->g[j]) / of->size;
    return of->g[j] < of->p->g_lower[j] ? -off : off;
}

static int evaluate(restoration *of, const double *s) {
    return of->p->values(of->p->self, s, &of->objective, of->gradient, of->g, of->rows);
}

static int values(void *self, const double *s, double *f, double *gradient, double *g, double *rows) {
    restoration *of = self;
    int i, j;
    (void)g;
    (void)rows;
    if (evaluate(of, s)) return 1;
    *f = 0.0;
    for (i = 0; i < of->p->n; ++i) gradient[i] = 0.0;
    for (j = 0; j < of->p->c; ++j) {
        double off = violated(of, j);
        *f += 0.5 * off * off;
        if (off != 0.0)
            for (i = 0; i < of->p->n; ++i) gradient[i] += off / of->size * of->rows[j * of->p->n + i];
    }
    return 0;
}

/* Evaluates the constraints at the iterate; the Hessian there uses them too. */
static int visit(void *self, const double *s, double f, const double *g, const double *rows, int *is_feasible) {
    restoration *of = self;
    (void)f;
    (void)g;
    (void)rows;
    if (evaluate(of, s)) return 1;
    return of->p->visit(of->p->self, s, of->objective, of->g, of->rows, is_feasible) || *is_feasible;
}

static int hessian(void *self, const double *s, double weight, const double *multipliers, double *H) {
    restoration *of = self;
    const int n = of->p->n;
    int i, j, k;
    (void)weight;
    (void)multipliers;
    for (j = 0; j < of->p->c; ++j) of->multipliers[j] = violated(of, j) / of->size;
    if (of->p->hessian(of->p->self, s, 0.0, of->multipliers, H)) return 1;
    for (j = 0; j < of->p->c; ++j) {
        const double *row = of->rows + j * n;
        if (of->multipliers[j] == 0.0) continue;
        for (i = 0; i < n; ++i)
            for (k = 0; k < n; ++k) H[i * n + k] += row[i] / of->size * row[k] / of->size;
    }
    return 0;
}

int screwsynth_SQP_restore(const screwsynth_SQP_problem *p, double *s, double *work, int *iwork) {
    screwsynth_SQP_problem program = *p;
    screwsynth_SQP_end end;
    restoration of;
    int j;
    if (p->c == 0) return 0;
    of.p = p;
    of.gradient = work + SCREWSYNTH_SQPWORK(p->n, 0);
    of.g = of.gradient + p->n;
    of.multipliers = of.g + p->c;
    of.rows = of.multipliers + p->c;
    of.size = 0.0;
    if (evaluate(&of, s)) return 0;
    for (j = 0; j < p->c; ++j) of.size = fmax(of.size, screwsynth_SQP_outside(p, j, of.g[j]));
    if (!(of.size > 0.0)) return 0;
    program.c = 0;
    program.values = values;
    program.hessian = hessian;
    program.visit = visit;
    program.self = &of;
    if (screwsynth_SQP(&program, s, &end, work, iwork)) return 0;
    return end.iterations;
}
