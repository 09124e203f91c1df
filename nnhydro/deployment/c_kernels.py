"""What the loops of c_tables.py are made of: products with small matrices in registers, long sums, and how compilers are told."""

from typing import Final

# a long sum in eight parts side by side: one part alone would wait for each addition
DOTTED: Final = """#define DOTTED(out, c, at, n) { real s[8] = {0}; int i = 0; \\
    for (; i + 8 <= n; i += 8) for (int j = 0; j < 8; ++j) s[j] += c[i + j]*v[at[i + j]]; \\
    for (; i < n; ++i) s[0] += c[i]*v[at[i]]; \\
    out = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7])); }"""
# loops alike share one function, so that the program stays in the cache of instructions; vectors are worth it at -O2 too. Without flags for
# the processor, gcc and glibc on x86-64 choose a function's version when the program starts: wide vectors where there are some
OPTIONS: Final = """#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC optimize ("O3,fp-contract=fast")
#define OPTIONS_PUSHED
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__AVX__) && !defined(NO_DISPATCH)
#define CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
#endif
#ifndef CLONES
#define CLONES
#elif !defined(SINGLE)
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
        const real c = x[step*i];
        const {lanes} *w = (const {lanes} *)W;
        {" ".join(f"a{j} += c*w[{j}];" for j in sums)}
    }}
    const {lanes} a[{m // per}] = {{{", ".join(f"a{j}" for j in sums)}}};
    for (int j = 0; j < n; ++j) y[jump*j] = a[j/{per}][j%{per}];"""


def dense(m: int, prefix: str) -> str:
    """The product of a matrix of `m` rows, a multiple of PAD, with x, `step` places apart, into y, `jump` places apart."""
    given = "(const real *RESTRICT x, int step, int k, const real *RESTRICT W, real *RESTRICT y, int jump, int n)"
    return f"""#ifdef WIDER
static NOINLINE __attribute__((target("avx2,fma"))) void {prefix}wide{m}{given} {{
{_in_registers(m, 4, f"{prefix}wide")}
}}
#endif
static NOINLINE void {prefix}dense{m}{given} {{
#ifdef WIDER
    if (WIDER) {{ {prefix}wide{m}(x, step, k, W, y, jump, n); return; }}
#endif
#if LANES == 4
{_in_registers(m, 4, f"{prefix}lanes")}
#elif LANES == 2
{_in_registers(m, 2, f"{prefix}lanes")}
#else
    real a[{m}] = {{0}};
    for (int i = 0; i < k; ++i, W += {m}) for (int j = 0; j < {m}; ++j) a[j] += x[step*i]*W[j];
    for (int j = 0; j < n; ++j) y[jump*j] = a[j];
#endif
}}"""
