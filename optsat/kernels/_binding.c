/* _binding: compiled kernels called on NumPy's arrays, every argument checked first.

   A kernel is a capsule. What a call does not take as it is, lists or strided arrays or numbers that are not finite,
   goes through a Python function that converts it or says what is wrong. Arrays are looked at and made through NumPy's
   C API: the buffer protocol, which describes each array in words, takes longer than most kernels. Under Python's
   limited API one binary serves every later Python, and compiled with the headers of NumPy 2 every NumPy from 1.26. */
#ifndef Py_LIMITED_API
#define Py_LIMITED_API 0x030B0000
#endif
#define NPY_NO_DEPRECATED_API NPY_1_22_API_VERSION
#include <Python.h>
#include <dlfcn.h>
#include <numpy/ndarrayobject.h>
#include <stdint.h>
#include <string.h>

enum {
    MAX_PORTS = 64,
    MAX_AXES = 2,
    SMALL_BATCH = 16, /* below, letting other threads run costs more than it gives */
    CHUNK = 256       /* samples that are checked and computed while they are in the cache */
};

static const char KERNEL[] = "optsat.kernels.kernel";

typedef int32_t (*call_t)(const void *const in[], void *const out[]);
typedef int64_t (*batch_t)(int64_t n, const void *const in[], const int64_t stride[], void *const out[], int32_t *status);
typedef void (*tiles_t)(int64_t tiles, const void *const in[], const int64_t stride[], void *const out[]);

typedef struct {
    Py_ssize_t size;
    int axes;
    npy_intp shape[MAX_AXES];
} port_t;

typedef struct {
    call_t call;
    batch_t batch;
    tiles_t tiles;
    int is_float;
    int width;
    int inputs;
    int outputs;
    PyArray_Descr *real;
    PyObject *statuses; /* by value; None where the kernel has none */
    PyObject *convert;
    port_t port[MAX_PORTS];
} kernel_t;

static kernel_t *kernel_of(PyObject *capsule)
{
    return (kernel_t *)PyCapsule_GetPointer(capsule, KERNEL);
}

static void kernel_free(PyObject *capsule)
{
    /* the library stays loaded: other capsules may point into it */
    kernel_t *kernel = kernel_of(capsule);
    if (kernel != NULL) {
        Py_XDECREF((PyObject *)kernel->real);
        Py_XDECREF(kernel->statuses);
        Py_XDECREF(kernel->convert);
        PyMem_Free(kernel);
    }
}

/* An exponent of all ones, of NaN and infinity, carries into the sign when one is added to it. The words stand side by
   side in vectors of 16 bytes, which any processor has; plain loops over them would take ten times as long. */
#if defined(__GNUC__)
typedef uint64_t doubles_t __attribute__((vector_size(16)));
typedef uint32_t floats_t __attribute__((vector_size(16)));
#else
typedef uint64_t doubles_t;
typedef uint32_t floats_t;
#endif

#define DEFINE_ALL_FINITE(NAME, WORD, LANES, EXPONENT, ONE)                \
    static int NAME(const char *memory, size_t count)                      \
    {                                                                      \
        LANES carried[4] = { { 0 } };                                      \
        LANES bits[4];                                                     \
        WORD words[4U * sizeof(LANES) / sizeof(WORD)];                     \
        const size_t block = 4U * sizeof(LANES) / sizeof(WORD);            \
        WORD rest = 0U;                                                    \
        size_t i = 0;                                                      \
        for (; i + block <= count; i += block) {                           \
            memcpy(bits, memory + i * sizeof(WORD), sizeof bits);          \
            carried[0] |= (bits[0] & (EXPONENT)) + (ONE);                  \
            carried[1] |= (bits[1] & (EXPONENT)) + (ONE);                  \
            carried[2] |= (bits[2] & (EXPONENT)) + (ONE);                  \
            carried[3] |= (bits[3] & (EXPONENT)) + (ONE);                  \
        }                                                                  \
        for (; i < count; ++i) {                                           \
            WORD word;                                                     \
            memcpy(&word, memory + i * sizeof(WORD), sizeof word);         \
            rest |= (word & (EXPONENT)) + (ONE);                           \
        }                                                                  \
        memcpy(words, carried, sizeof words);                              \
        for (size_t k = 0; k < block; ++k) {                               \
            rest |= words[k];                                              \
        }                                                                  \
        return (rest >> (8U * sizeof(WORD) - 1U)) == 0U;                   \
    }

