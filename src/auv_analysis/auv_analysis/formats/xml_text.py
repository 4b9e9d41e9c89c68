"""XML that nobody has to trust: no document type, no entities, bounded in size."""

import re
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import defusedxml.ElementTree
from defusedxml.common import DefusedXmlException

from auv_dynamics.files import LARGEST, InputError, first_line
from auv_dynamics.yaml_text import LONGEST_TEXT, MOST_ENTRIES

# SDF has prefixes that nobody declares, such as <experimental:params> or gz:expressed_in="..."
PREFIX = re.compile(r'(</?|\s(?!xmlns:)(?=[\w.:-]+=))([A-Za-z_][\w.-]*):(?=[A-Za-z_])')


def parse_xml(text: str, path: Path) -> Element:
    """Root element of a text; a prefix of a name ends in an underscore.

    Parameters
    ----------
    text : of the file
    path : named in errors

    Raises
    ------
    InputError : no XML, too large, or with a document type or entities of its own

    """
    if len(text) > LONGEST_TEXT:
        expected = f'XML of at most {LONGEST_TEXT} characters'
        raise InputError(path, '', expected, f'{len(text)} characters')
    try:
        root = defusedxml.ElementTree.fromstring(PREFIX.sub(r'\1\2_', text), forbid_dtd=True)
    except DefusedXmlException as error:
        found = f'a {type(error).__name__.removesuffix("Forbidden")}'
        raise InputError(path, '', 'XML without document type and entities', found) from None
    except (ParseError, ValueError) as error:
        raise InputError(path, '', 'valid XML', first_line(error)) from None
    for count, element in enumerate(root.iter()):
        if count >= MOST_ENTRIES:
            raise InputError(path, '', f'at most {MOST_ENTRIES} elements', 'more')
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition('}')[2]
    return root


def numbers(text: str | None, count: int, path: object, key: str) -> list[float]:
    """So many finite numbers of a text; InputError where it holds anything else."""
    words = (text or '').split()
    try:
        found = [float(word) for word in words]
    except ValueError:
        found = []
    if len(found) != count or not all(abs(value) <= LARGEST for value in found):
        expected = 'a number' if count == 1 else f'{count} numbers'
        hint = ' (expand xacro first)' if '${' in (text or '') else ''
        raise InputError(path, key, expected + hint, text or None)
    return found
