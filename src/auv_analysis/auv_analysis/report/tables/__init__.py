"""The tables of a report of runs, a module per kind of question."""

from auv_analysis.report.tables.certificate import certificate_table, reasons
from auv_analysis.report.tables.claims import claims_table
from auv_analysis.report.tables.controllers import controllers_table, set_up_table
from auv_analysis.report.tables.couplings import couplings_table, terms_table
from auv_analysis.report.tables.energy import energy_table
from auv_analysis.report.tables.gains import decompositions, gains_tables, scalar_gains
from auv_analysis.report.tables.key_figures import key_figures_table
from auv_analysis.report.tables.unexplained import unexplained_tables

__all__ = [
    'certificate_table',
    'claims_table',
    'controllers_table',
    'couplings_table',
    'decompositions',
    'energy_table',
    'gains_tables',
    'key_figures_table',
    'reasons',
    'scalar_gains',
    'set_up_table',
    'terms_table',
    'unexplained_tables',
]
