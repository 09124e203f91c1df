"""Numbers in words that stay true: a p value that draws cannot tell from 0 is bounded, an error is never rounded to nothing."""

SMALLEST = 1e-3  # what 999 draws can tell


def p_text(p: float, draws: int | None = None) -> str:
    """Return "p = 0.034", or "p < 0.001" where `p` is below what `draws` (999 by default) can tell; never "p = 0.000".

    The bound of d draws is 1/(d + 1). Source: Davison & Hinkley (1997), Bootstrap Methods, section 4.2, from general knowledge.
    """
    least = SMALLEST if draws is None else 1 / (draws + 1)
    if not p > least:
        return f"p < {least:.1g}" if least < 1e-3 else f"p < {least:.3g}"
    return f"p = {p:.3f}" if p >= 5e-4 else f"p = {p:.1g}"


def percent(share: float) -> str:
    """Return "3.5 %", below 1 % with two digits that count: "0.57 %" and "0.55 %" are not both "0.6 %"."""
    return f"{100 * share:#.2g} %" if 1e-4 <= share < 0.01 else f"{100 * share:.1f} %"
