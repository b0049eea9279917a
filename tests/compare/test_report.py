"""The page: the numbers of its JSON and no others, nothing from the network, failures shown as failures."""

import base64
import hashlib
import io
import json
import math
import re
import stat
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import synthetic_study
from PIL import Image

from compare import report
from compare.scene import load
from compare.table import rows
from reports import cantilever, scene, sections
from reports.ladders import limit_errors

FAILED = "cantilever ancf 3x3"


def publish(folder, entries, module=cantilever, name="cantilever"):
    """The page's text and its JSON."""
    path = module.publish(load(name), entries, rows(entries), folder)
    return path.read_text(encoding="utf-8"), json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))


@pytest.fixture
def without_plots(monkeypatch):
    """Plots take most of a page's time and do not matter to some tests."""
    monkeypatch.setattr(sections, "plot_sections", lambda entries: [])


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    """A standard study with one failed level."""
    return publish(tmp_path_factory.mktemp("page"), synthetic_study.entries(failed=(FAILED,)))


def numbers(value):
    """Every number in nested JSON values."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        return [number for item in value for number in numbers(item)]
    return [] if value is None or isinstance(value, (bool, str)) else [value]


def test_every_number_on_the_page_is_one_of_the_json(published):
    """The full value beside each printed number is the same double that the JSON holds."""
    page, content = published
    known = {json.dumps(number) for number in numbers(content)}
    shown = re.findall(r'<data value="([^"]*)">([^<]*)</data>', page)
    assert len(shown) > 500
    assert not {value for value, _ in shown} - known


def test_every_printed_number_is_its_full_value_rounded(published):
    """What a reader sees differs from what the JSON says by the last printed digit at most."""
    for value, text in re.findall(r'<data value="([^"]*)">([^<]*)</data>', published[0]):
        plain = text.replace("\u2212", "-").replace("\u202f", "").replace(",", "")
        digits, _, exponent = plain.partition("e")
        last = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
        assert math.isclose(float(plain), float(value), abs_tol=0.5000001 * last), (value, text)


def test_every_number_of_every_row_is_on_the_page(published):
    """Nothing of the table is left out."""
    page, content = published
    keys = [column.key for column in sections.COLUMNS if column.form != "text"]
    for row, error in zip(content["rows"], content["error_limit_percent"], strict=True):
        row = {**row, "error_limit_percent": error}
        for key in keys:
            assert row[key] is None or f'<data value="{json.dumps(row[key])}">' in page, (key, row)


def test_every_figure_is_on_the_page_with_its_name_bar_and_state(published):
    """All four parts of a figure, and only those four, are in the JSON; the page shows them."""
    page, content = published
    for name, figure in content["figures"].items():
        assert set(figure) == {"value", "unit", "bar", "met"}
        if figure["value"] is not None:
            assert f'<data value="{json.dumps(figure["value"])}">' in page
        if figure["bar"] is not None:
            assert re.search(rf'<article class="card (met|missed|idle)">(?:(?!</article>).)*{name}', page, re.S)


def test_nothing_is_fetched(published):
    """No address but anchors, data: and the namespace of SVG."""
    page = published[0]
    addresses = re.findall(r'(?:href|src|srcset|action|data)\s*=\s*"([^"]*)"', page) + re.findall(
        r"url\(([^)]*)\)", page
    )
    assert addresses and all(address.startswith(("#", "data:")) for address in addresses)
    assert set(re.findall(r"https?://[^\s\"'<]+", page)) <= {"http://www.w3.org/2000/svg"}
    assert "@import" not in page


def test_only_the_packages_own_script_may_run(published):
    """One script, the one whose hash the page's policy names; everything else marked so is data."""
    page = published[0]
    kinds = re.findall(r"<script([^>]*)>(.*?)</script>", page, re.S)
    run = [text for attributes, text in kinds if "application/octet-stream" not in attributes]
    assert run == [report.script(bodies=True)] and len(kinds) > 10
    digest = base64.b64encode(hashlib.sha256(run[0].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'\"" in page
    assert "</" not in run[0] and "eval" not in run[0]


def test_every_drawing_on_the_page_parses(published):
    """Sketches and plots are well-formed XML."""
    drawings = re.findall(r"<svg.*?</svg>", published[0], re.S)
    assert len(drawings) >= 17
    for drawing in drawings:
        ElementTree.fromstring(drawing)


def test_ids_are_unique_and_every_reference_has_its_target(published):
    """Anchors, labels and clip paths point at exactly one thing."""
    page = published[0]
    ids = re.findall(r'\sid="([^"]+)"', page)
    assert len(ids) == len(set(ids))
    used = re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)|aria-labelledby="([^"]+)"', page)
    assert {word for found in used for text in found for word in text.split()} <= set(ids)


class Balance(HTMLParser):
    """Open elements of a document; raises AssertionError where one is closed out of order."""

    VOID = ("meta", "link", "img", "br")

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attributes):
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_elements_are_closed_in_order(published):
    """The document's tree is the one that was meant."""
    parser = Balance()
    parser.feed(published[0])
    assert parser.open == []


