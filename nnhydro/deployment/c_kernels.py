"""What the loops of c_tables.py are made of: products with small matrices in registers, long sums, and how compilers are told."""

from typing import Final

# as long as a square root may report an error, gcc computes one at a time
ROOTS: Final = """#if defined(__SSE2__) && defined(OPTIONS_PUSHED) && !defined(SINGLE)
typedef real {at}pair __attribute__((vector_size(2*sizeof(real)), aligned(sizeof(real)), may_alias));
#define ROOTS for (; i + 2 <= n; i += 2) *({at}pair *)(y + i) = __builtin_ia32_sqrtpd(*(const {at}pair *)(x + i));
#else
#define ROOTS
#endif
static inline void {at}roots(const real *RESTRICT x, real *RESTRICT y, int n) {
    int i = 0;
    ROOTS
    for (; i < n; ++i) y[i] = f_sqrt(x[i]);
}
#undef ROOTS"""
# loops alike share one function, so that the program stays in the cache of instructions; vectors are worth it at -O2 too
OPTIONS: Final = """#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize ("O3,fp-contract=fast,no-trapping-math")
#define OPTIONS_PUSHED
#if defined(__x86_64__) && !defined(__AVX__) && !defined(NO_DISPATCH)
#define DISPATCH
#endif
#endif
#if defined(__GNUC__)
#define NOINLINE __attribute__((noinline))
#define RESTRICT __restrict
#define ROW __asm__ volatile ("")
#else
#define NOINLINE
#define RESTRICT restrict
#define ROW
#endif"""
# without flags for the processor, gcc writes the program for wider vectors as well, and the processor is asked at each call
WIDER: Final = {"x512": ("avx512f,avx512vl,fma", ("avx512f", "avx512vl")), "x256": ("avx2,fma", ("avx2", "fma"))}
# numbers in a vector: 0 where the compiler knows none
LANES: Final = """#if !defined(__GNUC__)
#define LANES 0
#elif defined(__AVX__) || defined(SINGLE)
#define LANES 4
#else
#define LANES 2
#endif
#if LANES
typedef real {at}lanes __attribute__((vector_size(LANES*sizeof(real)), aligned(sizeof(real)), may_alias));
#endif"""
END: Final = """#ifdef OPTIONS_PUSHED
#pragma GCC pop_options
#undef OPTIONS_PUSHED
#endif
#undef DISPATCH
#undef SINGLE
#undef NOINLINE
#undef RESTRICT
#undef ROW"""


def dispatch(core: str, head: str, prefix: str) -> str:
    """Return `core`, in whose names {at} stands, for each kind of processor, and the function `head`(in, out), which chooses its own.

    `prefix` begins the names.
    """
    name, wider, asked = head.split()[-1], [], []
    for at, (target, parts) in WIDER.items():
        wider.append(f"""#pragma GCC push_options
#pragma GCC target ("{target}")
{core.replace("{at}", f"{prefix}{at}_")}
#pragma GCC pop_options""")
        able = " && ".join(f'__builtin_cpu_supports("{part}")' for part in parts)
        asked.append(f"    if ({able}) {{ {prefix}{at}_{name}(in, out); return; }}")
    return "\n".join(["#ifdef DISPATCH", *wider, "#endif", core.replace("{at}", f"{prefix}plain_"), f"{head}(const real *in, real *out) {{",
                      "#ifdef DISPATCH", *asked, "#endif", f"    {prefix}plain_{name}(in, out);", "}"])


