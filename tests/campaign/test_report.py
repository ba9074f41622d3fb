"""The report and a page per test: whole, self-contained, escaped, and alive in a real browser."""

import base64
import hashlib
import html
import html.parser
import re
import shutil
import subprocess
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionlab.analysis.measurement import measure
from frictionlab.campaign import Campaign, evaluate
from frictionlab.campaign.trials import trial_of
from frictionlab.errors import UsageError
from frictionlab.figures.materials import energy, friction
from frictionlab.figures.plates import plates
from frictionlab.hdf5 import write_recording
from frictionlab.inference.compare import compare_record
from frictionlab.report import page
from frictionlab.report.charts import ChartLine, chart
from frictionlab.report.page_of_test import sheet_name, sheet_page, write_sheets
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.simulator import Problem, steady_state
from frictionlab.tables import write_rows
from frictionlab.tables.texts import kinds_of
from frictionlab.uncertainty import Estimate
from frictionlab.verbs.evaluate import evaluate as evaluate_all
from tests.analysis import test_force as cell
from tests.campaign.fabricate import RATIOS, SCENE, row, steady_recording
from tests.desk import invoke

SVG = b'<svg xmlns="http://www.w3.org/2000/svg" width="518pt" height="200pt"></svg>'
EVIL = "<img src=x onerror=document.title='owned'>"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
OPTIONS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--virtual-time-budget=4000"),
)


def page_of(campaign: Campaign) -> str:
    drawn = plates(campaign)
    return page(campaign, drawn, {plate.name: SVG for plate in drawn})


@pytest.fixture(scope="module")
def text(campaign: Campaign) -> str:
    return page_of(campaign)


@pytest.fixture(scope="module")
def evil(scene: Scene) -> Campaign:
    rows = [{**row("steel", 1.5, r, 0.6), "material": EVIL, "source": f"{EVIL}{r}", "warnings": [EVIL]} for r in RATIOS]
    return evaluate([trial_of(r) for r in rows], scene)


