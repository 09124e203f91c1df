"""What the loops of c_tables.py are made of: products with small matrices in registers, long sums, and how compilers are told."""

from typing import Final

# a long sum in eight parts side by side: one part alone would wait for each addition
DOTTED: Final = """#define DOTTED(out, c, at, n) { real s[8] = {0}; int i = 0; \\
    for (; i + 8 <= n; i += 8) for (int j = 0; j < 8; ++j) s[j] += c[i + j]*v[at[i + j]]; \\
    for (; i < n; ++i) s[0] += c[i]*v[at[i]]; \\
    out = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7])); }"""
# as long as a square root may report an error, gcc computes one at a time
ROOTS: Final = """#if defined(__SSE2__) && defined(OPTIONS_PUSHED) && !defined(SINGLE)
typedef real {prefix}pair __attribute__((vector_size(2*sizeof(real)), aligned(sizeof(real)), may_alias));
#define ROOTS for (; i + 2 <= n; i += 2) *({prefix}pair *)(y + i) = __builtin_ia32_sqrtpd(*(const {prefix}pair *)(x + i));
#else
#define ROOTS
#endif
static inline void {prefix}roots(const real *RESTRICT x, real *RESTRICT y, int n) {
    int i = 0;
    ROOTS
    for (; i < n; ++i) y[i] = f_sqrt(x[i]);
}
#undef ROOTS"""
# loops alike share one function, so that the program stays in the cache of instructions; vectors are worth it at -O2 too. Without flags for
# the processor, gcc and glibc on x86-64 choose a function's version when the program starts: wide vectors where there are some
OPTIONS: Final = """#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize ("O3,fp-contract=fast,no-trapping-math")
#define OPTIONS_PUSHED
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__AVX__) && !defined(NO_DISPATCH)
#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
#endif
#ifndef CLONES
#define CLONES
#else
#define WIDER (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
#endif
#if defined(__GNUC__)
#define NOINLINE __attribute__((noinline))
#define RESTRICT __restrict
#if defined(__AVX__) || defined(SINGLE)
#define LANES 4
#else
#define LANES 2
#endif
typedef real {prefix}lanes __attribute__((vector_size(LANES*sizeof(real)), aligned(sizeof(real)), may_alias));
typedef real {prefix}wide __attribute__((vector_size(4*sizeof(real)), aligned(sizeof(real)), may_alias));
#else
#define NOINLINE
#define RESTRICT restrict
#define LANES 0
#endif"""
END: Final = """#ifdef OPTIONS_PUSHED
#pragma GCC pop_options
#undef OPTIONS_PUSHED
#endif
#undef CLONES
#undef WIDER
#undef LANES
#undef SINGLE
#undef NOINLINE
#undef RESTRICT"""


