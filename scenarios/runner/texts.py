"""What --help says of each script."""

from __future__ import annotations

PAPER = {
    'ellipse': "The paper's ellipse in y, x and z: lifts off, follows it for 60 s measured, lands.",
    'ellipse_4dof': "The paper's ellipse with theta turning along: lifts off, follows it for 60 s"
    ' measured, lands.',
    'steps': "The steps of the paper's Table III in y, x, z and theta, each from rest, other axes"
    ' held.',
}
SINGLE_MOTOR = """\
The single-motor machine of refs. [10], [11]: steps, then sinusoids, in air gap and displacement."""
TRAJECTORY = """\
A trajectory: lifts off, follows it measured, lands.

  NAME      {names}
  FILE.csv  header t,y,x,z,phi,theta in s, m, rad; equally spaced rows; followed over and over, so
            that its last row is its first again
params/matched_NAME.yaml, where there is one, is an overlay with internal models to match."""
PAPER_TABLES = """\
All experiments of the paper, Table III and Figs. 4 to 8, through the nodes on the benchmark plant
and on the rough one, with the paper's controller and with ours; then one page with the paper's own
figures beside them. Some minutes in lockstep, twenty in real time."""
COMPARE = """\
Flies all control laws over the same steps, ellipses, disturbances and mismatches on the benchmark
plant, prints one table and draws their regions of operation. A few minutes on two cores."""
FAULTS = """\
The hardware bridge on emulated boards under every fault in every phase, judged by what truly
happens: thousands of runs, faster than real time, without ROS; one page at the end. About ten runs
a second and core.

Exits with 1 when a rule is broken; each failure can be flown again by its seed."""
ROBUSTNESS = """\
Draws machines from the distributions in params/robustness.yaml, flies each under each law through
the ellipse, also under forces, steps, a slow scan and a hold, without ROS, and leaves a table and a
page: who survives what, how far errors spread, which parameter matters, which machine is worst.

Called again with the same --out, it goes on where it was. --replay flies one machine through the
whole graph, the ellipse in 4DOF."""
TUNE = """\
Looks for the three numbers of each axis, bandwidth, integration and learning, that are best for
the worst five per cent of machines drawn as by robustness.sh, within a guaranteed margin. Prints
them as a file of parameters, and how they do on machines that they were not found on. Needs optuna.

Exits with 1 when they do not beat the numbers as they were."""
COMMISSION = """\
Brings a machine up step by step at low current and says what is wired or set wrongly. Without an
overlay it runs on the emulated boards."""
