/*
# /// script
# [tool.gradient-routes]
# summary = "a program in C: the bar by cumulative sums, its gradient by hand; compiled by cc -O2"
# cases = { bar = {} }
# ///

   The bar in C, without a library but the standard one. By hand:

       cc -O2 -o bar adapters/executable.c -lm
       routes run --problem bar --route adjoint --route 'adapter[command=./bar]'

   Speaks version 1 of the adapter protocol (docs/explanation/adapter-protocol.md). Little-endian machines. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct { const char *at; void *data; size_t n; } Array; /* of 8-byte numbers, at its place in the line */

static char *line;
static size_t room;
static Array arrays[8];
static int found, id;

/* --- reading: the values that are wanted, by their names; no general JSON */

static const char *value(const char *name) {
    char key[64];
    int length = snprintf(key, sizeof key, "\"%s\": ", name);
    const char *at = strstr(line, key);
    return at ? at + length : "";
}

static int says(const char *name, const char *text) { return strncmp(value(name) + 1, text, strlen(text)) == 0; }

static Array *array(const char *name) {
    for (int i = 0; i < found; i++)
        if (arrays[i].at == value(name)) return &arrays[i];
    return NULL;
}

static void decode(const char *text, unsigned char *to, size_t size) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned bits = 0, count = 0;
    for (const char *at; size && *text && (at = strchr(digits, *text)); text++) {
        bits = bits << 6 | (unsigned)(at - digits);
        if ((count += 6) < 8) continue;
        *to++ = (unsigned char)(bits >> (count -= 8));
        size--;
    }
}

/* A message: its line, and its arrays in the order in which they stand there, as their frames follow. 0 at the end. */
static int hear(void) {
    while (found) free(arrays[--found].data);
    if (getline(&line, &room, stdin) < 0) return 0;
    for (const char *at = line; (at = strstr(at, "64\": [")) && found < 8; at++) {
        Array *a = &arrays[found++];
        const char *how = strchr(at, ']'), *text = how ? strstr(how, "\"base64\": \"") : NULL;
        for (a->at = at; *a->at != '{'; a->at--);
        a->n = strtoull(at + 6, NULL, 10);
        a->data = calloc(a->n + 1, 8);
        if (text && text == how + 3)
            decode(text + 11, a->data, 8 * a->n);
        else if (fread(a->data, 8, a->n, stdin) != a->n)
            return 0;
    }
    id = atoi(value("id"));
    return 1;
}

/* --- answers: arrays always as a frame, which needs no base64 */

static void result(const char *said) { printf("{\"id\": %d, \"result\": {%s}}\n", id, said); }
static void error(const char *kind, const char *message) {
    printf("{\"id\": %d, \"error\": {\"kind\": \"%s\", \"message\": \"%s\"}}\n", id, kind, message);
}

/* --- the bar */

static size_t n, m;
static double stiffness, load, *d, *u, *k, *g; /* stiffness: of an element of E = 1 Pa */
static long long *sensors, of_log;

static void *taken(const char *name) {
    void *data = array(name)->data;
    array(name)->data = NULL; /* not to be freed with the message */
    return data;
}

static void load_case(void) {
    if (!says("kind", "bar\"") || !array("sensors") || !array("data")) {
        error("unsupported", "it knows the kind bar, with sensors and data");
        return;
    }
    n = strtoull(value("n"), NULL, 10), m = array("sensors")->n;
    load = atof(value("load")), stiffness = atof(value("area")) * (double)n / atof(value("length"));
    of_log = says("parametrization", "log");
    sensors = taken("sensors"), d = taken("data");
    u = calloc(n + 1, sizeof *u), k = calloc(n, sizeof *k), g = calloc(n, sizeof *g);
    result("");
}

/* J = 1/2 sum (u_s - d_s)^2, u_e = sum_{i <= e} F / k_i: every element carries the end load. */
static double forward(const double *p) {
    double J = 0.0;
    for (size_t e = 0; e < n; e++) {
        k[e] = stiffness * (of_log ? exp(p[e]) : p[e]);
        u[e + 1] = u[e] + load / k[e];
    }
    for (size_t i = 0; i < m; i++) J += 0.5 * pow(u[sensors[i]] - d[i], 2.0);
    return J;
}

/* K^T lam = -J_u: what lam stretches element e by is -q_e / k_e, q_e the sum of J_u from e to the tip. Then
   dJ/dk_e = (B lam)_e (B u)_e = -q_e / k_e * F / k_e. */
static void adjoint(void) {
    double q = 0.0;
    memset(g, 0, n * sizeof *g);
    for (size_t i = 0; i < m; i++) g[sensors[i] - 1] += u[sensors[i]] - d[i];
    for (size_t e = n; e-- > 0;) {
        q += g[e];
        g[e] = -q * load / (k[e] * k[e]) * (of_log ? k[e] : stiffness);
    }
}

static void answer(int with_gradient) {
    Array *p = array("p");
    double J;
    clock_t start = clock(), solved;
    if (!p || p->n != n) {
        error("bug", "p is not of the length of the case");
        return;
    }
    J = forward(p->data), solved = clock();
    if (with_gradient) adjoint();
    printf("{\"id\": %d, \"result\": {\"J\": %.17g", id, J);
    if (with_gradient)
        printf(", \"forward_s\": %.9f, \"backward_s\": %.9f, \"gradient\": {\"float64\": [%zu], \"frame\": %zu}",
               (double)(solved - start) / CLOCKS_PER_SEC, (double)(clock() - solved) / CLOCKS_PER_SEC, n, 8 * n);
    printf("}}\n");
    if (with_gradient) fwrite(g, sizeof *g, n, stdout);
}

int main(void) {
    while (hear()) {
        if (says("method", "describe")) result("\"protocol\": 1, \"name\": \"executable\", \"versions\": {\"cc\": \"" __VERSION__ "\"}");
        else if (says("method", "load")) load_case();
        else if (says("method", "value")) answer(0);
        else if (says("method", "gradient")) answer(1);
        else if (says("method", "bye")) result("");
        else error("unsupported", "it does not know this method");
        if (fflush(stdout) || says("method", "bye")) break;
    }
}
