/* Kernel of every proof: forms of expressions over boxes, and the inner loops of the rules that use them.
 *
 * The tape is interpreted over LANES boxes at once, so that an instruction is fetched once for all of them and its
 * loops become vector instructions; the boxes are then examined one by one. docs/certificate.md explains the formulas.
 * tests/reference has them in NumPy, in the same order, in the modules that the headers name. The headers of kernel/ have
 * an idea each and belong to this one translation unit, so that the compiler sees all of it: values, univariate, forms,
 * runs, rank; quadratic, contraction, models, quotients, examination, tangents, firstpass, blocks.
 *
 * Rounding is to nearest. Never compile this with -ffast-math, which would drop the tests for NaN that keep boxes open;
 * nor with contraction to fused operations, which would make it differ from the reference.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "kernel/blocks.h"
#include "kernel/models.h"
#include "kernel/rank.h"

typedef struct {
    Py_buffer buffers[32];
    int count;
} Borrowed;

/* An array that a call borrows: where its address goes, its items, the size of each, and whether they are written. */
typedef struct {
    void *to;
    Py_ssize_t items;
    size_t size;
    int writable;
} Array;

#define READ(to, items) {&(to), items, sizeof *(to), 0}
#define WRITE(to, items) {&(to), items, sizeof *(to), 1}

/* Borrows the memory of one object, which must be contiguous. 0 with an exception where it is not as expected. */
static int borrow(Borrowed *all, PyObject *object, Array array)
{
    Py_buffer *view = &all->buffers[all->count];
    if (PyObject_GetBuffer(object, view, array.writable ? PyBUF_WRITABLE | PyBUF_C_CONTIGUOUS : PyBUF_C_CONTIGUOUS) < 0)
        return 0;
    all->count++;
    if (view->len != array.items * (Py_ssize_t)array.size) {
        PyErr_SetString(PyExc_ValueError, "an array has another size than the kernel expects");
        return 0;
    }
    memcpy(array.to, &view->buf, sizeof view->buf);
    return 1;
}

/* Borrows the objects of a tuple. */
static int borrow_all(Borrowed *all, PyObject *tuple, const Array *arrays, size_t count)
{
    int good = PyTuple_Size(tuple) == (Py_ssize_t)count;
    for (size_t i = 0; good && i < count; i++)
        good = borrow(all, PyTuple_GetItem(tuple, (Py_ssize_t)i), arrays[i]);
    return good;
}

/* Borrows indices of any number, which is written. */
static int borrow_indices(Borrowed *all, PyObject *object, const int **to, int *count)
{
    Py_ssize_t items = PyObject_Length(object);
    *count = (int)items;
    return items >= 0 && borrow(all, object, (Array)READ(*to, items));
}

static int read_tape(Borrowed *all, PyObject *tuple, Tape *tape)
{
    PyObject *code, *constants;
    return PyArg_ParseTuple(tuple, "OOiii", &code, &constants, &tape->length, &tape->registers, &tape->outputs) &&
           borrow(all, code, (Array)READ(tape->code, (Py_ssize_t)tape->length * 6)) &&
           borrow(all, constants, (Array)READ(tape->k, tape->length));
}

/* Gets the memory that was counted, for a call whose arguments are good; 0 with an exception otherwise. */
static int is_ready(int good, Room *room)
{
    *room = (Room){good ? calloc(room->used, sizeof(double)) : NULL, 0};
    if (good && !room->at)
        PyErr_NoMemory();
    else if (!good && !PyErr_Occurred())
        PyErr_SetString(PyExc_ValueError, "the kernel got parts that do not belong together, or no boxes");
    return room->at != NULL;
}

/* Makes a call where its arguments are good: counts its memory first. */
#define CALL(good, call)                                                                                               \
    if (good)                                                                                                          \
        call;                                                                                                          \
    if (is_ready(good, &room)) {                                                                                       \
        Py_BEGIN_ALLOW_THREADS                                                                                         \
        call;                                                                                                          \
        Py_END_ALLOW_THREADS                                                                                           \
    }

/* Returns what a call borrowed, and its result. */
static PyObject *finish_call(Borrowed *all, Room room)
{
    for (int i = 0; i < all->count; i++)
        PyBuffer_Release(&all->buffers[i]);
    if (!room.at)
        return NULL;
    free(room.at);
    Py_RETURN_NONE;
}

