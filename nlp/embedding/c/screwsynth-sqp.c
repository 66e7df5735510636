/* Sequential quadratic programming with exact second derivatives, for few variables.
 *
* Each step solves a quadratic program. Its matrix is the Hessian of the Lagrangian along the active sides of the last one,
 * made positive definite; its curvature across those sides is arbitrary. Near a solution these are Newton's steps. A line
 * search on the merit f + sum w |violation| makes them a descent from any point. For curved constraints, a second-order
 * correction of the step is tried before it is shortened.
 *
* Source: J. Nocedal and S. J. Wright, Numerical Optimization, 2nd ed., Springer 2006, chapter 18.
 */
#include <math.h>
#include <string.h>

#include "screwsynth-search.h"

#define AIM 1e-10         /* residual at which the search ends; the caller's tolerances are wider */
#define AIM_INSIDE 1e-12  /* violation at which the search ends */
#define ENOUGH 1e-7       /* residual or violation that may be rounding error if no step descends */
#define STILL 1e-14       /* length of a step that changes nothing */
#define NEAR 1e-8         /* distance of a side that counts as active at the start, relative to the largest half range */
#define WEAK 1e-8         /* multiplier below which a side counts as inactive */
#define KICK 0.1          /* length of the step away from a saddle, relative to the largest half range */
#define KICKS 8
#define CREEP 1e-2        /* length of a short step, relative to the largest half range */
#define THIN 1e-12        /* half range below which bounds are within rounding error of each other */
#define POOR 3            /* number of successive partial steps to violated bounds after which the search ends */
#define IDLE 2            /* same from feasible points, which narrow bounds or rounding error leave slightly violated */
#define HELD 1e-9         /* change of f within narrow bounds below which their multipliers make a point stationary */
#define GOOD 0.7          /* ratio to which a step must reduce the violation or residual */
#define TRIALS 30        /* number of trial lengths of a step, each half of the one before */
#define DESCENT 1e-4      /* required fraction of the predicted descent (Armijo) */
#define ROUNDING 1e-14    /* rounding error of f, which is of order 1 */

static double merit(const screwsynth_SQP_problem *p, const point *at, const double *weights) {
    double sum = at->f;
    int j;
    for (j = 0; j < p->c; ++j) sum += weights[j] * screwsynth_SQP_outside(p, j, at->g[j]);
    return sum;
}

/* KKT residual: gradient of the Lagrangian, complementarity. The quadratic program gives nonnegative multipliers. */
static double residual_of(const screwsynth_SQP_problem *p, const point *at, const double *u, double *left) {
    int n = p->n, c = p->c, i, j;
    double most;
    for (i = 0; i < n; ++i) left[i] = at->gradient[i] - u[i] + u[n + i];
    for (j = 0; j < c; ++j) {
        double carried = u[2 * n + j] - u[2 * n + c + j];
        if (carried != 0.0)
            for (i = 0; i < n; ++i) left[i] -= carried * at->rows[j * n + i];
    }
    most = screwsynth_SQP_largest(left, n);
    for (i = 0; i < n; ++i) { /* an infinite bound has no multiplier */
        double product = u[i] != 0.0 ? u[i] * (at->s[i] - p->lower[i]) : 0.0;
        if (u[n + i] != 0.0) product += u[n + i] * (p->upper[i] - at->s[i]);
        if (!(product <= most)) most = product;
    }
    for (j = 0; j < c; ++j) {
        double product = 0.0;
        if (p->g_lower[j] == p->g_upper[j]) continue;
        if (u[2 * n + j] > 0.0) product += u[2 * n + j] * fabs(at->g[j] - p->g_lower[j]);
        if (u[2 * n + c + j] > 0.0) product += u[2 * n + c + j] * fabs(p->g_upper[j] - at->g[j]);
        if (!(product <= most)) most = product;
    }
    return most;
}

