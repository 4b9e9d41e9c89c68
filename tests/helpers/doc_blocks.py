"""What the pages of README and docs ask a reader to type, taken from the pages themselves.

A comment before a block says what the language does not:

    <!-- file: mine.yaml -->             the block is this file; it is written, not run
    <!-- part of: config/a.yaml -->      the block is quoted from this file of the repository
    <!-- output -->                      lines that the block before it prints
    <!-- exit: 2 -->                     the block ends with this exit code
    <!-- terminals -->                   each command has a terminal of its own, to the page's end
    <!-- interrupted after: 8 -->        each command that has not ended after so many s gets Ctrl-C
    <!-- needs: ros2: no wheel has it --> cannot be run here, and why
    <!-- blocks: long -->                at the top of a page: its blocks take more than seconds
"""

import re
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

ROOT = Path(__file__).resolve().parents[2]
NEEDS = ('ubuntu', 'docker', 'ros2', 'vehicle', 'rerun', 'hours')
RUN = ('bash', 'python')
FILES = ('yaml', 'javascript', 'python')
SHOWN = ('text', 'math')
MARKS = (
    'file', 'part of', 'output', 'exit', 'terminals', 'interrupted after', 'needs', 'blocks',
)  # fmt: skip
COMMENT = re.compile(r'<!--\s*([a-z ]+?)\s*(?::\s*(.*?))?\s*-->\s*$', re.DOTALL)
COMMAND = re.compile(r'^\s*(\$ |auv |ros2 |make |pip |python |\.venv/bin/)', re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A block of a page: its language, the line it begins at, its text and what is said of it."""

    language: str
    line: int
    text: str
    marks: dict[str, str]

    @property
    def need(self) -> tuple[str, str] | None:
        """What is missing here, and why that is so; None: it can be run."""
        if 'needs' not in self.marks:
            return None
        what, _, reason = self.marks['needs'].partition(':')
        return what.strip(), reason.strip()

    @property
    def is_run(self) -> bool:
        """Whether a reader types it, or saves it."""
        return not (self.need or 'part of' in self.marks) and (
            self.language in RUN or 'file' in self.marks
        )

    @property
    def commands(self) -> list[str]:
        """The commands of a bash block, continued lines together."""
        joined = re.sub(r'\\\n\s*', '', self.text)
        return [line for line in joined.splitlines() if line.strip() and line.strip()[0] != '#']


@dataclass(frozen=True)
class Page:
    """A page and its blocks."""

    path: Path
    blocks: list[Block] = field(default_factory=list)
    is_long: bool = False

    @property
    def name(self) -> str:
        """Path from the root of the repository."""
        return str(self.path.relative_to(ROOT))

    @cached_property
    def run(self) -> list[Block]:
        """The blocks that a reader types or saves."""
        return [block for block in self.blocks if block.is_run]


def marks_before(tokens: list[Token], i: int) -> dict[str, str]:
    """What the comments directly before a token say."""
    marks = {}
    while i and tokens[i - 1].type == 'html_block':
        i -= 1
        found = COMMENT.match(tokens[i].content.strip())
        assert found, f'not understood: {tokens[i].content}'
        marks[found[1]] = found[2] or ''
    return marks


def read_page(path: Path) -> Page:
    """Blocks of a page, in order; an indented block says nothing of its language: 'indented'."""
    tokens = MarkdownIt().parse(path.read_text(encoding='utf-8'))
    blocks = []
    for i, token in enumerate(tokens):
        if token.type in ('fence', 'code_block') and not token.info.startswith('{'):
            language = token.info.split()[0] if token.info else 'indented'
            blocks.append(
                Block(language, (token.map or [0])[0] + 1, token.content, marks_before(tokens, i))
            )
    is_long = any(
        token.type == 'html_block' and '<!-- blocks: long -->' in token.content for token in tokens
    )
    return Page(path, blocks, is_long)


def all_pages() -> list[Page]:
    """README, docs and the READMEs of the examples."""
    docs, examples = (sorted((ROOT / name).rglob('*.md')) for name in ('docs', 'examples'))
    return [read_page(path) for path in [ROOT / 'README.md', *docs, *examples]]
