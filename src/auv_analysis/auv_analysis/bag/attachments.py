"""Attachments of a bag: parameters, law, vehicle and scenario of its run."""

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from auv_analysis.bag.reading import BagContents
from auv_analysis.bag.step_topics import role_of
from auv_analysis.scenario.fault_words import Mark, marks_of
from auv_analysis.scenario.scaling import UNFIT
from auv_dynamics.files.errors import InputError, printable
from auv_dynamics.files.yaml_files import check, parse_yaml
from auv_dynamics.plant.faults import ACTING, SENSING
from auv_dynamics.plant.parameters import SCHEMA
from auv_dynamics.ros import interface
from auv_dynamics.ros.interface import CONTROLLER, GAIN, NANOSECONDS, WRENCH
from auv_dynamics.vehicle.vehicle import Vehicle
from auv_dynamics.vehicle.vehicle_file import load_vehicle, vehicle_from_dict
from auv_gvc_controller.laws.law import is_unasked, make_gains

NAME = re.compile('[A-Za-z0-9][A-Za-z0-9_.+-]{0,99}')
LAW = re.compile(r'[A-Za-z_][\w.]*:[A-Za-z_]\w*', re.ASCII)  # module:Class
UNKNOWN = 'unknown'  # law of a bag without params.yaml
Parameters = dict[str, dict[str, Any]]  # of nodes, by their names
Scenario = dict[str, Any] | None  # of a bag; None: it carries none
OWN = 2  # rank of parameters for the namespace; 1: for any, 0: for another


def parameters_of(contents: BagContents, bag: Path) -> Parameters:
    """Node name -> its parameters, from the attached parameter file.

    Of several nodes of a name, that in the namespace which is read; where it is not the recorder's,
    no other, since whatever names no namespace is of the recorder's vehicle. Law and gains are
    those that the controller says it has: they may have changed since the file was written.
    """
    found = _written(contents, bag)
    if contents.laws:
        found[CONTROLLER] = _in_charge(found.get(CONTROLLER, {}), contents)
    return found


def settings_in_turn(contents: BagContents, bag: Path) -> list[tuple[int, dict[str, Any]]]:
    """Parameters of the controller with the settings that it says, as `BagContents.laws`."""
    controller = _written(contents, bag).get(CONTROLLER, {})
    return [
        (ns, {**controller, **(_mapping(changed) or {})}) for (*_, changed), ns in contents.laws
    ]


def _written(contents: BagContents, bag: Path) -> Parameters:
    """Parameters of params.yaml, the controller's under its usual name."""
    text = contents.attachments.get('params.yaml', '{}')
    file = f'{bag}: params.yaml'
    found: Parameters = {}
    ranks: dict[str, int] = {}
    own = (contents.namespace or '').strip('/')
    for space, node, values in _nodes(parse_yaml(text, file, 'parameter'), file):
        rank = OWN if space == own else int(not space or '*' in space)
        if rank >= ranks.get(node, OWN if contents.is_of_another else 0):
            found[node], ranks[node] = values, rank
    if contents.controller in found:
        found[CONTROLLER] = found[contents.controller]
    return found


def _in_charge(controller: dict[str, Any], contents: BagContents) -> dict[str, Any]:
    """Parameters of a controller with the law and gains in charge; of several, with none.

    Settings are those that it says it began with.
    """
    written = {name for name in controller if name == 'law' or name.startswith(GAIN)}
    others = {name: value for name, value in controller.items() if name not in written}
    wrenches = [ns for topic, (ns, _) in contents.messages.items() if role_of(topic) == WRENCH]
    begin = min((int(ns.min()) for ns in wrenches), default=0)
    ends = [*(ns for _, ns in contents.laws[1:]), math.inf]
    course = [one for one, end in zip(contents.laws, ends, strict=True) if end > begin]
    said = ', '.join(
        f'{law} from {max(0, ns - begin) / NANOSECONDS:.3g} s' for (law, *_), ns in course
    )
    law, text, changed = course[0][0]
    others |= _mapping(changed) or {}
    if len({told[2] for told, _ in course}) > 1:
        note = 'settings of the controller were changed while it was recorded'
        contents.notes.append(f'{note}: {printable(said)}')
    if len({told[:2] for told, _ in course}) > 1:
        note = 'law or gains were changed while it was recorded, none is taken'
        contents.notes.append(f'{note}: {printable(said)}')
        return others
    gains = _mapping(text)
    if gains is None:
        return {**controller, **others}
    told = {'law': law, **{f'{GAIN}{name}': value for name, value in gains.items()}}
    if written and told != {name: controller[name] for name in written if controller[name]}:
        contents.notes.append(
            'law and gains are those that the controller says, not of params.yaml'
        )
    return {**others, **told}


