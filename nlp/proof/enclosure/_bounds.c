/* Kernel of every proof: forms of expressions over boxes, and the inner loops of the rules that use them.
 *
 * The tape is interpreted over LANES boxes at once, so that an instruction is fetched once for all of them and its
 * loops become vector instructions; the boxes are then examined one by one. docs/certificate.md explains the formulas.
 * tests/reference has them in NumPy, in the same order, in the modules that the headers name. Each header of kernel/ has
 * one idea, and all belong to this one translation unit, so that the compiler sees everything: values, univariate, forms,
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

/* An array that a call borrows: destination of its address, number and size of its items, whether they are written, and
 * whether None is allowed. */
typedef struct {
    void *to;
    Py_ssize_t items;
    size_t size;
    int is_written, is_optional;
} Array;

#define READ(to, items) {&(to), items, sizeof *(to), 0, 0}
#define WRITE(to, items) {&(to), items, sizeof *(to), 1, 0}
#define MAY_READ(to, items) {&(to), items, sizeof *(to), 0, 1}
#define MAY_WRITE(to, items) {&(to), items, sizeof *(to), 1, 1}

/* Borrows the memory of the objects of a tuple, which must be contiguous. Returns 0 if an object is not as expected. */
static int borrow(Borrowed *all, PyObject *tuple, const Array *arrays, size_t count)
{
    int good = PyTuple_Size(tuple) == (Py_ssize_t)count;
    for (size_t i = 0; good && i < count; i++) {
        PyObject *object = PyTuple_GetItem(tuple, (Py_ssize_t)i);
        Py_buffer *view = &all->buffers[all->count];
        if (arrays[i].is_optional && object == Py_None)
            continue;
        good = PyObject_GetBuffer(object, view, PyBUF_C_CONTIGUOUS | (arrays[i].is_written ? PyBUF_WRITABLE : 0)) == 0;
        all->count += good;
        if (good)
            memcpy(arrays[i].to, &view->buf, sizeof view->buf);
        good = good && view->len == arrays[i].items * (Py_ssize_t)arrays[i].size;
    }
    return good;
}

#define BORROW(tuple, ...) borrow(&all, tuple, (Array[]){__VA_ARGS__}, COUNT(((Array[]){__VA_ARGS__})))

/* Reads a tape; None is an empty tape. */
static int read_tape(Borrowed *all, PyObject *tuple, Tape *tape)
{
    PyObject *arrays;
    if (tuple == Py_None)
        return 1;
    if (!PyArg_ParseTuple(tuple, "O!iii", &PyTuple_Type, &arrays, &tape->length, &tape->registers, &tape->outputs))
        return 0;
    Array both[] = {READ(tape->code, (Py_ssize_t)tape->length * 6), READ(tape->k, tape->length)};
    return borrow(all, arrays, both, COUNT(both));
}

/* Allocates the counted memory for a call with valid arguments; otherwise returns 0 with an exception. */
static int is_ready(int good, Room *room)
{
    *room = (Room){good ? calloc(room->used, sizeof(double)) : NULL, 0};
    if (good && !room->at)
        PyErr_NoMemory();
    else if (!good && !PyErr_Occurred())
        PyErr_SetString(PyExc_ValueError, "the kernel got parts that do not belong together, or no boxes");
    return room->at != NULL;
}

/* Makes a call with valid arguments; it counts the memory first. */
#define CALL(good, call)                                                                                               \
    if (good)                                                                                                          \
        call;                                                                                                          \
    if (is_ready(good, &room)) {                                                                                       \
        Py_BEGIN_ALLOW_THREADS                                                                                         \
        call;                                                                                                          \
        Py_END_ALLOW_THREADS                                                                                           \
    }

/* Releases the borrowed memory of a call, and returns its result. */
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
    PyObject *parts, *tape, *values, *objective, *arrays;
    Form form = {0};
    Report report = {0};
    Py_ssize_t begin, finish;
    double threshold;
    Borrowed all = {.count = 0};
    Room room = {0};
    (void)module;
    if (!PyArg_ParseTuple(args, "(iiiiO!OOO)O!nnndi", &form.n, &form.functions, &form.quotients, &form.tangents,
                          &PyTuple_Type, &parts, &tape, &values, &objective, &PyTuple_Type, &arrays, &report.B, &begin,
                          &finish, &threshold, &report.shared))
        return NULL;
    int good = form.n > 0 && form.functions > 0 && form.quotients >= 0 && form.tangents >= 0 && report.shared >= 0 &&
               report.shared <= form.n && read_tape(&all, tape, &form.tape) && read_tape(&all, values, &form.values) &&
               read_tape(&all, objective, &form.objective);
    form.expressions = form.tape.outputs / (form.n + 1) - 2 * form.quotients;
    Py_ssize_t n = form.n, R = form.expressions, B = report.B;
    good = good && BORROW(parts, READ(form.equation, R), READ(form.depends, R * n), READ(form.low, n), READ(form.high, n),
                          READ(form.whose, 2 * form.quotients), READ(form.squared, form.tangents));
    good = good && BORROW(arrays, READ(report.lower, n * B), READ(report.upper, n * B), WRITE(report.verdict, B),
                          WRITE(report.reason, B), WRITE(report.bound, B), WRITE(report.left_lower, n * B),
                          WRITE(report.left_upper, n * B), WRITE(report.cut_lower, n * B), WRITE(report.cut_upper, n * B),
                          WRITE(report.split, B), WRITE(report.value, B), WRITE(report.centre, n * B),
                          MAY_WRITE(report.models, rows_of_models(form.n, report.shared) * B), MAY_READ(report.least, B),
                          MAY_READ(report.tilts, (3 + n + n * n) * B));
    good = good && (!report.tilts || (report.models && report.shared == n));
    report.shared = report.models ? report.shared : 0;
    good = good && form.functions <= R && form.tape.outputs == rows_of(&form) * (n + 1) && begin >= 0 && begin <= finish && finish <= B;
    for (int k = 0; good && k < form.quotients; k++)
        good = form.whose[2 * k] >= 0 && form.whose[2 * k] < form.functions;
    for (int k = 0; good && k < form.tangents; k++)
        good = form.squared[k] >= 0 && form.squared[k] < form.functions;
    good = good && (!form.values.length || (form.values.outputs == R + rows_of_tangents(&form) && n <= MOST_VARIABLES));
    good = good && (!form.objective.length || form.objective.outputs == form.functions * (n + 1));
    CALL(good, examine_range(&form, &report, begin, finish, threshold, &room))
    return finish_call(&all, room);
}

