"""Every equation of the article stands in docs/theory.md, and in the code that it names there."""

import importlib
import re
from typing import Any

import pytest
from helpers.doc_blocks import ROOT

TEXT = (ROOT / 'docs' / 'theory.md').read_text(encoding='utf-8')
EQUATION = re.compile(r'\\tag\{(\d+)\}\n\$\$\n(.*?)(?=\$\$|\Z)', re.DOTALL)
NAME = re.compile(r'\{py:(?:obj|mod)\}`([\w.]+)`')
FILE = re.compile(r'In file: `([^`]+)`')
NUMBERS = re.compile(r'\((\d+)\)(?: to \((\d+)\))?')
AFTER = {int(number): text.strip().split('\n\n')[0] for number, text in EQUATION.findall(TEXT)}


def named(name: str) -> Any:
    """Module, or what it holds, by its dotted name."""
    parts = name.split('.')
    for count in range(len(parts), 0, -1):
        try:
            found = importlib.import_module('.'.join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for part in parts[count:]:
            found = getattr(found, part)
        return found
    raise ModuleNotFoundError(name)


def numbers(text: str) -> set[int]:
    """Equation numbers that a docstring names, (16) to (21) in full."""
    found = set()
    for first, last in NUMBERS.findall(text):
        found |= set(range(int(first), int(last or first) + 1))
    return found


def test_all_equations_are_there() -> None:
    assert list(AFTER) == list(range(1, 41))


@pytest.mark.parametrize('number', AFTER)
def test_the_code_names_the_equation(number: int) -> None:
    text = AFTER[number]
    names, files = NAME.findall(text), FILE.findall(text)
    assert names or files or text.startswith('No code: '), text
    for name in names:
        found = named(name)
        assert number in numbers(getattr(found, 'py_func', found).__doc__ or ''), name
    for file in files:
        assert number in numbers((ROOT / file).read_text()), file


def test_every_name_of_the_page_exists() -> None:
    for name in NAME.findall(TEXT):
        assert named(name) is not None