static PyObject *examine(PyObject *module, PyObject *args)
{
    PyObject *tape, *values, *objective, *equation, *depends, *low, *high, *whose, *squared, *arrays, *models = NULL;
    PyObject *least = Py_None, *tilts = Py_None;
    Form form = {0};
    Report report = {0};
    Py_ssize_t begin, finish;
    double threshold;
    Borrowed all = {.count = 0};
    Room room = {0};
    (void)module;
    if (!PyArg_ParseTuple(args, "(iiOOOOOO!OOO)O!nnnd|iOOO", &form.n, &form.functions, &equation, &depends, &low, &high,
                          &whose, &PyTuple_Type, &tape, &values, &objective, &squared, &PyTuple_Type, &arrays, &report.B,
                          &begin, &finish, &threshold, &report.shared, &models, &least, &tilts))
        return NULL;
    int good = form.n > 0 && form.functions > 0 && report.shared >= 0 && report.shared <= form.n && read_tape(&all, tape, &form.tape);
    good = good && borrow_indices(&all, whose, &form.whose, &form.quotients);
    good = good && borrow_indices(&all, squared, &form.squared, &form.tangents);
    good = good && (values == Py_None || read_tape(&all, values, &form.values));
    good = good && (objective == Py_None || read_tape(&all, objective, &form.objective));
    form.quotients /= 2;
    form.tangents = values == Py_None ? 0 : form.tangents;
    form.expressions = form.tape.outputs / (form.n + 1) - 2 * form.quotients;
    Py_ssize_t n = form.n, R = form.expressions, B = report.B;
    Array results[] = {READ(report.lower, n * B), READ(report.upper, n * B), WRITE(report.verdict, B), WRITE(report.reason, B),
                       WRITE(report.bound, B), WRITE(report.left_lower, n * B), WRITE(report.left_upper, n * B),
                       WRITE(report.cut_lower, n * B), WRITE(report.cut_upper, n * B), WRITE(report.split, B),
                       WRITE(report.value, B), WRITE(report.centre, n * B)};
    good = good && borrow(&all, equation, (Array)READ(form.equation, R)) && borrow(&all, depends, (Array)READ(form.depends, R * n));
    good = good && borrow(&all, low, (Array)READ(form.low, n)) && borrow(&all, high, (Array)READ(form.high, n));
    good = good && borrow_all(&all, arrays, results, COUNT(results));
    good = good && (!models || borrow(&all, models, (Array)WRITE(report.models, rows_of_models(form.n, report.shared) * B)));
    good = good && (least == Py_None || borrow(&all, least, (Array)READ(report.least, B)));
    good = good && (tilts == Py_None || (models && report.shared == n && borrow(&all, tilts, (Array)READ(report.tilts, (3 + n + n * n) * B))));
    report.shared = models ? report.shared : 0;
    good = good && form.functions <= R && form.tape.outputs == rows_of(&form) * (n + 1) && begin >= 0 && begin <= finish && finish <= B;
    for (int k = 0; good && k < form.quotients; k++)
        good = form.whose[2 * k] >= 0 && form.whose[2 * k] < form.functions;
    for (int k = 0; good && k < form.tangents; k++)
        good = form.squared[k] >= 0 && form.squared[k] < form.functions;
    good = good && (values == Py_None || (form.values.outputs == R + rows_of_tangents(&form) && n <= MOST_VARIABLES));
    good = good && (objective == Py_None || form.objective.outputs == form.functions * (n + 1));
    CALL(good, examine_range(&form, &report, begin, finish, threshold, &room))
    return finish_call(&all, room);
}

static PyObject *enclose(PyObject *module, PyObject *args)
{
    PyObject *tuple, *arrays;
    Tape tape = {0};
    Enclosed found = {.order = 1};
    int n;
    Borrowed all = {.count = 0};
    Room room = {0};
    (void)module;
    if (!PyArg_ParseTuple(args, "iO!O!n|i", &n, &PyTuple_Type, &tuple, &PyTuple_Type, &arrays, &found.B, &found.order))
        return NULL;
    int good = n > 0 && (found.order == 1 || n <= MOST_VARIABLES) && found.B > 0 && read_tape(&all, tuple, &tape);
    Py_ssize_t B = found.B, all_rows = tape.outputs * B;
    Array each[] = {READ(found.lower, n * B), READ(found.upper, n * B), WRITE(found.c, all_rows), WRITE(found.p, all_rows),
                    WRITE(found.q, all_rows), WRITE(found.s, all_rows), WRITE(found.lo, all_rows), WRITE(found.hi, all_rows),
                    WRITE(found.a, all_rows * (Py_ssize_t)terms_of_order(n, found.order))};
    good = good && borrow_all(&all, arrays, each, COUNT(each));
    CALL(good, enclose_all(&tape, n, &found, &room))
    return finish_call(&all, room);
}

