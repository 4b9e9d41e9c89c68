"""Gains as logarithms: there and back, within bounds, and no faster than the samples."""

import numpy as np
import pytest
from helpers import tunings
from helpers.strategies import QUICK
from hypothesis import given
from hypothesis import strategies as st

from auv_analysis.cli import main
from auv_analysis.studies.tune.cost import Measures
from auv_analysis.studies.tune.gain_space import (
    BEST,
    STRUCTURES,
    GainSpace,
    make_space,
    starts_of,
)
from auv_analysis.studies.tune.search import Optimum, TunedLaw
from auv_dynamics.vehicle.vehicle_file import load_vehicle
from auv_gvc_controller.control.gains import sampling_warning
from auv_gvc_controller.laws import NAMES as LAWS
from auv_gvc_controller.laws.law import SHIPPED, make_gains
from auv_gvc_controller.laws.model import control_model

VEHICLE = load_vehicle('rexrov')
STEP = 0.01


def space_of(law: str, structure: str) -> GainSpace:
    return make_space(law, structure, control_model(VEHICLE), STEP, 1 / STEP)


@pytest.mark.parametrize('structure', STRUCTURES)
@pytest.mark.parametrize('law', LAWS)
@QUICK
@given(data=st.data())
def test_gains_lead_back_to_their_point(law: str, structure: str, data: st.DataObject) -> None:
    space = space_of(law, structure)
    unit = np.array(data.draw(st.lists(st.floats(0, 1), min_size=len(space.names),
                                       max_size=len(space.names))))  # fmt: skip
    x = space.low + unit * (space.high - space.low)
    entry = space.entry(x)
    assert entry.pop('law') == law
    np.testing.assert_allclose(space.nearest(entry), x, atol=1e-9)
    gains = make_gains(law, entry)
    assert all(np.all(np.linalg.eigvalsh(np.reshape(g, (6, 6))) > 0) for g in gains[: len(entry)])


def test_structures_are_what_they_say() -> None:
    M, x = VEHICLE.M, np.log([2.0, 3.0, 4.0, 5.0])
    gains = {s: space_of('cl', s).entry(x) for s in ('scalar', 'mass', 'inertia')}
    assert gains['scalar']['k_D'] == pytest.approx(2.0)
    np.testing.assert_allclose(gains['mass']['Gamma'], 5.0 * np.diagonal(M))
    np.testing.assert_allclose(gains['inertia']['k_I'], 3.0 * M)
    assert [gains[s]['Lambda'] for s in gains] == pytest.approx([4.0] * 3)
    about, axes = SHIPPED['cl'].search(STEP)['k_D'], np.diagonal(M)
    for structure, least, most in (('scalar', axes.min(), axes.max()), ('mass', 1.0, 1.0)):
        space = space_of('cl', structure)
        ends = np.exp([space.low[0], space.high[0]])
        assert ends == pytest.approx([about.low * least, about.high * most])


def test_every_structure_that_can_be_asked_for_has_its_own_words() -> None:
    tune = main.parser(['tune']).children['tune']
    (asked,) = (action for action in tune._actions if action.dest == 'structure')
    assert [BEST, *STRUCTURES] == list(asked.choices)
    assert len(set(STRUCTURES.values())) == len(STRUCTURES)


def test_the_rate_margin_ends_where_the_sampled_loop_begins_to_ring() -> None:
    space = space_of('cl', 'inertia')
    x = np.log([[0.99 / STEP, 1.0, 1.0, 1.0], [1.01 / STEP, 1.0, 1.0, 1.0]])
    np.testing.assert_allclose(space.rate_margin(x), -np.log([0.99, 1.01]), atol=1e-9)
    warned = [sampling_warning(k * VEHICLE.M, VEHICLE.M, STEP) for k in np.exp(x[:, 0])]
    assert [w is None for w in warned] == [True, False]


def test_gains_outside_come_to_the_border_and_those_that_are_not_positive_to_the_middle() -> None:
    space = space_of('gvc', 'mass')
    far = {'k_D': 1e9, 'k_I': 1.0, 'Lambda': 1e-9, 'Gamma': 1.0}
    x = space.nearest(far)
    assert (x[0], x[2]) == (space.high[0], space.low[2])
    assert space.nearest(far | {'k_I': 0.0})[1] == (space.low[1] + space.high[1]) / 2


@pytest.mark.parametrize('reference', ['gvc', 'cl', 'smc'])
def test_every_law_starts_from_the_same_two_points(tmp_path, reference: str) -> None:
    """The reference's gains in the units of the law, whatever else the scenario has."""
    smc = {'law': 'smc', 'k_D': 300.0, 'Lambda': 0.5, 'Gamma': 0.0, 'k_S': 3.0, 'phi': 0.1}
    entries = {'gvc': tunings.GVC, 'cl': tunings.SAME_CL, 'other': tunings.SAME_CL, 'smc': smc}
    scenario = tunings.scenario(tmp_path, entries)
    model = control_model(scenario.vehicle)
    for law in LAWS:
        space = make_space(law, 'mass', model, STEP, 1 / STEP)
        near, middle = starts_of(space, scenario, reference)
        np.testing.assert_array_equal(middle, (space.low + space.high) / 2)
        if {law, reference} <= {'gvc', 'cl'}:  # one and the same law where M is diagonal
            own = space.nearest(entries[law])
            np.testing.assert_allclose(near, own)


def remarks(space: GainSpace, x: np.ndarray) -> list[str]:
    nothing = Measures(*np.zeros((len(Measures._fields), 1)))
    none = np.zeros(0)
    best = Optimum(space, x, nothing, True, None, none, nothing, none, none)
    return TunedLaw(space.law, best, ()).remarks(30.0)


def test_an_adaptation_that_acts_in_one_axis_is_none_without_effect() -> None:
    for law, structure in (('gvc', 'diagonal'), ('pid', 'mass')):  # that has no adaptation
        space = space_of(law, structure)
        x = (space.low + space.high) / 2
        if law == 'gvc':
            x[:6], x[18:23], x[23] = np.log([12.0, 0.1, 5.0])
        assert remarks(space, x) == []


@pytest.mark.parametrize(
    ('Gamma', 'k_D', 'words'),
    [
        (5.0, 12.0, []),
        (0.1, 12.0, ['its adaptation is switched off']),  # 0.1 / 12 1/s in a run of 30 s
        (1e-3, 12.0, ['at a bound of the search: Gamma (lower)', 'its adaptation is switched off']),
        (60.0, 100.0, ['at a bound of the search: k_D (upper)', 'as fast as the control period']),
    ],
)
@pytest.mark.parametrize('law', ['gvc', 'cl'])
def test_a_bound_and_an_adaptation_without_effect_are_remarked_on(law, Gamma, k_D, words) -> None:
    found = remarks(space_of(law, 'inertia'), np.log([k_D, 1.0, 1.0, Gamma]))
    assert len(found) == len(words)
    assert all(word in text for word, text in zip(words, found, strict=True))
