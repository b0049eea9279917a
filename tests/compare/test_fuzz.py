"""Anything at all as a scene, a result or an exported file: an answer or a clear error, never another crash."""

import json
import tomllib
from dataclasses import replace

import fake_solver
import numpy as np
import pytest
from fake_solver import small

pytest.importorskip("hypothesis", reason="hypothesis is not installed: pip install groovecheck[test]")
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as some

from compare import ci, gate, report
from compare.external.exported import ExportError, entries
from compare.result import ResultError, load, save
from compare.scene import SHIPPED, Scene, SceneError, parse
from compare.scene import load as load_scene

QUICK = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
WORDS = some.text(max_size=12)
NUMBERS = some.floats(allow_nan=True, allow_infinity=True) | some.integers(-(10**12), 10**12)
VALUES = some.recursive(
    some.none() | some.booleans() | NUMBERS | WORDS,
    lambda inner: some.lists(inner, max_size=4) | some.dictionaries(WORDS, inner, max_size=4),
    max_leaves=8,
)
SHIPPED_DATA = [tomllib.loads(path.read_text()) for path in sorted(SHIPPED.glob("*.toml"))]


def places(data, path=()):
    """Paths of everything in nested dicts and lists."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from places(value, (*path, key))


def changed(data, path, value):
    """A deep copy with one place set otherwise."""
    copy = json.loads(json.dumps(data))
    at = copy
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return copy


@QUICK
@given(some.data())
def test_a_shipped_scene_with_one_place_changed_is_a_scene_or_a_scene_error(data):
    """Each problem begins with the file's name; whatever is accepted can be written down and read again."""
    stated = data.draw(some.sampled_from(SHIPPED_DATA))
    path = data.draw(some.sampled_from(list(places(stated))))
    try:
        scene = parse(changed(stated, path, data.draw(VALUES)), "fuzzed.toml")
    except SceneError as error:
        assert error.problems and all(problem.startswith("fuzzed.toml: ") for problem in error.problems)
        return
    again = Scene.model_validate(json.loads(scene.model_dump_json(exclude_defaults=True)))
    assert again.physics() == scene.physics()


@QUICK
@given(some.dictionaries(WORDS, VALUES, max_size=6))
def test_anything_is_a_scene_or_a_scene_error(data):
    with pytest.raises(SceneError):
        parse(data, "fuzzed.toml")


@QUICK
@given(some.binary(max_size=300))
def test_bytes_are_no_scene(tmp_path, raw):
    path = tmp_path / "fuzzed.toml"
    path.write_bytes(raw)
    with pytest.raises(SceneError, match=r"fuzzed\.toml"):
        load_scene(path)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A result and the bytes of its file."""
    result, path = fake_solver.solve(small(), small().ancf.levels[0]), tmp_path_factory.mktemp("made") / "a.npz"
    save(result, path)
    return result, path.read_bytes()


@QUICK
@given(place=some.floats(0, 1, exclude_max=True), raw=some.binary(min_size=1, max_size=40), cut=some.booleans())
def test_a_damaged_result_is_read_or_refused(tmp_path, made, place, raw, cut):
    """Bytes overwritten or cut off anywhere; zip's own checksum finds most, the rest must still be a result."""
    _, whole = made
    at = int(place * len(whole))
    path = tmp_path / "damaged.npz"
    path.write_bytes(whole[:at] if cut else whole[:at] + raw + whole[at + len(raw) :])
    try:
        assert load(path).scene["name"] == "cantilever"
    except ResultError as error:
        assert "damaged.npz" in str(error)


@QUICK
@given(header=(some.dictionaries(WORDS, VALUES, max_size=4) | some.just({"schema": 2})) | VALUES)
def test_a_header_of_anything_is_refused(tmp_path, header):
    path = tmp_path / "header.npz"
    try:
        text = json.dumps(header)
    except ValueError:
        assume(False)
    np.savez(path, header=np.array(text))
    with pytest.raises(ResultError, match=r"header\.npz"):
        load(path)


@QUICK
@given(
    times=some.lists(some.floats(0, 1e6), max_size=5),
    name=WORDS,
    facts=some.dictionaries(WORDS, some.floats(allow_nan=False, allow_infinity=False), max_size=3),
)
def test_what_is_saved_is_read_back(tmp_path, made, times, name, facts):
    count = len(times)
    result = replace(
        made[0], times=np.array(times), message=name, facts=facts, displacement=np.ones((count, 1, 3)), solver=name
    )
    save(result, tmp_path / "a.npz")
    again = load(tmp_path / "a.npz")
    assert (again.message, again.solver, again.facts) == (name, name, facts)
    np.testing.assert_array_equal(again.times, result.times)
    assert "<script" not in again._repr_html_()


@QUICK
@given(some.text(max_size=200) | some.lists(some.lists(WORDS, max_size=4).map(",".join), max_size=5).map("\n".join))
def test_any_text_is_a_table_or_an_error_that_names_the_file(tmp_path, text):
    path = tmp_path / "fuzzed.csv"
    path.write_text("h,value\n" + text, encoding="utf-8", newline="")
    try:
        found = entries(load_scene("cantilever_plain"), path, "Other")
        assert all(entry.result.h > 0 for entry in found)
    except ExportError as error:
        assert "fuzzed.csv" in str(error)


@QUICK
@given(WORDS, some.text(max_size=60))
def test_any_words_stay_words_on_a_page_and_in_a_verdict(title, words):
    """No element, attribute or script comes of them; XML stays XML."""
    import xml.etree.ElementTree as ElementTree

    hostile = f"{words}</td></script><script>alert(1)</script>\"'><img src=x onerror=alert(1)>"
    table = report.Table(hostile, [report.Column("a", hostile), report.Column("b", "b")], [{"a": hostile, "b": words}])
    text = report.render(report.Page(title, hostile, [report.Section("s", hostile, [table])], hostile))
    assert text.count("<script") == 1 and "<img" not in text
    verdict = gate.Verdict((gate.Margin(hostile, "missing", None, 1.0, None, None),), 1e-6, True, ())
    ElementTree.fromstring(ci.junit(verdict, title))
    assert "<script" not in ci.markdown(verdict, title).replace("\\<script", "")