static PyObject *enclose(PyObject *module, PyObject *args)
{
    PyObject *tuple, *arrays;
    Tape tape = {0};
    Forms found = {0};
    int n;
    Borrowed all = {.count = 0};
    Room room = {0};
    (void)module;
    if (!PyArg_ParseTuple(args, "iOO!ni", &n, &tuple, &PyTuple_Type, &arrays, &found.B, &found.order))
        return NULL;
    int good = n > 0 && (found.order == 1 || n <= MOST_VARIABLES) && found.B > 0 && read_tape(&all, tuple, &tape);
    Py_ssize_t B = found.B, rows = tape.outputs * B, terms = rows * (Py_ssize_t)terms_of_order(n, found.order);
    good = good && BORROW(arrays, READ(found.lower, n * B), READ(found.upper, n * B), WRITE(found.middle, rows),
                          WRITE(found.a, terms), WRITE(found.rest, rows));
    CALL(good, enclose_all(&tape, n, &found, &room))
    return finish_call(&all, room);
}

static PyObject *models(PyObject *module, PyObject *args)
{
    PyObject *arrays;
    Models found = {0};
    Borrowed all = {.count = 0};
    Room room = {0};
    (void)module;
    if (!PyArg_ParseTuple(args, "iO!n", &found.n, &PyTuple_Type, &arrays, &found.B))
        return NULL;
    Py_ssize_t n = found.n, B = found.B;
    int good = n > 0 && B > 0;
    good = good && BORROW(arrays, READ(found.middle, B), READ(found.b, n * B), READ(found.H, n * n * B), READ(found.w, n * B),
                          READ(found.slope_lo, n * B), READ(found.slope_hi, n * B), READ(found.rounding, B),
                          MAY_WRITE(found.bound, B), MAY_READ(found.level, B), MAY_WRITE(found.low, n * B),
                          MAY_WRITE(found.high, n * B));
    good = good && (found.level ? found.low && found.high : found.bound != NULL);
    CALL(good, use_models(&found, &room))
    return finish_call(&all, room);
}

static PyObject *rank(PyObject *module, PyObject *args)
{
    PyObject *parts, *arrays;
    Matrix matrix = {0};
    Ranks found = {0};
    Borrowed all = {.count = 0};
    Room room = {0};
    (void)module;
    if (!PyArg_ParseTuple(args, "(iiiO!)(iii)O!n", &matrix.rows, &matrix.columns, &matrix.entries, &PyTuple_Type, &parts,
                          &found.terms, &found.coordinates, &found.errors, &PyTuple_Type, &arrays, &found.B))
        return NULL;
    int good = found.coordinates >= 0 && found.errors >= 0 && found.errors % 3 == 0 && found.B > 0 &&
               found.coordinates + found.errors <= found.terms;
    good = good && matrix.entries >= 0 && matrix.columns > 0 && matrix.rows >= matrix.columns &&
           matrix.rows <= MOST_ROWS;
    Py_ssize_t B = found.B, E = matrix.entries, c = matrix.columns;
    good = good && BORROW(parts, READ(matrix.at, 2 * E), READ(matrix.scale, E));
    good = good && BORROW(arrays, READ(found.inverse, c * matrix.rows * B), READ(found.off, c * c * B),
                          READ(found.a, E * found.terms * B), READ(found.rest, E * B), WRITE(found.regular, B),
                          WRITE(found.shares, found.coordinates * B));
    for (Py_ssize_t e = 0; good && e < E; e++)
        good = matrix.at[2 * e] >= 0 && matrix.at[2 * e] < matrix.rows && matrix.at[2 * e + 1] >= 0 &&
               matrix.at[2 * e + 1] < matrix.columns;
    CALL(good, rank_all(&matrix, &found, &room))
    return finish_call(&all, room);
}

/* Arguments: see borrow and the calls of PyArg_ParseTuple above; each method has one caller in the package. */
static PyMethodDef methods[] = {
    {"rank", rank, METH_VARARGS, "Judge the rank of a matrix over B boxes."},
    {"models", models, METH_VARARGS, "Write upper bounds of B quadratic models, or the ends of points that can reach levels."},
    {"enclose", enclose, METH_VARARGS, "Write forms of the results of a tape over B boxes."},
    {"examine", examine, METH_VARARGS, "Examine the boxes begin <= i < finish of B."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "_bounds", "Bounds over lists of boxes.", -1, methods,
                                    NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__bounds(void) { return PyModule_Create(&module); }
