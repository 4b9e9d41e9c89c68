"""Figures and report: complete, readable, honest about zeros, and free of outside resources."""

import re
import shutil
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from auv_analysis import load_scenario, simulate, summarize
from auv_analysis.herman2018.claims import claims_part, judge_runs
from auv_analysis.herman2018.paper import paper_figures
from auv_analysis.output.text import capital, fixed, join, largest, number, plain, tied
from auv_analysis.report import plots, run_report
from auv_analysis.report.digest import digest, digests
from auv_analysis.report.panels import different_disturbances
from auv_analysis.report.plots import PALETTE, FigureRecord, style
from auv_analysis.report.run_plots import draw_figures, six_signals
from auv_analysis.report.run_report import write_report
from auv_analysis.report.traces import thinned
from auv_analysis.runs.run import Run

EMPTY_TAGS = {'meta', 'img', 'br', 'input'}
SIX = ('lumped_error_gvc', 'uncertainty_gvc', 'inputs_gvc', 'delta_xi', 'delta_pi')
ALIKE = {**dict.fromkeys(SIX, 'errors_gvc'), 'compared_inputs': 'settling'}  # by one function
SCRIPTS = re.compile(r'<script.*?</script>', re.DOTALL)


def _runs(name: str) -> dict[str, Run]:
    scenario = load_scenario(name)
    return {controller: simulate(scenario, controller) for controller in scenario.controllers}


@pytest.fixture(scope='module')
def case1() -> dict[str, Run]:
    return _runs('case1')


def _summaries(runs: dict[str, Run]) -> dict:
    return {name: summarize(run) for name, run in runs.items()}


def _write(
    out: Path, runs: dict[str, Run], scenario='a: 1', vehicle='b: 2  # <GIVEN>'
) -> tuple[str, dict[str, FigureRecord]]:
    """Page of a report and the figures that were drawn for it."""
    summaries, figures = _summaries(runs), {}
    sections, sentences = claims_part(out, judge_runs(runs, summaries), runs)
    more = {'couplings': sections}

    def draw(*arguments):
        drawn = draw_figures(*arguments)
        figures.update({figure.name: figure for figure in drawn})
        return drawn

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_report, 'draw_figures', draw)
        path = write_report(out, runs, summaries, scenario, vehicle, more=more, sentences=sentences)
    assert path == out / 'report.html'
    return path.read_text(encoding='utf-8'), figures


@pytest.fixture(scope='module')
def drawn(case1, tmp_path_factory) -> tuple[str, dict[str, FigureRecord]]:
    """One of those that one function draws is rendered, and its files stand for the others."""
    texts = load_scenario('case1').attachments
    folder, render = tmp_path_factory.mktemp('case1'), plots.save

    def save(figure: Figure, folder: Path, name: str) -> tuple[Path, ...]:
        gvc = name.replace('_cl', '_gvc')
        one = ALIKE.get(gvc, gvc)
        if one == name:
            return render(figure, folder, name)
        kinds = '.png', '.pdf'
        return tuple(shutil.copy(folder / (one + kind), folder / (name + kind)) for kind in kinds)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plots, 'save', save)
        return _write(folder, case1, texts['scenario.yaml'], texts['vehicle.yaml'])


@pytest.fixture(scope='module')
def report(drawn) -> str:
    return drawn[0]


@pytest.fixture(scope='module')
def figures(drawn) -> dict[str, FigureRecord]:
    return drawn[1]


@pytest.fixture(scope='module')
def other(case1, tmp_path_factory, composing) -> tuple[str, dict[str, FigureRecord]]:
    """Two seconds of another vehicle, of diagonal inertia, under an unknown disturbance."""
    run = _short(case1['gvc'], 2.0)
    M = np.diag(np.diagonal(run.vehicle.M))
    vehicle = replace(run.vehicle, M=M, name='other', warnings=('file: key: <odd>',))
    notes = ('3 samples dropped',)
    run = replace(run, scenario='mine', vehicle=vehicle, notes=notes, disturbance=None)
    with composing():
        return _write(tmp_path_factory.mktemp('other'), {'gvc': run})


