/* Internal parts of the solver of screwsynth.h. */
#ifndef SCREWSYNTH_SQPH
#define SCREWSYNTH_SQPH

/* The solver tests for infinite values and NaN, and its tolerances are near rounding error. */
#if defined(__FAST_MATH__) || defined(_M_FP_FAST) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "this solver needs IEEE arithmetic: compile it without -ffast-math, -Ofast, -ffinite-math-only or /fp:fast"
#endif

/* minimise 1/2 d'Bd + gradient'd  with  lower <= d <= upper  and  row_lower <= rows d <= row_upper.
 * factor: lower triangle L of B = LL', n x n. rows: c x n. Equal bounds of a row make it an equation. */
typedef struct {
    int n, c;
    const double *factor, *gradient, *lower, *upper, *rows, *row_lower, *row_upper;
} screwsynth_QP_data;

/* Doubles and ints in the workspace of the quadratic program. */
#define SCREWSYNTH_QPWORK(n, c) (2 * (n) * (n) + 3 * (n) + (c))
#define SCREWSYNTH_QPIWORK(n, c) ((n) + 2 * ((n) + (c)))
/* Largest number of passes of a quadratic program. */
#define SCREWSYNTH_QPPASSES(n, c) (20 * (2 * ((n) + (c)) + 5))

/* Solution d and the multiplier of each side: n lower bounds, n upper bounds, lower and upper bounds of c rows. The multiplier
 * of an equation is among the lower ones, and may have any sign. Returns 0, or 1 if there is no solution. */
int screwsynth_QP(const screwsynth_QP_data *q, double *d, double *multipliers, double *work, int *iwork);

double screwsynth_QP_dot(const double *a, const double *b, int n);

/* A program to be minimised, in n variables of order 1. The functions take `self` first. */
typedef struct {
    int n, c;
    const double *lower, *upper;     /* n bounds of the variables; equal ones fix a variable */
    const double *g_lower, *g_upper; /* c bounds of the constraints, scaled as g; infinite for none */
    const double *carried;           /* c multipliers of the constraints for the first Hessian; 0: none */
    double extent;                   /* largest half range of the variables, at most of order 1 */
    int max_iterations;
    /* f, its gradient, c constraints and their gradients, row by row. Returns 1 if a value is not finite. */
    int (*values)(void *self, const double *s, double *f, double *gradient, double *g, double *rows);
    /* Hessian of weight * f + multipliers . g, n x n. Returns 1 if a value is not finite. */
    int (*hessian)(void *self, const double *s, double weight, const double *multipliers, double *H);
    /* Called at each iterate, before its Hessian. Sets is_feasible; returns 1 to end the search there. */
    int (*visit)(void *self, const double *s, double f, const double *g, const double *rows, int *is_feasible);
    void *self;
} screwsynth_SQP_problem;

typedef struct {
    double f, violation, residual; /* recomputed at the point returned */
    const double *multipliers;     /* of the sides, in the order of the quadratic program; in the workspace */
    const double *g, *rows;        /* the constraints and their gradients there; in the workspace */
    int iterations;
    int is_minimum; /* 0 if f falls, to second order, along the active sides */
} screwsynth_SQP_end;

#define SCREWSYNTH_SQPWORK(n, c) (SCREWSYNTH_QPWORK(n, c) + 3 * (n) * (n) + 12 * (n) + 11 * (c) + 2 * (n) * (c))
#define SCREWSYNTH_SQPIWORK(n, c) SCREWSYNTH_QPIWORK(n, c)

/* Searches from s, and sets it to the end of the search. Returns 0, or 1 if f is not finite at s. */
int screwsynth_SQP(const screwsynth_SQP_problem *problem, double *s, screwsynth_SQP_end *end, double *work, int *iwork);

/* Searches from s for a feasible point: minimises the sum of squared violations within the bounds of the variables, up to the
 * first feasible point. The workspaces are as large as those of a search. Returns the number of iterations. */
int screwsynth_SQP_restore(const screwsynth_SQP_problem *problem, double *s, double *work, int *iwork);

/* Distance of a constraint outside its bounds. */
double screwsynth_SQP_outside(const screwsynth_SQP_problem *problem, int j, double g);

#endif
