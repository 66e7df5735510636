/* Blocks of LANES boxes: their tape, then the examination of each. */
#ifndef BLOCKS_H
#define BLOCKS_H

#include "firstpass.h"
#include "quotients.h"
#include "forms.h"
#include "tangents.h"

static double *carve(double **rest, size_t count)
{
    double *part = *rest;
    *rest += count;
    return part;
}

/* Memory in which a tape runs over LANES boxes: registers and results, the boxes, and the terms of an operation. */
typedef struct {
    const Tape *tape;
    int n, order;
    Store work, out;
    Lane *box[4], *terms; /* centre, radius, lower and upper ends; terms */
} Run;

static size_t stride_of_order(int n, int order) { return sizeof(Value) / sizeof(double) + terms_of_order(n, order) * LANES; }

static size_t memory_of_run(const Tape *tape, int n, int order)
{
    return (size_t)(tape->registers + tape->outputs) * stride_of_order(n, order) +
           (4 * (size_t)n + terms_of_order(n, order)) * LANES;
}

/* Lays a run over memory, which must be all 0 for forms of second order. */
static Run prepare(const Tape *tape, int n, int order, double *memory)
{
    size_t stride = stride_of_order(n, order);
    Run x = {.tape = tape, .n = n, .order = order};
    x.work = (Store){carve(&memory, (size_t)tape->registers * stride), stride};
    x.out = (Store){carve(&memory, (size_t)tape->outputs * stride), stride};
    for (int i = 0; i < 4; i++)
        x.box[i] = (Lane *)carve(&memory, (size_t)n * LANES);
    x.terms = (Lane *)memory;
    return x;
}

/* Runs a tape over LANES of B boxes with these ends, of numbers list[start], list[start + 1], ... or, without a list, from
 * number start on; the last one before finish again where there are fewer. */
static void run_block(const Run *x, const double *lower, const double *upper, Py_ssize_t B, const Py_ssize_t *list,
                      Py_ssize_t start, Py_ssize_t finish)
{
    EACH
    {
        Py_ssize_t place = start + l < finish ? start + l : finish - 1, at = list ? list[place] : place;
        for (int i = 0; i < x->n; i++, at += B) {
            double lo = lower[at], hi = upper[at], middle = 0.5 * lo + 0.5 * hi;
            middle = smaller(larger(middle, lo), hi);
            double half = larger(hi - middle, middle - lo);
            x->box[LOWER][i][l] = lo, x->box[UPPER][i][l] = hi, x->box[CENTRE][i][l] = middle;
            half = half > 0 ? half * (1 + ULP) + TINY : 0.0;
            x->box[RADIUS][i][l] = larger(-lo, hi) < LARGEST ? half : INFINITY;
        }
    }
    (x->order > 1 ? run2 : run1)(x->tape, x->n, x->work, x->out, x->box, x->terms);
}

/* The forms of second order of a box: centre, gradient and matrix of each row. */
static void read_form2(Box *x, int rows, Store out, int l)
{
    int n = x->n;
    for (int k = 0; k < rows; k++) {
        const Value *v = value_of(out, k);
        const Lane *a = terms_of(v);
        x->c[k] = v->c[l], x->p[k] = v->p[l], x->q[k] = v->q[l], x->s[k] = v->s[l];
        x->lo[k] = v->lo[l], x->hi[k] = v->hi[l];
        double *H = x->gA + k * n * n;
        for (int i = 0; i < n; i++) {
            x->gb[k * n + i] = a[i][l];
            for (int j = i; j < n; j++) {
                double entry = a[row_of(n, i) + j][l];
                H[i * n + j] = H[j * n + i] = i == j ? 2 * entry : entry;
            }
        }
    }
}

/* Values and gradients of E rows over a box, the latter times its radii r. */
static void read_forms(Box *x, size_t E, Store out, int l, const double *r)
{
    size_t n = (size_t)x->n;
    for (size_t k = 0; k < E; k++) {
        Value *v = value_of(out, (int)k);
        x->c[k] = v->c[l], x->p[k] = v->p[l], x->q[k] = v->q[l], x->s[k] = v->s[l];
        x->lo[k] = v->lo[l], x->hi[k] = v->hi[l];
        for (size_t i = 0, at = k * n; i < n; i++, at++) {
            Value *g = value_of(out, (int)(E + at));
            int wide = r[i] > 0;
            x->a[at] = terms_of(v)[i][l];
            x->gb[at] = wide ? g->c[l] * r[i] : 0.0, x->gs[at] = wide ? g->s[l] * r[i] : 0.0;
            x->gp[at] = wide ? g->p[l] * r[i] : 0.0, x->gq[at] = wide ? g->q[l] * r[i] : 0.0;
            x->grad_lo[at] = g->lo[l], x->grad_hi[at] = g->hi[l];
            x->slope_lo[at] = wide ? g->lo[l] * r[i] : 0.0, x->slope_hi[at] = wide ? g->hi[l] * r[i] : 0.0;
            for (size_t j = 0; j < n; j++)
                x->gA[at * n + j] = terms_of(g)[j][l] * r[i];
        }
    }
}

