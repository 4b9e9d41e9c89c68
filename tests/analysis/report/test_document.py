"""Reports as data: what the page shows is what lies beside it, and every source leads somewhere."""

import platform
import re
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import pyarrow.parquet as parquet
import pytest
from helpers import artists, shown
from helpers.report_pages import Page, check_numbers

from auv_analysis.cli import main
from auv_analysis.output.text import MISSING, Maths
from auv_analysis.report import document
from auv_analysis.report.document import Section, Sentence
from auv_analysis.report.results import described, make_table
from auv_dynamics.kernel.compile import sources_digest


@pytest.fixture(scope='module')
def folder(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp('document') / 'out'
    with artists.undrawn():
        main.main(['simulate', 'case1', '--out', str(out)])
    return out


def test_every_number_of_the_tables_lies_beside_the_page_with_its_source(folder):
    page = Page((folder / 'report.html').read_text(encoding='utf-8'))
    rows = parquet.read_table(folder / document.NUMBERS).to_pylist()
    numbers = {
        name for name, table in page.tables.items() if any(v for row in table for _, v in row)
    }
    assert {row['table'] for row in rows} == numbers
    values = [
        float(value) for table in page.tables.values() for row in table for _, value in row if value
    ]
    assert sorted(values) == sorted(row['value'] for row in rows)
    assert check_numbers(folder) > 250


def test_every_link_leads_to_an_anchor_that_there_is_once(folder):
    page = Page((folder / 'report.html').read_text(encoding='utf-8'))
    assert set(page.links) <= set(page.ids)
    assert {'experiment', 'table-key_figures', 'claim-14', 'quantities'} <= set(page.ids)


def test_a_report_says_what_made_it(folder, monkeypatch):
    text = (folder / 'report.html').read_text(encoding='utf-8')
    packages = ('auv_analysis', 'auv_gvc_controller', 'auv_dynamics', 'numpy', 'numba', 'scipy')
    versions = {'Python': platform.python_version()} | {n: version(n) for n in packages}
    listed = ', '.join(f'{name} {found}' for name, found in versions.items())
    assert f'<dt>versions</dt><dd>{listed}; sources <code>{sources_digest()}</code>' in text
    assert re.search(r'<dt>written</dt><dd>\d{4}-\d\d-\d\d', text)
    for program, command in (('bin/auv', "auv simulate 'a b'"), ('other.py', '')):
        monkeypatch.setattr('sys.argv', [program, 'simulate', 'a b'])
        assert document.provenance()['command'] == command
    now = lambda zone: datetime(2026, 3, 4, 17, 8, tzinfo=zone)  # noqa: E731
    monkeypatch.setattr(document, 'datetime', SimpleNamespace(now=now))
    assert document.provenance()['written'] == '2026-03-04 17:08 UTC'
    monkeypatch.setattr(document, 'PACKAGES', ('no such package', 'numpy'))
    assert list(document.provenance()['versions']) == ['Python', 'numpy']


def made(tmp_path: Path, **changes) -> str:
    rows = {'what': ['<a>', 'b', 'c'], 'x': [0.0, None, 1234.5]}
    shown = {'what': 'what', 'x': described('x', 'how far <it> is', 'm', group='far')}
    where = {'pointer': lambda row, column: ['', '', 'here'][row]}
    table = make_table('t', Maths('A table of x_d.'), rows, shown, **where)
    blocks = ['A paragraph.', Sentence('It is 1.', 'table-t'), table]
    sections = [Section('s', 'First', blocks), Section('empty', 'Second', [])]
    arguments = {'title': 'T', 'about': 'a', 'findings': [Sentence('Found.', 's')]} | changes
    document.write_document(tmp_path, **arguments, sections=sections, listings=[('f', 'a: <1>')])
    return (tmp_path / 'report.html').read_text(encoding='utf-8')


def test_a_name_that_is_no_utf_8_does_not_lose_a_report(tmp_path):
    assert '<h1>a?b</h1>' in made(tmp_path, title='a\udcffb')


def test_a_document_of_all_kinds_of_blocks(tmp_path, approved):
    text = made(tmp_path)
    approved.folder(tmp_path)
    approved.add(shown.frame_lines(text))
    page = Page(text)
    assert page.tables['t'] == [
        [('<a>', None), ('0', '0.0')], [('b', None), (MISSING, None)],
        [('c', None), ('1\u202f234', '1234.5')],
    ]  # fmt: skip
    assert '(table 1)</a>' in text
    assert '(section 1)</a>' in text
    assert 'x<sub>d</sub>' in text
    assert 'title="how far &lt;it&gt; is"' in text
    assert 'Second' not in text
    assert 'a: &lt;1&gt;' in text
    (zero, far) = parquet.read_table(tmp_path / document.NUMBERS).to_pylist()
    assert (zero['row'], zero['value']) == ('<a>', 0.0)
    assert far == {
        'table': 't', 'row': 'c', 'column': 'far x', 'text': '1\u202f234',
        'value': 1234.5, 'unit': 'm', 'source': 'here',
    }  # fmt: skip