class Tags(html.parser.HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.count: Counter[str] = Counter()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.count[tag] += 1
        self.links += [value or "" for key, value in attrs if key in ("src", "href", "srcset", "action", "data")]


def test_nothing_comes_from_outside_and_only_the_pages_own_script_runs(text: str) -> None:
    assert all(link.startswith(("#", "tests/test-", "data:image/svg+xml;base64,")) for link in Tags(text).links)
    assert not re.search("https?:", text)
    (script,) = re.findall(r"<script>(.*?)</script>", text, flags=re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'" in text


def test_the_answer_stands_first_and_every_part_is_there(text: str, campaign: Campaign) -> None:
    parts = ("What is doubtful", "Materials compared", "Figures", "Friction", "Long tests", "Tests", "Failures")
    heads = [*(f"<h2>{material}: " for material in campaign.materials), *(f"<h2>{part}</h2>" for part in parts)]
    places = [text.index(head) for head in (*heads, "<h2>Warnings</h2>", "<h2>What was assumed</h2>")]
    assert places == sorted(places)
    assert "coefficient of friction 0.60" in text
    for material, verdict in ((test.material, test.verdict) for test in campaign.amontons):  # as the screen says it
        assert html.unescape(text).count(verdict.removeprefix(f"{material}: t")) == 1
    assert text.count("<figure") == len(plates(campaign)) + 1  # and all tests in one chart
    beside = friction(campaign).axes[1].containers
    assert len({bars[0].get_marker() for bars in beside}) == len(beside) == len(campaign.materials)
    assert "stiffness_n_per_m = 1191.0" in text[places[-1] :]
    assert "frictionlab 0" in text[places[-1] :]
    assert page_of(campaign) == text, "the same campaign gives the same page"
    assert "th button { display: contents; }" in text.partition("@media print")[2]  # heads stand on each page


def test_one_material_is_not_ranked_and_energies_are_told_once(scene: Scene) -> None:
    rows = [row("steel", 1.5, r, 0.6) for r in RATIOS]
    text = page_of(evaluate([trial_of(one) for one in rows], scene))
    assert "Materials compared" not in text
    assert "energy [kY²]" in text
    joules = page_of(evaluate([trial_of({**one, "energy_per_cycle_j": 1e-3}) for one in rows], scene))
    assert "energy [kY²]" not in joules
    assert re.search(r"energy \[mJ\](?s:.*)>1</td>", joules), "in millijoules, as on the screen and a test's page"


def test_each_test_is_a_point_that_opens_its_page(text: str, campaign: Campaign) -> None:
    assert text.count("<circle") == sum(not trial.failed for trial in campaign.trials)
    for number, trial in enumerate(campaign.trials, 1):
        assert f'<a href="tests/{sheet_name(number, trial)}"' in text
    table = text[text.index('class="sortable"') :]
    assert table[: table.index("</tbody>")].count("<tr") == len(campaign.trials) + 1


def test_what_stood_in_logs_is_escaped(text: str, evil: Campaign) -> None:
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert" in text
    assert Tags(page_of(evil)).count["img"] == len(plates(evil))
    (points,) = friction(evil).axes[0].containers  # under one normal force: a point a test, not one point
    assert points[0].get_xdata() == pytest.approx(RATIOS)


def browser() -> str:
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(f"no browser is there: expected one of {', '.join(BROWSERS)} to look at the page with")
    return found


def seen(page_text: str, script: str, folder: Path) -> str:
    """The page's title after a script has driven it in a real browser, its own policy lifted for that script."""
    open_page = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page_text)
    path = folder / "page.html"
    path.write_text(open_page.replace("</body>", f"<script>{script}</script></body>"), encoding="utf-8")
    line = [browser(), *OPTIONS, f"--user-data-dir={folder / 'profile'}", "--dump-dom", path.as_uri()]
    dom = subprocess.run(line, capture_output=True, text=True, check=True, timeout=100).stdout
    return dom.split("<title>")[1].split("</title>")[0]


DRIVE = """
const rows = () => Array.from(document.querySelectorAll("table.sortable tbody tr"));
const shown = () => rows().filter((r) => !r.hidden);
const column = (n) => shown().map((r) => parseFloat(r.cells[n].dataset.v)).filter(Number.isFinite);
const rises = (list) => list.every((v, i) => i === 0 || list[i - 1] <= v);
const heads = document.querySelectorAll("table.sortable th button");
const out = [];
heads[5].click(); out.push(rises(column(5)) && column(5).length > 9);
heads[5].click(); out.push(rises(column(5).reverse()));
out.push(rows().at(-1).cells[5].dataset.v === undefined);
const words = document.getElementById("filter-words");
words.value = "steel_N1_"; words.dispatchEvent(new Event("input")); out.push(shown().length);
words.value = ""; words.dispatchEvent(new Event("input"));
const material = document.querySelector("select[data-column='2']");
material.value = "rubber"; material.dispatchEvent(new Event("change"));
out.push(shown().length, document.getElementById("filter-count").textContent);
out.push(document.documentElement.scrollWidth <= window.innerWidth);
document.title = out.join(";");
"""


def test_the_table_sorts_and_filters_in_a_browser(text: str, tmp_path: Path) -> None:
    assert seen(text, DRIVE, tmp_path) == "true;true;true;5;16;16 of 49 tests;true"


def test_nothing_of_a_log_runs_in_a_browser(evil: Campaign, tmp_path: Path) -> None:
    assert seen(page_of(evil), "", tmp_path).startswith("Friction of &lt;img")


SAID = st.tuples(st.sampled_from("abcd"), st.sampled_from(["lag: 3 s", "lag: 0.4 s", "no unit", "beats every 1e-3 s"]))


@given(st.lists(SAID))
def test_every_warning_of_every_test_is_in_exactly_one_kind(said: list[tuple[str, str]]) -> None:
    kinds = kinds_of(said)
    numbers = re.compile(r"[\d.e-]+( \.\.\. [\d.e-]+)? s\b( \(and \d+ more such\))?")
    told = {(source, numbers.sub("# s", sentence)) for sentence, sources in kinds for source in sources}
    assert told == {(source, numbers.sub("# s", sentence)) for source, sentence in said}
    assert len(told) == sum(len(sources) for _, sources in kinds)


@pytest.mark.usefixtures("one_format")
def test_a_campaign_tells_a_kind_once_on_screen_and_in_its_report(tmp_path: Path) -> None:
    rows = [
        {**row("steel", 1.0, r, 0.6), "warnings": [f"stops_per_cycle: {r:g} in some cycles", "odd"][: 1 + (r < 0.4)]}
        for r in (0.3, 0.5, 0.7)
    ]
    write_rows(rows, tmp_path / "m.jsonl")
    done = invoke("campaign", tmp_path / "m.jsonl", "-o", tmp_path / "out", status=0)
    shown = done.stdout.splitlines()
    assert shown[0].startswith("material")
    assert not any(line.startswith("by ") for line in shown), "one material is not ranked"
    told = [line for line in done.stderr.splitlines() if "warning (" in line]
    assert told == ["warning (3 tests): stops_per_cycle: 0.3 ... 0.7 in some cycles", "warning (steel_N1_r0.3): odd"]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8").partition('<section id="warnings">')[2]
    assert page.count("in some cycles") == 1
    assert page.count("steel_N1_r0.5") == page.count("steel_N1_r0.7") == 1


def test_a_page_without_a_recording_tells_numbers_and_joules(campaign: Campaign) -> None:
    first, scene, verdicts = campaign.trials[0], campaign.scene, campaign.verdicts
    pages = [sheet_page(trial, scene, verdicts.get(trial.source)) for trial in campaign.trials]
    known = replace(first, energy_joules=Estimate(4.4712e-3, None, 1.9e-5))
    text = sheet_page(known, scene, verdicts[first.source])
    assert "4.471 ± 0.019 mJ" in text, "as the measurement has them: with the stiffness's error"
    assert "mJ" not in pages[0]
    assert "The recording is not at hand" in text
    assert "in the fit of its group" in text
    assert any(">1 standard error<" in one for one in pages)
    assert not any(">1 standard errors<" in one for one in pages)
    assert 'href="../report.html#tests"' in text
    assert "<b>Failed:</b> no drive &amp; &lt;b&gt;nothing" in pages[-1]


def test_energies_are_shown_at_the_lag_found_and_a_gradient_of_both_signs_is_said(tmp_path: Path) -> None:
    """Points stood at the lag declared beside a law at the lag found: -4 % on one page, -23 % in the figure."""
    known: dict[str, object] = {"rig": SCENE["rig"], "sensors": {"lag_s_u": 5e-3}, "model": {"law": "coulomb+place"}}
    scene, rows, truth, late = scene_from_tables(known), [], [], 8e-3
    for number, (beta, gradient) in enumerate(((0.3, 0.06), (0.4, -0.06), (0.5, 0.06))):
        problem = Problem(0.32, beta, law="coulomb+place", parameters={"gradient": gradient})
        facts = {"material": "brass", "normal_force_n": 1.5 * beta / 0.3}
        seen = steady_recording(problem, late=late).changed(experiment=facts)
        write_recording(seen, tmp_path / f"{number}.h5")
        rows.append({**measure(seen, scene).row(), "source": str(tmp_path / f"{number}.h5")})
        truth.append(steady_state(problem).energy_per_cycle)
    campaign = evaluate_all(rows, scene, folders=[tmp_path])
    write_sheets(campaign, tmp_path / "tests")
    shown = [campaign.verdicts[str(r["source"])].energy.value for r in rows]
    assert shown == pytest.approx(truth, rel=0.01)
    assert shown == pytest.approx([test["measured_energy_per_cycle"] for test in campaign.left_out], rel=1e-9)
    for one in campaign.tables["measurements.csv"]:  # at the lag declared: a prediction beside it is as sensors show it
        ratio = float(str(one["energy_per_cycle"])) / float(str(one["predicted_energy_per_cycle"]))
        assert ratio - 1.0 == pytest.approx(one["energy_residual"], abs=1e-12)
    assert abs(float(str(rows[0]["energy_per_cycle"])) / (truth[0] or 0.0) - 1.0) > 0.1
    assert any("the gradient changes its sign from test to test (-0.06" in note for note in campaign.notes)
    assert "measured, at the lag found (+7.99 ms" in next((tmp_path / "tests").glob("*-0001-*")).read_text("utf-8")
    assert "at the lag found (+7.99 ms" in energy(campaign, "brass").axes[0].get_title(loc="left")


def test_what_stood_in_a_log_is_escaped_on_its_page(scene: Scene) -> None:
    facts = {"material": EVIL, "source": f"{EVIL}\x1b[31m.h5", "warnings": [f"\x9b {EVIL}"]}
    trial = trial_of({**row("steel", 1.5, 0.5, 0.6), **facts})
    text = sheet_page(trial, scene)
    assert not set("\x1b\x9b") & set(text + page_of(evaluate([trial], scene)))  # a terminal that shows it would obey
    assert "<img" not in text
    assert text.count("&lt;img") >= 5
    assert "default-src 'none'" in text
    assert sheet_name(3, trial).replace("-", "").replace(".", "").replace("_", "").isalnum()


def test_a_page_replaces_its_own_kind_alone(scene: Scene, tmp_path: Path) -> None:
    campaign = evaluate([trial_of(row("steel", 1.5, 0.5, 0.6))], scene)
    for _ in range(2):
        write_sheets(campaign, tmp_path)
    (page,) = tmp_path.iterdir()
    page.write_text("mine")
    with pytest.raises(OSError, match=page.name):
        write_sheets(campaign, tmp_path)


def test_a_chart_shows_its_lines_between_round_ticks() -> None:
    x = np.linspace(0.0, 1.0, 5001)
    text = chart([ChartLine(x, 10.0 * x - 5.0, "a < b")], "time [s]", "x & y")
    assert "a &lt; b" in text
    assert "x &amp; y" in text
    for tick in (">0.2<", ">0.8<", ">\N{MINUS SIGN}4<", ">4<"):
        assert tick in text
    assert text.count("L") < 2000
    assert chart([ChartLine(x, np.full_like(x, np.nan), "nothing")], "x", "y") == ""
    assert "NaN" not in chart([ChartLine(x, np.zeros_like(x), "level")], "x", "y")


def test_the_recording_is_drawn(scene: Scene) -> None:
    recording = steady_recording()
    measured = measure(recording, scene)
    trial = trial_of({**measured.row(), "material": "steel", "normal_force_n": 1.5})
    verdict = evaluate([trial], scene).verdicts[trial.source]
    text = sheet_page(trial, scene, verdict, measurement=measured)
    assert text.count("<svg") == 5
    for words in (
        "Time response",
        "Loop",
        "Force over displacement",
        "Force over speed",
        "Cycles",
        "friction force [N]",
    ):
        assert words in text


def test_the_page_of_a_vibrometers_test_shows_its_displacement() -> None:
    """It ended the whole campaign: no table, no report, and no test was named."""
    seen, facts = cell.recording(cell.channels_of(0.4, 0.3), "mass_velocity", "base_displacement"), cell.scene()
    measured = measure(seen, facts)
    trial = trial_of({**measured.row(), "source": "vibro.h5"})
    assert sheet_page(trial, facts, measurement=measured).count("<svg") > 4
    with pytest.raises(UsageError, match=r"whole record .* needs displacements, .* the recording has no mass_displace"):
        compare_record(seen, facts)