DEFINE_ALL_FINITE(
    all_finite_double, uint64_t, doubles_t, UINT64_C(0x7FF0000000000000), UINT64_C(0x0010000000000000))
DEFINE_ALL_FINITE(all_finite_float, uint32_t, floats_t, UINT32_C(0x7F800000), UINT32_C(0x00800000))

static int all_finite(const void *memory, Py_ssize_t count, int is_float)
{
    const char *from = (const char *)memory;
    return is_float ? all_finite_float(from, (size_t)count) : all_finite_double(from, (size_t)count);
}

/* Whether an array is contiguous, aligned and of the kernel's reals in the byte order of this machine. */
static int is_ready(const kernel_t *kernel, PyArrayObject *array)
{
    return PyArray_TYPE(array) == (kernel->is_float ? NPY_FLOAT : NPY_DOUBLE) && PyArray_ISNOTSWAPPED(array)
        && PyArray_IS_C_CONTIGUOUS(array) && (uintptr_t)PyArray_DATA(array) % (kernel->is_float ? 4U : 8U) == 0U;
}

typedef union {
    double d;
    float f;
} real_t;

/* The address of one argument, or NULL where the call does not take it as it is. */
static const void *argument(const kernel_t *kernel, const port_t *port, PyObject *value, real_t *scalar)
{
    /* of the exact type: a masked array would lose its mask */
    if (PyArray_CheckExact(value)) {
        PyArrayObject *array = (PyArrayObject *)value;
        if (PyArray_NDIM(array) != port->axes || !is_ready(kernel, array)) {
            return NULL;
        }
        for (int axis = 0; axis < port->axes; ++axis) {
            if (PyArray_DIM(array, axis) != port->shape[axis]) {
                return NULL;
            }
        }
        const void *data = PyArray_DATA(array);
        return all_finite(data, port->size, kernel->is_float) ? data : NULL;
    }
    if (port->axes != 0 || !PyFloat_Check(value)) {
        return NULL;
    }
    if (kernel->is_float) {
        scalar->f = (float)PyFloat_AsDouble(value);
    } else {
        scalar->d = PyFloat_AsDouble(value);
    }
    return all_finite(scalar, 1, kernel->is_float) ? scalar : NULL;
}

static PyObject *fresh(const kernel_t *kernel, const port_t *port)
{
    Py_INCREF((PyObject *)kernel->real);
    return PyArray_NewFromDescr(&PyArray_Type, kernel->real, port->axes, port->shape, NULL, NULL, 0, NULL);
}

/* The results, which it takes over, and after them the status; unpacked where that is one. */
static PyObject *unpacked(const kernel_t *kernel, PyObject **results, int32_t status)
{
    int count = kernel->outputs;
    if (kernel->statuses != Py_None) {
        results[count] = PyTuple_GetItem(kernel->statuses, status);
        if (results[count] == NULL) {
            return NULL;
        }
        Py_INCREF(results[count]);
        ++count;
    }
    PyObject *answer = NULL;
    if (count == 1) {
        answer = results[0];
        results[0] = NULL;
        return answer;
    }
    answer = PyTuple_New(count);
    for (int k = 0; answer != NULL && k < count; ++k) {
        (void)PyTuple_SetItem(answer, k, results[k]);
        results[k] = NULL;
    }
    return answer;
}

/* One sample: fresh results, unpacked where there is one, and the status after them. NULL without an exception where an
   argument cannot be taken as it is. */