static PyObject *models(PyObject *module, PyObject *args)
{
    PyObject *arrays, *first, *low = NULL, *high = NULL;
    Models found = {0};
    Borrowed all = {.count = 0};
    Room room = {0};
    (void)module;
    if (!PyArg_ParseTuple(args, "iO!nO|OO", &found.n, &PyTuple_Type, &arrays, &found.B, &first, &low, &high))
        return NULL;
    Py_ssize_t n = found.n, B = found.B;
    Array each[] = {READ(found.middle, B), READ(found.b, n * B), READ(found.H, n * n * B), READ(found.w, n * B),
                    READ(found.slope_lo, n * B), READ(found.slope_hi, n * B), READ(found.rounding, B)};
    int good = n > 0 && B > 0 && borrow_all(&all, arrays, each, COUNT(each));
    if (good && high)
        good = borrow(&all, first, (Array)READ(found.level, B)) && borrow(&all, low, (Array)WRITE(found.low, n * B)) &&
               borrow(&all, high, (Array)WRITE(found.high, n * B));
    else if (good)
        good = borrow(&all, first, (Array)WRITE(found.bound, B));
    CALL(good, use_models(&found, &room))
    return finish_call(&all, room);
}

static PyObject *rank(PyObject *module, PyObject *args)
{
    PyObject *tuple, *at, *scale, *constant, *arrays, *change = Py_None;
    Tape tape = {0};
    Matrix matrix = {0};
    Ranks found = {0};
    int n;
    Borrowed all = {.count = 0};
    Room room = {0};
    (void)module;
    if (!PyArg_ParseTuple(args, "iO!(iiiOOO)O!n|O", &n, &PyTuple_Type, &tuple, &matrix.rows, &matrix.columns,
                          &matrix.nullity, &at, &scale, &constant, &PyTuple_Type, &arrays, &found.B, &change))
        return NULL;
    int good = n > 0 && n <= MOST_VARIABLES && found.B > 0 && read_tape(&all, tuple, &tape);
    Py_ssize_t B = found.B, E = matrix.entries = tape.outputs;
    Array each[] = {READ(found.lower, n * B), READ(found.upper, n * B), WRITE(found.regular, B), WRITE(found.shares, n * B),
                    WRITE(found.smallest, B), WRITE(found.sign, B)};
    good = good && matrix.columns > 0 && matrix.columns <= 64 && matrix.nullity >= 0 && matrix.nullity < matrix.columns &&
           matrix.rows + matrix.nullity >= matrix.columns;
    good = good && borrow(&all, at, (Array)READ(matrix.at, 2 * E)) && borrow(&all, scale, (Array)READ(matrix.scale, E));
    good = good && borrow(&all, constant, (Array)READ(matrix.constant, (Py_ssize_t)matrix.rows * matrix.columns));
    good = good && borrow_all(&all, arrays, each, COUNT(each));
    good = good && (change == Py_None || borrow(&all, change, (Array)READ(found.change, E * B)));
    for (Py_ssize_t e = 0; good && e < E; e++)
        good = matrix.at[2 * e] >= 0 && matrix.at[2 * e] < matrix.rows && matrix.at[2 * e + 1] >= 0 &&
               matrix.at[2 * e + 1] < matrix.columns;
    CALL(good, rank_all(&tape, &matrix, n, &found, &room))
    return finish_call(&all, room);
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
     "        begin, finish, threshold, shared=0, models=None, least=None, tilts=None)\n\n"
     "Examine the boxes begin <= i < finish of B; a tape is (code, constants, length, registers, results).\n"
     "values is the tape of the expressions without their gradients and the rows for tangents to squares, whose functions\n"
     "are in squared, or None; objective that of the functions and\n"
     "their gradients where conditions are evaluated only if needed, or None.\n"
     "With models the first variables are shared with other limbs, whose tilts the part without variables of its own gets."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "_bounds", "Bounds over lists of boxes.", -1, methods,
                                    NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__bounds(void) { return PyModule_Create(&module); }
