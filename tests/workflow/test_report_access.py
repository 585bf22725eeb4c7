"""Anybody can read a report: by keyboard, in any colours, on a phone, on paper, without motion."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import WebDriverWait

from sandmould.drawing import figures
from sandmould.report.page import write_report
from sandmould.report.scene_page import draw_scene_file
from sandmould.scenario.fill import Fill, Layer
from sandmould.scenario.sand import Sand
from sandmould.study.collect import collect
from tests.unit.report_study import scenario, write_study

pytestmark = pytest.mark.browser

DESKTOP, PHONE = (1280, 900), (390, 800)
CONTROLS = "a[href], button, select, input, summary, [tabindex='0']"
"""What a person can do something with."""
LEAST_CONTRAST = 4.5
"""Of text, by level AA of the WCAG."""
CONTRAST = """
const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
function rgba(css) {
  canvas.clearRect(0, 0, 1, 1);
  canvas.fillStyle = css;
  canvas.fillRect(0, 0, 1, 1);
  const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
  return [r, g, b, a / 255];
}
const over = (top, below) => [0, 1, 2].map((i) => top[3] * top[i] + (1 - top[3]) * below[i]);
function behind(element) {
  const layers = [];
  for (let at = element; at; at = at.parentElement) {
    layers.push(rgba(getComputedStyle(at).backgroundColor));
    if (layers.at(-1)[3] === 1) break;
  }
  const page = rgba(getComputedStyle(document.body).backgroundColor).slice(0, 3);
  return layers.reverse().reduce((below, layer) => over(layer, below), page);
}
function luminance(rgb) {
  const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  const [r, g, b] = rgb.map((v) => linear(v / 255));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}
function opacity(element) {
  return element ? Number(getComputedStyle(element).opacity) * opacity(element.parentElement) : 1;
}
const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
for (let node = walker.nextNode(); node; node = walker.nextNode()) {
  const element = node.parentElement;
  if (!node.data.trim() || element.closest("script, style, title, option")) continue;
  if (!element.checkVisibility({ visibilityProperty: true })) continue;
  const style = getComputedStyle(element), below = behind(element);
  const colour = rgba(element instanceof SVGElement ? style.fill : style.color);
  colour[3] *= opacity(element);
  const [dark, light] = [luminance(over(colour, below)), luminance(below)].sort((a, b) => a - b);
  found.push([node.data.trim().slice(0, 40), (light + 0.05) / (dark + 0.05)]);
}
return found;
"""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six settings, of which two cannot be told apart, and a run that failed."""
    planted = {25.0: 0.30, 35.0: 0.46, 50.0: 0.55, 70.0: 0.552, 100.0: 0.40, 140.0: 0.31}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "_PANEL_PX", 120)
        study = write_study(
            tmp_path_factory.mktemp("results") / "tube", planted, grains=60, count=8
        )
        collect(study)
        write_report(study, study / "report.html")
    return study / "report.html"


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene in 3D before anything runs."""
    few = scenario(50.0, 3).model_copy(
        update={"fill": Fill(layers=(Layer(count=60, repeat=2),)), "sand": Sand(size_scale=16)}
    )
    path = tmp_path_factory.mktemp("scene") / "scene.html"
    draw_scene_file(few, "A tube", "base", path)
    return path


@pytest.fixture
def opened(browser: webdriver.Chrome, report: Path) -> Iterator[webdriver.Chrome]:
    """The report at a desktop's width."""
    resize(browser, *DESKTOP)
    browser.get(report.as_uri())
    WebDriverWait(browser, 5).until(lambda page: page.find_element(By.ID, "film-time").text)
    yield browser
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.fixture
def opened_scene(opened: webdriver.Chrome, scene: Path) -> webdriver.Chrome:
    opened.get(scene.as_uri())
    WebDriverWait(opened, 5).until(lambda page: page.find_element(By.ID, "film-look").text)
    return opened


def resize(browser: webdriver.Chrome, width: int, height: int) -> None:
    browser.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500},
    )


def emulate(browser: webdriver.Chrome, **features: str) -> None:
    listed = [{"name": name.replace("_", "-"), "value": value} for name, value in features.items()]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": listed})


def unreached_by_tab(page: webdriver.Chrome) -> tuple[list[str], list[str]]:
    """Controls that Tab does not reach, and those that do not show that they have the focus."""
    page.execute_script(
        """
        const all = [...document.querySelectorAll(arguments[0])].filter(
          (e) => e.checkVisibility({ contentVisibilityAuto: true }) && !e.disabled);
        window.reached = new Set(); window.hidden = []; window.wanted = all;
        document.addEventListener("focusin", (event) => {
          const it = event.target, style = getComputedStyle(it);
          window.reached.add(it);
          if (style.outlineStyle === "none" || parseFloat(style.outlineWidth) < 1)
            window.hidden.push(it.outerHTML.slice(0, 80));
        });
        """,
        CONTROLS,
    )
    count = int(page.execute_script("return window.wanted.length"))
    assert count > 5
    ActionChains(page).send_keys(*[Keys.TAB] * (count + 3)).perform()
    unreached, unseen = page.execute_script(
        "return [window.wanted.filter((e) => !window.reached.has(e)).map((e) => "
        "e.outerHTML.slice(0, 80)), window.hidden]"
    )
    return unreached, unseen


