"""The middleware's profile: ours by default, the user's where there is one."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree

import pytest

from maglev_node.dds import prepare_middleware

VARIABLE = 'FASTRTPS_DEFAULT_PROFILES_FILE'


def test_ours_by_default(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, '')  # so that it is put back
    monkeypatch.delenv(VARIABLE)
    prepare_middleware()
    profiles = ElementTree.parse(os.environ[VARIABLE]).getroot()
    assert [child.get('is_default_profile') for child in profiles] == ['true', 'true']


def test_what_the_user_chose_stays(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path / 'own.xml'))
    prepare_middleware()
    assert os.environ[VARIABLE] == str(tmp_path / 'own.xml')