def _mapping(text: str) -> dict[str, Any] | None:
    """Mapping in JSON; None where the text is none."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _nodes(entries: dict[str, Any], file: str, above: str = '') -> Iterator[tuple[str, str, Any]]:
    """Namespace, name and parameters of each node; mappings around it name its namespace."""
    for key, entry in entries.items():
        name = f'{above}/{key}'.strip('/')
        values = entry.get('ros__parameters') if isinstance(entry, dict) else None
        if isinstance(values, dict):
            space, _, node = name.rpartition('/')
            yield space, node, values
        elif isinstance(entry, dict) and any(isinstance(inner, dict) for inner in entry.values()):
            yield from _nodes(entry, file, name)
        else:
            raise InputError(file, name, 'a mapping with ros__parameters', entry)


def step_of(parameters: dict[str, dict[str, Any]], bag: Path) -> float | None:
    """Control period, s; None where the parameters do not say it."""
    step = parameters.get(interface.PLANT, {}).get('step')
    if step is None:
        return None
    if not (isinstance(step, int | float) and 0 < step < float('inf')):
        raise InputError(f'{bag}: params.yaml', 'plant_node: step', 'a positive number (s)', step)
    return float(step)


def controller_name(parameters: dict[str, dict[str, Any]], bag: Path) -> str:
    """Name of the controller: that of the folder that was recorded into, as a word.

    It becomes part of names of files and stands in figures.
    """
    recorded = parameters.get('recorder_node', {}).get('bag', str(bag))
    if not isinstance(recorded, str):
        raise InputError(f'{bag}: params.yaml', 'recorder_node: bag', 'a folder', recorded)
    return UNFIT.sub('_', Path(recorded).name)[:100].lstrip('_.+-') or 'controller'


def law_and_gains(controller: dict[str, Any], bag: Path) -> tuple[str, dict[str, Any]]:
    """Law and gains, from the parameters of the controller node; no gains of an unasked law."""
    gains = {}
    for key, value in controller.items():
        if key.startswith(GAIN):
            one = isinstance(value, list) and len(value) == 1
            gains[key.removeprefix(GAIN)] = value[0] if one else value
    law = controller.get('law')
    file = f'{bag}: params.yaml'
    if law is None:
        return UNKNOWN, {}  # a bag that somebody else recorded says nothing of it
    if is_unasked(law):
        if not LAW.fullmatch(law):
            raise InputError(file, CONTROLLER, 'a law, shipped or module:Class', law)
        return law, {}
    try:
        make_gains(law, gains)
    except ValueError as error:
        raise InputError(file, CONTROLLER, str(error), 'another law or gain') from None
    return law, gains


def notes_on(law: str) -> list[str]:
    """Notes on a law."""
    if not is_unasked(law):
        return []
    return [f'gains of {law} not looked at: a bag brings no code; --law {law} imports its module']


COUNTS = (  # signal of a run, its topic, what says that it was there, and what counts without it
    ('measured', interface.GROUND_TRUTH, {'sensors', *SENSING},
     'what was measured counts as the truth'),
    ('applied', interface.WRENCH_APPLIED, {'actuators', *ACTING}, 'the command counts as applied'),
    ('disturbance_estimate', interface.DISTURBANCE_ESTIMATE, {interface.DISTURBANCE},
     'f and its error are unknown'),
)  # fmt: skip


def unrecorded(scenario: Scenario, kinds: set[str], topics: set[str]) -> dict[str, str]:
    """Signal of a `Run` -> what counts without it, of those that were there but in no topic.

    Parameters
    ----------
    scenario : of `scenario_of`
    kinds, topics : of the faults; that are recorded

    """
    there = {*(scenario or ()), *kinds, *topics}
    return {signal: f'{topic}: no messages: {instead}' for signal, topic, told, instead in COUNTS
            if topic not in topics and there & told}  # fmt: skip


def vehicle_of(contents: BagContents, bag: Path, vehicle: str | Path | None) -> Vehicle:
    """The given vehicle, else the one that the bag carries."""
    if vehicle is not None:
        return load_vehicle(vehicle)
    text = contents.attachments.get('vehicle.yaml')
    if text is None:
        raise InputError(bag, 'vehicle.yaml', 'an attachment, or --vehicle FILE', None)
    if contents.is_of_another:
        told = f'vehicle.yaml is of the vehicle in {contents.recorder}, whose recorder this was'
        contents.notes.append(f'{told}: --vehicle FILE names that of {contents.namespace}')
    file = f'{bag}: vehicle.yaml'
    return vehicle_from_dict(parse_yaml(text, file, 'vehicle'), file)


def scenario_of(contents: BagContents, bag: Path) -> Scenario:
    """Scenario of the bag; None where it carries none."""
    text = contents.attachments.get('scenario.yaml')
    return None if text is None else parse_yaml(text, f'{bag}: scenario.yaml', 'scenario')


def faults_of(scenario: Scenario, vehicle: Vehicle) -> tuple[Mark, ...]:
    """Faults of a scenario, none where that is not one."""
    try:
        check(scenario or {}, SCHEMA, 'scenario.yaml')
    except InputError:
        return ()
    return marks_of((scenario or {}).get('faults', []), vehicle)


def kinds_of(scenario: Scenario) -> frozenset[str] | None:
    """Kinds of the disturbances, None where the bag does not say."""
    if scenario is None:
        return None
    listed = scenario.get('disturbance', [])
    specs = listed if isinstance(listed, list) else [listed]
    return frozenset(
        str(spec['kind']) for spec in specs if isinstance(spec, dict) and 'kind' in spec
    )


def folder_name(name: str) -> str:
    """A folder's name as a terminal and figures, which set formulas by $, can show it."""
    return printable(name).replace('$', '_')


def scenario_name(scenario: Scenario, bag: Path) -> str:
    """Name of the scenario; without it, that of the folder around the bag."""
    if scenario is None:
        return folder_name(bag.resolve().parent.name)
    name = scenario.get('name')
    if not (isinstance(name, str) and NAME.fullmatch(name)):
        expected = 'a word without blanks or slashes'
        raise InputError(f'{bag}: scenario.yaml', 'name', expected, name)
    return name
