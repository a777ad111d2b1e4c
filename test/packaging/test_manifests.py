"""package.xml and setup.cfg of every package say what its code and its tests import, no more."""

from __future__ import annotations

import configparser
import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from source_tree import PACKAGES, ROOT, imported, modules, top_level

DISTRIBUTIONS = {'yaml': 'PyYAML', 'mpl_toolkits': 'matplotlib', 'mcap_ros2': 'mcap-ros2-support'}
"""The names on PyPI of modules called otherwise."""

KEYS = {
    name: f'python3-{name.lower().removeprefix("py") if name == "PyYAML" else name}'
    for name in (
        'PyYAML',
        'argcomplete',
        'hypothesis',
        'matplotlib',
        'numpy',
        'psutil',
        'pytest',
        'scipy',
    )
}
"""The rosdep keys that Ubuntu 24.04 has, by names on PyPI."""

ROS_ONLY = {'maglev_msgs', 'maglev_node'}
"""Ours that stand on ROS, and so are no use to pip."""

SUPPORT = {path.stem: path for path in (ROOT / 'test' / 'support').glob('*.py')}


def requirements(*names: str) -> dict[str, str]:
    """The lines of setup/requirements*.txt by the distributions they are of."""
    lines = [line for name in names for line in (ROOT / 'setup' / name).read_text().splitlines()]
    return {re.split('[<>=]', line)[0]: line for line in lines if line and not line.startswith('#')}


RUN = requirements('requirements.txt', 'requirements-view.txt')
OPTIONAL = requirements('requirements-optional.txt')
TEST = requirements('requirements-test.txt', 'requirements-test-nodeps.txt')
ALL = {**RUN, **TEST, **OPTIONAL}


def used(package: str) -> set[str]:
    """The packages that a package's code imports."""
    names = top_level(name for path in modules(package).values() for name in imported(path))
    return names - set(sys.stdlib_module_names) - {package}


def used_by_tests(package: str) -> set[str]:
    """The packages that only its tests import, directly or by a module of test/support."""
    paths = list((ROOT / 'test' / package.removeprefix('maglev_')).rglob('*.py'))
    names: set[str] = set()
    while paths:
        fresh = top_level(imported(paths.pop())) - names
        names |= fresh
        paths += [SUPPORT[name] for name in fresh if name in SUPPORT]
    return names - set(SUPPORT) - set(sys.stdlib_module_names) - {package} - used(package)


def needs(package: str) -> set[str]:
    """The packages of ours that a package stands on, however indirectly."""
    found = used(package) & set(PACKAGES)
    return found.union(*(needs(name) for name in found))


def distributions(names: set[str]) -> set[str]:
    """Of some imports, those that come from PyPI, by their names there."""
    return {DISTRIBUTIONS.get(name, name) for name in names} & set(ALL)


def from_ros(names: set[str]) -> set[str]:
    """Of some imports, those that are ROS packages: all that are not from PyPI."""
    return {name for name in names if DISTRIBUTIONS.get(name, name) not in ALL}


def manifest(package: str, tag: str) -> tuple[set[str], set[str]]:
    """The dependencies of one kind in package.xml, and those its comment names for PyPI."""
    text = (ROOT / 'src' / package / 'package.xml').read_text()
    elements = [element.text or '' for element in ElementTree.fromstring(text).iter(tag)]
    comment = re.search(f'<!-- {tag} without a rosdep key, from PyPI: (.*) -->', text)
    assert len(elements) == len(set(elements)), f'{package}: package.xml names a {tag} twice'
    return set(elements), set(comment[1].split(', ') if comment else ())


def setup_cfg(package: str) -> configparser.ConfigParser:
    """The package's setup.cfg."""
    parser = configparser.ConfigParser()
    parser.read(ROOT / 'src' / package / 'setup.cfg', encoding='utf-8')
    return parser


def lines(text: str) -> set[str]:
    """The entries of a list in setup.cfg."""
    return {line.strip() for line in text.splitlines() if line.strip()}


def difference(where: str, named: set[str], right: set[str]) -> str:
    """What a list lacks and what it has too much, empty when it is right."""
    parts = (('lacks', right - named), ('names without use', named - right))
    return '; '.join(
        f'{where} {verb}: {", ".join(sorted(names))}' for verb, names in parts if names
    )


def package_xml(package: str, tag: str, imports: set[str]) -> list[str]:
    """What is wrong with the dependencies of one kind in package.xml."""
    found = distributions(imports)
    keys = {KEYS[name] for name in found if name in KEYS}
    named, commented = manifest(package, tag)
    return [
        difference(f'{tag} of package.xml', named, from_ros(imports) | keys),
        difference(f"the comment on {tag}'s from PyPI", commented, found - set(KEYS)),
    ]


