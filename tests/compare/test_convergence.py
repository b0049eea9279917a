"""Truths of compare.convergence: manufactured sequences of known order, and sequences that allow no number."""

import numpy as np
import pytest

from compare.convergence import Band, least_squares, observed_order, pairwise_orders, richardson, study

RATIOS = {"halving": (4, 2, 1), "unequal": (3.1, 1.7, 1), "nearly equal": (1.33**2, 1.33, 1), "wide": (9, 2, 1)}


def power(h, order, limit=-0.5, factor=0.3):
    return limit + factor * np.asarray(h) ** order


@pytest.mark.parametrize("h", RATIOS.values(), ids=RATIOS)
@pytest.mark.parametrize("order", [0.55, 1.0, 2.0, 3.7, 4.4])
@pytest.mark.parametrize("factor", [0.3, -0.3])
def test_a_pure_power_gives_its_order_and_limit_at_any_ratios(h, order, factor):
    h = np.array(h) * 0.05
    found = study(h, power(h, order, factor=factor))
    assert found.sequence == "monotone"
    assert found.refused is None
    # v1 - v2 loses up to four digits to cancellation at order 4.4
    assert found.order == pytest.approx(order, rel=1e-7)
    assert found.extrapolated == pytest.approx(-0.5, rel=1e-9)
    assert found.gci == pytest.approx(1.25 * abs(factor * h[-1] ** order), rel=1e-6)
    assert found.band.contains(-0.5)


def test_order_of_levels_does_not_matter():
    h = np.array([0.1, 0.4, 0.2])
    assert study(h, power(h, 2.0)) == study(np.sort(h), power(np.sort(h), 2.0))


# Celik et al., J. Fluids Eng. 130 (2008) 078001, Table 1: cells of a 2-D grid, values, and the printed results
CELIK = {
    "reattachment length": ((18000, 8000, 4500), (6.063, 5.972, 5.863), 1.53, 6.1685, 2.2),
    "axial velocity": ((18000, 4500, 980), (10.7880, 10.7250, 10.6050), 0.75, 10.8801, 1.1),
}


@pytest.mark.parametrize(("cells", "values", "order", "extrapolated", "gci"), CELIK.values(), ids=CELIK)
def test_printed_monotone_examples_of_celik_2008(cells, values, order, extrapolated, gci):
    found = study(np.array(cells) ** -0.5, values)
    assert found.order == pytest.approx(order, abs=0.005)  # half a unit of the printed digit
    assert found.extrapolated == pytest.approx(extrapolated, abs=2e-4)  # h from cells, printed with rounded ratios
    assert found.gci_percent == pytest.approx(gci, abs=0.05)


def test_printed_oscillating_example_of_celik_2008_is_refused():
    # the paper prints p = 1.51 and GCI 0.5 % for it, from absolute values of changes that alternate
    found = study(np.array([18000, 4500, 980]) ** -0.5, (6.0042, 5.9624, 6.0909))
    assert (found.sequence, found.order, found.extrapolated, found.gci, found.band) == ("oscillating", *[None] * 4)
    assert found.refused.startswith("oscillating")


def fixed_point(h, values):
    """Celik et al. 2008, Eq. (3), iterated as printed."""
    (h3, h2, h1), (v3, v2, v1) = h, values
    p, ratio = 1.0, (v3 - v2) / (v2 - v1)
    for _ in range(2000):
        q = np.log(((h2 / h1) ** p - np.sign(ratio)) / ((h3 / h2) ** p - np.sign(ratio)))
        p = abs(np.log(abs(ratio)) + q) / np.log(h2 / h1)
    return p


def test_order_is_the_fixed_point_of_celik_where_that_converges():
    h = np.array([0.5, 0.3, 0.2])
    assert observed_order(h, power(h, 1.6)) == pytest.approx(fixed_point(h, power(h, 1.6)), rel=1e-9)


