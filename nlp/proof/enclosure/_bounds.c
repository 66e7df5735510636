/* Kernel of every proof: forms of expressions over boxes, and the inner loops of the rules that use them.
 *
 * The tape is interpreted over LANES boxes at once, so that an instruction is fetched once for all of them and its
 * loops become vector instructions; the boxes are then examined one by one. docs/certificate.md explains the formulas.
 * tests/reference has them in NumPy, in the same order, in the modules that the headers name. The headers of kernel/ have
 * an idea each and belong to this one translation unit, so that the compiler sees all of it: values, univariate,
 * enclosure, quadratic, quotients, contraction, examination, secondorder, firstpass, tangents, blocks, enclosed, models,
 * rank.
 *
 * Rounding is to nearest. Never compile this with -ffast-math, which would drop the tests for NaN that keep boxes open;
 * nor with contraction to fused operations, which would make it differ from the reference.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "kernel/enclosed.h"
#include "kernel/models.h"
#include "kernel/rank.h"

typedef struct {
    Py_buffer buffers[24];
    int count;
} Borrowed;

/* Memory of an array, which must be contiguous and hold so many items of a size. NULL with an exception otherwise. */
static void *borrow(Borrowed *all, PyObject *object, Py_ssize_t items, Py_ssize_t size, int writable)
{
    Py_buffer *view = &all->buffers[all->count];
    if (PyObject_GetBuffer(object, view, writable ? PyBUF_WRITABLE | PyBUF_C_CONTIGUOUS : PyBUF_C_CONTIGUOUS) < 0)
        return NULL;
    all->count++;
    if (view->len != items * size) {
        PyErr_SetString(PyExc_ValueError, "an array has another size than the kernel expects");
        return NULL;
    }
    return view->buf;
}

static int read_tape(Borrowed *all, PyObject *tuple, Tape *tape)
{
    PyObject *code, *constants;
    if (!PyArg_ParseTuple(tuple, "OOiii", &code, &constants, &tape->length, &tape->registers, &tape->outputs))
        return -1;
    tape->code = borrow(all, code, (Py_ssize_t)tape->length * 6, sizeof(int), 0);
    tape->k = tape->code ? borrow(all, constants, tape->length, sizeof(double), 0) : NULL;
    return tape->k ? 0 : -1;
}

