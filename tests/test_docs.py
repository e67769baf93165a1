"""Documentation: links and paths lead somewhere, equations are MathML, every public name is there, the site builds,
its search finds the words of the field, and its pages fit a desktop and a phone."""

import html
import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from urllib.parse import quote

import pytest
import yaml

import wrcore
from tests.conftest import ROOT

PAGES = sorted(
    [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "reports").glob("*.md"), *(ROOT / "docs").rglob("*.md")]
)
THEORY = sorted((ROOT / "docs/theory").glob("*.md"))
LAID_OUT = {
    "guide": ("reports", ".md", {"index", "findings"}),
    "tutorials": ("notebooks", ".ipynb", {"index"}),
    "reference": ("docs/reference", ".md", {"index", "api", "modules", "cli", "files", "names"}),
}
"""Folders of the site that `docs/build.py` fills: from where, and pages that it makes itself."""
FIGURES = (ROOT / "docs/figures.py").read_text("utf-8")
TOOLS = [name for name in ("sphinx", "myst_parser", "furo", "latex2mathml") if not importlib.util.find_spec(name)]
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
NEEDS_BROWSER = pytest.mark.skipif(not BROWSER, reason="no Chromium")
WIDTHS = (1280, 390)
"""Of a desktop and of a phone, CSS px."""

ANSWERS = {
    "Y/Q": ("guide/assessment", "Y/Q the same the same 0.8"),
    "cant deficiency": ("guide/response", "by_deficiency"),
    "Nadal": ("theory/evaluation", "Nadal's limit, which the hard cases are held against, is"),
    "derailment": ("guide/how_runs_end", "a wheelset was more than 50 mm off the track"),
    "conicity": ("theory/evaluation", "the cone with the same L the equivalent conicity"),
    "equivalent conicity": ("theory/evaluation", "so that a wave has the length L"),
    "hunting": ("theory/evaluation", "The linear critical speed is the lowest"),
    "creepage": ("theory/creep", "the wheel's material point moves at"),
    "cant": ("guide/tracks", "lifts the higher rail by the whole cant"),
    "flange": ("theory/contact", "up to three are kept per wheel"),
}
"""Words that a reader searches for: the page of the site that answers, and words of the answer."""

NEEDS_TOOLS = pytest.mark.skipif(bool(TOOLS), reason=f"pip install .[docs]: {', '.join(TOOLS)} not installed")


def relative(path):
    return path.relative_to(ROOT).as_posix()


def prose(path):
    """Text of a page without code blocks."""
    return re.sub(r"^```.*?^```", "", path.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)


