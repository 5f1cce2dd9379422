"""The derivations of the paper, repeated symbolically with SymPy from (7) to (11)."""

import paper_symbols as p
import pytest
import sympy as sp

CALM = dict.fromkeys(p.DISTURBANCE, 0)
EXACT = {p.fu_hat: p.f_u, p.fv_hat: p.f_v, p.fr_hat: p.f_r}
YAW_RATE = p.a * p.PRINTED_13 + p.b * p.PRINTED_18  # dS1 of (20)


def under_the_law(expression):
    """Substitute tau_2 of (22), with its parts summed, and tau_1 of (28), which depends on tau_2."""
    return expression.subs(p.tau_1, p.LAW_TAU_1).subs(p.tau_2, p.SUMMED_TAU_2)


@pytest.mark.parametrize(
    ("coordinate", "velocity"),
    [(p.z1, p.u + p.z2 * p.r), (p.z2, p.v - p.z1 * p.r), (p.z3, p.r)],
    ids=["surge", "sway", "heading"],
)
def test_first_rates_of_the_transformation(coordinate, velocity) -> None:
    """dz1 = u + z2·r, dz2 = v - z1·r, dz3 = r, from (9) and (7)."""
    assert p.vanishes(p.rate(p.in_states(coordinate)) - p.in_states(velocity))


@pytest.mark.parametrize(
    ("surface", "printed"),
    [(p.sigma1, p.PRINTED_13), (p.sigma2, p.PRINTED_18), (p.SURGE_SURFACE, p.PRINTED_24)],
    ids=["(13)", "(18)", "(24)"],
)
def test_the_printed_rates_of_the_surfaces_follow(surface, printed) -> None:
    assert p.vanishes(p.rate(p.in_states(surface)) - p.in_states(printed))


def test_the_summed_yaw_moment_is_the_printed_one_where_that_exists() -> None:
    """(16) + (19) + (21) for z1 != 0; summed, z1 cancels from the denominator."""
    printed = p.TAU_EQ21 + p.TAU_EQ22 + p.TAU_SW2
    assert sp.simplify(printed - p.SUMMED_TAU_2) == 0
    assert sp.denom(p.TAU_EQ21).subs(p.z1, 0) == 0
    assert sp.limit(sp.together(printed), p.z1, 0).equals(p.SUMMED_TAU_2.subs(p.z1, 0))


def test_the_only_singularity_is_where_the_moment_has_no_authority_over_its_surface() -> None:
    """tau_2 has one pole, z1 = b/a, and there dS1 does not depend on tau_2: no other form of the law could do better."""
    denominator = sp.denom(sp.together(p.SUMMED_TAU_2))
    assert sp.solve(denominator, p.z1) == [p.b / p.a]
    authority = sp.expand(YAW_RATE).coeff(p.tau_2)
    assert sp.simplify(authority - (p.b - p.a * p.z1) / p.m33) == 0


def test_exact_networks_in_calm_water_give_the_reaching_laws() -> None:
    """dS1 = -k1·S1 - eta1·sgn S1 and dS2 = -k2·S2 - eta2·sgn S2."""
    for surface_rate, designed in (
        (YAW_RATE, -p.k1 * p.S1 - p.eta1 * p.sgn(p.S1)),
        (p.PRINTED_24, -p.k2 * p.S2 - p.eta2 * p.sgn(p.S2)),
    ):
        assert sp.simplify(under_the_law(surface_rate).subs(EXACT).subs(CALM) - designed) == 0


def test_estimation_errors_and_the_disturbance_drive_the_surfaces() -> None:
    """dS1 gains a·(f~v + tau_vw) + (b - a·z1)·(f~r + tau_rw), dS2 gains f~u + tau_uw + z2·(f~r + tau_rw), exactly."""
    tau_uw, tau_vw, tau_rw = p.DISTURBANCE
    missed_u, missed_v, missed_r = p.f_u - p.fu_hat + tau_uw, p.f_v - p.fv_hat + tau_vw, p.f_r - p.fr_hat + tau_rw
    gained1 = p.a * missed_v + (p.b - p.a * p.z1) * missed_r
    gained2 = missed_u + p.z2 * missed_r
    assert sp.simplify(under_the_law(YAW_RATE) + p.k1 * p.S1 + p.eta1 * p.sgn(p.S1) - gained1) == 0
    assert sp.simplify(under_the_law(p.PRINTED_24) + p.k2 * p.S2 + p.eta2 * p.sgn(p.S2) - gained2) == 0


def test_every_symbol_of_the_surfaces_has_its_definition() -> None:
    free = sp.Tuple(p.in_states(p.YAW_SURFACE), p.in_states(p.SURGE_SURFACE)).free_symbols
    assert free <= set(p.RATES) | {p.a, p.b, p.c1, p.c2, p.c3}
    assert not any(p.in_states(q).free_symbols & set(p.DEFINITIONS) for q in p.DEFINITIONS)
