"""Every block of README and docs works, in the order in which a reader comes to it."""

from pathlib import Path

import pytest
import yaml
from helpers.doc_blocks import (
    COMMAND,
    FILES,
    MARKS,
    NEEDS,
    ROOT,
    RUN,
    SHOWN,
    Block,
    Page,
    all_pages,
)
from helpers.doc_session import session

PAGES = all_pages()
BLOCKS = [(page, block) for page in PAGES for block in page.blocks]


def place(page: Page, block: Block) -> str:
    return f'{page.name}:{block.line}'


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_every_block_says_what_it_is(page: Page) -> None:
    for block in page.blocks:
        where = place(page, block)
        assert block.language in (*RUN, *FILES, *SHOWN), f'{where}: {block.language}'
        assert set(block.marks) <= set(MARKS), f'{where}: {block.marks}'
        if block.language in SHOWN and not block.need:
            assert not COMMAND.search(block.text) or 'output' in block.marks, where
        if block.language in FILES and block.language not in RUN:
            assert {'file', 'part of', 'needs'} & set(block.marks), f'{where}: whose file is it?'
        if block.language == 'yaml':
            yaml.safe_load(block.text)


def test_quoted_blocks_stand_in_their_files() -> None:
    quoted = [(page, block) for page, block in BLOCKS if 'part of' in block.marks]
    assert quoted
    for page, block in quoted:
        assert block.text in (ROOT / block.marks['part of']).read_text(), place(page, block)


def test_blocks_that_are_not_run_say_why(capsys: pytest.CaptureFixture) -> None:
    lines = []
    for page, block in BLOCKS:
        if block.need:
            what, reason = block.need
            assert what in NEEDS, place(page, block)
            assert reason, place(page, block)
            lines.append(f'  {place(page, block)}: {what}: {reason}')
    fast, long = ([p for p in PAGES if p.run and p.is_long is kind] for kind in (False, True))
    counts = [f'{sum(len(p.run) for p in kind)} on {len(kind)} pages' for kind in (fast, long)]
    with capsys.disabled():
        print(f'\nblocks of README and docs: fast {counts[0]}, long {counts[1]},')
        print(f'not run {len(lines)}:', *lines, sep='\n')


@pytest.mark.parametrize(
    'page',
    [
        pytest.param(page, marks=[pytest.mark.long] if page.is_long else [], id=page.name)
        for page in PAGES
        if page.run
    ],
)
def test_a_page_reads_as_a_session(page: Page, tmp_path: Path) -> None:
    with session(page, tmp_path) as opened:
        for block in page.blocks:
            if block.is_run or 'output' in block.marks:
                opened.run(block)
