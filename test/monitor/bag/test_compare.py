"""``compare_bags A B``: what two bags share and where they differ."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_up_run import TOPICS, Encoder, make_run, open_bag, write_samples

from maglev_model.contract.phases import Phase
from maglev_monitor.bag.compare import compare
from maglev_monitor.bag.compare_cli import DIFFERENT, EQUAL, UNREADABLE, compare_bags
from maglev_monitor.bag.reader import Bag

MakeBag = Callable[..., Path]


@pytest.fixture
def make_bag(tmp_path: Path, encoder: Encoder) -> MakeBag:
    """Makes a bag of a made-up run that was changed, with some messages left out."""

    def make(
        name: str,
        change: Callable[[Any], None] = lambda _: None,
        keep: Callable[[str, int], bool] = lambda _key, _n: True,
    ) -> Path:
        run = make_run(400)
        change(run)
        writer = open_bag(tmp_path / name, compress=True)
        for first in range(0, len(run), 40):
            for key, (topic, _) in TOPICS.items():
                numbers = [n for n in range(first, first + 40) if keep(key, n)]
                messages = [encoder.message(run, key, n) for n in numbers]
                writer.write(topic, zip(messages, run.stamp[numbers].tolist(), strict=True))
            writer.flush()
        writer.close()
        return tmp_path / name

    return make


def test_the_same_run_at_another_time_is_equal(make_bag: MakeBag, capsys: Any) -> None:
    def later(run: Any) -> None:
        run.stamp += 10**12
        run.late += 7

    first, second = make_bag('a'), make_bag('b', later)
    assert compare_bags([str(first), str(second)]) == EQUAL
    end = int(np.flatnonzero(make_run(400).phase == Phase.END)[0])
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        *(f'{key}: {end + 1} samples in both: equal bit by bit' for key in TOPICS),
        'equal',
    ]
    assert compare_bags([str(first), str(second), '--wall-clock']) == DIFFERENT
    lines = capsys.readouterr().out.splitlines()
    assert f'  late_samples: {end + 1} samples differ, first 0, at most by 7' in lines
    assert any(line.startswith('  seconds: ') for line in lines)


def test_a_bag_of_several_runs_is_refused(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]], capsys: Any
) -> None:
    writer = open_bag(tmp_path / 'twice')
    write_samples(writer, run, messages)
    write_samples(writer, run, messages)
    writer.close()
    assert compare_bags([str(tmp_path / 'twice')] * 2) == UNREADABLE
    assert "twice' holds several runs" in capsys.readouterr().err


def test_a_difference_is_named_with_its_size_and_first_sample(
    make_bag: MakeBag, capsys: Any
) -> None:
    def shifted(run: Any) -> None:
        run.direct[123, 2] += 1e-6
        run.direct[130, 0] -= 3e-6

    bags = [str(make_bag('a')), str(make_bag('b', shifted))]
    assert compare_bags(bags) == DIFFERENT
    printed = capsys.readouterr().out
    assert '  direct_current: 2 samples differ, first 123, at most by 3e-06\n' in printed
    assert 'reference: 381 samples in both: equal bit by bit\n' in printed
    assert printed.endswith('different\n')
    assert compare_bags([*bags, '--tolerance', '2e-6']) == DIFFERENT
    assert 'direct_current: 1 samples differ, first 130' in capsys.readouterr().out
    assert compare_bags([*bags, '--tolerance', '4e-6']) == EQUAL
    assert 'equal within 4e-06' in capsys.readouterr().out
    assert compare_bags([*bags, '--topics', 'reference', 'measurement']) == EQUAL
    assert 'currents' not in capsys.readouterr().out


def test_bits_count_unless_a_tolerance_is_given(make_bag: MakeBag) -> None:
    def zero(value: float) -> Callable[[Any], None]:
        def change(run: Any) -> None:
            run.quadrature[50, 1] = value

        return change

    names = {'plus': 0.0, 'minus': -0.0, 'nan': np.nan, 'again': np.nan}
    bags = {name: str(make_bag(name, zero(value))) for name, value in names.items()}
    found = compare((Bag(Path(bags['plus'])), Bag(Path(bags['minus']))))
    assert found['currents'].differences['quadrature_current'].largest == 0.0
    assert compare_bags([bags['plus'], bags['minus'], '--tolerance', '1e-300']) == EQUAL
    assert compare_bags([bags['plus'], bags['nan'], '--tolerance', '1e300']) == DIFFERENT
    assert compare_bags([bags['nan'], bags['again']]) == EQUAL


def test_a_sample_in_one_bag_only_is_a_difference_before_the_end(
    make_bag: MakeBag, capsys: Any
) -> None:
    whole = str(make_bag('a'))
    short = str(make_bag('b', keep=lambda key, n: n < (398 if key == 'reference' else 385)))
    assert compare_bags([whole, short]) == EQUAL
    lost = str(make_bag('c', keep=lambda key, n: key != 'plant' or n not in (77, 200)))
    assert compare_bags([whole, lost]) == DIFFERENT
    capsys.readouterr()
    assert compare_bags([lost, whole]) == DIFFERENT
    assert 'plant: 379 samples in both, 2 only in the second from sample 77 on: equal' in (
        capsys.readouterr().out
    )
    without = str(make_bag('d', keep=lambda key, n: key != 'plant'))
    assert compare_bags([whole, without]) == DIFFERENT
    assert 'plant: 0 samples in both, 381 only in the first' in capsys.readouterr().out


def test_a_sample_that_was_repeated_counts_once(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]], bag: Path
) -> None:
    writer = open_bag(tmp_path / 'bag')
    writer.write('/stage/measurement', [(messages['measurement'][0], int(run.stamp[0]))] * 3)
    writer.flush()
    write_samples(writer, run, messages)
    writer.close()
    found = compare((Bag(tmp_path / 'bag'), Bag(bag)))
    assert all(topic.equal for topic in found.values())
    assert found['measurement'].both == found['currents'].both


def test_what_cannot_be_compared_is_one_line(
    make_bag: MakeBag, tmp_path: Path, capsys: Any
) -> None:
    bag = str(make_bag('a', keep=lambda key, _: key != 'plant'))
    assert compare_bags([bag, str(tmp_path / 'nothing')]) == UNREADABLE
    assert compare_bags([bag, bag, '--topics', 'plant']) == UNREADABLE
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.splitlines() == [
        f"compare_bags: error: there is no bag '{tmp_path / 'nothing'}'",
        "compare_bags: error: neither bag holds 'plant'",
    ]
    with pytest.raises(SystemExit):
        compare_bags([bag, bag, '--tolerance', '-1'])


def test_a_bag_that_was_cut_off_differs_and_says_so(make_bag: MakeBag, capsys: Any) -> None:
    whole, cut = make_bag('a'), make_bag('b')
    file = cut / 'b_0.mcap'
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    assert compare_bags([str(whole), str(cut)]) == DIFFERENT
    captured = capsys.readouterr()
    assert 'was cut off' in captured.err
    assert 'only in the first from sample' in captured.out


def test_fields_that_only_one_has_are_named(
    make_bag: MakeBag, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    """As of a bag of an older version."""
    first, second = make_bag('a'), make_bag('b')
    read = Bag.batches

    def older(bag: Bag) -> Any:
        for batch in read(bag):
            if bag.path == second and 'measurement' in batch.samples:
                kept = batch.samples['measurement']
                batch.samples['measurement'] = kept[[n for n in kept.dtype.names if n != 'gap']]
            yield batch

    monkeypatch.setattr(Bag, 'batches', older)
    for bags, side in (((first, second), 'the first'), ((second, first), 'the second')):
        assert compare_bags([*map(str, bags)]) == EQUAL
        told = f'  not compared, for only {side} has it: gap'
        assert capsys.readouterr().out.splitlines().count(told) == 1
