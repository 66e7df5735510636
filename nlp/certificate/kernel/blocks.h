/* Blocks of LANES boxes: their tape, then the examination of each. */
#ifndef BLOCKS_H
#define BLOCKS_H

#include "enclosure.h"
#include "examination.h"
#include "quotients.h"

static double *carve(double **rest, size_t count)
{
    double *part = *rest;
    *rest += count;
    return part;
}

static void examine_range(const Form *form, Report *report, Py_ssize_t begin, Py_ssize_t finish, double threshold,
                          double *memory)
{
    size_t n = (size_t)form->n, R = (size_t)form->expressions, E = R + 2 * (size_t)form->quotients;
    size_t J = form->quotients ? (size_t)form->functions : 0;
    Store work = {memory, sizeof(Value) / sizeof(double) + n * LANES}, out = work;
    double *rest = memory;
    carve(&rest, (size_t)form->tape.registers * work.stride);
    out.memory = carve(&rest, (size_t)form->tape.outputs * out.stride);
    Lane *lanes[5];
    for (int i = 0; i < 5; i++)
        lanes[i] = (Lane *)carve(&rest, n * LANES);
    Lane *centre = lanes[0], *radius = lanes[1], *lower = lanes[2], *upper = lanes[3];
    Box x = {.n = form->n, .J = form->functions, .R = form->expressions, .squares = J > 0};
    double **singles[] = {&x.c, &x.p, &x.q, &x.s, &x.lo, &x.hi, &x.weights, &x.size, &x.high, &x.low};
    for (size_t i = 0; i < sizeof singles / sizeof *singles; i++)
        *singles[i] = carve(&rest, E);
    double **rows[] = {&x.a, &x.gb, &x.gp, &x.gq, &x.gs, &x.slope_lo, &x.slope_hi, &x.grad_lo, &x.grad_hi};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        *rows[i] = carve(&rest, E * n);
    double *c, *r, **vectors[] = {&x.left, &x.qb, &x.qw, &x.qlo, &x.qhi, &x.sign, &x.fb, &x.fw, &x.diagonal, &x.t,
                                  &x.gradient, &x.e_lo, &x.e_hi, &c, &r, &x.aE, &x.bN, &x.bD, &x.wN, &x.wD};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++)
        *vectors[i] = carve(&rest, n);
    x.gA = carve(&rest, E * n * n), x.HN = carve(&rest, n * n), x.HD = carve(&rest, n * n);
    x.sH = carve(&rest, J * n * n), x.sw = carve(&rest, J * n);
    x.H = carve(&rest, n * n), x.fH = carve(&rest, n * n);
    x.why_lo = (int *)carve(&rest, n), x.why_hi = (int *)carve(&rest, n);
    for (Py_ssize_t start = begin; start < finish; start += LANES) {
        EACH
        {
            Py_ssize_t at = start + l < finish ? start + l : finish - 1;
            for (size_t i = 0; i < n; i++, at += report->B) {
                double lo = report->lower[at], hi = report->upper[at], middle = 0.5 * lo + 0.5 * hi;
                middle = smaller(larger(middle, lo), hi);
                double half = larger(hi - middle, middle - lo);
                lower[i][l] = lo, upper[i][l] = hi, centre[i][l] = middle;
                radius[i][l] = half > 0 ? half * (1 + ULP) + TINY : 0.0;
            }
        }
        run(&form->tape, form->n, work, out, centre, radius, lower, upper, lanes[4]);
        for (int l = 0; l < LANES && start + l < finish; l++) {
            for (size_t i = 0; i < n; i++)
                c[i] = centre[i][l], r[i] = radius[i][l];
            for (size_t k = 0; k < E; k++) {
                Value *v = value_of(out, (int)k);
                x.c[k] = v->c[l], x.p[k] = v->p[l], x.q[k] = v->q[l], x.s[k] = v->s[l];
                x.lo[k] = v->lo[l], x.hi[k] = v->hi[l];
                for (size_t i = 0, at = k * n; i < n; i++, at++) {
                    Value *g = value_of(out, (int)(E + at));
                    int wide = r[i] > 0;
                    x.a[at] = terms_of(v)[i][l];
                    x.gb[at] = wide ? g->c[l] * r[i] : 0.0, x.gs[at] = wide ? g->s[l] * r[i] : 0.0;
                    x.gp[at] = wide ? g->p[l] * r[i] : 0.0, x.gq[at] = wide ? g->q[l] * r[i] : 0.0;
                    x.grad_lo[at] = g->lo[l], x.grad_hi[at] = g->hi[l];
                    x.slope_lo[at] = wide ? g->lo[l] * r[i] : 0.0, x.slope_hi[at] = wide ? g->hi[l] * r[i] : 0.0;
                    for (size_t j = 0; j < n; j++)
                        x.gA[at * n + j] = terms_of(g)[j][l] * r[i];
                }
            }
            if (x.squares)
                add_quotients(form, &x, r, report->least ? report->least + start + l : NULL);
            judge(form, &x, c, r, report, start + l, threshold);
        }
    }
}

static size_t memory_needed(const Form *form)
{
    size_t n = (size_t)form->n, E = (size_t)form->expressions + 2 * (size_t)form->quotients, J = (size_t)form->functions;
    size_t stride = sizeof(Value) / sizeof(double) + n * LANES;
    size_t values = (size_t)(form->tape.registers + form->tape.outputs) * stride + 5 * n * LANES;
    return values + 10 * E + 9 * E * n + 22 * n + (E + 4) * n * n + J * n * (n + 1);
}

#endif