static PyObject *attempt(const kernel_t *kernel, PyObject *const *args)
{
    real_t scalars[MAX_PORTS];
    const void *in[MAX_PORTS];
    void *out[MAX_PORTS];
    PyObject *results[MAX_PORTS + 1];
    PyObject *answer = NULL;
    for (int i = 0; i < kernel->inputs; ++i) {
        in[i] = argument(kernel, &kernel->port[i], args[i], &scalars[i]);
        if (in[i] == NULL) {
            return NULL;
        }
    }
    for (int k = 0; k <= kernel->outputs; ++k) {
        results[k] = NULL;
    }
    for (int k = 0; k < kernel->outputs; ++k) {
        const port_t *port = &kernel->port[kernel->inputs + k];
        out[k] = &scalars[kernel->inputs + k];
        if (port->axes != 0) {
            results[k] = fresh(kernel, port);
            if (results[k] == NULL) {
                goto done;
            }
            out[k] = PyArray_DATA((PyArrayObject *)results[k]);
        }
    }
    const int32_t status = kernel->call(in, out);
    for (int k = 0; k < kernel->outputs; ++k) {
        if (results[k] == NULL) {
            results[k] = PyArray_Scalar(out[k], kernel->real, NULL);
            if (results[k] == NULL) {
                goto done;
            }
        }
    }
    answer = unpacked(kernel, results, status);
done:
    for (int k = 0; k <= kernel->outputs; ++k) {
        Py_XDECREF(results[k]);
    }
    return answer;
}

/* The arguments by position and by name as a tuple of arrays that a call takes. */
static PyObject *converted(const kernel_t *kernel, PyObject *const *args, Py_ssize_t count, PyObject *names)
{
    PyObject *by_position = PyTuple_New(count);
    PyObject *by_name = PyDict_New();
    PyObject *answer = NULL;
    int ready = by_position != NULL && by_name != NULL;
    for (Py_ssize_t i = 0; ready && i < count; ++i) {
        ready = PyTuple_SetItem(by_position, i, Py_NewRef(args[i])) == 0;
    }
    for (Py_ssize_t i = 0; ready && names != NULL && i < PyTuple_Size(names); ++i) {
        ready = PyDict_SetItem(by_name, PyTuple_GetItem(names, i), args[count + i]) == 0;
    }
    if (ready) {
        answer = PyObject_CallFunctionObjArgs(kernel->convert, by_position, by_name, NULL);
    }
    Py_XDECREF(by_position);
    Py_XDECREF(by_name);
    return answer;
}

static PyObject *kernel_call(PyObject *self, PyObject *const *args, Py_ssize_t count, PyObject *names)
{
    const kernel_t *kernel = kernel_of(self);
    if (kernel == NULL) {
        return NULL;
    }
    if (names == NULL && count == kernel->inputs) {
        PyObject *answer = attempt(kernel, args);
        if (answer != NULL || PyErr_Occurred()) {
            return answer;
        }
    }
    PyObject *arrays = converted(kernel, args, count, names);
    if (arrays == NULL) {
        return NULL;
    }
    PyObject *answer = NULL;
    if (PyTuple_Check(arrays) && PyTuple_Size(arrays) == kernel->inputs) {
        PyObject *again[MAX_PORTS];
        for (int i = 0; i < kernel->inputs; ++i) {
            again[i] = PyTuple_GetItem(arrays, i);
        }
        answer = attempt(kernel, again);
    }
    if (answer == NULL && !PyErr_Occurred()) {
        PyErr_SetString(PyExc_SystemError, "the conversion returned arguments that the kernel does not take");
    }
    Py_DECREF(arrays);
    return answer;
}

typedef struct {
    const void *in[MAX_PORTS];
    void *out[MAX_PORTS];
    int64_t stride[MAX_PORTS]; /* of arguments and results, in reals from one unit to the next */
    Py_ssize_t length[MAX_PORTS];
    int32_t *status;
    int64_t failed;
    int not_finite; /* the argument, or -1 */
} work_t;