static PyObject *examine(PyObject *module, PyObject *args)
{
    PyObject *tape, *values, *objective, *equation, *depends, *low, *high, *whose, *squared, *arrays[12];
    PyObject *models = NULL, *least = NULL;
    Form form = {0};
    Report report = {0};
    Py_ssize_t begin, finish;
    double threshold;
    Borrowed all = {.count = 0};
    (void)module;
    if (!PyArg_ParseTuple(args, "(iiOOOOOO!OOO)(OOOOOOOOOOOO)nnnd|iOO", &form.n, &form.functions, &equation, &depends, &low,
                          &high, &whose, &PyTuple_Type, &tape, &values, &objective, &squared, &arrays[0], &arrays[1], &arrays[2],
                          &arrays[3], &arrays[4], &arrays[5], &arrays[6], &arrays[7], &arrays[8], &arrays[9],
                          &arrays[10], &arrays[11], &report.B, &begin, &finish, &threshold,
                          &report.shared, &models, &least))
        return NULL;
    int good = form.n > 0 && form.functions > 0 && read_tape(&all, tape, &form.tape) == 0;
    Py_ssize_t pairs = good ? PyObject_Length(whose) : 0;
    good = good && pairs >= 0 && (form.whose = borrow(&all, whose, pairs, sizeof(int), 0));
    form.quotients = (int)(pairs / 2);
    form.expressions = good ? form.tape.outputs / (form.n + 1) - 2 * form.quotients : 0;
    Py_ssize_t squares = good ? PyObject_Length(squared) : 0;
    good = good && squares >= 0 && (form.squared = borrow(&all, squared, squares, sizeof(int), 0));
    form.tangents = values == Py_None ? 0 : (int)squares;
    good = good && (values == Py_None || read_tape(&all, values, &form.values) == 0);
    good = good && (objective == Py_None || read_tape(&all, objective, &form.objective) == 0);
    Py_ssize_t n = form.n, R = form.expressions, B = report.B, D = sizeof(double), I = sizeof(int);
    good = good && (form.equation = borrow(&all, equation, R, I, 0)) && (form.depends = borrow(&all, depends, R * n, I, 0));
    good = good && (form.low = borrow(&all, low, n, D, 0)) && (form.high = borrow(&all, high, n, D, 0));
    good = good && (report.lower = borrow(&all, arrays[0], n * B, D, 0)) && (report.upper = borrow(&all, arrays[1], n * B, D, 0));
    good = good && (report.verdict = borrow(&all, arrays[2], B, I, 1)) && (report.reason = borrow(&all, arrays[3], B, I, 1));
    good = good && (report.bound = borrow(&all, arrays[4], B, D, 1));
    good = good && (report.left_lower = borrow(&all, arrays[5], n * B, D, 1));
    good = good && (report.left_upper = borrow(&all, arrays[6], n * B, D, 1));
    good = good && (report.cut_lower = borrow(&all, arrays[7], n * B, I, 1));
    good = good && (report.cut_upper = borrow(&all, arrays[8], n * B, I, 1));
    good = good && (report.split = borrow(&all, arrays[9], B, I, 1)) && (report.value = borrow(&all, arrays[10], B, D, 1));
    good = good && (report.centre = borrow(&all, arrays[11], n * B, D, 1));
    if (good && models) {
        int valid = report.shared >= 0 && report.shared <= form.n;
        Py_ssize_t rows = valid ? rows_of_models(form.n, report.shared) : -1;
        good = (report.models = borrow(&all, models, rows * B, D, 1)) != NULL;
    } else if (report.shared != 0) {
        report.shared = 0;
    }
    if (good && models && least)
        good = (report.least = borrow(&all, least, B, D, 0)) != NULL;
    double *memory = NULL;
    int fits = form.functions <= R && form.tape.outputs == rows_of(&form) * (n + 1) && begin >= 0 && finish <= B;
    for (int k = 0; good && k < form.quotients; k++)
        fits = fits && form.whose[2 * k] >= 0 && form.whose[2 * k] < form.functions;
    for (int k = 0; good && k < form.tangents; k++)
        fits = fits && form.squared[k] >= 0 && form.squared[k] < form.functions;
    fits = fits && (values == Py_None || form.values.outputs == R + rows_of_tangents(&form));
    fits = fits && (values == Py_None || n <= MOST_VARIABLES);
    if (good && !(fits && (objective == Py_None || form.objective.outputs == form.functions * (n + 1)))) {
        PyErr_SetString(PyExc_ValueError, "the kernel got parts that do not belong together");
        good = 0;
    }
    size_t count = finish > begin ? (size_t)(finish - begin) : 1;
    Kept kept = {NULL, NULL};
    if (good) {
        memory = calloc(memory_needed(&form), sizeof(double));
        kept.open = malloc(count * sizeof(Py_ssize_t));
        kept.scores = malloc((form.objective.length ? count * (size_t)n : 1) * sizeof(double));
    }
    int ready = memory && kept.open && kept.scores;
    if (good && !ready)
        PyErr_NoMemory();
    if (ready) {
        Py_BEGIN_ALLOW_THREADS
        examine_range(&form, &report, begin, finish, threshold, memory, &kept);
        Py_END_ALLOW_THREADS
    }
    free(memory);
    free(kept.open);
    free(kept.scores);
    for (int i = 0; i < all.count; i++)
        PyBuffer_Release(&all.buffers[i]);
    if (!ready)
        return NULL;
    Py_RETURN_NONE;
}

