"""The middleware's profile: ours by default, the user's where there is one."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree

import pytest

from maglev_node import dds
from maglev_node.dds import only_here, prepare_middleware
from maglev_node.topics import KEPT

PROFILES = 'FASTRTPS_DEFAULT_PROFILES_FILE'
TRANSPORTS = 'FASTDDS_BUILTIN_TRANSPORTS'
RANGE, PEERS = 'ROS_AUTOMATIC_DISCOVERY_RANGE', 'ROS_STATIC_PEERS'


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing chosen, and what was is put back."""
    for name in (PROFILES, TRANSPORTS, RANGE, PEERS):
        monkeypatch.setenv(name, '')
        monkeypatch.delenv(name)


def profiles() -> dict[str, ElementTree.Element]:
    """Of the file that is in effect, by what they are for."""
    return {
        child.tag.rpartition('}')[2]: child
        for child in ElementTree.parse(os.environ[PROFILES]).getroot()
    }


def text(root: ElementTree.Element, name: str) -> str | None:
    """What stands in an element."""
    return root.findtext(f'.//{{*}}{name}')


@pytest.mark.parametrize('where', [None, 'SUBNET', 'LOCALHOST'])
def test_messages_go_over_the_network_whatever_the_range(where: str | None) -> None:
    if where is not None:
        os.environ[RANGE] = where
    prepare_middleware()
    assert os.environ[TRANSPORTS] == 'UDPv4'
    assert profiles()['participant'].get('is_default_profile') == 'true'
    writer = profiles()['data_writer']
    assert writer.get('is_default_profile') == 'true'
    assert text(writer, 'disable_heartbeat_piggyback') == 'true'
    assert only_here() == (where == 'LOCALHOST')


def test_on_this_machine_alone_there_is_no_other_transport_than_its_loopback() -> None:
    os.environ[RANGE] = 'LOCALHOST'
    prepare_middleware()
    assert os.environ[RANGE] == 'SYSTEM_DEFAULT'  # or rmw_fastrtps adds shared memory
    (transport,) = profiles()['transport_descriptors']
    assert text(transport, 'type') == 'UDPv4'
    assert [each.text for each in transport.findall('.//{*}interfaceWhiteList/*')] == ['127.0.0.1']
    assert text(profiles()['participant'], 'useBuiltinTransports') == 'false'
    prepare_middleware()  # and once more changes nothing
    assert only_here()


@pytest.mark.parametrize(('where', 'here'), [('SUBNET', False), ('LOCALHOST', True)])
def test_a_process_that_is_started_from_one_here_may_have_a_range_of_its_own(
    where: str, *, here: bool
) -> None:
    os.environ[RANGE] = 'LOCALHOST'
    prepare_middleware()
    os.environ[RANGE] = where
    prepare_middleware()
    assert only_here() == here
    assert os.environ[PROFILES] == str(dds._HERE if here else dds._ANYWHERE)


def test_peers_that_are_given_stay_in_effect() -> None:
    os.environ[RANGE], os.environ[PEERS] = 'LOCALHOST', '192.0.2.1'
    prepare_middleware()
    assert os.environ[RANGE] == 'LOCALHOST'
    assert not only_here()
    assert os.environ[PROFILES] == str(dds._ANYWHERE)


def test_both_profiles_have_the_same_timing() -> None:
    def timing(file: Path) -> list[str]:
        root = ElementTree.parse(file).getroot()
        return [
            ElementTree.tostring(element, encoding='unicode')
            for name in ('initialAnnouncements', 'data_writer')
            for element in root.iter(f'{{{root.tag[1:].partition("}")[0]}}}{name}')
        ]

    assert len(timing(dds._HERE)) == 2
    assert timing(dds._HERE) == timing(dds._ANYWHERE)


def test_a_writer_has_room_at_once_for_all_that_it_keeps_in_real_time() -> None:
    prepare_middleware()
    assert text(profiles()['data_writer'], 'allocated_samples') == str(KEPT['realtime'])


def test_what_the_user_chose_stays(tmp_path: Path) -> None:
    os.environ[PROFILES], os.environ[TRANSPORTS] = str(tmp_path / 'own.xml'), 'LARGE_DATA'
    os.environ[RANGE] = 'LOCALHOST'
    prepare_middleware()
    assert os.environ[PROFILES] == str(tmp_path / 'own.xml')
    assert os.environ[TRANSPORTS] == 'LARGE_DATA'
    assert os.environ[RANGE] == 'LOCALHOST'