def _in_registers(m: int, per: int, lanes: str) -> str:
    """The sums of `m` rows in vectors of `per` numbers."""
    sums = range(m // per)
    return f"""    {lanes} {", ".join(f"a{j} = {{0}}" for j in sums)};
    for (int i = 0; i < k; ++i, W += {m}) {{
        const real c = x[i];
        const {lanes} *w = (const {lanes} *)W;
        {" ".join(f"a{j} += c*w[{j}];" for j in sums)}
    }}
    const {lanes} a[{m // per}] = {{{", ".join(f"a{j}" for j in sums)}}};
    for (int j = 0; j < n; ++j) y[j] = a[j/{per}][j%{per}];"""


def dense(m: int, prefix: str) -> str:
    """The product of a matrix of `m` rows, a multiple of PAD, with k numbers x into n numbers y."""
    given = "(const real *RESTRICT x, int k, const real *RESTRICT W, real *RESTRICT y, int n)"
    return f"""#ifdef WIDER
static NOINLINE __attribute__((target("avx2,fma"))) void {prefix}wide{m}{given} {{
{_in_registers(m, 4, f"{prefix}wide")}
}}
#endif
static NOINLINE void {prefix}dense{m}{given} {{
#ifdef WIDER
    if (WIDER) {{ {prefix}wide{m}(x, k, W, y, n); return; }}
#endif
#if LANES == 4
{_in_registers(m, 4, f"{prefix}lanes")}
#elif LANES == 2
{_in_registers(m, 2, f"{prefix}lanes")}
#else
    real a[{m}] = {{0}};
    for (int i = 0; i < k; ++i, W += {m}) for (int j = 0; j < {m}; ++j) a[j] += x[i]*W[j];
    for (int j = 0; j < n; ++j) y[j] = a[j];
#endif
}}"""


def together(vectors: int) -> int:
    """Return how many rows of `vectors` vectors `beside` sums at once: as many as there are registers for."""
    return min(8, 12 // vectors)


def _beside_body(vectors: int, wide: str) -> str:
    """The sums of a few rows at a time over vectors of columns, the last of which overlaps the one before it."""
    rows, columns = range(together(vectors)), range(vectors)
    places = [f"({4*j} < last ? {4*j} : last)" for j in columns]
    return f"""    for (int r = 0; r < m; r += {len(rows)}) {{
        {wide} {", ".join(f"a{i}_{j} = {{0}}" for i in rows for j in columns)};
        for (int i = 0; i < k; ++i, W += {len(rows)}) {{
            const real *at = x + rows[i];
            {" ".join(f"const {wide} x{j} = *(const {wide} *)(at + {places[j]});" for j in columns)}
            {" ".join(f"a{i}_{j} += W[{i}]*x{j};" for i in rows for j in columns)}
        }}
        {" ".join(f"if (r + {i} < m) {{ real *to = y + jump*(r + {i}); "
                  + " ".join(f"*({wide} *)(to + {places[j]}) = a{i}_{j};" for j in columns) + " }" for i in rows)}
    }}"""


def _beside_narrow(vectors: int, lanes: str) -> str:
    """The same in vectors of two numbers: four columns at a time."""
    rows = range(together(vectors))
    return f"""    for (int r = 0; r < m; r += {len(rows)}, W += {len(rows)}*k)
        for (int j = 0; j < {vectors}; ++j) {{
            const real *from = x + (4*j < last ? 4*j : last), *w = W;
            {lanes} {", ".join(f"a{i} = {{0}}, b{i} = {{0}}" for i in rows)};
            for (int i = 0; i < k; ++i, w += {len(rows)}) {{
                const {lanes} p = *(const {lanes} *)(from + rows[i]), q = *(const {lanes} *)(from + rows[i] + 2);
                {" ".join(f"a{i} += w[{i}]*p; b{i} += w[{i}]*q;" for i in rows)}
            }}
            real *to = y + jump*r + (4*j < last ? 4*j : last);
            {" ".join(f"if (r + {i} < m) {{ *({lanes} *)(to + jump*{i}) = a{i}; *({lanes} *)(to + jump*{i} + 2) = b{i}; }}" for i in rows)}
        }}"""


def name_beside(vectors: int, kind: str) -> str:
    """Return the name of the function `beside` writes for places of the C type `kind`."""
    return f"beside{vectors}{'wide' if kind == 'int' else ''}"


def beside(vectors: int, kind: str, prefix: str) -> str:
    """The product of a matrix W with a matrix of k rows, which begin at the places `rows`, into m rows of y, `jump` apart."""
    given = (f"(const real *RESTRICT x, const {kind} *RESTRICT rows, int k, const real *RESTRICT W, real *RESTRICT y, int jump, "
             "int m, int last)")
    name, body = name_beside(vectors, kind), _beside_body(vectors, f"{prefix}wide")
    high = together(vectors)
    return f"""#ifdef WIDER
static NOINLINE __attribute__((target("avx2,fma"))) void {prefix}fused_{name}{given} {{
{body}
}}
#endif
static NOINLINE void {prefix}{name}{given} {{
#ifdef WIDER
    if (WIDER) {{ {prefix}fused_{name}(x, rows, k, W, y, jump, m, last); return; }}
#endif
#if LANES == 4
{body}
#elif LANES == 2
{_beside_narrow(vectors, f"{prefix}lanes")}
#else
    for (int r = 0; r < m; r += {high}, W += {high}*k)
        for (int q = 0; q < {high} && r + q < m; ++q)
            for (int s = 0; s < last + 4; ++s) {{
                real a = 0;
                for (int i = 0; i < k; ++i) a += W[{high}*i + q]*x[rows[i] + s];
                y[jump*(r + q) + s] = a;
            }}
#endif
}}"""