def _short(run: Run, seconds: float) -> Run:
    keep = run.t <= seconds + run.step / 2
    return run.part(keep)


def _text(report: str) -> str:
    body = report[report.index('<body>') : report.index('<script>')]
    return unescape(re.sub(r'\s+', ' ', re.sub(r'<[^>]+>', '', body))).replace('\u00a0', ' ')


def test_every_figure_is_a_png_and_a_pdf_with_something_on_it(figures):
    assert len(figures) >= 7
    for figure in figures.values():
        assert figure.pdf.read_bytes().startswith(b'%PDF')
        image = Image.open(figure.png)
        pixels = np.asarray(image.convert('L'), float)
        assert pixels.std() > 5.0, figure.name
        assert (pixels < 200).mean() > 0.003, figure.name
        assert image.getpixel((1, 1)) == PALETTE - 1, 'white has its own colour'


def test_figures_are_what_the_journal_prints(figures):
    """At the width of its text, of lines and embedded fonts, without images and transparency."""
    for figure in figures.values():
        pdf = figure.pdf.read_bytes()
        left, _, right, _ = map(float, re.search(rb'/MediaBox \[([^]]*)\]', pdf)[1].split())
        assert right - left == pytest.approx(72 * 6.27, abs=0.5), figure.name
        kinds = set(re.findall(rb'/Subtype /(\w+)', pdf)) - {b'Form'}  # the shape of a mark
        assert kinds == {b'Type0', b'CIDFontType2'}
        assert pdf.count(b'/FontFile2') == pdf.count(b'/Subtype /CIDFontType2') > 0
        assert set(re.findall(rb'/(?:ca|CA) ([0-9.]+)', pdf)) <= {b'0', b'1'}
        assert not re.search(rb'/(Creator|Producer|CreationDate)\b', pdf), 'the same everywhere'
        with Image.open(figure.png) as image:
            assert image.size[0] == pytest.approx(184 * 6.27, abs=1.0)


def test_the_paper_figures_are_all_there(case1):
    words = ' '.join(text for run in case1.values() for text in paper_figures(run))
    assert all(f'figure {number}' in words for number in '12345')
    short = {n: _short(r, 3.0) for n, r in _runs('case2').items()}
    words = ' '.join(text for run in short.values() for text in paper_figures(run))
    assert all(f'figure {number}' in words for number in ('6(a,b)', '6(c,d)', '6(e,f)', '7'))


def test_a_figure_is_not_called_the_papers_when_the_gains_are_others(case1):
    gvc = replace(case1['gvc'], gains=case1['gvc'].gains | {'Gamma': 61.0})
    assert paper_figures(gvc) == []


def test_signals_that_stay_zero_are_named_and_not_drawn(case1):
    still = case1['gvc'].nu_d.copy()
    still[:, 2] = case1['gvc'].nu[:, 2]
    figure, _, caption = six_signals('error', digest(replace(case1['gvc'], nu=still)))
    assert 'not drawn: surge, sway, roll, pitch and yaw.' in caption
    assert {len(axes.lines) for axes in figure.axes} == {1}


def test_diagonal_inertia_has_sentences_in_place_of_coupling_figures(other):
    html, figures = other
    for name, symbol in (('delta_xi', 'Δξ'), ('delta_pi', 'Δπ')):
        assert figures[name].png is None
        assert figures[name].pdf is None
        assert f'{symbol} vanishes in all six degrees of freedom' in figures[name].caption
    text = _text(html)
    assert 'no degree of freedom is coupled to another by inertia' in text
    assert 'Δξ vanishes in all six' in text


def test_unknown_disturbance_leaves_out_what_needs_it(other):
    html, figures = other
    assert not [name for name in figures if name.startswith(('lumped', 'uncertainty'))]
    assert 'is neither drawn nor tabulated' in _text(html)


def test_one_uncertainty_figure_when_all_runs_have_the_same(figures, case1):
    assert [name for name in figures if name.startswith('uncertainty')] == ['uncertainty_gvc']
    gvc, cl = (_short(case1[name], 1.0) for name in ('gvc', 'cl'))
    cl = replace(cl, disturbance=2.0 * cl.disturbance)
    assert [*different_disturbances(digests({'gvc': gvc, 'cl': cl}))] == ['gvc', 'cl']


