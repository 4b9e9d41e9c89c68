"""Draws: physical, within their spread, and of seed and index alone."""

import numpy as np
import pytest
from helpers import tunings
from helpers.strategies import QUICK
from helpers.tunings import GVC, SAME_CL, scenario
from hypothesis import given
from hypothesis import strategies as st

from auv_analysis import load_scenario
from auv_analysis.scenario.changes import changed_scenario
from auv_analysis.studies.tune.perturbations import (
    Spread,
    applicable,
    monte_carlo,
    perturbed,
    spread_of,
)
from auv_dynamics.files.errors import InputError
from auv_dynamics.files.yaml_files import matrix6
from auv_dynamics.vehicle import DOFS

HERMAN = load_scenario('case1')
REXROV = load_scenario('case1_rexrov')
NONE = Spread(**dict.fromkeys(Spread.__dataclass_fields__, 0.0))


def of_kind(scenario, kind):
    return [spec for spec in scenario.data['disturbance'] if spec['kind'] == kind]


@QUICK
@given(seed=st.integers(0, 2**62), size=st.floats(0.01, 0.9))
def test_relative_error_of_M_stays_within_its_size(seed: int, size: float) -> None:
    found = perturbed(HERMAN, Spread(inertia=size, damping=size), seed, 0)
    dM = np.array(of_kind(found, 'model_error')[0]['dM'])
    L = np.linalg.cholesky(HERMAN.vehicle.M)
    relative = np.linalg.eigvalsh(np.linalg.solve(L, np.linalg.solve(L, dM).T))
    assert np.abs(relative).max() <= size * (1 + 1e-9)
    assert np.abs(relative).max() > 0
    D = HERMAN.vehicle.D_linear + matrix6(of_kind(found, 'model_error')[0]['dD'])
    assert np.linalg.eigvalsh(D + D.T)[0] >= 0


def test_relative_errors_of_M_and_D_lie_on_either_side() -> None:
    one, D = Spread(inertia=0.5, damping=0.5), HERMAN.vehicle.D_linear
    found = [of_kind(perturbed(HERMAN, one, 1, i), 'model_error')[0] for i in range(30)]
    L = np.linalg.inv(np.linalg.cholesky(HERMAN.vehicle.M))
    inertia = [np.linalg.eigvalsh(L @ np.array(spec['dM']) @ L.T) for spec in found]
    damping = [np.diag(np.array(spec['dD'])) / np.diag(D) for spec in found]
    for values in (np.array(inertia), np.array(damping)):
        assert values.min() < -0.4
        assert values.max() > 0.4


def test_drawn_numbers_fill_their_spread_on_either_side() -> None:
    draws = [perturbed(REXROV, Spread(), 1, i) for i in range(60)]
    found = [of_kind(draw, 'model_error')[0] for draw in draws]
    for name, largest in (
        ('mass', 0.05),
        ('added_mass', 0.2),
        ('damping', 0.3),
        ('buoyancy', 0.02),
    ):
        values = np.array([spec[name] for spec in found])
        assert np.abs(values).max() <= largest
        assert values.min() < -0.7 * largest
        assert values.max() > 0.7 * largest
    scales = [matrix6(of_kind(draw, 'herman2018')[0]['scale'])
              / matrix6(of_kind(REXROV, 'herman2018')[0]['scale']) for draw in draws]  # fmt: skip
    factors = np.array([np.nanmax(scale) for scale in scales])
    assert 0.5 <= factors.min() < 0.65
    assert 1.35 < factors.max() <= 1.5


def test_added_forces_and_currents_fill_what_they_may_be() -> None:
    draws = [perturbed(REXROV, Spread(waves=0.04, current=0.3), 1, i) for i in range(60)]
    waves = [of_kind(draw, 'harmonic')[0] for draw in draws]
    assert {len(wave[dof]['terms']) for wave in waves for dof in DOFS} == {1}
    terms = [[wave[dof]['terms'][0] for dof in DOFS] for wave in waves]
    sizes, omegas, phases = (
        np.array([[term[key] for term in row] for row in terms])
        for key in ('amplitude', 'omega', 'phase')
    )
    sizes /= np.diagonal(REXROV.vehicle.M)
    for found, low, high in ((sizes, 0.0, 0.04), (omegas, 0.3, 1.5), (phases, 0.0, 2 * np.pi)):
        assert low <= found.min() < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < found.max() <= high
        assert len(np.unique(found)) == found.size
    velocity = np.array([of_kind(draw, 'current')[0]['velocity'] for draw in draws])
    speed = np.linalg.norm(velocity, axis=1)
    assert speed.min() < 0.05
    assert 0.27 < speed.max() <= 0.3
    assert not velocity[:, 2].any()
    for way in (velocity[:, 0], velocity[:, 1]):
        assert way.min() < -0.15
        assert way.max() > 0.15


