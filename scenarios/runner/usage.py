"""What --help says. ``{name}`` is what the run is called."""

FLIGHT_OPTIONS = """
  --stage plant|hw_bridge   what is levitated: the simulated plant, or the hardware (default plant)
  --mode lockstep|realtime  as fast as it computes and repeatable, or 1 kHz by the clock
                            (default lockstep)
  --duration S              measured time: of the tracking window, or of each step [s]
  --params OVERLAY.yaml     parameters on top of the scenario's, from the current folder or from
                            params/; repeatable, the last one wins
  --out DIR                 where the run is left (default runs/{name}-<time>)
  --help                    this text"""


def _of_flight(description: str, arguments: str = '{name}.sh') -> str:
    return f'{description}\n\nusage: scenarios/{arguments} [options]{FLIGHT_OPTIONS}'


ELLIPSE = _of_flight(
    "The paper's ellipse in y, x and z: lifts off, follows it for 60 s measured, lands."
)
ELLIPSE_4DOF = _of_flight(
    "The paper's ellipse with theta turning along: lifts off, follows it for 60 s measured, lands."
)
STEPS = _of_flight(
    "The steps of the paper's Table III in y, x, z and theta, each from rest, other axes held."
)
SINGLE_MOTOR = _of_flight(
    'The single-motor machine of refs. [10], [11]: steps, then sinusoids, in air gap and'
    ' displacement.'
)
TRAJECTORY = _of_flight(
    """\
A trajectory: lifts off, follows it measured, lands.

  NAME      NAMES
  FILE.csv  header t,y,x,z,phi,theta in s, m, rad; equally spaced rows; followed over and over, so
            that its last row is its first again
params/matched_NAME.yaml, where there is one, is an overlay with internal models to match.""",
    'trajectory.sh NAME|FILE.csv',
)
PAPER_TABLES = """\
All experiments of the paper, Table III and Figs. 4 to 8, through the nodes on the benchmark plant,
with the paper's controller and with ours; then one page with the paper's own figures beside both.
Some minutes in lockstep, a quarter of an hour in real time.

usage: scenarios/paper_tables.sh [options]
  --mode lockstep|realtime  as fast as it computes and repeatable, or 1 kHz by the clock
                            (default lockstep)
  --out DIR                 where runs and page are left (default runs/paper_tables-<time>)
  --quick                   short windows: 6 s for each step, 4 s of each ellipse
  --help                    this text"""
COMPARE = """\
Flies all control laws over the same steps, ellipses, disturbances and mismatches on the benchmark
plant, prints one table and draws their regions of operation. A few minutes on two cores.

usage: scenarios/compare.sh [options]
  --out DIR           where the results are left (default runs/compare-<time>)
  --quick             coarse regions and short windows
  --laws NAME...      only these: files of params/laws, paper, default
  --bandwidth RAD_S   crossover of laws with compensators, on all axes (default: as in their files)
  --help              this text"""
COMMISSION = """\
Brings a machine up step by step at low current and says what is wired or set wrongly. Without an
overlay it runs on the emulated boards.

usage: scenarios/commission.sh [options]
  --params OVERLAY.yaml   parameters of hw_bridge, from the current folder or from params/;
                          repeatable, the last one wins
  --current A             largest current of a phase alone, 0.2 to 3 A (default 1.5)
  --yes                   do not ask before each step
  --help                  this text"""