@pytest.mark.long
def test_figures_are_the_same_bytes_every_time_and_leave_matplotlib_alone(case1, tmp_path):
    runs = {'gvc': _short(case1['gvc'], 1.0)}
    settings = dict(matplotlib.rcParams)
    first, second = (draw_figures(runs, tmp_path / name) for name in ('a', 'b'))
    assert dict(matplotlib.rcParams) == settings
    for one, other in zip(first, second, strict=True):
        assert one.png.read_bytes() == other.png.read_bytes(), one.name
        assert one.pdf.read_bytes() == other.pdf.read_bytes(), one.name


@pytest.mark.parametrize('logarithmic', [False, True])
@pytest.mark.parametrize('n', [10, 4000, 4001, 123_457])
def test_decimation_keeps_every_extreme_and_few_points(n, logarithmic):
    rng = np.random.default_rng(n)
    t, y = np.arange(1.0, n + 1), rng.normal(size=n)
    y[n // 3], y[-1] = 50.0, -60.0
    few_t, few_y = thinned(t, y, logarithmic=logarithmic)
    assert len(few_t) <= 4000
    assert few_y.max() == 50.0
    assert few_y.min() == -60.0
    assert np.all(np.diff(few_t) > 0)
    assert np.array_equal(y[few_t.astype(int) - 1], few_y)
    if logarithmic:  # the first decades keep all of their samples
        assert np.array_equal(few_t[: min(n, 100)], t[:100])


class _Resources(HTMLParser):
    """Collects what a browser would load, and checks that tags are closed in order."""

    def __init__(self):
        super().__init__()
        self.loaded: list[str] = []
        self.open: list[str] = []
        self.images: list[dict] = []

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.loaded += [values[key] for key in ('src', 'srcset', 'data', 'poster') if key in values]
        if tag in ('link', 'iframe', 'object', 'embed'):
            self.loaded.append(f'<{tag}>')
        if tag == 'a':
            self.loaded += [] if values['href'].startswith('#') else [values['href']]
        if tag == 'img':
            self.images.append(values)
        if tag not in EMPTY_TAGS:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f'</{tag}> closes something else'


def test_report_needs_nothing_but_itself(report):
    page = _Resources()
    page.feed(report)
    assert page.open == []
    inline = 'data:image/png;base64,'
    assert [item[:40] for item in page.loaded if not item.startswith(inline)] == []
    assert not re.search(r'@import|url\(|https?://', SCRIPTS.sub('', report))
    assert len(report) < 6_000_000
    assert len(page.images) >= 7
    assert all(len(image['alt']) > 30 for image in page.images)


def test_headers_of_tables_have_a_scope(report):
    headers = re.findall(r'<th\b[^>]*>', report)
    assert headers
    assert [header for header in headers if 'scope=' not in header] == []


def test_report_shows_every_claim_with_its_verdict(report):
    rows = re.findall(r'<tr id="claim-(\d+)".*?</tr>', report, re.DOTALL)
    assert [int(row) for row in rows] == list(range(1, 22))
    badges = re.findall(r'<tr id="claim-\d+".*?<span class="badge ([a-z-]+)">', report, re.DOTALL)
    assert badges[13] == 'not-reproduced'
    assert badges[16] == 'other-case'
    assert badges.count('reproduced') == 13


def test_report_says_what_it_must(report):
    text = _text(report)
    for sentence in (
        'The velocity is tracked, not the position: nothing bounds η',
        '528.18 J over 0–10 s and 402.45 J over 0–30 s',
        '519.47 J',
        'an en dash (–) stands for what is missing',
        'What the paper gives, and what is reconstructed',
        'errors is the paper’s figure 1',
        'Readings of the paper',
        'RECONSTRUCTED from N = diag(300, 500, 500, 40, 175.5, 141.1)',
        'kind: herman2018, exponent_sign: -1',
        'structural zero',
        'not reproduced (no. 14)',
    ):
        assert sentence in text, sentence
    assert [int(n) for n in re.findall(r'<b>Figure (\d+)\.', report)] == list(range(1, 16))
    assert 'nan' not in text.lower().split()
    assert 'None' not in text


def test_report_of_one_run(other):
    one = _text(other[0])
    assert 'Inputs compared' not in one
    assert 'Under cl' not in one


def test_report_of_three_runs(case1, tmp_path, undrawn):
    """All a sample longer than what is drawn in one phase."""
    gvc, cl = (_short(case1[name], 4.01) for name in ('gvc', 'cl'))
    third = replace(cl, law='mine:Law')
    with pytest.raises(ValueError, match='mine'):
        summarize(third)
    summaries = _summaries({'gvc': gvc, 'cl': cl})
    summaries['cl_2'] = summaries['cl'] | {'law': 'mine:Law'}
    path = write_report(tmp_path, {'gvc': gvc, 'cl': cl, 'cl_2': third}, summaries, '', '')
    three = path.read_text(encoding='utf-8')
    assert {path.stem for path in (path.parent / 'figures').glob('errors_*.png')} == {
        'errors_gvc', 'errors_cl', 'errors_cl_2',
    }  # fmt: skip
    assert '<pre' not in three  # no listings of files that were not given
    assert 'mine:Law' in three
    assert 'What was found' in three


def test_report_of_another_vehicle_and_scenario(other):
    html = other[0]
    text = _text(html)
    assert 'reconstructed' not in text
    assert 'claim-1"' not in html
    assert '519.47' not in text
    assert 'gvc: 3 samples dropped' in text
    assert 'file: key: <odd>' in text
    assert 'file: key: &lt;odd&gt;' in html
    assert 'b: 2 # <GIVEN>' in text


def test_report_of_two_samples(case1, tmp_path, composing):
    """They are the hardest to draw."""
    with composing() as figures:
        html, _ = _write(tmp_path, {'cl': _short(case1['cl'], 0.01)})
    with style():
        for name, figure in figures.items():
            if name.replace('_cl', '_gvc') not in ALIKE:
                FigureCanvasAgg(figure).draw()
    assert len(figures) >= 7
    assert 'What was found' in _text(html)


def test_no_run_is_refused(tmp_path):
    with pytest.raises(ValueError, match='at least one run'):
        write_report(tmp_path, {}, {}, '', '')


def test_numbers_as_text():
    assert [number(x) for x in (0.0, 11479.1, -0.51912, 528.184, None, 3.921e-5, -np.inf)] == [
        '0', '11\u202f479', '−0.519', '528', '–', '3.92·10⁻⁵', '−∞',
    ]  # fmt: skip
    assert [number(x) for x in (1.234e-4, 9.87e-5, 1234567.0, 12345678.0, np.inf, np.nan)] == [
        '0.000123', '9.87·10⁻⁵', '1\u202f234\u202f567', '1.23·10⁷', '∞', '–',
    ]  # fmt: skip
    assert largest([1.0, None, 3.0, np.nan, 5.0, 4.0]) == 4
    assert largest([1.0, None, 3.0, np.nan, 5.0, 4.0], range(3)) == 2
    assert largest([None] * 6) is None
    assert [plain(x) for x in (12.0, 0.8, -0.025, 30000.0, 0)] == [
        '12', '0.8', '−0.025', '30\u202f000', '0',
    ]  # fmt: skip
    assert [plain(x) for x in (1.5e9, -1e-7)] == ['1.5·10⁹', '−1·10⁻⁷']
    assert [fixed(x, 2) for x in (-4.016, -0.004, None)] == ['−4.02', '0.00', '–']
    assert [fixed(x, 1) for x in (12345.67, np.nan)] == ['12\u202f345.7', '–']
    assert [capital(text) for text in ('', 'a', 'aB c', 'Δξ')] == ['', 'A', 'AB c', 'Δξ']
    assert [join(words) for words in ([], ['a'], ['a', 'b'], ['a', 'b', 'c'])] == [
        '', 'a', 'a and b', 'a, b and c',
    ]  # fmt: skip
    assert tied('840 N m in 2 s') == '840\u00a0N\u00a0m in 2\u00a0s'
    assert tied('5 %, 3 kg, 2 m/s, 4 mm') == '5\u00a0%, 3\u00a0kg, 2\u00a0m/s, 4 mm'
