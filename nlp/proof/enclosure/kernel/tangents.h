/* Tangents to squares over a box: second-order forms of functions with negative squared quotients.
 * Reference in NumPy: tests/reference/numpy_engine/tangent_bounds.py. */
#ifndef TANGENTS_H
#define TANGENTS_H

#include "quadratic.h"

#define SWEEPS 8

static int rows_of_tangents(const Form *form) { return form->tangents ? form->functions + 2 * form->tangents : 0; }

/* Value of a second-order form at e, without its remainder. */
static double value_of_row(const Box *x, int r, const double *e)
{
    int n = x->n;
    double value = x->c[r];
    for (int i = 0; i < n; i++) {
        double across = 0.0;
        for (int j = 0; j < n; j++)
            across += x->gA[(r * n + i) * n + j] * e[j];
        value += (x->gb[r * n + i] + 0.5 * across) * e[i];
    }
    return value;
}

static void add_row(Box *x, int to, int from, double weight)
{
    int n = x->n, up = weight > 0;
    double size = fabs(weight), least = x->p[from] * weight, most = x->q[from] * weight;
    x->s[to] += size * x->s[from] + 64 * ULP * (size * size_of_row(x, from)) + TINY;
    x->c[to] += x->c[from] * weight;
    x->p[to] += up ? least : most, x->q[to] += up ? most : least;
    for (int i = 0; i < n; i++)
        x->gb[to * n + i] += x->gb[from * n + i] * weight;
    for (int i = 0; i < n * n; i++)
        x->gA[to * n * n + i] += x->gA[from * n * n + i] * weight;
}

/* A point of the box, relative to its radii, with a small sum of N^2 / D of a function: N by its linear form, D at the
 * centre. */
static void find_low_point(const Form *form, Box *x, int function, double *e)
{
    int n = x->n, first = form->expressions + x->J;
    double *N = x->weights, *scale = x->size;
    for (int k = 0; k < form->tangents; k++) {
        double D = x->c[first + 2 * k + 1];
        N[k] = x->c[first + 2 * k], scale[k] = form->squared[k] == function && D > 0 ? 1 / D : 0.0;
    }
    memset(e, 0, (size_t)n * sizeof(double));
    for (int sweep = 0; sweep < SWEEPS; sweep++)
        for (int i = 0; i < n; i++) {
            double slope = 0.0, curvature = 0.0;
            for (int k = 0; k < form->tangents; k++) {
                double a = x->gb[(first + 2 * k) * n + i];
                slope += scale[k] * N[k] * a, curvature += scale[k] * a * a;
            }
            double new = curvature > 0 ? smaller(larger(e[i] - slope / curvature, -1.0), 1.0) : e[i];
            double change = new - e[i];
            e[i] = new;
            for (int k = 0; k < form->tangents && change != 0; k++)
                N[k] += x->gb[(first + 2 * k) * n + i] * change;
        }
}

/* Replaces the rows of the functions by rows with tangents; returns 0, without a change, if some D may be 0. */
static int take_tangents(const Form *form, Box *x)
{
    int n = x->n, J = x->J, R = form->expressions;
    for (int k = 0; k < form->tangents; k++) {
        int N = R + J + 2 * k;
        if (!(x->lo[N + 1] > 0 && x->s[N] < INFINITY && x->s[N + 1] < INFINITY))
            return 0;
    }
    for (int j = 0; j < J; j++)
        if (!(x->s[R + j] < INFINITY))
            return 0;
    for (int j = 0; j < J; j++) {
        find_low_point(form, x, j, x->t);
        x->c[j] = x->p[j] = x->q[j] = x->s[j] = 0.0;
        memset(x->gb + j * n, 0, (size_t)n * sizeof(double));
        memset(x->gA + j * n * n, 0, (size_t)(n * n) * sizeof(double));
        add_row(x, j, R + j, 1.0);
        for (int k = 0; k < form->tangents; k++) {
            int N = R + J + 2 * k;
            if (form->squared[k] != j)
                continue;
            double D = value_of_row(x, N + 1, x->t), ratio = D > 0 ? value_of_row(x, N, x->t) / D : 0.0;
            ratio = fabs(ratio) > 1 / LARGEST && fabs(ratio) < LARGEST ? ratio : 0.0; /* any ratio gives a valid bound */
            add_row(x, j, N, -2 * ratio);
            add_row(x, j, N + 1, ratio * ratio);
        }
        x->lo[j] = -INFINITY, x->hi[j] = INFINITY;
    }
    return 1;
}

#endif