static PyObject *enclose(PyObject *module, PyObject *args)
{
    PyObject *tuple, *arrays[9];
    Tape tape = {0};
    Enclosed found = {.order = 1};
    int n;
    Borrowed all = {.count = 0};
    (void)module;
    if (!PyArg_ParseTuple(args, "iO!(OOOOOOOOO)n|i", &n, &PyTuple_Type, &tuple, &arrays[0], &arrays[1], &arrays[2],
                          &arrays[3], &arrays[4], &arrays[5], &arrays[6], &arrays[7], &arrays[8], &found.B,
                          &found.order))
        return NULL;
    int good = n > 0 && (found.order == 1 || n <= MOST_VARIABLES) && found.B > 0 && read_tape(&all, tuple, &tape) == 0;
    Py_ssize_t R = tape.outputs, B = found.B, D = sizeof(double);
    good = good && (found.lower = borrow(&all, arrays[0], n * B, D, 0)) && (found.upper = borrow(&all, arrays[1], n * B, D, 0));
    good = good && (found.c = borrow(&all, arrays[2], R * B, D, 1)) && (found.p = borrow(&all, arrays[3], R * B, D, 1));
    good = good && (found.q = borrow(&all, arrays[4], R * B, D, 1)) && (found.s = borrow(&all, arrays[5], R * B, D, 1));
    good = good && (found.lo = borrow(&all, arrays[6], R * B, D, 1)) && (found.hi = borrow(&all, arrays[7], R * B, D, 1));
    good = good && (found.a = borrow(&all, arrays[8], R * (Py_ssize_t)terms_to_enclose(n, found.order) * B, D, 1));
    double *memory = NULL;
    if (good && !(memory = calloc(memory_to_enclose(&tape, n, found.order), sizeof(double))))
        PyErr_NoMemory();
    if (memory) {
        Py_BEGIN_ALLOW_THREADS
        enclose_all(&tape, n, &found, memory);
        Py_END_ALLOW_THREADS
    } else if (!PyErr_Occurred()) {
        PyErr_SetString(PyExc_ValueError, "the kernel got no variables or no boxes");
    }
    free(memory);
    for (int i = 0; i < all.count; i++)
        PyBuffer_Release(&all.buffers[i]);
    if (!memory)
        return NULL;
    Py_RETURN_NONE;
}

static PyObject *models(PyObject *module, PyObject *args)
{
    PyObject *arrays[7], *first, *low = NULL, *high = NULL;
    Models found = {0};
    Borrowed all = {.count = 0};
    (void)module;
    if (!PyArg_ParseTuple(args, "i(OOOOOOO)nO|OO", &found.n, &arrays[0], &arrays[1], &arrays[2], &arrays[3], &arrays[4],
                          &arrays[5], &arrays[6], &found.B, &first, &low, &high))
        return NULL;
    Py_ssize_t n = found.n, B = found.B, D = sizeof(double), rows[] = {1, n, n * n, n, n, n, 1};
    const double **inputs[] = {&found.middle,   &found.b,        &found.H,       &found.w,
                               &found.slope_lo, &found.slope_hi, &found.rounding};
    int good = n > 0 && B > 0;
    if (!good)
        PyErr_SetString(PyExc_ValueError, "the kernel got no variables or no boxes");
    for (int i = 0; good && i < 7; i++)
        good = (*inputs[i] = borrow(&all, arrays[i], rows[i] * B, D, 0)) != NULL;
    if (good && high)
        good = (found.level = borrow(&all, first, B, D, 0)) && (found.low = borrow(&all, low, n * B, D, 1)) &&
               (found.high = borrow(&all, high, n * B, D, 1));
    else if (good)
        good = (found.bound = borrow(&all, first, B, D, 1)) != NULL;
    double *memory = good ? malloc(memory_for_models(found.n) * sizeof(double)) : NULL;
    if (good && !memory)
        PyErr_NoMemory();
    if (memory) {
        Py_BEGIN_ALLOW_THREADS
        if (found.bound)
            bound_models(&found, memory);
        else
            reach_models(&found, memory);
        Py_END_ALLOW_THREADS
    }
    free(memory);
    for (int i = 0; i < all.count; i++)
        PyBuffer_Release(&all.buffers[i]);
    if (!memory)
        return NULL;
    Py_RETURN_NONE;
}