static int move(const screwsynth_SQP_problem *p, const point *from, const double *d, double length, point *to) {
    int i;
    for (i = 0; i < p->n; ++i) {
        double s = from->s[i] + length * d[i];
        to->s[i] = s < p->lower[i] ? p->lower[i] : s > p->upper[i] ? p->upper[i] : s;
    }
    return p->values(p->self, to->s, &to->f, to->gradient, to->g, to->rows);
}

static void exchange(point *a, point *b) {
    point kept = *a;
    *a = *b;
    *b = kept;
}

static void set_up(search *of, const screwsynth_SQP_problem *p, double *s, double *work, int *iwork) {
    const int n = p->n, c = p->c;
    memset(of, 0, sizeof *of);
    of->p = p;
    of->qp_iwork = iwork;
    of->qp_work = work;
    of->H = of->qp_work + SCREWSYNTH_QPWORK(n, c);
    of->L = of->H + n * n;
    of->basis = of->L + n * n;
    of->d = of->basis + n * n;
    of->bent_d = of->d + n;
    of->spare = of->bent_d + n;
    of->low = of->spare + n;
    of->high = of->low + n;
    of->u = of->high + n;
    of->bent_u = of->u + 2 * (n + c);
    of->carried = of->bent_u + 2 * (n + c);
    of->weights = of->carried + c;
    of->row_low = of->weights + c;
    of->row_high = of->row_low + c;
    of->bent = of->row_high + c;
    of->at.s = s;
    of->at.gradient = of->bent + c;
    of->at.g = of->at.gradient + n;
    of->at.rows = of->at.g + c;
    of->to.s = of->at.rows + n * c;
    of->to.gradient = of->to.s + n;
    of->to.g = of->to.gradient + n;
    of->to.rows = of->to.g + c;
    of->q.n = n;
    of->q.c = c;
    of->q.factor = of->L;
    of->q.lower = of->low;
    of->q.upper = of->high;
    of->q.row_lower = of->row_low;
    of->q.row_upper = of->row_high;
    of->residual = of->last = HUGE_VAL;
    of->unit = p->extent > 0.0 && p->extent < NARROW ? fmax(p->extent, THIN) : 1.0;
}

/* Marks the active sides at the start: sides through the point towards which f falls. */
static void guess_sides(search *of) {
    const screwsynth_SQP_problem *p = of->p;
    const point *at = &of->at;
    const int n = p->n, c = p->c;
    const double near = NEAR * p->extent;
    int i, j;
    for (i = 0; i < n; ++i) {
        of->u[i] = at->s[i] <= p->lower[i] + near && at->gradient[i] > 0.0 ? 1.0 : 0.0;
        of->u[n + i] = at->s[i] >= p->upper[i] - near && at->gradient[i] < 0.0 ? 1.0 : 0.0;
    }
    for (j = 0; j < c; ++j) {
        of->u[2 * n + j] = fabs(at->g[j] - p->g_lower[j]) <= near ? 1.0 : 0.0;
        of->u[2 * n + c + j] = fabs(at->g[j] - p->g_upper[j]) <= near ? 1.0 : 0.0;
        of->carried[j] = p->carried ? p->carried[j] : 0.0;
        of->weights[j] = 0.0;
    }
}

/* Steps away from a saddle along (-L^-T l, 1, 0), where l is row k of the triangle: the curvature along it is the pivot,
* which is not positive. Of the two directions it takes that with the smaller merit. */
static void leave_saddle(search *of, int k) {
    const int n = of->p->n, c = of->p->c;
    double best = HUGE_VAL, chosen = 0.0;
    int side, i, j;
    for (i = 0; i < n; ++i) of->d[i] = i == k ? 1.0 : 0.0;
    for (i = k - 1; i >= 0; --i) {
        double sum = of->L[k * n + i];
        for (j = i + 1; j < k; ++j) sum += of->L[j * n + i] * of->d[j];
        of->d[i] = -sum / of->L[i * n + i];
    }
    for (side = -1; side <= 1; side += 2) {
        double length = side * KICK * of->p->extent / screwsynth_SQP_largest(of->d, n);
        if (move(of->p, &of->at, of->d, length, &of->to) || !(merit(of->p, &of->to, of->weights) < best)) continue;
        best = merit(of->p, &of->to, of->weights);
        chosen = length;
    }
    if (!move(of->p, &of->at, of->d, chosen, &of->to)) exchange(&of->at, &of->to);
    memset(of->u, 0, (size_t)(2 * (n + c)) * sizeof *of->u);
}

