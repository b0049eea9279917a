"""The page in a real browser: no request but its own file, no message on the console, dark and print."""

import json
import shutil
import subprocess

import pytest
import synthetic_study

from compare.scene import load
from compare.table import rows
from reports import cantilever

CHROMIUM = next((path for path in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if path), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no chromium or google-chrome on this machine")
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-sync", "--disable-extensions"),
    *("--disable-background-networking", "--disable-component-update", "--disable-default-apps", "--hide-scrollbars"),
    "--host-resolver-rules=MAP * ~NOTFOUND",
)


def browse(page, folder, *options):
    """Standard output and error of the browser with the page opened; no name resolves."""
    command = [CHROMIUM, *QUIET, f"--user-data-dir={folder / 'profile'}", *options, page.as_uri()]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def requests(page, folder):
    """(addresses that the page asked for over the network, messages on its console)."""
    log = folder / "net.json"
    run = browse(page, folder, "--enable-logging=stderr", f"--log-net-log={log}", "--dump-dom")
    assert "</html>" in run.stdout
    text = log.read_text().rstrip().rstrip(",")
    events = json.loads(text if text.endswith("}") else text + "]}")["events"]
    started = [event["params"] for event in events if "initiator" in event.get("params", {})]
    asked = [
        params["url"] for params in started if params["initiator"] != "not an origin"
    ]  # that is the browser itself
    return asked, [line for line in run.stderr.splitlines() if "CONSOLE" in line]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page of the quick study, without pictures."""
    entries = synthetic_study.entries("quick", outlines=False)
    return cantilever.publish(load("cantilever"), entries, rows(entries), tmp_path_factory.mktemp("page"))


def test_the_page_asks_for_nothing_and_complains_about_nothing(page, tmp_path):
    """Not one address beyond file:, not one console message."""
    assert requests(page, tmp_path) == ([], [])


def test_the_browser_would_have_told(tmp_path):
    """The same look at a page with a foreign picture and an error finds both."""
    bad = tmp_path / "bad.html"
    bad.write_text('<!doctype html><img src="http://example.invalid/x.png"><script>console.error("oh")</script>')
    asked, said = requests(bad, tmp_path)
    assert asked == ["http://example.invalid/x.png"] and any('"oh"' in line for line in said)


def corner(page, folder, *options):
    """Colour of the page's upper left corner."""
    from PIL import Image

    shot = folder / "shot.png"
    browse(page, folder, f"--screenshot={shot}", "--window-size=900,600", *options)
    return Image.open(shot).convert("RGB").getpixel((3, 3))


def test_light_and_dark_are_different_pages(page, tmp_path):
    """The background follows the reader's preference."""
    light = corner(page, tmp_path, "--blink-settings=preferredColorScheme=1")
    dark = corner(page, tmp_path, "--blink-settings=preferredColorScheme=0")
    assert min(light) > 230 and max(dark) < 60


def test_it_fits_a_phone(page, tmp_path):
    """At 400 px nothing but the boxes of the tables is wider than the screen."""
    probe = tmp_path / "probe.html"
    text = page.read_text(encoding="utf-8").replace(
        "default-src 'none'", "default-src 'none'; script-src 'unsafe-inline'"
    )
    ask = "<script>document.title = [innerWidth, document.documentElement.scrollWidth].join()</script></body>"
    probe.write_text(text.replace("</body>", ask), encoding="utf-8")
    run = browse(probe, tmp_path, "--window-size=500,900", "--dump-dom")
    inner, wide = map(int, run.stdout.partition("<title>")[2].partition("<")[0].split(","))
    assert inner <= 500 and wide <= inner


def test_it_prints(page, tmp_path):
    """A PDF of several pages comes out."""
    paper = tmp_path / "page.pdf"
    browse(page, tmp_path, f"--print-to-pdf={paper}", "--no-pdf-header-footer")
    content = paper.read_bytes()
    assert content.startswith(b"%PDF") and content.count(b"/Type /Page") > 5
