"""The files in a design's folder from which its claim can be simulated again."""

from pathlib import Path

import yaml

from auv_analysis.design.changed_file import changed_data, changed_text
from auv_analysis.design.couplings import COUPLINGS
from auv_analysis.design.proposal import Proposal
from auv_analysis.design.words import change_words
from auv_analysis.scenario.scenario import Scenario, load_scenario

LONGEST = 92  # of a scenario's name, with room for the word behind it


def write_inputs(found: Proposal, out: Path) -> Scenario:
    """Both vehicles, and the scenario with the changed one, read back."""
    setting, best = found.setting, found.best
    (out / 'vehicle_before.yaml').write_text(setting.vehicle_text, encoding='utf-8')
    text = setting.vehicle_text
    if best is not None and found.target is not None:
        words = '; '.join(change_words(setting.space, best.x))
        name = setting.space.vehicle.name
        about = (
            f'{name}, changed by auv design against {COUPLINGS[found.target]}: {words}.\n'
            'vehicle_before.yaml beside it is the vehicle as it was, with its comments.'
        )
        text = changed_text(changed_data(setting.space, best.x, words), about)
    (out / 'vehicle.yaml').write_text(text, encoding='utf-8')
    data = dict(setting.scenario.data)
    data['vehicle'] = 'vehicle.yaml'
    data['name'] = f'{data["name"][:LONGEST]}_changed'
    if 'setpoint.csv' in setting.scenario.attachments:
        data['setpoint'] = {'file': 'setpoint.csv'}
        csv = setting.scenario.attachments['setpoint.csv']
        (out / 'setpoint.csv').write_text(csv, encoding='utf-8')
    header = f'# {setting.scenario.name} with the vehicle beside it, every default filled in\n'
    body = yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=100)
    (out / 'scenario.yaml').write_text(header + body, encoding='utf-8')
    return load_scenario(out / 'scenario.yaml')