def test_what_is_neither_a_harmonic_nor_the_papers_stays_as_it_is(tmp_path) -> None:
    own = [{'kind': 'current', 'velocity': [0.2, -0.1, 0.0]}, tunings.WAVES]
    base = scenario(tmp_path, {'gvc': GVC}, disturbance=own)
    assert perturbed(base, NONE, 0, 0).data['disturbance'][0] == base.data['disturbance'][0]
    found = perturbed(base, Spread(), 0, 0).data['disturbance']
    assert found[0] == base.data['disturbance'][0]
    assert [spec['kind'] for spec in found[1:]] == ['harmonic', 'model_error', 'harmonic',
                                                    'current']  # fmt: skip
    (term,) = found[1]['surge']['terms']
    assert term['omega'] == 2.0


def test_draw_depends_on_seed_and_index_alone() -> None:
    one = perturbed(REXROV, Spread(), 5, 3).data['disturbance']
    assert perturbed(REXROV, Spread(), 5, 3).data['disturbance'] == one
    assert perturbed(REXROV, Spread(), 5, 4).data['disturbance'] != one
    assert perturbed(REXROV, Spread(), 6, 3).data['disturbance'] != one
    seeds = [perturbed(REXROV, Spread(), 5, i).data['seed'] for i in (0, 1, 2, 0)]
    assert len(set(seeds)) == 3, 'sensors have noise of their own in each draw'


def test_without_spread_nothing_is_added() -> None:
    assert perturbed(HERMAN, NONE, 0, 0).data['disturbance'] == [
        {'kind': 'herman2018', 'exponent_sign': -1, 'scale': 1.0}
    ]


def test_own_harmonic_changes_size_and_phase(tmp_path) -> None:
    base = scenario(tmp_path, {'gvc': GVC})
    waves = [of_kind(perturbed(base, Spread(waves=0.0), 0, i), 'harmonic')[0] for i in range(4)]
    sizes = [w['surge']['terms'][0]['amplitude'] / 9.0 for w in waves]
    assert [w['surge']['offset'] / 5.0 for w in waves] == pytest.approx(sizes)
    assert len({w['surge']['terms'][0]['phase'] for w in waves}) == 4


def test_every_controller_meets_the_same_draws(tmp_path) -> None:
    """Rows do not depend on which controllers are compared, nor on the order or the threads."""
    both = scenario(tmp_path, {'gvc': GVC, 'again': GVC, 'cl': SAME_CL | {'k_D': 300.0}})
    alone = changed_scenario(both, {'controllers': {'cl': both.controllers['cl']}})
    done: list[None] = []
    asked = Spread(), 12, 3, 'continuous'
    found = monte_carlo(both, *asked, 2, lambda: done.append(None))
    assert len(done) == 12
    np.testing.assert_array_equal(found['gvc'], found['again'])
    np.testing.assert_array_equal(found['cl'], monte_carlo(alone, *asked, 1)['cl'])
    assert len(set(found['gvc'].error.tolist())) == 12


def test_spread_of_the_command_line() -> None:
    vehicle = REXROV.vehicle
    assert spread_of(['mass=0', 'waves=2.5'], vehicle) == Spread(mass=0.0, waves=2.5)
    every = {'mass', 'added_mass', 'damping', 'buoyancy', 'inertia', 'disturbance', 'waves',
             'current'}  # fmt: skip
    assert applicable(Spread(), REXROV.vehicle).keys() == every - {'inertia'}
    assert applicable(Spread(), HERMAN.vehicle).keys() == every - {'mass', 'added_mass'}
    assert applicable(Spread(waves=0.7), HERMAN.vehicle)['waves'] == 0.7
    for text, match in (
        ('size=1', 'with NAME one of mass, added_mass'), ('mass', 'from 0 up below 1, found'),
        ('mass=1', 'below 1, found 1'), ('current=-1', 'from 0 up, found -1'),
        ('waves=nan', 'found nan'), ('current=inf', 'found inf'),
    ):  # fmt: skip
        with pytest.raises(InputError, match=match):
            spread_of([text], vehicle)
    with pytest.raises(InputError, match=r'one of damping, buoyancy, inertia, .* found mass=0\.1'):
        spread_of(['mass=0.1'], HERMAN.vehicle)  # whose M_RB and M_A are not apart
    with pytest.raises(InputError, match=r'found inertia=0\.1'):
        spread_of(['inertia=0.1'], vehicle)


def test_errors_that_leave_no_plant_are_one_line(tmp_path) -> None:
    base = scenario(tmp_path, {'gvc': GVC},
                    disturbance={'kind': 'model_error', 'mass': -0.99})  # fmt: skip
    with pytest.raises(InputError, match=r'--spread: expected draws that leave disturbance\[0\]'):
        [perturbed(base, Spread(mass=0.9), 0, i) for i in range(10)]
