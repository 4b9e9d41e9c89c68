"""`auv linearize`: one document, a table of poles, a pole map."""

import json

import numpy as np
import pytest
import yaml
from numpy.testing import assert_allclose

from auv_analysis import linearize, load_scenario
from auv_analysis.cli.main import main
from auv_analysis.studies.linearize.modes import stability


@pytest.mark.usefixtures('undrawn')
def test_a_vehicle_alone(tmp_path, capsys):
    out = tmp_path / 'out'
    point = ['--nu0', '0.5', '0', '0', '0', '0', '-0.1', '--attitude', '0.1', '-0.2', '0']
    main(['linearize', 'rexrov', *point, '--out', str(out), '--json'])
    document = json.loads(capsys.readouterr().out)
    assert document == json.loads((out / 'linearization.json').read_text())
    (name, model), *others = document['models'].items()
    assert (name, others) == ('open loop', [])
    expected = linearize('rexrov', [0.5, 0, 0, 0, 0, -0.1], eta0=[0, 0, 0, 0.1, -0.2, 0])
    for key, matrix in zip('ABCD', expected, strict=True):
        assert_allclose(model[key], matrix, rtol=1e-12)
    poles = [complex(*mode['pole']) for mode in model['modes']]
    every = [*poles, *(p.conjugate() for p in poles if p.imag)]
    assert_allclose(np.sort(np.real(every)), np.sort(np.linalg.eigvals(expected.A).real), atol=1e-9)
    assert (out / 'figures' / 'poles.png').is_file()


@pytest.mark.usefixtures('unrendered')
def test_the_loops_of_a_scenario_as_a_table(tmp_path, monkeypatch, capsys, approved):
    monkeypatch.chdir(tmp_path)
    main(['linearize', 'case1', '--controller', 'cl'])
    text, out = capsys.readouterr().out, tmp_path / 'runs' / 'linearize_case1'
    approved.folder(out)
    approved.add(text.splitlines())
    for word in ('open loop: 8 states', 'cl: 20 states', 'damping', 'frequency, rad/s', '±'):
        assert word in text
    assert 'gvc' not in text
    model = json.loads((out / 'linearization.json').read_text())['models']['cl']
    zeros = sum(mode['pole'] == [0.0, 0.0] for mode in model['modes'])
    assert zeros == 2, 'roll and pitch: their restoring moments are compensated'
    assert (model['stable'], model['stability']) == (False, 'marginal')
    assert f'cl: 20 states, marginal, 2 of its {len(model["modes"])} modes neither grow' in text


@pytest.mark.usefixtures('undrawn')
def test_all_models_are_of_one_point(tmp_path, capsys):
    late = {'vehicle': 'herman2018', 'actuators': {'delay': 2.0}}  # too late for any margins
    (tmp_path / 'late.yaml').write_text(yaml.safe_dump(load_scenario('case1').data | late))
    nu0, attitude = ['0.5', '0.1', '-0.2', '0.01', '0.02', '0.03'], ['0.1', '-0.2', '0.3']
    point = ['--nu0', *nu0, '--attitude', *attitude, '--out', str(tmp_path / 'out'), '--json']
    both = ['--controller', 'cl', '--controller', 'gvc']
    main(['linearize', str(tmp_path / 'late.yaml'), *both, *point])
    models = json.loads(capsys.readouterr().out)['models']
    assert list(models) == ['open loop', 'cl', 'gvc']
    for model in models.values():
        assert_allclose(model['x0'][:8], np.array([*attitude[:2], *nu0], float))


@pytest.mark.parametrize(('rate', 'verdict'), [(-1, 'asymptotically stable'), (1e-3, 'unstable')])
def test_one_growing_pole_is_enough(rate, verdict):
    poles = [{'pole': [-2.0, 1.0]}, {'pole': [rate, 0.0]}]
    assert stability(poles) == verdict


@pytest.mark.parametrize(
    ('line', 'name'),
    [
        ('linearize nautilus', 'nautilus'),
        ('linearize rexrov --controller gvc', '--controller'),
        ('linearize case1 --controller pid', 'controllers'),
        ('linearize rexrov --attitude 0 1.5707963267948966 0', 'eta0'),
        ('linearize rexrov --nu0 nan 0 0 0 0 0', 'nu0'),
    ],
)
def test_refusals_are_one_line(line, name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(line.split())
    captured = capsys.readouterr()
    assert (end.value.code, len(captured.err.splitlines()), captured.out) == (2, 1, '')
    assert name in captured.err
    assert 'expected' in captured.err
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures('undrawn')
def test_a_controller_without_feedback_has_no_closed_loop(tmp_path, capsys):
    """What `auv excite` writes: its wrench holds no velocity, and the vehicle alone is left."""
    data = load_scenario('case1_bluerov2_heavy').data | {
        'vehicle': 'bluerov2_heavy', 'controllers': {'wave': {'law': 'multisine'}},
        'excitation': {'surge': {'terms': [{'amplitude': 5.0, 'omega': 1.0, 'phase': 1.0}]}},
    }  # fmt: skip
    (tmp_path / 'wave.yaml').write_text(yaml.safe_dump(data))
    main(['linearize', str(tmp_path / 'wave.yaml'), '--out', str(tmp_path / 'out'), '--json'])
    assert list(json.loads(capsys.readouterr().out)['models']) == ['open loop']