REFUSED = {
    "oscillating": ([1.0, 1.3, 1.2], "oscillating"),
    "growing oscillation": ([1.0, 1.1, 0.9], "diverging"),
    "growing steps": ([1.0, 1.1, 1.4], "diverging"),
    "equal steps, as of a logarithm": ([1.0, 1.1, 1.2], "diverging"),
    "constant": ([1.0, 1.0, 1.0], "plateau"),
    "change below the solver's tolerance": ([1.0, 1.1, 1.1 + 5e-9], "plateau"),
    "zero": ([0.0, 0.0, 0.0], "plateau"),
}


@pytest.mark.parametrize(("values", "sequence"), REFUSED.values(), ids=REFUSED)
def test_no_numbers_from_a_sequence_that_allows_none(values, sequence):
    found = study([0.4, 0.2, 0.1], values)
    assert (found.sequence, found.order, found.extrapolated, found.gci) == (sequence, None, None, None)
    assert found.refused.startswith(sequence)


@pytest.mark.parametrize("order", [0.2, 6.0])
def test_an_implausible_order_is_shown_but_claims_no_band(order):
    h = np.array([0.4, 0.2, 0.1])
    found = study(h, power(h, order))
    assert found.order == pytest.approx(order, rel=1e-6)
    assert (found.sequence, found.extrapolated, found.gci) == ("monotone", None, None)
    assert found.refused.startswith("implausible order")


def test_fewer_than_three_levels_are_refused():
    assert study([0.2, 0.1], [1.0, 1.1]).refused == "fewer than three levels: 2"
    assert study([], []).refused == "fewer than three levels: 0"


@pytest.mark.parametrize("bad", [None, np.nan, np.inf])
def test_a_failed_level_refuses_the_band_and_is_named(bad):
    found = study([0.4, 0.2, 0.1, 0.05], [1.0, bad, 1.2, 1.25])
    assert (found.sequence, found.order, found.gci) == (None, None, None)
    assert found.refused == "failed level: h = 0.2"


def test_levels_too_close_to_each_other_are_refused():
    h = np.array([0.12, 0.11, 0.1])
    assert study(h, power(h, 2.0)).refused.startswith("too little refinement")


def test_a_ratio_of_1_2_is_taken_where_there_is_no_1_3():
    h = 1.25 ** -np.arange(3.0)
    assert study(h, power(h, 2.0)).order == pytest.approx(2.0, rel=1e-8)
    h = 1 / np.array([3.0, 4, 5, 6])
    assert study(h, power(h, 2.0)).used == (0, 1, 3)


def test_an_order_that_still_changes_claims_no_band():
    """Values whose order grows from 1 to 3 with refinement, as of an element that begins to resolve the answer."""
    h = 0.5 ** np.arange(4.0)
    values = [1.0, 0.6, 0.4, 0.4 - 0.2 / 8]
    found = study(h, values)
    assert study(h[:3], values[:3]).gci is not None
    assert (found.sequence, found.extrapolated, found.gci) == ("monotone", None, None)
    assert found.order == pytest.approx(3.0)
    assert found.refused == "unsettled order: 1 before the finest level, 3 with it"


def test_levels_before_the_finest_without_an_order_claim_no_band():
    h = 0.5 ** np.arange(5.0)
    found = study(h, [0.3, 0.9, 0.6, 0.4, 0.35])
    assert study(h[1:], [0.9, 0.6, 0.4, 0.3]).sequence == "monotone"
    assert study(h[:4], [0.3, 0.9, 0.6, 0.4]).order == pytest.approx(np.log2(1.5))
    assert found.refused.startswith("unsettled order: 0.585 before")
    assert study(h[1:], [0.5, 0.4, 0.3, 0.25]).refused == (
        "unsettled order: the levels before the finest have none, with it 1"
    )


def test_levels_between_the_three_still_judge_the_sequence():
    # 8, 6, 4 carry the order; the kink at 5 elements per side would be skipped
    h = 1 / np.array([4.0, 5, 6, 8])
    values = power(h, 2.0)
    assert study(h, values).used == (0, 2, 3)
    values[1] += 0.02
    assert study(h, values).sequence == "oscillating"


