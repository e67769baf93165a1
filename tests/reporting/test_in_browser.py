"""A report in headless Chromium: no horizontal scrolling at two widths, a picture, a PDF, no script from names."""

import html
import json
import re
import shutil
import subprocess

import pytest

import wrcore as wr
from tests.conftest import ELLIPTIC
from tests.reporting.test_report import EVERYTHING, EVIL, evil_run

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(not BROWSER, reason="no Chromium")

WIDTHS = (1200, 400)
"""Of a desktop and of a phone, CSS px."""

PROBE = """<!doctype html><body><script>
(async () => {
  const found = [];
  for (const width of %s) {
    const frame = document.createElement("iframe");
    frame.style = `width: ${width}px; height: 900px; border: 0`;
    await new Promise((loaded) => { frame.onload = loaded; frame.src = "page.html"; document.body.append(frame); });
    const inside = frame.contentDocument, root = inside.documentElement;
    const all = (what) => [...inside.querySelectorAll(what)], box = (one) => one.getBoundingClientRect();
    const wide = all("body *").filter((one) => !one.closest("svg") && box(one).right > width + 1);
    found.push({
      width, overflow: root.scrollWidth - root.clientWidth, wide: wide.map((one) => one.outerHTML.slice(0, 80)),
      figures: all("figure svg").length, title: inside.title,
      columns: new Set(all("#motion figure").map((one) => box(one).left)).size,
      small: all("svg text").filter((one) => box(one).height < 7).length,
    });
    frame.remove();
  }
  document.body.textContent = JSON.stringify(found);
})();
</script>"""


def browse(*options):
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files", *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=True).stdout


def measured(folder, page):
    page.write(folder / "page.html")
    (folder / "probe.html").write_text(PROBE % json.dumps(WIDTHS))
    shown = browse("--virtual-time-budget=20000", "--dump-dom", (folder / "probe.html").as_uri())
    return json.loads(html.unescape(re.search(r"<body>(.*)</body>", shown, re.DOTALL)[1]))


@pytest.fixture(scope="module")
def page():
    runs = [wr.simulate(ELLIPTIC / "trailer_vehicle.yaml", EVERYTHING, speed=speed) for speed in (15, 20, 25)]
    return wr.report(runs, accuracy=False)


def test_page_fits_desktop_and_phone(page, tmp_path):
    desktop, phone = measured(tmp_path, page)
    for found in (desktop, phone):
        assert (found["overflow"], found["wide"], found["small"]) == (0, [], 0)
        assert found["figures"] > 30
    assert desktop["columns"] == 3 and phone["columns"] == 1


def test_page_that_does_not_fit_is_found(page, tmp_path):
    wide = wr.ReportPage(page.html.replace("<main>", '<main><div style="width: 700px">wide</div>'), (), ())
    desktop, phone = measured(tmp_path, wide)
    assert desktop["overflow"] == 0 < phone["overflow"] and phone["wide"]


def test_page_is_drawn_and_printed(page, tmp_path):
    page.write(tmp_path / "page.html")
    address = (tmp_path / "page.html").as_uri()
    browse("--window-size=1200,900", f"--screenshot={tmp_path / 'page.png'}", address)
    browse("--no-pdf-header-footer", f"--print-to-pdf={tmp_path / 'page.pdf'}", address)
    assert (tmp_path / "page.png").read_bytes().startswith(b"\x89PNG")
    printed = (tmp_path / "page.pdf").read_bytes()
    assert printed.startswith(b"%PDF") and 4 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 20


def test_code_in_names_is_not_executed(tmp_path):
    page = wr.report(evil_run(), accuracy=False)
    assert {found["title"] for found in measured(tmp_path, page)} == {f"Report: {EVIL}"}
