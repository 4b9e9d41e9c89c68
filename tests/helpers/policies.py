"""The shipped SROS 2 policy as the tests read it, and the schema that it must fit.

The rules below are those of the policy schema 0.2.0 of sros2, the one of Jazzy.
"""

from pathlib import Path
from typing import Any
from xml.etree import ElementInclude, ElementTree
from xml.etree.ElementTree import Element

FOLDER = Path(__file__).resolve().parents[2] / 'config/security'
POLICY = FOLDER / 'auv_gvc.policy.xml'
VERSION = '0.2.0'
RULES = {
    'topics': ('publish', 'subscribe'),
    'services': ('reply', 'request'),
    'actions': ('call', 'execute'),
}
CHILDREN = {  # element -> what stands in it, one at least
    'policy': ('enclaves',),
    'enclaves': ('enclave',),
    'enclave': ('profiles',),
    'profiles': ('profile',),
    'profile': tuple(RULES),
    **{group: (group[:-1],) for group in RULES},
}
ATTRIBUTES = {  # element -> those that must be there
    'policy': {'version'},
    'enclave': {'path'},
    'profile': {'ns', 'node'},
}
Allowed = dict[str, dict[str, set[tuple[str, str]]]]  # enclave -> node -> rule and full name


def tree(path: Path = POLICY, namespace: str = '/') -> Element:
    """Root of a policy with its parts included, its profiles moved to a namespace."""
    root = ElementTree.parse(path).getroot()
    ElementInclude.include(root, base_url=str(path))
    for profile in root.iter('profile'):
        profile.set('ns', profile.get('ns') if namespace == '/' else namespace)
    return root


def allowed(root: Element) -> Allowed:
    """What each node of each enclave may do."""
    return {
        enclave.get('path'): {
            profile.get('node'): set(_entries(profile)) for profile in enclave.iter('profile')
        }
        for enclave in root.iter('enclave')
    }


def _entries(profile: Element) -> Any:
    above = profile.get('ns').rstrip('/')
    for group in profile:
        for rule in RULES[group.tag]:
            for entry in group if group.get(rule) == 'ALLOW' else ():
                yield rule, _full(entry.text, above, profile.get('node'))


def _full(name: str, above: str, node: str) -> str:
    if name.startswith('/'):
        return name
    return f'{above}/{node}{name[1:]}' if name.startswith('~') else f'{above}/{name}'


def faults(root: Element) -> list[str]:
    """Where a policy breaks the schema, one line each."""
    found = [] if root.tag == 'policy' else [f'root {root.tag}']
    if root.get('version') != VERSION:
        found.append(f'version {root.get("version")}')
    return [*found, *_faults(root)]


def _faults(element: Element) -> Any:
    tag, children = element.tag, CHILDREN.get(element.tag)
    rules = set(RULES.get(tag, ()))
    names = {name for name in element.keys() if not name.startswith('{')}  # noqa: SIM118
    if missing := ATTRIBUTES.get(tag, set()) - names:
        yield f'{tag} without {", ".join(sorted(missing))}'
    if unknown := names - ATTRIBUTES.get(tag, set()) - rules - ({'type'} & {tag[:0]}):
        yield f'{tag} with {", ".join(sorted(unknown))}'
    for rule in rules & names:
        if element.get(rule) not in ('ALLOW', 'DENY'):
            yield f'{tag}: {rule}="{element.get(rule)}"'
    if children is None:
        if len(element) or not (element.text or '').strip():
            yield f'{tag} that is no name: {element.text}'
        return
    if not len(element) and tag != 'profile':
        yield f'{tag} with nothing in it'
    for child in element:
        if child.tag not in children:
            yield f'{child.tag} in {tag}'
        else:
            yield from _faults(child)