/* Units `begin` to `end`, samples or tiles, a chunk after the other; needs no interpreter. */
static void compute(const kernel_t *kernel, work_t *work, int in_tiles, int64_t begin, int64_t end)
{
    const int64_t chunk = in_tiles ? (CHUNK / kernel->width) : CHUNK;
    const int64_t item = kernel->is_float ? 4 : 8;
    const void *in[MAX_PORTS];
    void *out[MAX_PORTS];
    work->failed = 0;
    work->not_finite = -1;
    for (int64_t at = begin; at < end; at += chunk) {
        const int64_t n = (end - at < chunk) ? (end - at) : chunk;
        for (int i = 0; i < kernel->inputs; ++i) {
            const int64_t stride = work->stride[i];
            in[i] = (const char *)work->in[i] + at * stride * item;
            const int64_t count = (stride == 0) ? ((at == begin) ? work->length[i] : 0) : n * stride;
            if (!all_finite(in[i], (Py_ssize_t)count, kernel->is_float)) {
                work->not_finite = i;
                return;
            }
        }
        for (int k = 0; k < kernel->outputs; ++k) {
            out[k] = (char *)work->out[k] + at * work->stride[kernel->inputs + k] * item;
        }
        if (in_tiles) {
            kernel->tiles(n, in, work->stride, out);
        } else {
            work->failed += kernel->batch(n, in, work->stride, out, (work->status == NULL) ? NULL : work->status + at);
        }
    }
}

static int overlap(const char *a, const char *b, Py_ssize_t size_a, Py_ssize_t size_b)
{
    return size_a > 0 && size_b > 0 && a < b + size_b && b < a + size_a;
}

static const char *memory(const kernel_t *kernel, const work_t *work, int port)
{
    return (const char *)((port < kernel->inputs) ? work->in[port] : work->out[port - kernel->inputs]);
}

/* (in_tiles, begin, end, count, arrays, status): see `run` of the module. */
static PyObject *kernel_run(PyObject *self, PyObject *args)
{
    const kernel_t *kernel = kernel_of(self);
    int in_tiles = 0;
    long long begin = 0;
    long long end = 0;
    long long units = 0;
    PyObject *arrays = NULL;
    PyObject *status = NULL;
    if (kernel == NULL
        || !PyArg_ParseTuple(args, "pLLLO!O", &in_tiles, &begin, &end, &units, &PyTuple_Type, &arrays, &status)) {
        return NULL;
    }
    const int ports = kernel->inputs + kernel->outputs;
    if (PyTuple_Size(arrays) != ports || begin < 0 || begin > end || end > units || (in_tiles && kernel->tiles == NULL)) {
        PyErr_SetString(PyExc_ValueError, "wrong number of arrays, a range beyond the samples, or no form in tiles");
        return NULL;
    }
    const Py_ssize_t item = kernel->is_float ? 4 : 8;
    work_t work = { .status = NULL };
    for (int i = 0; i < ports; ++i) {
        const int is_result = i >= kernel->inputs;
        const Py_ssize_t unit = kernel->port[i].size * (in_tiles ? kernel->width : 1);
        PyArrayObject *array = (PyArrayObject *)PyTuple_GetItem(arrays, i);
        const int ready = PyArray_Check((PyObject *)array) && is_ready(kernel, array)
            && (!is_result || PyArray_ISWRITEABLE(array));
        const Py_ssize_t found = ready ? PyArray_SIZE(array) : -1;
        const int is_shared = !is_result && found == unit;
        if (!ready || !(is_shared || found == unit * (Py_ssize_t)units)) {
            PyErr_Format(PyExc_ValueError, "array %d is not contiguous, of the kernel's reals and of its length", i);
            return NULL;
        }
        work.stride[i] = (is_shared && units != 1) ? 0 : unit;
        work.length[i] = found;
        if (is_result) {
            work.out[i - kernel->inputs] = PyArray_DATA(array);
        } else {
            work.in[i] = PyArray_DATA(array);
        }
        for (int j = 0; is_result && j < i; ++j) {
            if (overlap(memory(kernel, &work, i), memory(kernel, &work, j), found * item, work.length[j] * item)) {
                PyErr_Format(PyExc_ValueError, "arrays %d and %d share memory; a result must have its own", j, i);
                return NULL;
            }
        }
    }
    if (status != Py_None) {
        PyArrayObject *array = (PyArrayObject *)status;
        if (!PyArray_Check(status) || !PyArray_ISSIGNED(array) || PyArray_ITEMSIZE(array) != 4
            || !PyArray_ISCARRAY(array) || PyArray_SIZE(array) != units) {
            PyErr_SetString(PyExc_ValueError, "the statuses must be 32-bit whole numbers, one for each sample");
            return NULL;
        }
        work.status = (int32_t *)PyArray_DATA(array);
    }
    /* the tuple that the caller holds keeps the arrays alive meanwhile */
    if (end - begin > SMALL_BATCH) {
        Py_BEGIN_ALLOW_THREADS
        compute(kernel, &work, in_tiles, begin, end);
        Py_END_ALLOW_THREADS
    } else {
        compute(kernel, &work, in_tiles, begin, end);
    }
    return Py_BuildValue("Li", (long long)work.failed, work.not_finite);
}

