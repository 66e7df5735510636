/* Blocks of LANES boxes: runs of the tapes, then the examination of each box. */
#ifndef BLOCKS_H
#define BLOCKS_H

#include "firstpass.h"
#include "quotients.h"
#include "runs.h"

static void read_value(Box *x, size_t k, const Value *v, Py_ssize_t l)
{
    x->c[k] = v->c[l], x->p[k] = v->p[l], x->q[k] = v->q[l], x->s[k] = v->s[l], x->lo[k] = v->lo[l], x->hi[k] = v->hi[l];
}

/* Reads second-order forms of a box: centre, gradient and matrix of each row. */
static void read_second(Box *x, int rows, Store out, Py_ssize_t l)
{
    int n = x->n;
    for (int k = 0; k < rows; k++) {
        const Lane *a = terms_of(value_of(out, k));
        read_value(x, (size_t)k, value_of(out, k), l);
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

/* Reads values and gradients of E rows over a box; gradients are multiplied by the radii r. */
static void read_gradients(Box *x, size_t E, Store out, Py_ssize_t l)
{
    size_t n = (size_t)x->n;
    const double *r = x->radius;
    for (size_t k = 0; k < E; k++) {
        read_value(x, k, value_of(out, (int)k), l);
        for (size_t i = 0, at = k * n; i < n; i++, at++) {
            Value *g = value_of(out, (int)(E + at));
            int wide = r[i] > 0;
            x->gb[at] = wide ? g->c[l] * r[i] : 0.0, x->gs[at] = wide ? g->s[l] * r[i] : 0.0;
            x->gp[at] = wide ? g->p[l] * r[i] : 0.0, x->gq[at] = wide ? g->q[l] * r[i] : 0.0;
            x->grad_lo[at] = g->lo[l], x->grad_hi[at] = g->hi[l];
            x->slope_lo[at] = wide ? g->lo[l] * r[i] : 0.0, x->slope_hi[at] = wide ? g->hi[l] * r[i] : 0.0;
            for (size_t j = 0; j < n; j++)
                x->gA[at * n + j] = terms_of(g)[j][l] * r[i];
        }
    }
}

/* Examines boxes; without memory, only counts the memory that is needed. The tapes run one after the other in the same
 * memory: expressions without gradients (the first pass); functions and their gradients if there are many conditions; and
 * all gradients, on the boxes where they may decide. */
static void examine_range(const Form *form, Report *report, Py_ssize_t begin, Py_ssize_t finish, double threshold, Room *room)
{
    size_t n = (size_t)form->n, boxes = (size_t)(finish - begin), behind = room->used;
    int passes = form->values.length > 0 && !report->models, in_turn = passes && form->objective.length > 0;
    const Tape *tapes[] = {passes ? &form->values : NULL, in_turn ? &form->objective : NULL, &form->tape};
    Run runs[COUNT(tapes)];
    for (size_t stage = 0; stage < COUNT(tapes); stage++)
        if (tapes[stage]) {
            Room same = {room->at, room->used};
            runs[stage] = prepare(tapes[stage], form->n, stage ? 1 : 2, &same);
            behind = same.used > behind ? same.used : behind;
        }
    room->used = behind;
    int rows = rows_of(form), others = form->expressions + rows_of_tangents(form);
    Box x = lay_box(form->n, (size_t)(rows > others ? rows : others), room);
    Py_ssize_t *open = (Py_ssize_t *)carve(room, boxes), count = finish - begin;
    double *scores = in_turn ? carve(room, boxes * n) : NULL; /* scores of the variables of open boxes */
    if (!room->at)
        return;
    x.J = form->functions, x.squares = form->quotients > 0;
    for (Py_ssize_t k = 0; k < count; k++)
        open[k] = begin + k;
    for (size_t stage = 0; stage < COUNT(tapes); stage++) {
        Py_ssize_t left = 0;
        x.is_second = stage == 0, x.R = stage == 1 ? form->functions : form->expressions;
        for (Py_ssize_t start = 0; tapes[stage] && start < count; start += LANES) {
            const Run *run = &runs[stage];
            run_block(run, report->lower, report->upper, report->B, open, start, count);
            for (Py_ssize_t l = 0; l < LANES && start + l < count; l++) {
                Py_ssize_t at = open[start + l];
                int is_open;
                for (size_t i = 0; i < n; i++)
                    x.centre[i] = run->box[CENTRE][i][l], x.radius[i] = run->box[RADIUS][i][l];
                if (stage == 0) {
                    read_second(&x, form->values.outputs, run->out, l);
                    is_open = pass_first(form, &x, report, at, threshold, scores ? scores + (size_t)left * n : NULL);
                } else {
                    read_gradients(&x, (size_t)(x.R + 2 * form->quotients), run->out, l);
                    add_quotients(form, &x, report->least ? report->least + at : NULL);
                    is_open = judge(form, &x, report, at, threshold, passes, stage == 1 ? scores + (size_t)(start + l) * n : NULL);
                }
                if (is_open)
                    open[left++] = at;
            }
        }
        count = tapes[stage] ? left : count;
    }
}

#endif