def agreed(*differences: str) -> None:
    """Fail with all that differs."""
    told = [difference for difference in differences if difference]
    assert not told, '\n'.join(told)


@pytest.mark.parametrize('package', PACKAGES)
def test_what_the_code_imports(package: str) -> None:
    optional = used(package) & set(OPTIONAL)
    imports = used(package) - optional
    ours = (imports & set(PACKAGES)) - ROS_ONLY
    right = ours | {ALL[name] for name in distributions(imports)}
    required = lines(setup_cfg(package)['options']['install_requires'])
    extras = lines(setup_cfg(package)['options.extras_require'].get('optional', ''))
    agreed(
        *package_xml(package, 'exec_depend', imports),
        difference('install_requires of setup.cfg', required, right),
        difference('optional of setup.cfg', extras, {OPTIONAL[name] for name in optional}),
    )


@pytest.mark.parametrize('package', PACKAGES)
def test_what_the_tests_import(package: str) -> None:
    """Packages above this one apart, on which no manifest can let it depend."""
    imports = {name for name in used_by_tests(package) if package not in needs_of(name)}
    right = {ALL[name] for name in distributions(imports)}
    required = lines(setup_cfg(package)['options.extras_require']['test'])
    agreed(
        *package_xml(package, 'test_depend', imports),
        difference('extras_require of setup.cfg', required, right),
    )


def needs_of(name: str) -> set[str]:
    """What a package of ours stands on; nothing for others."""
    return needs(name) if name in PACKAGES else set()


def test_every_requirement_is_one_of_a_package() -> None:
    imports: set[str] = set().union(*(used(package) for package in PACKAGES))
    agreed(
        difference(
            'setup/requirements{,-view}.txt', set(RUN), distributions(imports) - set(OPTIONAL)
        )
    )


def test_what_is_optional_is_used_and_tested_as_it_is_installed() -> None:
    imports: set[str] = set().union(*(used(package) for package in PACKAGES))
    agreed(difference('setup/requirements-optional.txt', set(OPTIONAL), imports & set(OPTIONAL)))
    assert {name: TEST[name] for name in set(TEST) & set(OPTIONAL)} == {
        name: OPTIONAL[name] for name in set(TEST) & set(OPTIONAL)
    }


def test_messages() -> None:
    folder = ROOT / 'src' / 'maglev_msgs'
    text = '\n'.join(path.read_text() for path in folder.glob('msg/*.msg'))
    named, _ = manifest('maglev_msgs', 'depend')
    agreed(difference('depend', named, set(re.findall(r'^(\w+)/\w+', text, re.MULTILINE))))


@pytest.mark.parametrize('package', PACKAGES)
def test_both_manifests_say_the_same_of_the_package(package: str) -> None:
    root = ElementTree.parse(ROOT / 'src' / package / 'package.xml').getroot()
    metadata = setup_cfg(package)['metadata']
    for field in ('name', 'version', 'description', 'license', 'maintainer'):
        assert root.findtext(field) == metadata[field]
    maintainer = root.find('maintainer')
    assert maintainer is not None
    assert maintainer.get('email') == metadata['maintainer_email']


def test_one_version() -> None:
    found = {
        ElementTree.parse(path).getroot().findtext('version')
        for path in ROOT.glob('src/*/package.xml')
    }
    citation = re.search('^version: (.*)$', (ROOT / 'CITATION.cff').read_text(), re.MULTILINE)
    assert citation is not None
    assert found == {citation[1]}


@pytest.mark.parametrize('package', PACKAGES)
def test_executables_are_functions(package: str) -> None:
    """What setup.cfg names as an executable is a function of a module that exists."""
    section = setup_cfg(package)
    if 'options.entry_points' not in section:
        return
    for line in lines(section['options.entry_points']['console_scripts']):
        module, _, function = line.split('=')[1].strip().partition(':')
        path = modules(package).get(module, Path())
        assert f'\ndef {function}(' in path.read_text(), line


@pytest.mark.parametrize('package', PACKAGES)
def test_its_own_tests_are_found_from_the_package(package: str) -> None:
    """By a link to the folder in test/, from which ``colcon test`` collects."""
    link = ROOT / 'src' / package / 'test'
    folder = ROOT / 'test' / package.removeprefix('maglev_')
    assert link.is_symlink()
    assert link.resolve() == folder
    assert list(folder.rglob('test_*.py'))


def test_tests_find_files_also_through_the_link() -> None:
    """``__file__`` is the link's then, and its parents are not the folder's."""
    wrong = 'Path(__file__)' + '.parent'
    assert [path for path in (ROOT / 'test').rglob('*.py') if wrong in path.read_text()] == []