static PyMethodDef call_method = {
    "call", (PyCFunction)(void (*)(void))kernel_call, METH_FASTCALL | METH_KEYWORDS, NULL
};
static PyMethodDef run_method = { "run", kernel_run, METH_VARARGS, NULL };

static int read_port(port_t *port, PyObject *shape)
{
    if (!PyTuple_Check(shape) || PyTuple_Size(shape) > MAX_AXES) {
        PyErr_SetString(PyExc_ValueError, "a shape must be a tuple of at most two lengths");
        return -1;
    }
    port->axes = (int)PyTuple_Size(shape);
    port->size = 1;
    for (int axis = 0; axis < port->axes; ++axis) {
        port->shape[axis] = (npy_intp)PyLong_AsSsize_t(PyTuple_GetItem(shape, axis));
        if (port->shape[axis] < 1) {
            if (!PyErr_Occurred()) {
                PyErr_SetString(PyExc_ValueError, "a length must be at least 1");
            }
            return -1;
        }
        port->size *= port->shape[axis];
    }
    return 0;
}

static void *symbol(void *library, const char *name, const char *ending)
{
    char whole[256];
    (void)PyOS_snprintf(whole, sizeof whole, "%s%s", name, ending);
    return dlsym(library, whole);
}

static int find_functions(kernel_t *kernel, const char *path, const char *name, unsigned int abi)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        PyErr_SetString(PyExc_OSError, dlerror());
        return -1;
    }
    const uint32_t *found_abi = (const uint32_t *)dlsym(library, "os_abi");
    const uint32_t *width = (const uint32_t *)dlsym(library, "os_width");
    *(void **)&kernel->call = symbol(library, name, "_call");
    *(void **)&kernel->batch = symbol(library, name, "_batch");
    *(void **)&kernel->tiles = symbol(library, name, "_tiles");
    if (found_abi == NULL || width == NULL || kernel->call == NULL || kernel->batch == NULL) {
        PyErr_Format(PyExc_OSError, "%s holds no kernel %s", path, name);
        return -1;
    }
    if (*found_abi != abi || *width < 1U || *width > 64U) {
        PyErr_Format(PyExc_OSError, "%s speaks ABI %u, not %u", path, (unsigned int)*found_abi, abi);
        return -1;
    }
    kernel->width = (int)*width;
    return 0;
}