def test_the_page_stays_small(published):
    """Below 5 MB, pictures included."""
    assert len(published[0].encode()) < 5e6


def test_pictures_are_png_with_something_on_them(published):
    """Where rendering works at all, each of the six has pixels that are neither empty nor all alike."""
    found = re.findall(r'<img src="data:image/png;base64,([^"]+)" width="(\d+)" height="(\d+)"', published[0])
    if not found:
        pytest.skip("no rendering here: " + re.search(r"Pictures missing.</strong>([^<]*)", published[0])[1])
    assert len(found) == 6
    for text, width, height in found:
        pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(text))).convert("RGBA"))
        assert pixels.shape[:2] == (int(height), int(width))
        assert len(np.unique(pixels.view(np.uint32))) > 20 and pixels[..., 3].min() == 0


def test_a_failed_level_shows_its_status_and_no_number(published):
    """The row names the failure; its value is a dash, its figure null and missed."""
    page, content = published
    row = next(row for row in content["rows"] if row["status"] != "ok")
    assert row["status"] == "newton_diverged" and row["value"] is None
    line = re.search(r'<tr class="failed"[^>]*>.*?</tr>', page, re.S)[0]
    assert "newton_diverged" in line and "does not apply or was not run" in line
    assert "residual 3e2 at t = 0.4 s" in page
    assert content["figures"]["table5_grooved_max_percent"] == {"value": None, "unit": "%", "bar": 1.0, "met": False}


def test_a_crashed_unit_is_a_row_without_numbers(tmp_path, without_plots):
    """A unit without any result keeps its reason."""
    entries = synthetic_study.entries("quick", outlines=False)
    dead = {**vars(entries[0]), "result": None, "status": "crashed: killed by signal 9", "wall_seconds": None}
    page, content = publish(tmp_path, [type(entries[0])(**dead), *entries[1:]])
    assert "crashed: killed by signal 9" in page and content["rows"][0]["unknowns"] is None


def test_figures_of_known_heights():
    """Heights invented 1e-4 m beside the printed ones, and a reference -0.566 m (1 - 0.8 h^2), h = 0.05 and 0.025 last.

    With grooves its limit is drawn with the order 1.0890 of a right-angled re-entrant edge, not with the observed 2.
    """
    entries = synthetic_study.entries("full", outlines=False)
    found = {figure.name: figure for figure in cantilever.figures(entries, rows(entries))}
    plain = found["table5_plain_max_difference"]
    assert plain.value == pytest.approx(1e-4, abs=1e-9) and plain.met
    assert "Rows 2x2, 3x3, 4x4, 5x5, 6x6, 8x8, 12x12, 16x16." in plain.note
    coarse, fine = (-0.566 * (1 - 0.8 * h**2) for h in (0.05, 0.025))
    limit = fine + (fine - coarse) / (2**1.0890 - 1)
    error = 100 * abs(limit / 0.5669 + 1)
    assert found["reference_grooved_error_percent"].value == pytest.approx(error, rel=1e-3)  # 1.0890 is rounded
    assert found["softening_ratio_reference"].value == pytest.approx(0.566 / 0.5015)
    assert found["patch_grooved_reference_order"].value == pytest.approx(2.0, abs=1e-9)
    gap = 100 * (0.985 * (1 - (1 / 60) ** 1.8) / (1 - 0.8 * 0.025**2) - 1)
    assert found["ancf_reference_patch_grooved_percent"].value == pytest.approx(gap, rel=1e-9)
    assert "same element size, 40x40 (7x7x3) against h=0.025:" in found["ancf_reference_patch_grooved_percent"].note
    assert found["patch_plain_band_gap_percent"].met is (found["patch_plain_band_gap_percent"].value == 0)


def test_each_printed_row_is_compared_at_the_rule_that_it_names():
    """Rows 5 and 6 at 7x7x3, the others at 3x3x2, and the other rule beside each."""
    table = {line["mesh"]: line for line in cantilever.table5(synthetic_study.entries("quick", outlines=False))}
    named = {mesh: line["rule_plain"] for mesh, line in table.items() if line["ancf_plain"] is not None}
    assert named == {"2x2": "3x3x2", "3x3": "3x3x2", "4x4": "3x3x2", "5x5": "7x7x3", "6x6": "7x7x3", "8x8": "3x3x2"}
    assert table["5x5"]["other_rule_plain"] == "3x3x2" and table["2x2"]["other_rule_plain"] == "7x7x3"


