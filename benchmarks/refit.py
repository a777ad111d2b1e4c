"""Can the benchmark plant be made to foretell what the paper measured and it was not fitted to?

The paper's law on the plant, for every candidate of ``maglev_study.refit``: fitted to all rows but
y of the 4DOF ellipse and the overshoot of θ, and to all rows. Prints the numbers found, every row
beside the paper's, and whether the two rows are met (15 %, 4 points). Takes some minutes.
"""

from __future__ import annotations

import argparse
import sys

from maglev_study.refit import CANDIDATES, FORETOLD, PUBLISHED, STEP, figures, fit

RATIO, POINTS = 0.15, 4.0


def met(found: dict[str, float]) -> bool:
    """Whether both rows to be foretold are."""
    y = abs(found['4DOF y'] / PUBLISHED['4DOF y'] - 1.0) <= RATIO
    return y and abs(found[STEP] - PUBLISHED[STEP]) <= POINTS


def main() -> int:
    """Fit and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--evaluations', type=int, default=12, help='steps of each fit')
    parser.add_argument('--only', type=int, nargs='*', help='numbers of candidates, from 0')
    options = parser.parse_args()
    others = [row for row in PUBLISHED if row not in FORETOLD]
    print('| fitted | to | ' + ' | '.join(PUBLISHED) + ' | met |')
    print('|:--|:--|' + '--:|' * (len(PUBLISHED) + 1))
    paper = ' | '.join(f'{value:.1f}' for value in PUBLISHED.values())
    print(f'| the paper | | {paper} | |', flush=True)
    for number, candidate in enumerate(CANDIDATES):
        if options.only is not None and number not in options.only:
            continue
        for name, rows in (('the other rows', others), ('all rows', list(PUBLISHED))):
            best = fit(candidate, rows, options.evaluations)
            found = figures(candidate.plant(best))
            cells = ' | '.join(f'{found[row]:.1f}' for row in PUBLISHED)
            verdict = 'yes' if met(found) else 'no'
            print(f'| {candidate.name} | {name} | {cells} | {verdict} |')
            print(f'  {candidate.plant(best)}', flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
