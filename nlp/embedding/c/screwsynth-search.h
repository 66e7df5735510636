/* The state of one search of screwsynth-sqp.c, and what its step in screwsynth-step.c offers. */
#ifndef SCREWSYNTH_SEARCHH
#define SCREWSYNTH_SEARCHH

#include "screwsynth-sqp.h"

#define MILD 1e-3         /* damping, in parts of the curvature, below which it is set to 0; the largest first shift */
#define NARROW 1e-4       /* half range below which bounds are narrow: curvature improves F by parts of its half square only */

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
    double curvature;            /* largest entry of the last H before it was restricted; 0 where there was none */
    double free_size;            /* largest entry of the restricted H */
    double size, shift, damping; /* of H: this, or 1 for a linear f; shift of its diagonal; least shift in parts of the size */
    double unit;                 /* of the quadratic program's variables */
    int is_feasible;
    double part;                 /* part of the way to violated bounds that the step goes */
    double residual;             /* at the last iterate */
    double last;                 /* violation at the last iterate */
    int poor;                    /* number of steps in turn that lessened the violation little, and went a part of the way */
    int idle;                    /* or, from a feasible point, lessened the residual little too */
} search;

/* Largest size of n numbers; not a number where one of them is none. */
double screwsynth_SQP_largest(const double *values, int n);

/* Largest violation of the constraints g. */
double screwsynth_SQP_violation(const screwsynth_SQP_problem *p, const double *g);

/* H: the Hessian of the Lagrangian, restricted by the active sides. Returns 1 where it is not finite. */
int screwsynth_SQP_curve(search *of);

/* L: the triangle of H + shift I, with a shift that makes it positive definite. Shifts are tried from the last residual on:
 * near optima that are not isolated, such as those with F = 0, larger ones would make the steps short. Returns 1 where no
 * shift does. */
int screwsynth_SQP_factorise(search *of);

/* Bounds of the quadratic program: part of the way to violated ones, and shifted by the curvature of the constraints. Its
 * variables are d / unit, so that rounding error is small beside narrow bounds too. */
void screwsynth_SQP_limit_step(search *of, double part, const double *bent);

/* The step within the bounds of limit_step. Returns 1 where there is none. */
int screwsynth_SQP_step_within(search *of, double *d, double *u);

/* The step d with its multipliers u. Where linearised bounds contradict each other, the step goes a part of the way to them,
 * in the end no part. Returns 1 where there is no step. */
int screwsynth_SQP_find_step(search *of);

/* Row of the triangle at which the restricted H shows negative curvature; n where it has none. Along a narrow range no
 * curvature makes a difference, so these are scaled down. */
int screwsynth_SQP_saddle_row(search *of);

#endif