@pytest.mark.parametrize("seed", range(20))
def test_noise_never_yields_a_band_far_from_the_truth(seed):
    """Noise of 2 % of the last change moves the limit by less than the quarter that the safety factor adds."""
    h = np.array([0.4, 0.2, 0.1])
    noise = 0.02 * 0.009 * np.random.default_rng(seed).uniform(-1, 1, 3)
    found = study(h, power(h, 2.0) + noise)
    assert found.band.contains(-0.5)


def test_pure_noise_around_a_limit_is_mostly_refused():
    """Of random triples few look like a power between 0.5 and 4.5; each of those is unavoidable with three levels."""
    random = np.random.default_rng(7)
    claimed = [study([0.4, 0.2, 0.1], 1 + 1e-3 * random.standard_normal(3)).gci is not None for _ in range(400)]
    assert np.mean(claimed) < 0.2


def test_least_squares_finds_a_power_over_many_levels_of_unequal_ratios():
    h = 1 / np.array([2.0, 3, 4, 5, 6, 8])
    fit = least_squares(h, power(h, 1.7))
    assert fit.order == pytest.approx(1.7, rel=1e-5)
    assert fit.extrapolated == pytest.approx(-0.5, rel=1e-6)
    assert fit.factor == pytest.approx(0.3, rel=1e-5)
    assert fit.scatter < 1e-8


def test_least_squares_averages_noise_and_reports_its_size():
    h = 1 / np.arange(2.0, 30.0)
    fit = least_squares(h, power(h, 2.0) + 1e-4 * np.random.default_rng(1).standard_normal(len(h)))
    assert fit.order == pytest.approx(2.0, abs=0.05)
    assert fit.extrapolated == pytest.approx(-0.5, abs=1e-4)
    assert fit.scatter == pytest.approx(1e-4, rel=0.4)


def test_least_squares_of_a_logarithm_has_no_order():
    h = 0.5 ** np.arange(6)
    assert least_squares(h, np.log(h)) is None


def test_least_squares_needs_four_levels():
    with pytest.raises(ValueError, match="four levels"):
        least_squares([0.4, 0.2, 0.1], [1, 2, 3])


def test_pairwise_orders_of_errors():
    h = np.array([0.4, 0.25, 0.1])
    assert pairwise_orders(h, -0.7 * h**3) == pytest.approx([3.0, 3.0], rel=1e-12)
    assert pairwise_orders([0.2, 0.1], [0.1, 0.0]) == [None]


def test_richardson_removes_the_leading_error():
    assert richardson([0.2, 0.1], [1.04, 1.01], 2) == pytest.approx(1.0, rel=1e-14)


def test_bands_overlap_when_they_share_a_value():
    assert Band(0, 1).overlaps(Band(1, 2))
    assert not Band(0, 1).overlaps(Band(1.1, 2))


@pytest.mark.parametrize("h", [[0.2, 0.2, 0.1], [0.2, 0.1, 0.0], [0.2, 0.1, -0.1]])
def test_equal_or_negative_h_are_an_error(h):
    with pytest.raises(ValueError, match="element lengths"):
        study(h, [1, 2, 3])


def test_an_order_above_the_highest_is_reported_but_not_extrapolated_with():
    """v = 1 + h^2 on halved levels: the last change is 3 h^2 of the finest, a first order leaves as much again."""
    h = [0.4, 0.2, 0.1]
    values = [1 + x**2 for x in h]
    free, bound = study(h, values), study(h, values, highest=1.0)
    assert free.taken == pytest.approx(2.0) and free.extrapolated == pytest.approx(1.0)
    assert bound.order == pytest.approx(2.0) and bound.taken == 1.0
    assert bound.extrapolated == pytest.approx(values[-1] - (values[-2] - values[-1]))
    assert bound.gci == pytest.approx(1.25 * 0.03)


def test_orders_above_the_highest_count_as_settled():
    """Orders 4 then 1.8 contradict each other, unless both are above what the limit allows."""
    h, values = [0.8, 0.4, 0.2, 0.1], [1.0]
    for change in (0.16, 0.01, 0.01 / 2**1.8):
        values.append(values[-1] - change)
    assert "unsettled" in study(h, values).refused
    assert study(h, values, highest=1.0).refused is None