/* Sets the weights of the violations from the multipliers, and returns the slope of the merit along the step. */
static double weigh(search *of) {
    double slope = screwsynth_QP_dot(of->at.gradient, of->d, of->p->n), distance = 0.0;
    int j;
    for (j = 0; j < of->p->c; ++j) {
        double needed = fabs(of->carried[j]), off = of->part * screwsynth_SQP_outside(of->p, j, of->at.g[j]);
        of->weights[j] = of->weights[j] > needed ? 0.5 * (of->weights[j] + needed) : needed;
        slope -= of->weights[j] * off;
        distance += off;
    }
    /* A partial step may increase the merit: then the weights must exceed the multipliers. */
    if (slope > 0.0 && distance > 0.0) {
        double more = 2.0 * slope / distance;
        for (j = 0; j < of->p->c; ++j) of->weights[j] += more;
        slope -= more * distance;
    }
    return slope;
}

/* Line search: takes the step, shortened until the merit falls enough. Returns its length, or 0 if the merit does not fall. */
static double advance(search *of) {
    const screwsynth_SQP_problem *p = of->p;
    const double slope = weigh(of), now = merit(p, &of->at, of->weights), slack = ROUNDING * (1.0 + fabs(now));
    double length = 1.0;
    int trial, j;
    for (trial = 0; trial < TRIALS; ++trial, length *= 0.5) {
        if (move(p, &of->at, of->d, length, &of->to)) continue;
        if (merit(p, &of->to, of->weights) <= now + DESCENT * length * slope + slack) break;
        if (trial > 0 || screwsynth_SQP_violation(p, of->to.g) <= screwsynth_SQP_violation(p, of->at.g)) continue;
        for (j = 0; j < p->c; ++j)
            of->bent[j] = of->to.g[j] - of->at.g[j] - screwsynth_QP_dot(of->at.rows + j * p->n, of->d, p->n);
        screwsynth_SQP_limit_step(of, of->part, of->bent);
        if (screwsynth_SQP_step_within(of, of->bent_d, of->bent_u)) continue;
        if (move(p, &of->at, of->bent_d, 1.0, &of->to)) continue;
        if (merit(p, &of->to, of->weights) <= now + DESCENT * slope + slack) break;
    }
    if (trial == TRIALS) return 0.0;
    exchange(&of->at, &of->to);
    return length;
}

/* Counts successive steps without progress, and keeps the reference values of the next one. */
static void compare_with_last(search *of, double residual, double violation) {
    const int is_little = violation > GOOD * of->last;
    of->poor = is_little && of->part < 1.0 && !of->is_feasible ? of->poor + 1 : 0;
    /* A residual within its aim is rounding error, and may fall again and again. */
    const int is_still = is_little && (residual > GOOD * of->residual || residual <= AIM);
    of->idle = is_still && residual <= ENOUGH && of->is_feasible ? of->idle + 1 : 0;
    of->residual = residual;
    of->last = violation;
}

/* Returns 1 if the multipliers of the variables' bounds make the point stationary, because f hardly changes within them.
 * Then they are the multipliers of the point. */
static int is_held_by_bounds(search *of) {
    const int n = of->p->n;
    int i;
    memset(of->bent_u, 0, (size_t)(2 * (n + of->p->c)) * sizeof *of->bent_u);
    for (i = 0; i < n; ++i) of->bent_u[of->at.gradient[i] > 0.0 ? i : n + i] = fabs(of->at.gradient[i]);
    if (!(residual_of(of->p, &of->at, of->bent_u, of->spare) <= HELD)) return 0;
    memcpy(of->u, of->bent_u, (size_t)(2 * (n + of->p->c)) * sizeof *of->u);
    return 1;
}

