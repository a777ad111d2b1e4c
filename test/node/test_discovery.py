"""A process is on the graph before its node is loaded, which then knows who else is there."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

TALKER = """
from rclpy.node import Node
from std_msgs.msg import Empty
import rclpy
from maglev_node.dds import prepare_middleware

prepare_middleware()
rclpy.init()
node = Node('talker')
publisher = node.create_publisher(Empty, 'talk', 1)
print('up', flush=True)
input()
"""

LATE = """
import time
from maglev_node import node

time.sleep(2.0)

class Late(node.MaglevNode):
    def __init__(self):
        super().__init__('late', node.NodeParameters)
        self.there_for = time.monotonic() - self.discovering_since
        self.heard = self.get_publishers_info_by_topic('talk')
        self.create_timer(0.1, self.look, clock=self.steady_clock)
    def look(self):
        names = self.get_node_names()
        if any('loading' in name for name in names):
            return
        print(self.there_for > 2.0, [who.node_name for who in self.heard], sorted(names))
        self.finish(0)
"""


def test_a_node_named_by_text_finds_the_others_while_it_loads(tmp_path: Path) -> None:
    (tmp_path / 'late.py').write_text(LATE)
    program = 'from maglev_node.executable import run_nodes\nrun_nodes("late", "late:Late")'
    with subprocess.Popen(
        [sys.executable, '-c', TALKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as talker:
        assert talker.stdout is not None
        assert talker.stdout.readline() == 'up\n'
        done = subprocess.run(
            [sys.executable, '-c', program],
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
            cwd=tmp_path,
        )
        talker.communicate('\n')
    said = "True ['talker'] ['late', 'talker']\n"
    assert (done.returncode, done.stdout) == (0, said), done.stderr