def test_a_wrong_height_is_a_missed_figure():
    """3e-4 m beside the printed 4x4 row is beyond the bar of 2e-4 m."""
    entries = synthetic_study.entries("quick", outlines=False)
    index = next(
        i
        for i, e in enumerate(entries)
        if e.scene.name == "cantilever_plain" and e.solver == "ancf" and e.level.mesh == (4, 4)
    )
    entries[index].result.displacement[-1, 0, 2] += 2e-4
    found = {figure.name: figure for figure in cantilever.figures(entries, rows(entries))}
    assert found["table5_plain_max_difference"].met is False
    assert found["table5_plain_max_difference"].margin == pytest.approx(-1e-4, abs=1e-9)


@pytest.mark.parametrize("kept", ["ancf", "reference", None])
def test_what_was_not_run_is_null_and_not_judged(kept):
    """Without a solver, its figures have neither value nor verdict; without any, none has."""
    entries = [e for e in synthetic_study.entries("quick", outlines=False) if e.solver == kept]
    found = {figure.name: figure.entry() for figure in cantilever.figures(entries, rows(entries))}
    both = [figure for name, figure in found.items() if "gap" in name or name.startswith("ancf_reference")]
    other = [figure for name, figure in found.items() if kept != "reference" and name.startswith("reference_")]
    table = [figure for name, figure in found.items() if kept != "ancf" and name.startswith("table5")]
    for figure in both + other + table:
        assert figure["value"] is None and figure["met"] is None


def test_pictures_that_cannot_be_made_are_named_with_the_reason(tmp_path, monkeypatch, without_plots):
    """Without OpenGL the page still carries every number."""
    python = tmp_path / "python"
    python.write_text("#!/bin/sh\nkill -SEGV $$\n")
    python.chmod(python.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(sys, "executable", str(python))
    page, content = publish(tmp_path / "out", synthetic_study.entries("quick"))
    assert "Pictures missing." in page and "signal 11" in page and "undeformed mesh of cantilever" in page
    assert "<img" not in page and len(numbers(content["rows"])) > 300


def test_any_scene_has_a_page(tmp_path):
    """The generic page of one scene alone, with the same promise about its numbers."""
    entries = [e for e in synthetic_study.entries("quick", outlines=False) if e.scene.name == "cantilever_plain"]
    page, content = publish(tmp_path, entries, scene, "cantilever_plain")
    known = {json.dumps(number) for number in numbers(content)}
    assert {value for value in re.findall(r'<data value="([^"]*)">', page)} <= known
    assert content["figures"]["cantilever_plain_ancf_reference_percent"]["value"] is not None


def test_markup_in_words_is_text():
    """A title or a message cannot become an element."""
    section = report.Section("a", "<b>title</b>", [report.Text(["<script>alert(1)</script>"])])
    page = report.render(report.Page("<i>x</i>", "lead", [section]))
    assert page.count("<script") == 1 and "alert(1)</script>" not in page and "<b>" not in page and "<i>" not in page


def test_a_number_that_json_cannot_say_is_refused(tmp_path):
    """NaN must not reach a page's JSON."""
    with pytest.raises(ValueError, match="Out of range"):
        report.write(tmp_path, "x", report.Page("x", "x", []), {"value": math.nan})


def test_a_scene_with_a_poissons_ratio_is_told_that_the_plate_locks():
    """(1 - nu)^2 / (1 - 2 nu) = 1.225 at nu = 0.3; nothing is said at nu = 0, nor of a point load that is not there."""
    plain = [e for e in synthetic_study.entries() if e.scene.name == "cantilever_plain_patch"]
    assert not any("locking" in words or "sinks" in words for words in scene.limits(plain))
    stated = plain[0].scene.override({"material.poissons_ratio": 0.3})
    told = scene.limits([replace(entry, scene=stated) for entry in plain])
    assert any("22.5 % too stiff" in words for words in told)
    ancf = [entry for entry in plain if entry.solver == "ancf"]
    cured = [replace(e, scene=stated, level=e.level.model_copy(update={"element": "enriched"})) for e in ancf]
    assert not any("locking" in words for words in scene.limits(cured))


def test_each_row_says_how_far_it_is_from_its_own_limit():
    """The reference without grooves follows -0.5015 m (1 - 0.8 h^2), so h = 0.1 lies 0.8 % from its limit."""
    entries = [e for e in synthetic_study.entries() if e.scene.name == "cantilever_plain"]
    errors = dict(zip(((r["solver"], r["mesh"]) for r in rows(entries)), limit_errors(entries), strict=True))
    assert errors["reference", "h=0.1"] == pytest.approx(-0.8, rel=1e-6)


def test_a_twin_that_is_run_alone_has_a_page_of_its_own(tmp_path, monkeypatch):
    """Not the exhibit of the printed table with every row missing."""
    monkeypatch.setattr(sections.figures, "render", lambda jobs: ([], "not drawn here"))
    entries = [e for e in synthetic_study.entries("quick") if e.scene.name == "cantilever_plain_patch"]
    path = cantilever.publish(entries[0].scene, entries, rows(entries), tmp_path)
    text = path.read_text(encoding="utf-8")
    assert "Table 5, printed and computed" not in text and entries[0].scene.title in text