static size_t larger_size(size_t a, size_t b) { return a > b ? a : b; }

/* Doubles for the largest of the tapes, which are run one after the other. */
static size_t memory_of_runs(const Form *form)
{
    size_t first = form->values.length ? memory_of_run(&form->values, form->n, 2) : 0;
    size_t objective = form->objective.length ? memory_of_run(&form->objective, form->n, 1) : 0;
    return larger_size(larger_size(first, objective), memory_of_run(&form->tape, form->n, 1));
}

/* Boxes that are open after the first pass, and the scores of their variables. */
typedef struct {
    Py_ssize_t *open;
    double *scores;
} Kept;

/* Rows of a box that are known at once. */
static size_t rows_needed(const Form *form)
{
    return larger_size((size_t)rows_of(form), (size_t)(form->expressions + rows_of_tangents(form)));
}

/* The first pass over a box, and again with tangents to its squares where it is still open: whether it is closed. */
static int pass_first(const Form *form, Box *x, const double *centre, Report *report, Py_ssize_t at, double threshold,
                      double *scores)
{
    int closed = judge2(form, x, centre, report, at, threshold, scores, FIRST);
    if (closed <= 0 && form->tangents && take_tangents(form, x))
        closed = judge2(form, x, centre, report, at, threshold, scores, closed ? UNDEFINED_BEFORE : DEFINED_BEFORE);
    return closed > 0;
}

static void examine_range(const Form *form, Report *report, Py_ssize_t begin, Py_ssize_t finish, double threshold,
                          double *memory, Kept *kept)
{
    size_t n = (size_t)form->n, E = rows_needed(form), J = form->quotients ? (size_t)form->functions : 0;
    double *rest = memory, *registers = carve(&rest, memory_of_runs(form));
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

    int passes = form->values.length > 0 && !report->models, in_turn = passes && form->objective.length > 0;
    double *scores = in_turn ? kept->scores : NULL;
    Py_ssize_t count = 0;
    if (passes) {
        Run first = prepare(&form->values, form->n, 2, registers);
        for (Py_ssize_t start = begin; start < finish; start += LANES) {
            run_block(&first, report->lower, report->upper, report->B, NULL, start, finish);
            for (int l = 0; l < LANES && start + l < finish; l++) {
                for (size_t i = 0; i < n; i++)
                    c[i] = first.box[CENTRE][i][l];
                read_form2(&x, form->values.outputs, first.out, l);
                if (!pass_first(form, &x, c, report, start + l, threshold, scores ? scores + (size_t)count * n : NULL))
                    kept->open[count++] = start + l;
            }
        }
    } else
        for (Py_ssize_t at = begin; at < finish; at++)
            kept->open[count++] = at;
    /* The gradients: of the functions first where there are many conditions, and of the rest where they may decide. */
    for (int alone = in_turn; alone >= 0; alone--) {
        Run run = prepare(alone ? &form->objective : &form->tape, form->n, 1, registers);
        Py_ssize_t left = 0;
        x.R = alone ? form->functions : form->expressions;
        for (Py_ssize_t start = 0; start < count; start += LANES) {
            run_block(&run, report->lower, report->upper, report->B, kept->open, start, count);
            for (int l = 0; l < LANES && start + l < count; l++) {
                Py_ssize_t at = kept->open[start + l];
                for (size_t i = 0; i < n; i++)
                    c[i] = run.box[CENTRE][i][l], r[i] = run.box[RADIUS][i][l];
                read_forms(&x, (size_t)(x.R + 2 * form->quotients), run.out, l, r);
                add_quotients(form, &x, r, report->least ? report->least + at : NULL);
                if (judge(form, &x, c, r, report, at, threshold, passes, alone ? scores + (size_t)(start + l) * n : NULL))
                    kept->open[left++] = at;
            }
        }
        count = left;
    }
}

static size_t memory_needed(const Form *form)
{
    size_t n = (size_t)form->n, E = rows_needed(form), J = (size_t)form->functions;
    size_t vectors = 10 * E + 9 * E * n + 22 * n, matrices = (E + 4) * n * n + J * n * (n + 1);
    return memory_of_runs(form) + vectors + matrices;
}

#endif
