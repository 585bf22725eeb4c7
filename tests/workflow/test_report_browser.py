"""The report in a real browser: chromium opens the file, plays the film, sorts the runs."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator

import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

from sandmould.report.page import write_report
from sandmould.study.collect import collect
from tests.unit.report_study import write_study

pytestmark = pytest.mark.browser

_FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--window-size=1100,900",
)  # fmt: skip
_DISTINCT = """
const canvas = document.getElementById('film-canvas');
const pixels = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
const seen = new Map();
for (let i = 0; i < pixels.length; i += 4) {
  const colour = pixels[i] + ',' + pixels[i + 1] + ',' + pixels[i + 2];
  seen.set(colour, (seen.get(colour) || 0) + 1);
}
return [...seen].filter(([, n]) => n > 200).map(([c]) => c);
"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[webdriver.Chrome]:
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        said = "chromium and chromium-driver are not installed"
        if os.environ.get("CI"):
            pytest.fail(said)
        pytest.skip(said)
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for flag in (*_FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('chromium')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    with webdriver.Chrome(options, webdriver.ChromeService(driver)) as opened:
        yield opened


@pytest.fixture(scope="module", params=[2, 3])
def page(
    request: pytest.FixtureRequest,
    browser: webdriver.Chrome,
    tmp_path_factory: pytest.TempPathFactory,
) -> webdriver.Chrome:
    study = write_study(
        tmp_path_factory.mktemp("results") / "tube", dimension=request.param, count=16
    )
    collect(study)
    write_report(study, study / "report.html")
    browser.get((study / "report.html").as_uri())
    wait(lambda: text(browser, "film-time") != "")
    return browser


def wait(holds: Callable[[], bool], longest_s: float = 5.0) -> None:
    end = time.monotonic() + longest_s
    while not holds():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.02)


def text(page: webdriver.Chrome, name: str) -> str:
    return page.find_element(By.ID, name).text


def slider(page: webdriver.Chrome) -> int:
    return int(page.find_element(By.ID, "film-slider").get_property("value"))


def slide(page: webdriver.Chrome, value: int) -> None:
    page.execute_script(
        "const s = document.getElementById('film-slider'); s.value = arguments[0];"
        "s.dispatchEvent(new Event('input'));",
        value,
    )


def test_opens_without_errors_or_requests(page: webdriver.Chrome) -> None:
    assert [e for e in page.get_log("browser") if e["level"] == "SEVERE"] == []
    asked = [
        e["message"] for e in page.get_log("performance") if 'requestWillBeSent"' in e["message"]
    ]
    assert not [m for m in asked if '"url":"http' in m]
    assert page.find_element(By.CSS_SELECTOR, ".verdict .first").is_displayed()
    broken = "return [...document.images].filter((i) => !i.complete || !i.naturalWidth).length"
    assert page.execute_script(broken) == 0


def test_canvas_shows_the_layers_and_the_tube(page: webdriver.Chrome) -> None:
    slide(page, 15)
    colours = page.execute_script(_DISTINCT)
    assert "230,159,0" in colours
    assert "86,180,233" in colours
    assert "204,204,204" in colours


def test_play_advances_and_pause_stops(page: webdriver.Chrome) -> None:
    slide(page, 0)
    # watched in the page: the film is over before a busy machine has asked from outside
    playing, stopped, at, later = page.execute_async_script(
        """
        const done = arguments[0], byId = (id) => document.getElementById(id);
        const button = byId("film-play"), slider = byId("film-slider");
        button.click();
        const playing = button.textContent;
        const look = setInterval(() => {
          if (Number(slider.value) < 2) return;
          clearInterval(look);
          button.click();
          const stopped = button.textContent, at = slider.value;
          setTimeout(() => done([playing, stopped, at, slider.value]), 200);
        }, 5);
        """
    )
    assert (playing, stopped) == ("Pause", "Play")
    assert later == at


def test_film_stops_at_its_end_and_starts_again(page: webdriver.Chrome) -> None:
    slide(page, 14)
    button = page.find_element(By.ID, "film-play")
    button.click()
    wait(lambda: button.text == "Play")
    assert slider(page) == 15
    button.click()
    wait(lambda: 0 < slider(page) < 15)
    button.click()


def test_slider_sets_the_time(page: webdriver.Chrome) -> None:
    slide(page, 0)
    assert text(page, "film-time").startswith("filling, 0.00 s")
    slide(page, 15)
    assert text(page, "film-time").startswith("vibration, 2.00 of 2.00 s · fill of the tube 0.5")


def test_run_selector_switches_at_the_same_moment(page: webdriver.Chrome) -> None:
    slide(page, 15)
    choice = Select(page.find_element(By.ID, "film-run"))
    assert [o.text for o in choice.options] == ["best: 50 Hz", "median: 100 Hz", "worst: 25 Hz"]
    choice.select_by_visible_text("worst: 25 Hz")
    wait(
        lambda: (
            "fill of the tube 0.2" in text(page, "film-time") or "0.3" in text(page, "film-time")
        )
    )
    assert slider(page) == 15
    choice.select_by_visible_text("best: 50 Hz")
    wait(lambda: "0.5" in text(page, "film-time"))


def test_headings_sort_the_runs(page: webdriver.Chrome) -> None:
    def column(place: int) -> list[str]:
        cells = page.find_elements(By.CSS_SELECTOR, f"table.sortable td:nth-child({place})")
        return [cell.text for cell in cells]

    heads = page.find_elements(By.CSS_SELECTOR, "table.sortable th")
    fill = next(n for n, head in enumerate(heads, 1) if head.text == "fill of the tube")
    for way in ("ascending", "descending"):
        heads[fill - 1].find_element(By.TAG_NAME, "button").click()
        assert heads[fill - 1].get_attribute("aria-sort") == way
        values = column(fill)
        # the failed run has no value and stays last
        assert values[-1] == "–"
        assert values[:-1] == sorted(values[:-1], reverse=way == "descending")
    heads[0].find_element(By.TAG_NAME, "button").click()
    assert column(1) == sorted(column(1))


def test_cut_shows_more_grains_when_closed(page: webdriver.Chrome) -> None:
    cuts = page.find_elements(By.ID, "film-cut")
    if not cuts:  # discs are not cut open
        return
    before = page.execute_script("return document.getElementById('film-canvas').toDataURL()")
    cuts[0].click()
    after = page.execute_script("return document.getElementById('film-canvas').toDataURL()")
    cuts[0].click()
    assert before != after


def test_phone_shows_no_part_beside_the_page(page: webdriver.Chrome) -> None:
    page.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": 390, "height": 800, "deviceScaleFactor": 2, "mobile": True},
    )
    assert page.execute_script("return document.documentElement.scrollWidth") <= 390
    shown = (
        "return [...document.querySelectorAll(arguments[0])].filter((e) => e.clientWidth).length"
    )
    assert page.execute_script(shown, "svg.narrow") > 0
    assert page.execute_script(shown, "svg.wide") == 0
    wait(lambda: page.execute_script("return document.getElementById('film-canvas').width") < 800)
    page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_no_error_came_up_on_the_way(page: webdriver.Chrome) -> None:
    assert [e for e in page.get_log("browser") if e["level"] == "SEVERE"] == []
