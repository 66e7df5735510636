/* Enclosures of a tape's results over many boxes, for other searches than that of a whole box; first_order.py. */
#ifndef ENCLOSED_H
#define ENCLOSED_H

#include "blocks.h"

typedef struct {
    const double *lower, *upper;  /* (n, B) */
    double *c, *p, *q, *s, *a;    /* (R, B), a: (R, n, B) */
    Py_ssize_t B;
} Enclosed;

static size_t memory_to_enclose(const Tape *tape, int n)
{
    Form form = {.n = n};
    return (size_t)(tape->registers + tape->outputs) * stride_of_value(&form) + 5 * (size_t)n * LANES;
}

static void enclose_all(const Tape *tape, int n, Enclosed *found, double *memory)
{
    Py_ssize_t B = found->B;
    Form form = {.n = n};
    Report report = {.B = B, .lower = found->lower, .upper = found->upper};
    Store work = {memory, stride_of_value(&form)}, out = work;
    double *rest = memory;
    carve(&rest, (size_t)tape->registers * work.stride);
    out.memory = carve(&rest, (size_t)tape->outputs * out.stride);
    Lane *lanes[5];
    for (int i = 0; i < 5; i++)
        lanes[i] = (Lane *)carve(&rest, (size_t)n * LANES);
    for (Py_ssize_t start = 0; start < B; start += LANES) {
        load(&form, &report, NULL, start, B, lanes[0], lanes[1], lanes[2], lanes[3]);
        run(tape, n, work, out, lanes[0], lanes[1], lanes[2], lanes[3], lanes[4]);
        Py_ssize_t lanes_used = B - start < LANES ? B - start : LANES;
        for (int k = 0; k < tape->outputs; k++) {
            Value *v = value_of(out, k);
            size_t at = (size_t)(k * B + start), bytes = (size_t)lanes_used * sizeof(double);
            memcpy(found->c + at, v->c, bytes), memcpy(found->p + at, v->p, bytes);
            memcpy(found->q + at, v->q, bytes), memcpy(found->s + at, v->s, bytes);
            for (int i = 0; i < n; i++)
                memcpy(found->a + ((size_t)k * (size_t)n + (size_t)i) * (size_t)B + start, terms_of(v)[i], bytes);
        }
    }
}

#endif