def slugs(path):
    """Anchors of a page's headings, as GitHub and the site make them."""
    headings = re.findall(r"^#+ +(.+)$", prose(path), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def lost(page, target):
    """Why a link of a page leads nowhere; empty where it does not."""
    path, _, anchor = target.partition("#")
    place = (page.parent / path) if path else page
    parts = place.resolve().relative_to(ROOT).parts if place.resolve().is_relative_to(ROOT) else ()
    if parts[:2] == ("docs", "theory") and place.suffix == ".png":
        return "" if f"def {place.stem}()" in FIGURES else f"{relative(page)}: {target}: not drawn"
    if parts[:1] == ("docs",) and len(parts) == 3 and parts[1] in LAID_OUT:
        folder, ending, made = LAID_OUT[parts[1]]
        if place.stem in made:
            return ""
        place = ROOT / folder / f"{place.stem}{ending}"
    if not place.exists():
        return f"{relative(page)}: {target}: no such file"
    if anchor and place.suffix == ".md" and anchor not in slugs(place):
        return f"{relative(page)}: {target}: no such heading"
    return ""


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_links_and_images_lead_somewhere(page):
    targets = re.findall(r"\]\(([^)\s]+)\)", prose(page)) + re.findall(r'(?:src|href)="([^"]+)"', prose(page))
    assert [why for target in targets if "://" not in target and (why := lost(page, target))] == []


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_paths_in_code_style_exist(page):
    """But for pattern names such as ``config/vehicles/NAME.yaml``."""
    named = re.findall(
        r"`((?:config|tests|reports|wrcore|workflow|docs|notebooks)/[\w/.*-]+)`", page.read_text("utf-8")
    )
    named = [name for name in named if not re.search(r"NAME|/Q/|/Q\.|\*|^wrcore/examples", name)]
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_links_from_reports_to_theory_survive_on_the_site(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    build, links = importlib.import_module("build"), []
    for page in (ROOT / "reports").glob("*.md"):
        text = page.read_text("utf-8")
        here = re.findall(r"\]\(\.\./docs/(theory/[^)]*)\)", text)
        assert re.findall(r"\]\(\.\./(theory/[^)]*)\)", build.guide_text(text)) == here
        links += here
    assert links and build.guide_text("[how](../docs/theory/a.md) [b](../wrcore/b.py)") == "[how](../theory/a.md) [b]"


def test_a_lost_link_is_found():
    page = ROOT / "docs/index.md"
    assert lost(page, "guide/nothing.md").endswith("no such file") and lost(page, "nothing.md")
    assert not lost(page, "theory/overlap.png") and lost(page, "theory/nothing.png").endswith("not drawn")
    assert lost(page, "theory/creep.md#nothing").endswith("no such heading") and not lost(page, "guide/tracks.md")


def test_equations_have_labels_of_their_own_and_references_lead_to_one():
    text = "\n".join(path.read_text("utf-8") for path in THEORY)
    labels = re.findall(r"^\$\$ \((eq-[\w-]+)\)$", text, re.MULTILINE)
    assert len(labels) == len(set(labels)) > 40
    assert text.count("\n$$\n") == len(labels)  # each block begins with a line of its own and ends with a label
    assert set(re.findall(r"\{eq\}`([^`]+)`", text)) <= set(labels)


def test_numbers_in_the_theory_are_those_of_the_code():
    """Constants that a reader will rely on, each as its page prints it."""
    from wrcore.analysis.to_accuracy import BELIEVED, FINER, SAFETY, TIGHTER
    from wrcore.analysis.wear import wear_laws
    from wrcore.contact.search.geometry import SCAN_STEP
    from wrcore.contact.search.reduction import CURVATURE_FLOOR
    from wrcore.creep.build import A_OVER_B
    from wrcore.creep.kalker import GRID_A_OVER_B
    from wrcore.creep.laws import FASTSIM_GRID
    from wrcore.creep.table import DEFAULT_TOLERANCE
    from wrcore.equations import pace
    from wrcore.forces.drive import GRIP
    from wrcore.forces.kinds import damper, friction
    from wrcore.geometry import irregularity
    from wrcore.geometry.profiles import profile
    from wrcore.integrate import choice, engine, tolerances
    from wrcore.scene.description import load_scene

    scene = load_scene(ROOT / "config/scenes/suspended_wheelset.yaml").data
    damping = scene["contact"]["normal"]["damping"]
    feedback = load_scene(ROOT / "config/scenes/metro_car.yaml").data["integration"]["baumgarte"]
    share, factors = tolerances.SHARE, [*irregularity.VERTICAL.values(), *irregularity.LATERAL.values()]
    spectra = [f"{factor:.3e}".replace("e-0", "e-") for factor in factors]
    printed = {
        "profiles": [
            f"({1e3 * profile.SPACING:g} mm)", f"w = {1e3 * profile.WINDOW:g} mm", f"exceeds {profile.STEEPEST:g} ",
            f"down to {1e3 * profile.GAUGE_DEPTH:g} mm",
        ],
        "contact": [f"({1e3 * SCAN_STEP:g} mm)", f"floor of {CURVATURE_FLOOR} 1/m"],
        "normal": [f"({damping['c_e']} and {damping['v0']} m/s unless stated)"],
        "creep": [
            f"{FASTSIM_GRID} strips of {FASTSIM_GRID} steps", f"a/b ({A_OVER_B[0]:g} to {A_OVER_B[1]:g})",
            f"({DEFAULT_TOLERANCE} of", f"from 1/{1 / GRID_A_OVER_B[0]:g} to {GRID_A_OVER_B[-1]:g} (",
        ],
        "multibody": [
            f"w = {100 * friction.ROUNDING:g} % of L", f"T = {1e3 * friction.GIVING_WAY:g} ms",
            f"rises {damper.STEEPEST_INVERSE:g} times", f"= {GRIP}$ rad/s", f"\\beta = {feedback['alpha']:g}$ 1/s",
        ],
        "evaluation": [
            f"$\\rho$ = {wear_laws.DENSITY:g} kg/m³", f"k = {1e9 * wear_laws._MILD:g}e-9 and",
            f"$q_1$ = {1e-6 * wear_laws._FLAT:g}e6 and $q_2$ = {1e-6 * wear_laws._SEVERE:g}e6",
        ],
        "track": [
            f"{irregularity.CUTOFF_C}$", f"{irregularity.CUTOFF_R}$", f"{irregularity.CUTOFF_S}$ rad/m",
            f"b = {irregularity.HALF_BASE} m", *spectra,
        ],
        "integration": [
            f"${choice.STABLE:g}/", f"{tolerances.LENGTH}\\ \\mathrm m",
            f"\\min({pace.RATE:g},\\ V/{pace.HALF_GAUGE}", f"= {engine.SAFETY}\\,h_n",
            f"{choice.GROWING} steps for their length and {choice.FIRST['rodas5']} more",
            f"{choice.LAST['rodas5']} at most",
            f"less than {choice.WORTH:g} of", f"over {choice.TRIED} steps, after {choice.GROWING} in which",
            f"{choice.FIRST['rk4']} steps after the trial, then {choice.APART['rk4']:g} times as many,",
            f"{choice.LAST['rk4']} at most",
            f"for {choice.GROWING} steps if that costs {choice.HOPELESS:g} times",
            f"If {SAFETY:g} times this error", f"at least d/{BELIEVED[1]:g} and at most d",
            f"1/{FINER[0] ** -1:.2g} and 1/{FINER[1] ** -1:.2g} of",
            f"allowed {share['rodas4']:g} times", f"`rodas4p2` {share['rodas4p2']:g} times",
            f"allowed {share['rodas5']:g} times",
            f"`rk4` {share['rk4']:g} times",
            "a tenth of the first",
        ],
    }  # fmt: skip
    assert share["ros34pw2"] == TIGHTER == 0.1  # in words
    missing = [
        (name, text)
        for name, texts in printed.items()
        for text in texts
        if text not in (ROOT / f"docs/theory/{name}.md").read_text("utf-8")
    ]
    assert missing == []


@NEEDS_TOOLS
@pytest.mark.parametrize("page", THEORY, ids=relative)
def test_equations_become_mathml(page, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    from mathml import to_mathml

    text = page.read_text("utf-8")
    for latex in re.findall(r"^\$\$\n(.*?)\n\$\$", text, re.MULTILINE | re.DOTALL):
        assert to_mathml(latex, block=True).startswith("<math")
    inline = re.sub(r"^\$\$\n.*?\n\$\$.*?$", "", text, flags=re.MULTILINE | re.DOTALL)
    for latex in re.findall(r"\$([^$]+)\$", inline):
        assert to_mathml(latex).startswith("<math")
    with pytest.raises(ValueError, match="no MathML"):
        to_mathml(r"\nosuchcommand")


def test_every_public_name_is_in_the_reference(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    from reference import GROUPS, api_page, groups

    shown = re.findall(r"^\.\. auto\w+:: wrcore\.(\w+)$", api_page(), re.MULTILINE)
    assert sorted(shown) == sorted(wrcore._PUBLIC)
    assert {name for names in GROUPS.values() for name in names} <= set(wrcore._PUBLIC)
    assert sum(map(len, groups().values())) == len(wrcore._PUBLIC)


def test_every_command_and_key_is_in_the_reference(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    from reference import cli_page, files_page

    page = cli_page()
    assert {"simulate", "sweep", "contact", "table build"} <= set(re.findall(r"^## wrcore (.+)$", page, re.MULTILINE))
    assert "| `--threads` `n` | `1` | runs at the same time |" in page
    keys = files_page()
    assert "| `integration.rtol` |" in keys and "| `0.0001` |" in keys and "| `bodies` |" in keys


def test_the_theory_names_every_kind_of_element_and_every_law():
    """Each in a row of a table: kinds of force elements, wear laws; creep laws in headings."""
    from wrcore.analysis.wear.wear_laws import LAWS
    from wrcore.creep.laws import LAWS as CREEP_LAWS
    from wrcore.forces.kinds import KINDS

    rows = {path.stem: re.findall(r"^\| `(\w+)` \|", path.read_text("utf-8"), re.MULTILINE) for path in THEORY}
    schema = yaml.safe_load((ROOT / "wrcore/scene/schemas/wear_law.yaml").read_text("utf-8"))
    assert rows["multibody"] == list(dict.fromkeys(rows["multibody"])) and set(KINDS) <= set(rows["multibody"])
    assert {*LAWS, *schema["properties"]} <= set(rows["evaluation"])
    headings = re.findall(r"^## (\w+)", (ROOT / "docs/theory/creep.md").read_text("utf-8"), re.MULTILINE)
    assert set(CREEP_LAWS) <= set(headings)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Folder of the site, built once."""
    folder = tmp_path_factory.mktemp("docs") / "site"
    paths = os.pathsep.join([str(ROOT), str(ROOT / "workflow"), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, str(ROOT / "docs/build.py"), str(folder)], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": paths}, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


def browse(address, budget):
    """The page as Chromium leaves it after a virtual time (ms), and what it wrote to the console."""
    done = subprocess.run(
        [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files",
         "--enable-logging=stderr", f"--virtual-time-budget={budget}", "--dump-dom", address],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    return done.stdout, [line for line in done.stderr.splitlines() if ":CONSOLE" in line]


def shown_at_widths(pages):
    """What the probe found on each page (Path) at each width, and what was written to the console."""
    asked = quote(json.dumps({"pages": [page.as_uri() for page in pages], "widths": WIDTHS}))
    shown, said = browse(f"{(ROOT / 'tests/docs_probe.html').as_uri()}#{asked}", 1000000)
    found = re.search(r'<body id="found">(.*)</body>', shown, re.DOTALL)
    assert found, shown[-1000:]
    return json.loads(html.unescape(found[1])), said


@NEEDS_TOOLS
def test_the_site_builds_without_a_warning_and_without_a_network(site):
    """Nothing is loaded from elsewhere; search finds words of theory, guides, docstrings and tutorials."""
    pages = {path.relative_to(site).as_posix(): path for path in site.rglob("*.html")}
    assert {"index.html", "guide/tracks.html", "tutorials/creep_table.html", "reference/cli.html"} <= set(pages)
    loaded = [
        (name, url)
        for name, path in pages.items()
        for url in re.findall(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="([^"]+)"', path.read_text("utf-8"))
        if "//" in url
    ]
    assert loaded == []
    assert "SHOW_SEARCH_SUMMARY: false" in (site / "_static/documentation_options.js").read_text("utf-8")
    index = (site / "searchindex.js").read_text("utf-8").lower()
    assert all(word in index for word in ("polach", "baumgart", "simulate_to_accuraci", "clothoid", "conic"))


@NEEDS_TOOLS
@pytest.mark.parametrize("word", ANSWERS)
def test_search_leads_to_an_answer(site, word):
    """The word is an entry of the index, which stands above all other results; its definition links to the answer."""
    index = json.loads(re.search(r"setIndex\((.*)\)", (site / "searchindex.js").read_text("utf-8"), re.DOTALL)[1])
    ((number, anchor, _),) = index["indexentries"][word.lower()]
    assert index["docnames"][number] == "glossary"
    glossary, (page, answer) = (site / "glossary.html").read_text("utf-8"), ANSWERS[word]
    definition = glossary.partition(f'id="{anchor}"')[2].partition("<dd>")[2].partition("</dd>")[0]
    assert f'href="{page}.html' in definition
    text = re.sub(r"<[^>]*>", " ", (site / f"{page}.html").read_text("utf-8"))
    assert answer in re.sub(r"\s+", " ", html.unescape(text))


@NEEDS_TOOLS
@NEEDS_BROWSER
@pytest.mark.parametrize("word", ["Y/Q", "cant deficiency"])
def test_the_search_page_shows_the_word_first(site, word):
    shown, said = browse(f"{(site / 'search.html').as_uri()}?q={quote(word, safe='')}", 10000)
    first = re.search(r'<ul [^>]*class="search">.*?href="([^"]+)"', shown, re.DOTALL)
    assert first and first[1].startswith("glossary.html#term-") and said == []


@NEEDS_TOOLS
@NEEDS_BROWSER
def test_pages_fit_desktop_and_phone(site):
    """Nothing stands out of a page, no formula begins left of its line, all have a size; the console stays empty."""
    pages = sorted(site.rglob("*.html"))
    found, said = shown_at_widths(pages)
    assert said == [] and len(found) == len(WIDTHS) * len(pages)
    assert [at for at in found if at["overflow"] > 0 or at["unseen"] or at["cut"]] == []
    theory = [at["formulas"] for at in found if "/theory/" in at["page"] and "index" not in at["page"]]
    assert len(theory) == len(WIDTHS) * (len(THEORY) - 1) and min(theory) > 0


@NEEDS_BROWSER
def test_a_page_that_does_not_fit_is_found(tmp_path):
    page = tmp_path / "wide.html"
    line = '<div class="equation" style="overflow: auto"><math style="margin-left: -9px"><mi>x</mi></math></div>'
    page.write_text(
        f'<div class="content"><div style="width: 600px">wide</div>{line}<math></math></div><script>no()</script>'
    )
    (desktop, phone), said = shown_at_widths([page])
    assert desktop["overflow"] <= 0 < phone["overflow"] and len(said) == 2 and "no is not defined" in said[0]
    assert [(at["formulas"], at["unseen"], at["cut"]) for at in (desktop, phone)] == [(2, 1, 1)] * 2