def _in_registers(m: int, per: int, given: int) -> str:
    """The sums of `m` rows in vectors of `per` numbers, for each of `given` columns x."""
    sums, columns = range(m // per), range(given)
    names = [f"a{j}_{q}" for q in columns for j in sums]
    return f"""    {{at}}lanes {", ".join(f"{name} = {{0}}" for name in names)};
    for (int i = 0; i < k; ++i, W += {m}) {{
        const real {", ".join(f"c{q} = x{q}[i]" for q in columns)};
        const {{at}}lanes *w = (const {{at}}lanes *)W;
        {" ".join(f"a{j}_{q} += c{q}*w[{j}];" for j in sums for q in columns)}
    }}
    const {{at}}lanes a[{len(names)}] = {{{", ".join(names)}}};
    for (int j = 0; j < n; ++j) {{ {" ".join(f"y{q}[j] = a[{m // per * q} + j/{per}][j%{per}];" for q in columns)} }}"""


def dense(m: int, given: int) -> str:
    """The product of a matrix of `m` rows, a multiple of PAD, with one or two (`given`) columns of k numbers x into n numbers y each."""
    columns = range(given)
    plain = " ".join(f"a{q}[j] += x{q}[i]*W[j];" for q in columns)
    return f"""static NOINLINE void {{at}}dense{m}x{given}({", ".join(f"const real *RESTRICT x{q}, real *RESTRICT y{q}" for q in columns)},
                                 int k, const real *RESTRICT W, int n) {{
#if LANES == 4
{_in_registers(m, 4, given)}
#elif LANES == 2
{_in_registers(m, 2, given)}
#else
    real {", ".join(f"a{q}[{m}] = {{0}}" for q in columns)};
    for (int i = 0; i < k; ++i, W += {m}) for (int j = 0; j < {m}; ++j) {{ {plain} }}
    for (int j = 0; j < n; ++j) {{ {" ".join(f"y{q}[j] = a{q}[j];" for q in columns)} }}
#endif
}}"""


def name_dots(width: int, running: bool, *kinds: str) -> str:
    """Return the name of the function `dots` writes."""
    return f"{{at}}dots{width}{'run' if running else 'at'}{''.join('wide' if kind == 'int' else '' for kind in kinds)}"


def dots(width: int, running: bool, which: str, place: str) -> str:
    """Long sums y[r] of `width` terms: weights c[which[r]...), values at p[r] and behind it (`running`) or at `width` places p each.

    Eight parts of a sum side by side: one part alone would wait for each addition. `which` and `place` are the C types of both tables.
    """
    at, step = ("p[r] + {}", "++r") if running else ("p[{}]", f"++r, p += {width}")
    return f"""static NOINLINE void {name_dots(width, running, which, place)}(const real *RESTRICT v, real *RESTRICT y, int n,
                              const real *RESTRICT c, const {which} *RESTRICT which, const {place} *RESTRICT p) {{
    for (int r = 0; r < n; {step}) {{
        const real *RESTRICT w = c + which[r];
        real s[8] = {{0}}; int i = 0;
        for (; i + 8 <= {width}; i += 8) for (int j = 0; j < 8; ++j) s[j] += w[i + j]*v[{at.format("i + j")}];
        for (; i < {width}; ++i) s[0] += w[i]*v[{at.format("i")}];
        y[r] = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    }}
}}"""


def together(rows: int, vectors: int) -> int:
    """Return how many of `rows` rows of `vectors` vectors `columns_product` sums at once: as registers allow, with few rows filled up."""
    return min(range(1, min(8, 12 // vectors) + 1), key=lambda n: (-(-rows // n) * n + -(-rows // n), -n))


def _columns_product_wide(vectors: int, high: int) -> str:
    """The sums of `high` rows at a time over vectors of columns, the last of which overlaps the one before it."""
    rows, columns = range(high), range(vectors)
    places = [f"({4*j} < last ? {4*j} : last)" for j in columns]
    return f"""    for (int r = 0; r < m; r += {high}) {{
        {{at}}lanes {", ".join(f"a{i}_{j} = {{0}}" for i in rows for j in columns)};
        for (int i = 0; i < k; ++i, W += {high}) {{
            const real *from = x + rows[i];
            {" ".join(f"const {{at}}lanes x{j} = *(const {{at}}lanes *)(from + {places[j]});" for j in columns)}
            {" ".join(f"a{i}_{j} += W[{i}]*x{j};" for i in rows for j in columns)}
        }}
        {" ".join(f"if (r + {i} < m) {{ real *to = y + jump*(r + {i}); "
                  + " ".join(f"*({{at}}lanes *)(to + {places[j]}) = a{i}_{j};" for j in columns) + " }" for i in rows)}
    }}"""


def _columns_product_narrow(vectors: int, high: int) -> str:
    """The same in vectors of two numbers: four columns at a time."""
    rows = range(high)
    return f"""    for (int r = 0; r < m; r += {high}, W += {high}*k)
        for (int j = 0; j < {vectors}; ++j) {{
            const real *from = x + (4*j < last ? 4*j : last), *w = W;
            {{at}}lanes {", ".join(f"a{i} = {{0}}, b{i} = {{0}}" for i in rows)};
            for (int i = 0; i < k; ++i, w += {high}) {{
                const {{at}}lanes p = *(const {{at}}lanes *)(from + rows[i]), q = *(const {{at}}lanes *)(from + rows[i] + 2);
                {" ".join(f"a{i} += w[{i}]*p; b{i} += w[{i}]*q;" for i in rows)}
            }}
            real *to = y + jump*r + (4*j < last ? 4*j : last);
            {" ".join(f"if (r + {i} < m) {{ *({{at}}lanes *)(to + jump*{i}) = a{i}; *({{at}}lanes *)(to + jump*{i} + 2) = b{i}; }}"
                      for i in rows)}
        }}"""


def name_columns_product(vectors: int, high: int, kind: str) -> str:
    """Return the name of the function `columns_product` writes for places of the C type `kind`."""
    return f"{{at}}beside{vectors}x{high}{'wide' if kind == 'int' else ''}"


def columns_product(vectors: int, high: int, kind: str) -> str:
    """The product of a matrix W with a matrix of k rows, which begin at the places `rows`, into m rows of y, `jump` apart."""
    return f"""static NOINLINE void {name_columns_product(vectors, high, kind)}(const real *RESTRICT x, const {kind} *RESTRICT rows, int k,
                              const real *RESTRICT W, real *RESTRICT y, int jump, int m, int last) {{
#if LANES == 4
{_columns_product_wide(vectors, high)}
#elif LANES == 2
{_columns_product_narrow(vectors, high)}
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