PyDoc_STRVAR(bind_doc,
    "bind(path, name, abi, is_float, inputs, outputs, statuses, convert) -> (call, run, width, has_tiles)\n\n"
    "inputs, outputs : shapes; statuses : by value, or None\n"
    "convert(arguments, by_name) : a tuple of contiguous arrays, for arguments of any other kind; or it raises\n"
    "call(*arguments, **by_name) : results of one sample\n"
    "run(in_tiles, begin, end, count, arrays, statuses) : samples or tiles from begin to end of all; how many failed,\n"
    "and the argument that is not finite, or -1");

static PyObject *bind(PyObject *module, PyObject *args)
{
    (void)module;
    const char *path = NULL;
    const char *name = NULL;
    unsigned int abi = 0;
    int is_float = 0;
    PyObject *inputs = NULL;
    PyObject *outputs = NULL;
    PyObject *statuses = NULL;
    PyObject *convert = NULL;
    if (!PyArg_ParseTuple(args, "ssIpO!O!OO", &path, &name, &abi, &is_float, &PyTuple_Type, &inputs, &PyTuple_Type,
            &outputs, &statuses, &convert)) {
        return NULL;
    }
    const Py_ssize_t count_in = PyTuple_Size(inputs);
    const Py_ssize_t count_out = PyTuple_Size(outputs);
    if (count_in + count_out > MAX_PORTS || count_out < 1) {
        PyErr_Format(PyExc_ValueError, "%s has %zd ports; from one result to %d ports are allowed", name,
            count_in + count_out, (int)MAX_PORTS);
        return NULL;
    }
    kernel_t *kernel = (kernel_t *)PyMem_Calloc(1, sizeof *kernel);
    if (kernel == NULL) {
        return PyErr_NoMemory();
    }
    PyObject *capsule = PyCapsule_New(kernel, KERNEL, kernel_free);
    if (capsule == NULL) {
        PyMem_Free(kernel);
        return NULL;
    }
    PyObject *answer = NULL;
    kernel->is_float = is_float;
    kernel->inputs = (int)count_in;
    kernel->outputs = (int)count_out;
    kernel->real = PyArray_DescrFromType(is_float ? NPY_FLOAT : NPY_DOUBLE);
    kernel->statuses = Py_NewRef(statuses);
    kernel->convert = Py_NewRef(convert);
    for (int i = 0; i < kernel->inputs + kernel->outputs; ++i) {
        const int k = i - kernel->inputs;
        PyObject *shape = (k < 0) ? PyTuple_GetItem(inputs, i) : PyTuple_GetItem(outputs, k);
        if (read_port(&kernel->port[i], shape) != 0) {
            goto done;
        }
    }
    if (find_functions(kernel, path, name, abi) == 0) {
        answer = Py_BuildValue("NNiO", PyCFunction_New(&call_method, capsule), PyCFunction_New(&run_method, capsule),
            kernel->width, (kernel->tiles != NULL) ? Py_True : Py_False);
    }
done:
    Py_DECREF(capsule);
    return answer;
}

static PyMethodDef methods[] = {
    { "bind", bind, METH_VARARGS, bind_doc },
    { NULL, NULL, 0, NULL },
};

/* An installed binary may be older than the Python beside it: raise this number with the arguments of `bind`. */
static int prepare(PyObject *module)
{
    if (_import_array() < 0) {
        /* of another age, NumPy raises a RuntimeError; NumPy's own macros would print it */
        PyErr_SetString(PyExc_ImportError, "the binding was compiled for another NumPy");
        return -1;
    }
    return PyModule_AddIntConstant(module, "INTERFACE", 2);
}

static PyModuleDef_Slot slots[] = {
    { Py_mod_exec, (void *)prepare },
    { 0, NULL },
};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT,
    .m_name = "_binding",
    .m_doc = "Compiled kernels called on arrays, every argument checked first.",
    .m_size = 0,
    .m_methods = methods,
    .m_slots = slots,
};

PyMODINIT_FUNC PyInit__binding(void)
{
    return PyModuleDef_Init(&definition);
}
