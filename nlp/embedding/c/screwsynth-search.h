/* State of one search of screwsynth-sqp.c, and functions of its step in screwsynth-step.c. */
#ifndef SCREWSYNTH_SEARCHH
#define SCREWSYNTH_SEARCHH

#include "screwsynth-sqp.h"

#define MILD 1e-3         /* relative damping below which it is set to 0; the largest first shift */
#define NARROW 1e-4       /* half range below which bounds are narrow: curvature changes F by at most half of its square */

typedef struct {
    double f, *gradient, *g, *rows, *s;
} point;

/* The state of one search. */
typedef struct {
    const screwsynth_SQP_problem *p;
    point at, to;       /* the iterate, and the trial point */
    screwsynth_QP_data q;    /* the quadratic program of a step */
    double *H, *L;      /* its matrix, and the triangle L */
    double *d, *bent_d; /* the step, and its second-order correction */
    double *u, *bent_u; /* multipliers of the sides */
    double *low, *high, *row_low, *row_high, *bent;
    double *carried, *weights; /* multipliers of the constraints in the Lagrangian, and weights of the violations */
    double *basis, *spare, *qp_work;
    int *qp_iwork;
    double curvature;            /* largest entry of the last H before its restriction; 0 for none */
    double free_size;            /* largest entry of the restricted H */
    double size, shift, damping; /* of H: largest entry, or 1 for a linear f; shift of its diagonal; least relative shift */
    double unit;                 /* unit of the quadratic program's variables */
    int is_feasible;
    double part;                 /* fraction of the way to violated bounds in the step */
    double residual;             /* at the last iterate */
    double last;                 /* violation at the last iterate */
    int poor;                    /* number of successive partial steps that hardly reduced the violation */
    int idle;                    /* same, from feasible points, if they hardly reduced the residual too */
} search;

/* Largest absolute value of n numbers; NaN if one of them is NaN. */
double screwsynth_SQP_largest(const double *values, int n);

/* Largest violation of the constraints g. */
double screwsynth_SQP_violation(const screwsynth_SQP_problem *p, const double *g);

/* H: the Hessian of the Lagrangian, restricted by the active sides. Returns 1 if it is not finite. */
int screwsynth_SQP_curve(search *of);

/* L: the triangle of H + shift I, with a shift that makes it positive definite. Shifts are tried from the last residual on:
* near optima that are not isolated, such as those with F = 0, larger ones would make the steps short. Returns 1 if no
 * shift is sufficient. */
int screwsynth_SQP_factorise(search *of);

/* Bounds of the quadratic program: a fraction of the way to violated ones, and shifted by the curvature of the constraints.
 * Its variables are d / unit, so that rounding error is small compared with narrow bounds too. */
void screwsynth_SQP_limit_step(search *of, double part, const double *bent);

/* Step within the bounds of limit_step. Returns 1 if there is none. */
int screwsynth_SQP_step_within(search *of, double *d, double *u);

/* Step d with its multipliers u. If linearised bounds contradict each other, the step goes a fraction of the way to them, at
 * last no way. Returns 1 if there is no step. */
int screwsynth_SQP_find_step(search *of);

/* Row of the triangle with a negative curvature of the restricted H; n if there is none. Narrow ranges are scaled down,
 * because curvature has no effect along them. */
int screwsynth_SQP_saddle_row(search *of);

#endif
