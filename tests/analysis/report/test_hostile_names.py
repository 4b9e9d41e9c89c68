"""Names and texts of strangers are text: in reports, in file names, in figures, in a terminal."""

import io
from contextlib import nullcontext
from html.parser import HTMLParser
from pathlib import Path

import pytest
import yaml
from helpers import tunings
from helpers.untrusted_bags import SCENARIO, write
from rich.table import Table
from rich.text import Text

from auv_analysis import load_run, load_scenario, simulate
from auv_analysis.cli import main
from auv_analysis.output.progress import TextConsole
from auv_analysis.output.text import Maths, symbol
from auv_analysis.report.digest import digests
from auv_analysis.report.document import maths
from auv_analysis.report.run_plots import settling
from auv_dynamics import load_vehicle
from auv_dynamics.files.errors import MARK, InputError, printable

HTML = '<xss onload="x()">&amp;</script></style></title></textarea><xss>\'"{{7*7}}'
ESCAPES = '\x1b[2J\x1b]0;mine\x07\r\x9b31m\u202e[red]x[/red]'


class Found(HTMLParser):
    """Elements of a page, and what stands in its scripts."""

    def __init__(self, page: str):
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list) -> None:
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}


@pytest.mark.usefixtures('unrendered')
def test_a_report_shows_what_a_bag_says_as_text(tmp_path: Path) -> None:
    plain = write(tmp_path / 'plain.mcap')
    bag = write(tmp_path / 'bag.mcap', controller=HTML.replace('/', '_'), vehicle=HTML, remark=HTML)
    for name in ('plain', 'bag'):
        main.main(['analyze', str(tmp_path / f'{name}.mcap'), '--out', str(tmp_path / name)])
    pages = [(tmp_path / name / 'report.html').read_text() for name in ('plain', 'bag')]
    usual, found = map(Found, pages)
    assert plain != bag
    assert found.tags == usual.tags
    assert found.attributes == usual.attributes
    assert pages[1].count('</script>') == pages[0].count('</script>')
    assert '&lt;xss' in pages[1]
    assert '{{7*7}}' in pages[1]


@pytest.mark.parametrize('name', ['../../out', '$\\frac$', 'x' * 3000, '..', ESCAPES, '-rf', 'a b'])
def test_the_controller_of_a_bag_is_a_word(tmp_path: Path, name: str) -> None:
    found = load_run(write(tmp_path / 'bag.mcap', controller=name)).controller
    assert 0 < len(found) <= 100
    assert set(found) <= set('ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.+-')
    assert found[0].isalnum()


@pytest.mark.parametrize('name', ['', '$x$', 'a\x1b[2J', 'a\nb', 'a\n', 'x' * 201, 'a\u202eb'])
def test_a_vehicle_whose_name_would_be_obeyed_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / 'vehicle.yaml'
    path.write_text(yaml.safe_dump({**SCENARIO.vehicle_data, 'name': name}))
    with pytest.raises(InputError, match='name: expected a word or more, at most') as error:
        load_vehicle(path)
    assert printable(str(error.value)) == str(error.value)


def test_a_vehicle_may_have_any_other_name(tmp_path: Path) -> None:
    path = tmp_path / 'vehicle.yaml'
    path.write_text(yaml.safe_dump({**SCENARIO.vehicle_data, 'name': 'Łódź <2> & Söhne'}))
    assert load_vehicle(path).name == 'Łódź <2> & Söhne'


@pytest.mark.parametrize('command', ['info', 'analyze'])
def test_a_terminal_obeys_no_bag(tmp_path: Path, capsys, command: str) -> None:
    bag = write(tmp_path / 'bag.mcap', topic=f'/{ESCAPES}', remark=ESCAPES, samples=2)
    with pytest.raises(SystemExit) if command == 'analyze' else nullcontext():
        main.main([command, str(bag), *(['--vehicle', ESCAPES] if command == 'analyze' else [])])
    out, err = capsys.readouterr()
    assert printable(out + err) == out + err
    assert MARK in out + err
    if command == 'info':  # a name that is short enough for its column
        short = write(tmp_path / 'short.mcap', topic='/[red]x[/red]', samples=2)
        main.main([command, str(short)])
        assert '[red]x[/red]' in capsys.readouterr().out


def test_a_console_shows_texts_and_keeps_its_own_colours() -> None:
    out = io.StringIO()
    console = TextConsole(
        file=out, force_terminal=True, width=80, color_system='standard', highlight=False
    )
    table = Table()
    table.add_column(ESCAPES)
    table.add_row(Text(ESCAPES, 'red'))
    console.print(table, ESCAPES)
    shown = out.getvalue()
    for obeyed in ('\x1b[2J', '\x1b]0', '\x07', '\r', '\x9b', '\u202e'):
        assert obeyed not in shown
    assert '\x1b[31m' in shown
    assert '[red]x[/red]' in shown


def test_lines_of_an_error_stay_lines() -> None:
    assert printable('a\nb\x1bc\td') == f'a\nb{MARK}c{MARK}d'
    assert printable('Δξ – ½ · 漢\u00a0字') == 'Δξ – ½ · 漢\u00a0字'


@pytest.mark.usefixtures('undrawn')
def test_names_that_look_like_symbols_stay_as_they_are(tmp_path: Path, capsys) -> None:
    names = ('dolphin', 'alphabet', 'psi_delta', 'nu-shell', 'omega3', 'tau', 'k_D', 'Lambda')
    gvc = {'law': 'gvc', 'k_D': 6.0, 'k_I': 2.0, 'Lambda': 0.5, 'Gamma': 20.0}
    path = tunings.write(
        tmp_path, dict.fromkeys(names, gvc), name='w_X.phi', duration=0.1,
        vehicle={**tunings.DIAGONAL, 'name': 'seagull omega^2 ξ3'},
    )  # fmt: skip
    main.main(['simulate', str(path), '--out', str(tmp_path / 'out')])
    page, shown = (tmp_path / 'out' / 'report.html').read_text(), capsys.readouterr().err
    for name in (*names, 'w_X.phi', 'seagull omega^2 ξ3'):
        assert f'>{name}<' in page or f': {name}<' in page or f' {name};' in page, name
        assert name in shown or name.startswith(('w_X', 'seagull')), name
    assert '<sub>X</sub>.φ' not in page
    assert 'K<sub>D</sub>' in page  # ours is set
    figure, _, caption = settling(digests({n: simulate(load_scenario(path), n) for n in names}))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list(names)
    assert all(f'{name} ' in caption for name in names)


def test_symbols_are_set_in_words_of_ours_alone() -> None:
    text = Maths('w_X < ξ3, K_D of {} and M^-1 of {}', 'omega_f & Gamma', symbol('Lambda'))
    assert str(text) == 'w_X < ξ3, K_D of omega_f & Gamma and M^-1 of Lambda'
    assert str(maths(text)) == (
        'w<sub>X</sub> &lt; ξ<sub>3</sub>, K<sub>D</sub> of omega_f &amp; Gamma '
        'and M<sup>−1</sup> of Λ'
    )
    assert str(maths('dolphin w_X')) == 'dolphin w_X'
    assert type(symbol('k_Dolphin')) is str