def low_contrast(page: webdriver.Chrome) -> list[Any]:
    found = page.execute_script(CONTRAST)
    assert len(found) > 20
    return [it for it in found if it[1] < LEAST_CONTRAST]


def open_all(page: webdriver.Chrome) -> None:
    page.execute_script("document.querySelectorAll('details').forEach((d) => (d.open = true))")


def test_every_control_is_reached_by_tab_and_shows_it(opened: webdriver.Chrome) -> None:
    open_all(opened)
    assert unreached_by_tab(opened) == ([], [])


def test_every_control_of_a_scene_is_reached_by_tab(opened_scene: webdriver.Chrome) -> None:
    assert unreached_by_tab(opened_scene) == ([], [])


def test_tables_and_films_are_worked_by_keys(opened: webdriver.Chrome) -> None:
    opened.find_element(By.CSS_SELECTOR, "#runs-table summary").send_keys(Keys.ENTER)
    assert opened.execute_script("return document.getElementById('runs-table').open")
    head = opened.find_element(By.CSS_SELECTOR, "#runs-table th")
    head.find_element(By.TAG_NAME, "button").send_keys(Keys.ENTER)
    assert head.get_attribute("aria-sort") == "ascending"
    frame = opened.find_element(By.CSS_SELECTOR, "#runs-table .scroll")
    resize(opened, *PHONE)
    frame.send_keys(Keys.ARROW_RIGHT * 3)
    assert opened.execute_async_script(
        "const [frame, done] = arguments;"
        "setTimeout(() => done(frame.scrollLeft > 0), 300);", frame,
    )  # fmt: skip
    slider = opened.find_element(By.ID, "film-slider")
    before = int(str(slider.get_property("value")))
    slider.send_keys(Keys.ARROW_RIGHT)
    assert int(str(slider.get_property("value"))) == before + 1


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out_from_what_is_behind_it(opened: webdriver.Chrome, scheme: str) -> None:
    open_all(opened)
    emulate(opened, prefers_color_scheme=scheme)
    assert low_contrast(opened) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_of_a_scene_stands_out(opened_scene: webdriver.Chrome, scheme: str) -> None:
    emulate(opened_scene, prefers_color_scheme=scheme)
    assert low_contrast(opened_scene) == []


@pytest.mark.parametrize("page", ["opened", "opened_scene"])
def test_pictures_charts_and_films_say_what_they_show(
    page: str, request: pytest.FixtureRequest
) -> None:
    browser = request.getfixturevalue(page)
    shown = browser.find_elements(By.CSS_SELECTOR, "img, svg, canvas")
    named = [(it.get_attribute("role"), it.accessible_name) for it in shown if it.is_displayed()]
    assert len(named) >= 2
    assert [it for it in named if len(it[1]) < 20] == []
    charts = browser.find_elements(By.CSS_SELECTOR, "svg.chart")
    assert {it.get_attribute("role") for it in charts} <= {"img"}


def test_nothing_moves_by_itself(opened: webdriver.Chrome) -> None:
    emulate(opened, prefers_reduced_motion="reduce")
    opened.refresh()
    moved = opened.execute_async_script(
        """
        const done = arguments[0], slider = document.getElementById("film-slider");
        const before = slider.value;
        setTimeout(() => done([slider.value !== before, document.getAnimations().length]), 700);
        """
    )
    assert moved == [False, 0]


@pytest.mark.parametrize("page", ["opened", "opened_scene"])
@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_no_part_lies_beside_the_page(
    page: str, size: tuple[int, int], request: pytest.FixtureRequest
) -> None:
    browser = request.getfixturevalue(page)
    open_all(browser)
    resize(browser, *size)
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    assert browser.execute_script("return document.documentElement.scrollWidth") <= size[0]


def test_the_summary_prints_on_one_page(opened: webdriver.Chrome) -> None:
    """Answer, chart and next steps; the rest begins on the next page."""
    opened.execute_script(
        "const style = document.createElement('style');"
        "style.textContent = 'main > :not(#findings) { display: none !important; }';"
        "document.head.append(style);"
    )
    shown = opened.find_element(By.ID, "findings").text
    assert "What to do next" in shown
    assert opened.find_element(By.CSS_SELECTOR, "#findings svg").is_displayed()
    assert pages(opened) == 1
    opened.execute_script("document.querySelector('head style:last-child').remove()")
    assert pages(opened) > 2


def pages(browser: webdriver.Chrome) -> int:
    """Pages of A4 paper that a browser prints."""
    asked = {"paperWidth": 8.27, "paperHeight": 11.69}
    printed = browser.execute_cdp_cmd("Page.printToPDF", asked)
    return base64.b64decode(printed["data"]).count(b"/Type /Page\n")
