"""What is printed of a real node over real DDS, in the forms of ros2cli 0.32."""

from __future__ import annotations

import re
import time

import pytest
from graph import Process
from ros2_command import Ros2


def test_nodes(ros2: Ros2, small: Process) -> None:
    assert ros2('node', 'list') == (0, '/small\n', '')
    assert ros2('node', 'list', '-c').out == '1\n'
    code, out, _ = ros2('node', 'info', '/small')
    assert code == 0
    assert out.startswith(
        '/small\n  Subscribers:\n    /heard: std_msgs/msg/String\n  Publishers:\n'
    )
    assert '\n    /stage/measurement: maglev_msgs/msg/Measurement\n  Service Servers:\n' in out
    assert '\n    /small/enable: std_srvs/srv/SetBool\n' in out
    assert out.endswith('\n  Service Clients:\n\n  Action Servers:\n\n  Action Clients:\n\n')


@pytest.mark.parametrize('domain', ['0x46', '70a'])
def test_a_domain_is_the_one_that_ros_makes_of_it(
    domain: str, ros2: Ros2, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', domain)
    assert ros2('node', 'list') == (0, '', '')


def test_an_unknown_node(ros2: Ros2, small: Process) -> None:
    assert ros2('node', 'info', '/none') == (1, '', "Unable to find node '/none'\n")
    assert ros2('param', 'get', '/none', 'x') == (1, '', 'Node not found\n')
    assert ros2('lifecycle', 'get', '/none') == (1, '', 'Node not found\n')


def test_topics(ros2: Ros2, small: Process) -> None:
    lines = ros2('topic', 'list', '-t').out.splitlines()
    assert lines == sorted(lines)
    assert '/stage/measurement [maglev_msgs/msg/Measurement]' in lines
    assert '/heard [std_msgs/msg/String]' in lines
    verbose = ros2('topic', 'list', '-v').out
    published, _, subscribed = verbose.partition('\n\nSubscribed topics:\n')
    assert published.startswith('Published topics:\n * ')
    assert ' * /stage/measurement [maglev_msgs/msg/Measurement] 1 publisher' in published
    assert subscribed == ' * /heard [std_msgs/msg/String] 1 subscriber\n\n'


def test_a_topic(ros2: Ros2, small: Process) -> None:
    assert ros2('topic', 'info', '/stage/measurement') == (
        0,
        'Type: maglev_msgs/msg/Measurement\nPublisher count: 1\nSubscription count: 0\n',
        '',
    )
    assert ros2('topic', 'type', '/stage/measurement').out == 'maglev_msgs/msg/Measurement\n'
    verbose = ros2('topic', 'info', '-v', '/stage/measurement').out
    assert verbose.startswith(
        'Type: maglev_msgs/msg/Measurement\n\nPublisher count: 1\n\nNode name: small\n'
        'Node namespace: /\nTopic type: maglev_msgs/msg/Measurement\nTopic type hash: RIHS01_'
    )
    assert '\nQoS profile:\n  Reliability: RELIABLE\n' in verbose
    assert verbose.endswith('  Liveliness lease duration: Infinite\n\nSubscription count: 0\n\n')


def test_an_unknown_topic(ros2: Ros2, small: Process) -> None:
    assert ros2('topic', 'info', '/none') == (1, '', "Unknown topic '/none'\n")
    assert ros2('topic', 'type', '/none') == (1, '', '')
    assert ros2('topic', 'echo', '/none') == (
        1,
        'WARNING: topic [/none] does not appear to be published yet\n',
        'Could not determine the type for the passed topic\n',
    )


def test_echo(ros2: Ros2, small: Process) -> None:
    code, out, err = ros2('topic', 'echo', '--once', '/stage/measurement')
    assert (code, err) == (0, '')
    assert out.startswith('header:\n  stamp:\n    sec: 0\n    nanosec: 0\n  frame_id: stage\nseque')
    assert out.endswith('wall_time: 0\nlockstep: true\ncontroller: 0\n---\n')
    field = ros2('topic', 'echo', '--once', '--field', 'gap', '/stage/measurement').out
    assert field == '[0.03 0.03 0.03 0.03]\n---\n'
    csv = ros2('topic', 'echo', '--once', '--csv', '--field', 'header', '/stage/measurement').out
    assert csv == '0,0,stage\n'


def test_the_wait_is_over_when_what_is_asked_for_is_there(ros2: Ros2, small: Process) -> None:
    start = time.monotonic()
    for words in (('type',), ('echo', '--once', '--field', 'x')):
        assert ros2('topic', *words, '--spin-time', '60', '/stage/measurement').code == 0
    assert time.monotonic() - start < 30.0


def test_echo_of_what_was_said_before(ros2: Ros2, small: Process) -> None:
    """The quality of service of the publisher is taken: transient local."""
    assert ros2('topic', 'echo', '--once', 'kept').out == 'data: said once\n---\n'
    volatile = ('--qos-durability', 'volatile', '--timeout', '0.3')
    assert ros2('topic', 'echo', '--once', *volatile, '/kept') == (0, '', '')


def test_echo_of_some(ros2: Ros2, small: Process) -> None:
    words = ('--filter', 'm.sequence % 10 == 3', '--once', '--csv', '/stage/measurement')
    assert int(ros2('topic', 'echo', *words).out.split(',')[3]) % 10 == 3
    code, _, err = ros2('topic', 'echo', '--field', 'gaap', '/stage/measurement')
    assert code == 1
    assert err.startswith("Invalid field 'gaap': ")
    wrong = ros2('topic', 'echo', '--filter', 'm.gaap > 0', '/stage/measurement')
    what = "Invalid filter: 'Measurement' object has no attribute 'gaap'\n"
    assert wrong == (1, '', what)


@pytest.mark.parametrize(
    'words',
    [
        ('topic', 'echo', '/a b', 'std_msgs/msg/String'),
        ('topic', 'pub', '-1', '/a b', 'std_msgs/msg/String'),
        ('service', 'call', 'a b', 'std_srvs/srv/Trigger'),
    ],
)
def test_what_is_no_name_is_refused_in_a_line(ros2: Ros2, words: tuple[str, ...]) -> None:
    code, out, err = ros2(*words)
    assert (code, out) == (1, '')
    assert re.fullmatch("'/?a b' is no name: topic name must not contain .*\n", err)


def test_pub(ros2: Ros2, small: Process) -> None:
    code, out, _ = ros2('topic', 'pub', '-1', '/heard', 'std_msgs/msg/String', '{data: hello}')
    assert code == 0
    assert out.replace('Waiting for at least 1 matching subscription(s)...\n', '') == (
        "publisher: beginning loop\npublishing #1: std_msgs.msg.String(data='hello')\n\n"
    )
    small.wait_for('heard: hello')
    words = ('-t', '3', '-r', '50', '-p', '3', '/heard', 'std_msgs/String', 'data: thrice')
    _, out, _ = ros2('topic', 'pub', *words)
    assert out.count('publishing') == 1
    assert "publishing #3: std_msgs.msg.String(data='thrice')" in out
    small.wait_for('heard: thrice')


def test_pub_of_what_it_is_not(ros2: Ros2, small: Process) -> None:
    code, out, err = ros2('topic', 'pub', '-1', '/heard', 'std_msgs/msg/String', '{dato: hello}')
    assert (code, out) == (1, '')
    assert err.startswith('Failed to populate field: ')
    words = ('--max-wait-time-secs', '0.1', '-1', '/unheard', 'std_msgs/msg/String')
    code, out, err = ros2('topic', 'pub', *words)
    assert (code, err) == (1, 'Timed out waiting for subscribers: Expected 1\n')
    assert out == 'Waiting for at least 1 matching subscription(s)...\n'


def test_services(ros2: Ros2, small: Process) -> None:
    lines = ros2('service', 'list', '-t').out.splitlines()
    assert lines == sorted(lines)
    assert '/small/enable [std_srvs/srv/SetBool]' in lines
    assert '/small/change_state [lifecycle_msgs/srv/ChangeState]' in lines
    assert ros2('service', 'type', '/small/enable') == (0, 'std_srvs/srv/SetBool\n', '')
    assert ros2('service', 'type', '/none') == (1, '', '')


def test_a_call(ros2: Ros2, small: Process) -> None:
    words = ('/small/enable', 'std_srvs/srv/SetBool', '{data: true}')
    code, out, _ = ros2('service', 'call', *words)
    assert code == 0
    assert out.removeprefix('waiting for service to become available...\n') == (
        'requester: making request: std_srvs.srv.SetBool_Request(data=True)\n\n'
        "response:\nstd_srvs.srv.SetBool_Response(success=True, message='as it was asked')\n\n"
    )
    wrong = ros2('service', 'call', '/small/enable', 'std_srvs/srv/SetBul')
    assert wrong == (1, '', 'The passed service type is invalid\n')


def test_parameters(ros2: Ros2, small: Process) -> None:
    names = ros2('param', 'list', '/small').out.splitlines()
    assert names == sorted(names)
    assert '  limits.current' in names
    assert ros2('param', 'list').out.startswith('/small:\n  autostart\n')
    typed = ros2('param', 'list', '/small', '--param-type', '--param-prefixes', 'limits').out
    assert typed == '  limits.current (type: double)\n  limits.weights (type: double array)\n'


def test_a_parameter(ros2: Ros2, small: Process) -> None:
    assert ros2('param', 'get', '/small', 'steps') == (0, 'Integer value is: 3\n', '')
    assert ros2('param', 'get', 'small', 'name', '--hide-type').out == 'a name\n'
    assert ros2('param', 'get', '/small', 'nonsense') == (1, '', 'Parameter not set\n')
    assert ros2('param', 'describe', '/small', 'limits.current').out == (
        'Parameter name: limits.current\n'
        '  Type: double\n'
        '  Description: largest current [A]\n'
        '  Constraints:\n'
        '    Min value: 0.1\n'
        '    Max value: 50.0\n'
        '    Additional constraints: [0.1, 50] A\n'
    )


def test_set(ros2: Ros2, small: Process) -> None:
    assert ros2('param', 'set', '/small', 'limits.current', '6.5') == (
        0,
        'Set parameter successful\n',
        '',
    )
    assert ros2('param', 'get', '/small', 'limits.current').out == 'Double value is: 6.5\n'
    code, out, err = ros2('param', 'set', '/small', 'limits.current', '-6.5')
    assert (code, out) == (0, '')
    assert err == (
        "Setting parameter failed: parameter 'limits.current' is -6.5, it must lie in [0.1, 50] A\n"
    )
    err = ros2('param', 'set', '/small', 'limits.current', 'hello').err
    assert "'limits.current' is 'hello' (str), its type is double" in err


def test_dump_and_load(ros2: Ros2, small: Process, tmp_path: object) -> None:
    assert isinstance(tmp_path, type(small.log.parent))
    before = ros2('param', 'dump', '/small').out
    assert before.startswith('/small:\n  ros__parameters:\n    autostart: true\n')
    assert '\n      weights:\n      - 1.0\n      - 2.5\n' in before
    file = tmp_path / 'parameters.yaml'
    file.write_text('/small:\n  ros__parameters:\n    steps: 4\n    limits: {current: 60.0}\n')
    code, out, err = ros2('param', 'load', '/small', str(file))
    assert (code, out) == (0, 'Set parameter steps successful\n')
    assert err.startswith('Set parameter limits.current failed: ')
    after = before.replace('steps: 3', 'steps: 4')
    assert ros2('param', 'dump', '/small') == (0, after, '')
    file.write_text('[steps, 4]')
    assert ros2('param', 'load', '/small', str(file)) == (1, '', f"'{file}' is no parameter file\n")
    code, _, err = ros2('param', 'load', '/small', f'{file}.none')
    assert code == 1
    assert 'No such file' in err


def test_life_cycle(ros2: Ros2, small: Process) -> None:
    assert ros2('lifecycle', 'nodes') == (0, '/small\n', '')
    assert ros2('lifecycle', 'get', '/small') == (0, 'active [3]\n', '')
    assert ros2('lifecycle', 'get').out == '/small: active [3]\n'
    assert ros2('lifecycle', 'set', '/small', 'cleanup') == (
        1,
        '',
        'Unknown transition requested, available ones are:\n- deactivate [4]\n- shutdown [7]\n',
    )
    done = (0, 'Transitioning successful\n', '')
    assert ros2('lifecycle', 'set', '/small', 'deactivate') == done
    assert ros2('lifecycle', 'list', '/small').out.startswith(
        '- cleanup [2]\n\tStart: inactive\n\tGoal: cleaningup\n'
    )
    assert ros2('lifecycle', 'set', '/small', '3') == done