int screwsynth_SQP(const screwsynth_SQP_problem *p, double *s, screwsynth_SQP_end *end, double *work, int *iwork) {
    search of;
    int kicks = 0, settled = 0, i;
    set_up(&of, p, s, work, iwork);
    memset(end, 0, sizeof *end);
    if (p->values(p->self, of.at.s, &of.at.f, of.at.gradient, of.at.g, of.at.rows)) return 1;
    guess_sides(&of);
    while (end->iterations < p->max_iterations) {
        double length;
        int creeps;
        ++end->iterations;
        if (p->visit(p->self, of.at.s, of.at.f, of.at.g, of.at.rows, &of.is_feasible)) break;
        if (screwsynth_SQP_curve(&of) || screwsynth_SQP_factorise(&of) || screwsynth_SQP_find_step(&of)) break;
        end->residual = residual_of(p, &of.at, of.u, of.spare);
        end->violation = screwsynth_SQP_violation(p, of.at.g);
        compare_with_last(&of, end->residual, end->violation);
        if (of.poor == POOR) break;
        if ((end->residual <= AIM && end->violation <= AIM_INSIDE) || screwsynth_SQP_largest(of.d, p->n) <= STILL) settled = 1;
        if (of.idle == IDLE) settled = 1;
        /* Within narrow bounds F changes too little for a test: there the first step is always taken. */
        if (end->iterations == 1 && p->extent < NARROW && screwsynth_SQP_largest(of.d, p->n) > CREEP * p->extent) settled = 0;
        /* Short steps with negative curvature approach a saddle. */
        creeps = of.shift > of.damping * of.size && screwsynth_SQP_largest(of.d, p->n) <= CREEP * p->extent && end->violation <= CREEP;
        if (settled || (creeps && kicks < KICKS)) {
            int row;
            for (i = 0; settled && i < 2 * (p->n + p->c); ++i)
                if (fabs(of.u[i]) <= WEAK) of.u[i] = 0.0;
            if (screwsynth_SQP_curve(&of)) break; /* along the present active sides */
            row = screwsynth_SQP_saddle_row(&of);
            end->is_minimum = settled && row == p->n;
            if (settled && (row == p->n || kicks == KICKS)) break;
            if (row < p->n) {
                leave_saddle(&of, row);
                ++kicks;
                settled = 0;
                continue;
            }
            if (screwsynth_SQP_curve(&of) || screwsynth_SQP_factorise(&of)) break;
        }
        length = advance(&of);
        /* A matrix with too little curvature gives steps that must be shortened. */
        if (length < 0.3) {
            of.damping = fmax(fmax(of.damping, MILD), of.shift / of.size) * fmin(0.5 / fmax(length, 1e-9), 64.0);
        } else {
            of.damping = of.damping > MILD ? 0.2 * of.damping : 0.0;
        }
        if (length > 0.0) continue;
        if (end->residual > ENOUGH || end->violation > ENOUGH) break;
        settled = 1; /* rounding error stops the search: check the point */
    }
    /* The results are those of the last point. */
    end->f = of.at.f;
    end->violation = screwsynth_SQP_violation(p, of.at.g);
    end->residual = residual_of(p, &of.at, of.u, of.spare);
    if (p->extent < NARROW && !(end->residual <= AIM && end->is_minimum) && is_held_by_bounds(&of)) {
        end->residual = residual_of(p, &of.at, of.u, of.spare);
        end->is_minimum = 1;
    }
    end->multipliers = of.u;
    end->g = of.at.g;
    end->rows = of.at.rows;
    if (of.at.s != s) memcpy(s, of.at.s, (size_t)p->n * sizeof *s);
    return 0;
}