static PyObject *rank(PyObject *module, PyObject *args)
{
    PyObject *tuple, *at, *scale, *constant, *arrays[6], *change = Py_None;
    Tape tape = {0};
    Matrix matrix = {0};
    Ranks found = {0};
    int n;
    Borrowed all = {.count = 0};
    (void)module;
    if (!PyArg_ParseTuple(args, "iO!(iiiOOO)(OOOOOO)n|O", &n, &PyTuple_Type, &tuple, &matrix.rows, &matrix.columns,
                          &matrix.nullity, &at, &scale, &constant, &arrays[0], &arrays[1], &arrays[2], &arrays[3],
                          &arrays[4], &arrays[5], &found.B, &change))
        return NULL;
    int good = n > 0 && found.B > 0 && read_tape(&all, tuple, &tape) == 0;
    Py_ssize_t B = found.B, D = sizeof(double), E = matrix.entries = tape.outputs;
    good = good && n <= MOST_VARIABLES && matrix.columns > 0 && matrix.columns <= 64 && matrix.nullity >= 0 && matrix.nullity < matrix.columns &&
           matrix.rows + matrix.nullity >= matrix.columns;
    good = good && (matrix.at = borrow(&all, at, 2 * E, sizeof(int), 0)) && (matrix.scale = borrow(&all, scale, E, D, 0));
    good = good && (matrix.constant = borrow(&all, constant, (Py_ssize_t)matrix.rows * matrix.columns, D, 0));
    good = good && (found.lower = borrow(&all, arrays[0], n * B, D, 0)) && (found.upper = borrow(&all, arrays[1], n * B, D, 0));
    good = good && (found.regular = borrow(&all, arrays[2], B, sizeof(int), 1));
    good = good && (found.shares = borrow(&all, arrays[3], n * B, D, 1)) && (found.smallest = borrow(&all, arrays[4], B, D, 1));
    good = good && (found.sign = borrow(&all, arrays[5], B, sizeof(int), 1));
    good = good && (change == Py_None || (found.change = borrow(&all, change, E * B, D, 0)));
    for (Py_ssize_t e = 0; good && e < E; e++)
        good = matrix.at[2 * e] >= 0 && matrix.at[2 * e] < matrix.rows && matrix.at[2 * e + 1] >= 0 &&
               matrix.at[2 * e + 1] < matrix.columns;
    double *memory = NULL;
    if (good && !(memory = calloc(memory_for_ranks(&tape, &matrix, n), sizeof(double))))
        PyErr_NoMemory();
    if (memory) {
        Py_BEGIN_ALLOW_THREADS
        rank_all(&tape, &matrix, n, &found, memory);
        Py_END_ALLOW_THREADS
    } else if (!PyErr_Occurred()) {
        PyErr_SetString(PyExc_ValueError, "the kernel got parts that do not belong together");
    }
    free(memory);
    for (int i = 0; i < all.count; i++)
        PyBuffer_Release(&all.buffers[i]);
    if (!memory)
        return NULL;
    Py_RETURN_NONE;
}

static PyMethodDef methods[] = {
    {"rank", rank, METH_VARARGS,
     "rank(n, tape, (rows, columns, nullity, at, scale, constant), (lower, upper, regular, shares, smallest, sign), B,\n"
     "     change=None)\n\n"
     "Judge the rank of a matrix over B boxes: arrays (n, B), (B,) of int, (n, B), (B,) and (B,) of int; (entries, B)."},
    {"models", models, METH_VARARGS,
     "models(n, (middle, b, H, w, slope_lo, slope_hi, rounding), B, bound)\n"
     "models(n, (...), B, level, low, high)\n\n"
     "Write upper bounds (B,) of B quadratic models, or the ends (n, B) of points that can reach levels (B,)."},
    {"enclose", enclose, METH_VARARGS,
     "enclose(n, tape, (lower, upper, c, p, q, s, lo, hi, a), B, order=1)\n\n"
     "Write forms and ranges of the results of a tape over B boxes: arrays (n, B), (R, B), and (R, n, B) for a; with order 2\n"
     "a has the coefficients of pairs of variables too."},
    {"examine", examine, METH_VARARGS,
     "examine((n, functions, equation, depends, low, high, whose, tape, values, objective, squared), arrays, B,\n"
     "        begin, finish, threshold, shared=0, models=None, least=None)\n\n"
     "Examine the boxes begin <= i < finish of B; a tape is (code, constants, length, registers, results).\n"
     "values is the tape of the expressions without their gradients and the rows for tangents to squares, whose functions\n"
     "are in squared, or None; objective that of the functions and\n"
     "their gradients where conditions are evaluated only if needed, or None.\n"
     "With models the first variables are shared with other limbs."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "_bounds", "Bounds over lists of boxes.", -1, methods,
                                    NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__bounds(void) { return PyModule_Create(&module); }
