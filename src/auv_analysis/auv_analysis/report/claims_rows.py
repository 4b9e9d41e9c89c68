"""The 21 claims of Herman 2018, each with its judge and the criterion that it goes by."""

from auv_analysis.output.text import fixed
from auv_analysis.report import claims_case as case
from auv_analysis.report import claims_coupling as coupling
from auv_analysis.report import claims_motion as motion
from auv_analysis.report import paper
from auv_analysis.report.claim import BOTH, Row
from auv_analysis.report.quotes import Value


def _listed(name: str, values: tuple[float, ...], unit: str) -> tuple[Value, ...]:
    return tuple(Value(f'{name}{i}', value, unit) for i, value in enumerate(values, start=1))


ROWS = (
    Row(
        'GVC errors near zero after about 2 s',
        'yes',
        'every error within 0.005 m/s or rad/s from 2 s on',
        motion.errors_vanish,
        seconds=2.5,
    ),
    Row(
        'CL with the same gains: Δu, Δw converge slowly',
        'yes',
        'after 2 s both exceed 0.005 m/s and ten times those of GVC',
        motion.linear_slow,
        laws=BOTH,
        seconds=2.5,
    ),
    Row(
        'CL with the same gains: Δq converges very slowly',
        'yes',
        'exceeds 0.005 rad/s after 2 s and still in the last third of the run',
        motion.pitch_slow,
        laws=('cl',),
        seconds=6.0,
    ),
    Row(
        'GVC: Δu, Δw largest; Δq largest of the angular errors, Δp not zero',
        'yes',
        'peaks of Δu, Δw above ten times Δv; Δq above Δp, Δr; Δp at least 1 % of Δq',
        motion.largest_errors,
    ),
    Row(
        'GVC: w goes to near zero fast and does not end at zero',
        'yes',
        'after 2 s every w below 10 % of its peak; w_X or w_Z ends above 1 % of the peak of F',
        motion.lumped_fast,
        seconds=2.5,
        knows_F=True,
    ),
    Row(
        'CL: w_X, w_Z, w_M not reduced so fast, reach no small constant',
        'yes',
        'each above ten times GVC’s after 2 s; ranges in the last third above half those of F',
        motion.lumped_slow,
        laws=BOTH,
        seconds=6.0,
        knows_F=True,
    ),
    Row(
        'GVC: w_X, w_Z, w_M, w_N great in the first phase',
        'yes',
        'peaks before 2 s above ten times those after, and above w_Y and w_K',
        motion.lumped_first_phase,
        seconds=2.5,
        knows_F=True,
        remark='w(0) = −F(0) under either law, since f starts at zero.',
    ),
    Row(
        'F_Z and F_M big, F_N smaller',
        'yes',
        'F_Z the largest force, F_M the largest moment, F_N below F_M',
        motion.disturbance_sizes,
        knows_F=True,
        remark='F is an input: it tests our reading of (39).',
    ),
    Row(
        'total kinetic energy',
        f'{fixed(paper.KINETIC_ENERGY, 2)} J',
        'mean within 2 % over 0–10 s; at best partly, since the paper prints no window',
        coupling.kinetic_energy_mean,
        printed=(Value('kinetic energy', paper.KINETIC_ENERGY, 'J'),),
    ),
    Row(
        'shares of kinetic energy',
        f'{", ".join(fixed(share, 2) for share in paper.SHARES)} %',
        'each within 1 percentage point in both windows',
        coupling.kinetic_energy_shares,
        printed=_listed('share of ξ', paper.SHARES, '%'),
    ),
    Row(
        'Δξ: sway deformed, about 0.01 m/s',
        f'{fixed(paper.SWAY_DEFORMATION, 2)} m/s',
        'largest linear Δξ, and 0.01 when rounded to two decimals',
        coupling.sway_deformed,
        remark='Scales with the mass, which is reconstructed.',
        printed=(Value('Δξ2', paper.SWAY_DEFORMATION, 'm/s'),),
    ),
    Row(
        'Δξ: roll deformed',
        'yes',
        'largest angular Δξ, and above the roll rate itself',
        coupling.roll_deformed,
        remark='M46 was reconstructed with this in view: no independent confirmation.',
    ),
    Row(
        'Δπ: only pitch significant',
        'yes',
        'its peak above ten times that of every other axis',
        coupling.pitch_input,
    ),
    Row(
        'inputs of GVC and CL differ only slightly in Case 1',
        'yes',
        'peak and RMS after 2 s within 10 % on every axis; partly if only the RMS is',
        case.inputs_similar,
        laws=BOTH,
        seconds=2.5,
    ),
    Row(
        'q strongly coupled with the others, and sensitive',
        'yes',
        'Δπ of pitch above ten times that of every other axis; under each law the RMS of Δq is the '
        'one of the six that follows the set-points of the others most, and the gains most',
        coupling.pitch_sensitive,
        laws=BOTH,
        remark='The paper’s sentence names changes of other velocities and disturbances; its step '
        '3 asks for a change of gains.',
        responds=True,
    ),
    Row(
        'energy mainly in ξ3 and ξ1',
        'yes',
        'the largest shares in this order, together above 99 %',
        coupling.energy_in_two,
    ),
    Row(
        'GVC reaches the final errors earlier',
        'yes',
        'all errors within 0.005 for good at an earlier time than CL’s',
        case.earlier,
        laws=BOTH,
        cases=('case2',),
        seconds=6.0,
    ),
    Row(
        'CL oscillates more',
        'yes',
        'larger total variation of every error that exceeds 0.005 under either law',
        case.oscillates,
        laws=BOTH,
        cases=('case2',),
        seconds=6.0,
    ),
    Row(
        'efforts comparable',
        'yes',
        'RMS after 2 s within 5 % on every axis; partly if on four',
        case.efforts_comparable,
        laws=BOTH,
        cases=('case2',),
        seconds=2.5,
    ),
    Row(
        'τ_X, τ_Z at the start larger for GVC',
        'yes',
        'largest magnitude of the first 2 s above that of CL on both axes',
        case.larger_start,
        laws=BOTH,
        cases=('case2',),
    ),
    Row(
        'N',
        ', '.join(fixed(entry, 1) for entry in paper.N),
        'equal when rounded to the printed decimal',
        coupling.decomposition,
        laws=(),
        cases=paper.CASES,
        remark='M was reconstructed from this N: it tests the decomposition.',
        printed=_listed('N', paper.N, 'kg, kg m2'),
    ),
)
