"""The report pages in a real browser: nothing breaks or is fetched; mouse, keyboard, screen reader and printer get what they need."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from pages import HOSTILE, small_campaign, write_benchmark_page, write_diagnosis_page

pytestmark = pytest.mark.slow
LIMIT = 3_000_000  # bytes of a page
WIDTHS = (375, 820, 1400)


@pytest.fixture(scope="module")
def benchmark(tmp_path_factory):
    return write_benchmark_page(tmp_path_factory.mktemp("pages") / "benchmark.html")


@pytest.fixture(scope="module")
def diagnosis(tmp_path_factory):
    return write_diagnosis_page(tmp_path_factory.mktemp("pages") / "diagnosis.html")


@pytest.fixture(params=["benchmark", "diagnosis"])
def page_file(request):
    return request.getfixturevalue(request.param)


def test_a_page_is_small_and_whole(page_file, visit):
    assert page_file.stat().st_size < LIMIT
    page = visit(page_file)
    assert page.locator("html[data-ready=yes]").count() == 1
    assert page.locator("h1").inner_text() == page.title()


@pytest.mark.parametrize("width", WIDTHS)
def test_a_page_never_scrolls_sideways_as_a_whole(page_file, visit, width):
    page = visit(page_file, viewport={"width": width, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(("width", "scheme"), [(375, "light"), (1400, "dark")])
def test_a_page_has_no_barrier_that_axe_finds(page_file, visit, scheme, width):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed: pip install 'nnhydro[web]'")
    page = visit(page_file, color_scheme=scheme, viewport={"width": width, "height": 900})
    found = axe.Axe().run(page)
    told = [f"{v['id']}: {v['help']}: {v['nodes'][0]['html'][:200]}" for v in found.response["violations"]]
    assert told == []


def test_the_theme_follows_the_system_until_the_button_is_pressed(benchmark, visit):
    def ink(page):
        return page.evaluate("getComputedStyle(document.body).backgroundColor")

    dark = visit(benchmark, color_scheme="dark")
    assert ink(dark) == "rgb(21, 24, 28)"
    dark.locator("#theme").click()
    assert ink(dark) == "rgb(255, 255, 255)"
    assert dark.locator("#theme").inner_text() == "Dark"


def test_a_switch_hides_its_model_in_every_picture(benchmark, visit):
    page = visit(benchmark)
    lines = page.locator("svg.history [data-series=textbook]")
    assert lines.count() > 10
    box = page.locator(".switches input[value=textbook]")
    for checked in (not box.is_checked(), box.is_checked()):
        box.click()
        assert page.locator("svg.history [data-series=textbook].off").count() == (0 if checked else lines.count())
    assert page.locator("svg.history [data-series=measured].off").count() == 0


def test_a_cell_under_the_mouse_names_its_recordings_and_leads_to_their_curves(diagnosis, visit):
    page = visit(diagnosis)
    assert page.locator("#map-joint").input_value() == "2", "the map opens at the joint where the residual lies"
    page.locator("#map-over").select_option("when")
    cell = page.locator(".map:not([hidden]) tbody td[data-rows]").first
    cell.hover()
    told = page.locator("#cell")
    assert "N m rms" in told.inner_text()
    assert f"{cell.get_attribute('data-rows')} rows" in told.inner_text()
    name = page.locator(".map:not([hidden]) tbody th").first.inner_text()
    button = told.locator("button").first
    assert button.inner_text() == f"{name} (100 %)"
    button.click()
    assert page.locator(".run:not([hidden])").get_attribute("data-recording") == name
    assert page.locator("#recording").evaluate("e => e.selectedOptions[0].textContent") == name


def test_every_map_can_be_chosen_and_only_one_is_shown(diagnosis, visit):
    page = visit(diagnosis)
    seen = set()
    for joint in page.locator("#map-joint option").all_inner_texts():
        page.locator("#map-joint").select_option(joint)
        for over in page.locator("#map-over option:not([disabled])").all_inner_texts():
            page.locator("#map-over").select_option(over)
            for model in page.locator("#map-model option").all_inner_texts():
                page.locator("#map-model").select_option(model)
                shown = page.locator(".map:not([hidden])")
                assert shown.count() == 1
                seen.add(shown.get_attribute("data-key"))
    assert len(seen) == page.locator(".map").count() == 2 * 4 * 2


def test_the_keyboard_alone_reaches_a_cell_its_recordings_and_their_curves(diagnosis, visit):
    page = visit(diagnosis)
    page.locator("#map-model").focus()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.tagName") == "TD"
    for _ in range(4):
        page.keyboard.press("ArrowDown")
        page.keyboard.press("ArrowRight")
    at = page.evaluate("[document.activeElement.cellIndex, document.activeElement.parentElement.rowIndex]")
    assert at == [5, 6]  # the fifth column and row of cells; heading rows and columns count
    assert page.locator("#cell").inner_text().startswith("q2_rad")
    for key in ("ArrowLeft", "ArrowUp") * 5:  # on to a cell that holds rows
        if page.locator("#cell button").count():
            break
        page.keyboard.press(key)
    page.keyboard.press("Enter")
    name = page.evaluate("document.activeElement.dataset.visit")
    page.keyboard.press("Enter")
    assert page.locator(".run:not([hidden])").get_attribute("data-recording") == name
    assert page.evaluate("document.activeElement.id") == "recording"


def test_the_values_read_under_the_cursor_are_those_of_the_recording(benchmark, visit):
    page = visit(benchmark)
    run = small_campaign("test arm").load("run2")
    page.locator("#recording").select_option("run2")
    picture = page.locator(".run:not([hidden]) svg.history")
    picture.focus()
    for _ in range(70):
        page.keyboard.press("ArrowRight")
    told = page.locator(".run:not([hidden]) .read").inner_text()
    time = float(told.split(" s;")[0])
    assert 1.0 < time < 3.0
    for joint in (1, 2):
        value = float(told.split(f"torque {joint} [N m]:")[1].split("measured ")[1].split(",")[0])
        near = abs(run.t - time) < 0.03
        span = run.tau[:, joint - 1].max() - run.tau[:, joint - 1].min()
        assert run.tau[near, joint - 1].min() - 0.02 * span < value < run.tau[near, joint - 1].max() + 0.02 * span


def test_a_value_between_two_corners_lies_between_them_and_one_beyond_its_panel_says_so(benchmark, visit):
    page = visit(benchmark)
    read = page.evaluate("""() => {
        const svg = document.querySelector(".run:not([hidden]) svg.history");
        const [, left, , , , bottom, top] = JSON.parse(svg.dataset.panels)[0];
        const path = svg.querySelector("[data-curve='0'][data-series=measured] path");
        path.setAttribute("d", `M${left} ${bottom}l60 ${top - bottom}M${left + 80} ${bottom}l20 0 20 30`);
        return [30, 70, 90, 115].map((step) => {
            svg.cursorAt = left + step - 6;
            svg.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
            const text = document.querySelector(".run:not([hidden]) .read").textContent;
            return text.split("measured ")[1].split(",")[0];
        });
    }""")
    low, high = page.evaluate("JSON.parse(document.querySelector('.run:not([hidden]) svg.history').dataset.panels)[0].slice(-2)")
    assert float(read[0]) == pytest.approx((low + high) / 2, abs=0.01 * (high - low))
    assert read[1] == "none", "between two lines"
    assert float(read[2]) == pytest.approx(low, rel=0.01)
    assert read[3].startswith("< ")


def test_previous_and_next_go_round_all_recordings(benchmark, visit):
    page = visit(benchmark)
    count = page.locator(".run").count()
    seen = []
    for _ in range(count):
        seen.append(page.locator(".run:not([hidden]) figcaption b").inner_text())
        page.locator("#after").click()
    assert len(set(seen)) == count
    assert page.locator(".run:not([hidden]) figcaption b").inner_text() == seen[0]
    page.locator("#before").click()
    assert page.locator(".run:not([hidden]) figcaption b").inner_text() == seen[-1]
    assert any("steady" not in label and "towing speed" in label for label in seen), "steady runs are drawn against what they vary"


def test_names_from_files_stay_text(diagnosis, visit):
    page = visit(diagnosis)
    assert HOSTILE in page.title()
    assert "<img src=x onerror=alert(1)>" in page.locator("#recording option").all_inner_texts()
    assert page.locator("main img, main script").count() == 0


def test_on_paper_controls_are_gone_and_numbers_are_there(page_file, visit, tmp_path):
    page = visit(page_file, color_scheme="dark")
    page.emulate_media(media="print")
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert not page.locator("#theme, .controls, .detail").locator("visible=true").count()
    assert page.locator("details table").first.is_visible(), "what is folded on the screen is open on paper"
    printed = [key.split("|") for key in page.locator(".map").locator("visible=true").evaluate_all("all => all.map(e => e.dataset.key)")]
    assert {joint for joint, _, _ in printed} == {"1", "2"}, "no selector works on paper: the first map of every joint and model is there"
    assert {m for _, _, m in printed} == set(page.locator("#map-model option").all_text_contents())
    page.pdf(path=tmp_path / "page.pdf", format="A4")
    assert (tmp_path / "page.pdf").stat().st_size > 10_000


def test_without_javascript_everything_is_there(diagnosis, visit):
    page = visit(diagnosis, java_script_enabled=False)
    assert page.locator(".run").locator("visible=true").count() == page.locator(".run").count()
    assert page.locator(".map").locator("visible=true").count() == page.locator(".map").count()
    assert not page.locator(".controls").locator("visible=true").count()


def test_a_healthy_campaign_gets_a_page_that_says_so(visit, tmp_path):
    page = visit(write_diagnosis_page(tmp_path / "healthy.html", findings=[], detected=False))
    assert "No effect is named." in page.locator("main").inner_text()
    assert "No residual beyond noise." in page.locator("main").inner_text()
