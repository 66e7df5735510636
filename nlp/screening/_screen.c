/* Searches of a program from many points by the solver of generated C, in this process.
 *
* The search has the source of nlp/embedding/c. CasADi evaluates the functions: its buffers are called through a C pointer
 * without Python, so that other threads can run. Each thread has its own buffers and workspace.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "screwsynth-search.h"

#define FEASIBLE 1e-9    /* largest violation of a feasible point, in half ranges, as in the evidence */
#define STATIONARY 1e-7  /* largest residual of a stationary point, as in the evidence */
#define RESTORES 2       /* largest number of searches for a feasible point in a search, as in generated C */
#define SHARE 4          /* allowed evaluations of a search for each iteration so far, as in generated C */
#define RESERVE 30       /* further allowed evaluations */

typedef void (*evaluator)(void *buffer);

/* Program in scaled variables (x - centre) / scale; weight: factor of F, which is minimised; sizes: divisors of constraints. */
typedef struct {
    int n, c, iterations;
    double weight;
    evaluator evaluate;
    void *derivatives, *curvature; /* CasADi's buffers; they read and write the arrays below */
    const double *centre, *scale, *sizes, *lower, *upper;
    double *x, *F, *gradient, *g, *jacobian, *factor, *multipliers, *hessian;
    const volatile int *stop; /* nonzero to end the search */
    int evaluations, visits;
} program;

static int is_finite(const double *values, int count)
{
    double sum = 0.0;
    for (int i = 0; i < count; i++)
        sum += values[i] * 0.0;
    return sum == 0.0;
}

static void move_to(program *of, const double *s)
{
    for (int i = 0; i < of->n; i++)
        of->x[i] = fmin(fmax(of->centre[i] + of->scale[i] * s[i], of->lower[i]), of->upper[i]);
}

/* CasADi stores matrices by columns, the search by rows. */
static int values(void *self, const double *s, double *f, double *gradient, double *g, double *rows)
{
    program *of = self;
    const int n = of->n, c = of->c;
    if (*of->stop || of->evaluations >= SHARE * of->visits + RESERVE)
        return 1;
    of->evaluations++;
    move_to(of, s);
    of->evaluate(of->derivatives);
    *f = of->weight * *of->F;
    for (int i = 0; i < n; i++)
        gradient[i] = of->weight * of->scale[i] * of->gradient[i];
    for (int j = 0; j < c; j++) {
        g[j] = of->g[j] / of->sizes[j];
        for (int i = 0; i < n; i++)
            rows[j * n + i] = of->jacobian[i * c + j] * of->scale[i] / of->sizes[j];
    }
    return !(is_finite(f, 1) && is_finite(gradient, n) && is_finite(g, c) && is_finite(rows, c * n));
}

static int hessian(void *self, const double *s, double weight, const double *multipliers, double *H)
{
    program *of = self;
    const int n = of->n;
    move_to(of, s);
    *of->factor = weight * of->weight;
    for (int j = 0; j < of->c; j++)
        of->multipliers[j] = multipliers[j] / of->sizes[j];
    of->evaluate(of->curvature);
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++)
            H[i * n + k] = of->hessian[k * n + i] * of->scale[i] * of->scale[k];
    return !is_finite(H, n * n);
}

/* Task of a search: program, and problem with the bounds of the constraints. */
typedef struct {
    program of;
    screwsynth_SQP_problem problem;
} task;

static int visit(void *self, const double *s, double f, const double *g, const double *rows, int *is_feasible)
{
    task *of = self; /* whose first member is the program */
    (void)s, (void)f, (void)rows;
    of->of.visits++;
    *is_feasible = screwsynth_SQP_violation(&of->problem, g) <= FEASIBLE;
    return *of->of.stop;
}

/* Searches from s, and again after a search for a feasible point if it ends infeasible. Returns 1 if it ends at an optimum;
 * u: n + c multipliers, positive at an upper bound and negative at a lower one. */
static int search_from(task *of, double *s, double *u, int *iterations, double *work, int *iwork)
{
    screwsynth_SQP_problem *p = &of->problem;
    screwsynth_SQP_end end;
    const int n = p->n, c = p->c;
    of->of.evaluations = of->of.visits = 0;
    *iterations = 0;
    for (int restores = 0;; restores++) {
        p->max_iterations = of->of.iterations - *iterations;
        if (p->max_iterations <= 0 || screwsynth_SQP(p, s, &end, work, iwork))
            return 0;
        *iterations += end.iterations;
        if (end.violation <= FEASIBLE)
            break;
        p->max_iterations = of->of.iterations - *iterations;
        if (restores == RESTORES || p->max_iterations <= 0)
            return 0;
        *iterations += screwsynth_SQP_restore(p, s, work, iwork);
    }
    for (int i = 0; i < n; i++)
        u[i] = end.multipliers[n + i] - end.multipliers[i];
    for (int j = 0; j < c; j++)
        u[n + j] = (end.multipliers[2 * n + c + j] - end.multipliers[2 * n + j]) / of->of.sizes[j];
    return end.is_minimum && end.residual <= STATIONARY;
}

/* ---- Python. ---- */

#define ARRAYS 24

typedef struct {
    Py_buffer views[ARRAYS];
    int count;
} borrowed;

/* Memory of a contiguous array of given item count and size. NULL with an exception otherwise. */
static void *borrow(borrowed *all, PyObject *object, Py_ssize_t items, Py_ssize_t size, int writable)
{
    Py_buffer *view = &all->views[all->count];
    if (PyObject_GetBuffer(object, view, writable ? PyBUF_WRITABLE | PyBUF_C_CONTIGUOUS : PyBUF_C_CONTIGUOUS) < 0)
        return NULL;
    all->count++;
    if (view->len != items * size) {
        PyErr_SetString(PyExc_ValueError, "an array has another size than the search expects");
        return NULL;
    }
    return view->buf;
}

