/* Enclosures of a tape's results over many boxes, for other searches than that of a whole box; first_order.py. */
#ifndef ENCLOSED_H
#define ENCLOSED_H

#include "blocks.h"

typedef struct {
    const double *lower, *upper;  /* (n, B) */
    double *c, *p, *q, *s, *lo, *hi, *a; /* (R, B), a: (R, n, B), or (R, n + n (n + 1) / 2, B) for forms of second order */
    Py_ssize_t B;
    int order;
} Enclosed;

static size_t terms_to_enclose(int n, int order) { return (size_t)n + (order > 1 ? pairs_of(n) : 0); }

static size_t stride_to_enclose(int n, int order)
{
    Form form = {.n = n};
    return order > 1 ? stride_of_form2(n) : stride_of_value(&form);
}

static size_t memory_to_enclose(const Tape *tape, int n, int order)
{
    return (size_t)(tape->registers + tape->outputs) * stride_to_enclose(n, order) +
           (4 * (size_t)n + terms_to_enclose(n, order)) * LANES;
}

static void enclose_all(const Tape *tape, int n, Enclosed *found, double *memory)
{
    Py_ssize_t B = found->B;
    Form form = {.n = n};
    Report report = {.B = B, .lower = found->lower, .upper = found->upper};
    Store work = {memory, stride_to_enclose(n, found->order)}, out = work;
    size_t terms = terms_to_enclose(n, found->order);
    double *rest = memory;
    carve(&rest, (size_t)tape->registers * work.stride);
    out.memory = carve(&rest, (size_t)tape->outputs * out.stride);
    Lane *lanes[5];
    for (int i = 0; i < 5; i++)
        lanes[i] = (Lane *)carve(&rest, (i < 4 ? (size_t)n : terms) * LANES);
    for (Py_ssize_t start = 0; start < B; start += LANES) {
        load(&form, &report, NULL, start, B, lanes[0], lanes[1], lanes[2], lanes[3]);
        (found->order > 1 ? run2 : run)(tape, n, work, out, lanes[0], lanes[1], lanes[2], lanes[3], lanes[4]);
        Py_ssize_t lanes_used = B - start < LANES ? B - start : LANES;
        for (int k = 0; k < tape->outputs; k++) {
            Value *v = value_of(out, k); /* also the first part of a form of second order */
            const Lane *a = found->order > 1 ? terms_of_form2((Form2 *)v) : terms_of(v);
            size_t at = (size_t)(k * B + start), bytes = (size_t)lanes_used * sizeof(double);
            memcpy(found->c + at, v->c, bytes), memcpy(found->p + at, v->p, bytes);
            memcpy(found->q + at, v->q, bytes), memcpy(found->s + at, v->s, bytes);
            memcpy(found->lo + at, v->lo, bytes), memcpy(found->hi + at, v->hi, bytes);
            for (size_t i = 0; i < terms; i++)
                memcpy(found->a + ((size_t)k * terms + i) * (size_t)B + start, a[i], bytes);
        }
    }
}

#endif