static PyObject *search_each(PyObject *module, PyObject *args)
{
    PyObject *address, *derivatives, *curvature, *fixed[7], *written[8], *points, *found, *counts, *multipliers, *stop;
    task of = {{0}, {0}};
    program *p = &of.of;
    Py_ssize_t count, first, last;
    borrowed all = {.count = 0};
    double *ends = NULL, *u = NULL, *work = NULL;
    int *converged = NULL, *iterations = NULL, *iwork = NULL;
    (void)module;
    if (!PyArg_ParseTuple(args, "(OOOiiid(OOOOOOO)(OOOOOOOO))(OOOO)Onnn", &address, &derivatives, &curvature, &p->n, &p->c,
                          &p->iterations, &p->weight, &fixed[0], &fixed[1], &fixed[2], &fixed[3], &fixed[4], &fixed[5],
                          &fixed[6], &written[0], &written[1], &written[2], &written[3], &written[4], &written[5],
                          &written[6], &written[7], &points, &multipliers, &found, &counts, &stop, &count, &first, &last))
        return NULL;
    if (p->n < 1 || p->c < 0 || p->n > 10000 || p->c > 100000 || first < 0 || first > last || last > count) {
        PyErr_SetString(PyExc_ValueError, "the search got inconsistent sizes or indices");
        return NULL;
    }
    const Py_ssize_t n = p->n, c = p->c, D = sizeof(double), I = sizeof(int);
    void *function = PyLong_AsVoidPtr(address);
    memcpy(&p->evaluate, &function, sizeof function);
    p->derivatives = function ? PyCapsule_GetPointer(derivatives, PyCapsule_GetName(derivatives)) : NULL;
    p->curvature = p->derivatives ? PyCapsule_GetPointer(curvature, PyCapsule_GetName(curvature)) : NULL;
    int good = p->curvature != NULL;
    if (!good && !PyErr_Occurred())
        PyErr_SetString(PyExc_ValueError, "the search got no function to call");
    const double **constant[] = {&p->centre, &p->scale, &p->lower, &p->upper, &p->sizes, &of.problem.g_lower, &of.problem.g_upper};
    const Py_ssize_t lengths[] = {n, n, n, n, c, c, c};
    for (int i = 0; good && i < 7; i++)
        good = (*constant[i] = borrow(&all, fixed[i], lengths[i], D, 0)) != NULL;
    double **variable[] = {&p->x, &p->F, &p->gradient, &p->g, &p->jacobian, &p->factor, &p->multipliers, &p->hessian};
    const Py_ssize_t sizes[] = {n, 1, n, c, c * n, 1, c, n * n};
    for (int i = 0; good && i < 8; i++)
        good = (*variable[i] = borrow(&all, written[i], sizes[i], D, 1)) != NULL;
    good = good && (ends = borrow(&all, points, count * n, D, 1)) && (u = borrow(&all, multipliers, count * (n + c), D, 1));
    good = good && (converged = borrow(&all, found, count, I, 1)) && (iterations = borrow(&all, counts, count, I, 1));
    good = good && (p->stop = borrow(&all, stop, 1, I, 0));
    if (good) {
        work = malloc(((size_t)SCREWSYNTH_SQPWORK(n, c) + 3 * (size_t)n) * sizeof(double));
        iwork = malloc((size_t)(SCREWSYNTH_SQPIWORK(n, c) + 1) * sizeof(int));
        if (!work || !iwork) {
            PyErr_NoMemory();
            good = 0;
        }
    }
    if (good) {
        double *low = work + SCREWSYNTH_SQPWORK(n, c), *high = low + n, *s = high + n;
        for (Py_ssize_t i = 0; i < n; i++)
            low[i] = -1.0, high[i] = 1.0;
        of.problem.n = p->n, of.problem.c = p->c;
        of.problem.lower = low, of.problem.upper = high;
        of.problem.extent = 1.0;
        of.problem.values = values, of.problem.hessian = hessian, of.problem.visit = visit;
        of.problem.self = &of;
        Py_BEGIN_ALLOW_THREADS
        for (Py_ssize_t k = first; k < last && !*p->stop; k++) {
            double *x = ends + k * n;
            for (Py_ssize_t i = 0; i < n; i++)
                s[i] = fmin(fmax((x[i] - p->centre[i]) / p->scale[i], -1.0), 1.0);
            converged[k] = search_from(&of, s, u + k * (n + c), &iterations[k], work, iwork) && !*p->stop;
            move_to(p, s);
            memcpy(x, p->x, (size_t)n * sizeof *x);
        }
        Py_END_ALLOW_THREADS
    }
    free(work);
    free(iwork);
    for (int i = 0; i < all.count; i++)
        PyBuffer_Release(&all.views[i]);
    if (!good)
        return NULL;
    Py_RETURN_NONE;
}

static PyMethodDef methods[] = {
    {"search_each", search_each, METH_VARARGS,
     "search_each(program, (points, multipliers, converged, iterations), stop, count, first, last)\n\n"
     "Search from the points first <= k < last of count, and set them to the ends of the searches. A program is (address of\n"
     "CasADi's function that evaluates a buffer, buffer of the derivatives, buffer of the Hessian, n, c, iterations, weight,\n"
     "(centre, scale, lower, upper, sizes, g_lower, g_upper),\n"
     "(x, F, gradient, g, jacobian, factor, multipliers, hessian)); the last arrays are those of the buffers."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "_screen", "Searches from many points.", -1, methods,
                                    NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__screen(void) { return PyModule_Create(&module); }
