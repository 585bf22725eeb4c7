"""The report in a real browser: chromium opens the file, plays films, turns spheres, sorts runs."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlparse
from urllib.request import url2pathname

import numpy as np
import pytest
from PIL import Image
from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.wheel_input import ScrollOrigin
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

from sandmould.drawing import figures, sphere_film
from sandmould.report.page import write_report
from sandmould.report.scene_page import draw_scene_file
from sandmould.scenario.fill import Fill, Layer
from sandmould.scenario.sand import Sand
from sandmould.study.collect import collect
from tests.unit.report_study import scenario, write_study

pytestmark = pytest.mark.browser

NO_WEBGL = """
const real = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind === "webgl2" ? null : real.call(this, kind, ...rest);
};
"""
LAYERS = {"orange": (230, 159, 0), "blue": (86, 180, 233), "green": (0, 158, 115)}
"""Colours of the first layers."""


@pytest.fixture(scope="module", params=[2, 3])
def page(
    request: pytest.FixtureRequest,
    browser: webdriver.Chrome,
    tmp_path_factory: pytest.TempPathFactory,
) -> webdriver.Chrome:
    report = written(tmp_path_factory.mktemp("results"), request.param)
    return opened_page(browser, report)


@pytest.fixture(scope="module")
def spheres(
    browser: webdriver.Chrome, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[webdriver.Chrome]:
    """A report with more spheres than it holds: a part of them lies beside it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sphere_film, "MOST_INSIDE", 120)
        patch.setattr(figures, "_PANEL_PX", 200)
        yield opened_page(browser, written(tmp_path_factory.mktemp("results"), 3))


def written(results: Path, dimension: int) -> Path:
    """Report of a small study."""
    study = write_study(results / "tube", dimension=dimension, count=16)
    collect(study)
    write_report(study, study / "report.html")
    return study / "report.html"


def opened_page(browser: webdriver.Chrome, file: Path) -> webdriver.Chrome:
    browser.get(file.as_uri())
    wait(lambda: text(browser, "film-time") != "")
    return browser


def picture(page: webdriver.Chrome) -> np.ndarray:
    """Pixels of the canvas as they are on the screen, (rows, columns, 3)."""
    canvas = page.find_element(By.ID, "film-canvas")
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", canvas)
    # two pictures of the screen later what was asked for is drawn
    page.execute_async_script(
        "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done));"
    )
    shot = Image.open(io.BytesIO(canvas.screenshot_as_png)).convert("RGB")
    return np.asarray(shot, dtype=np.float64)


def share(pixels: np.ndarray, rgb: tuple[int, int, int]) -> float:
    """Part of a picture whose pixels have a colour, in light or in shadow."""
    length = np.linalg.norm(pixels, axis=2) + 1e-9
    alike = pixels @ np.array(rgb) / length / np.linalg.norm(rgb)
    return float(((alike > 0.995) & (length > 40)).mean())


def choose(page: webdriver.Chrome, name: str, value: str) -> None:
    Select(page.find_element(By.ID, name)).select_by_value(value)


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


def test_canvas_shows_the_layers(page: webdriver.Chrome) -> None:
    slide(page, 15)
    seen = picture(page)
    assert all(share(seen, LAYERS[name]) > 0.02 for name in ("orange", "blue"))


def test_films_are_no_higher_than_most_of_the_window(page: webdriver.Chrome) -> None:
    """Of a window that is low and broad, and of one that is tall."""
    for width, height in ((1100, 420), (700, 900)):
        page.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
        )
        wait(lambda: page.execute_script("return innerHeight") == height)  # noqa: B023
        high = "return document.getElementById('film-canvas').getBoundingClientRect().height"
        wait(lambda: page.execute_script(high) <= 0.7 * height)  # noqa: B023
        assert page.execute_script(high) > 0.3 * height
    page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


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
    assert [o.text for o in choice.options] == [
        "best setting: 50 Hz",
        "median: 100 Hz",
        "lowest: 25 Hz",
    ]
    choice.select_by_visible_text("lowest: 25 Hz")
    wait(
        lambda: (
            "fill of the tube 0.2" in text(page, "film-time") or "0.3" in text(page, "film-time")
        )
    )
    assert slider(page) == 15
    choice.select_by_visible_text("best setting: 50 Hz")
    wait(lambda: "0.5" in text(page, "film-time"))


def test_headings_sort_the_runs(page: webdriver.Chrome) -> None:
    def column(place: int) -> list[str]:
        cells = page.find_elements(By.CSS_SELECTOR, f"#runs-table td:nth-child({place})")
        return [cell.text for cell in cells]

    page.find_element(By.CSS_SELECTOR, "#runs-table summary").click()
    heads = page.find_elements(By.CSS_SELECTOR, "#runs-table th")
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


def test_paper_cuts_no_table(page: webdriver.Chrome) -> None:
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    size = {"height": 900, "deviceScaleFactor": 1, "mobile": False}
    widths = "return [...document.querySelectorAll(arguments[0])].map((e) => e.offsetWidth)"
    # letters of both kinds less margins: runs lie across
    for tables, width in (("#runs table", 964), ("section:not(#runs) table", 700)):
        page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, **size})
        found = page.execute_script(widths, tables)
        assert found
        assert max(found) <= width
    page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})


def test_no_error_came_up_on_the_way(page: webdriver.Chrome) -> None:
    assert [e for e in page.get_log("browser") if e["level"] == "SEVERE"] == []


def test_part_of_the_spheres_is_in_the_page_and_all_lie_beside_it(
    spheres: webdriver.Chrome,
) -> None:
    slide(spheres, 15)
    assert text(spheres, "film-shown").startswith("120 of 200 grains at 16 moments: a slice from y")
    choose(spheres, "film-cut", "none")
    few = share(picture(spheres), LAYERS["orange"])
    button = spheres.find_element(By.ID, "film-all")
    assert button.text.startswith("Load all 200 grains at 16 moments (")
    button.click()
    wait(lambda: text(spheres, "film-shown") == "All 200 grains at 16 moments.")
    assert not button.is_displayed()
    # the moment that was shown stays
    assert slider(spheres) == 15
    assert share(picture(spheres), LAYERS["orange"]) > 1.1 * few


def test_spheres_turn_zoom_and_are_cut(spheres: webdriver.Chrome) -> None:
    canvas = spheres.find_element(By.ID, "film-canvas")
    spheres.find_element(By.ID, "film-corner").click()
    before = picture(spheres)
    assert text(spheres, "film-look") == "turned 32°, tilted 20°, zoom 1.0"
    canvas.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP)
    wait(lambda: text(spheres, "film-look") == "turned 38°, tilted 27°, zoom 1.0")
    assert np.abs(picture(spheres) - before).mean() > 1.0
    canvas.send_keys("++-0")
    wait(lambda: text(spheres, "film-look") == "turned 32°, tilted 20°, zoom 1.0")
    ActionChains(spheres).drag_and_drop_by_offset(canvas, -50, 0).perform()
    wait(lambda: text(spheres, "film-look").startswith("turned 60°, tilted 20°"))
    spheres.find_element(By.ID, "film-front").click()
    wait(lambda: text(spheres, "film-look") == "turned 0°, tilted 0°, zoom 1.0")
    whole = share(picture(spheres), LAYERS["green"])
    choose(spheres, "film-cut", "z")
    place = spheres.find_element(By.ID, "film-cut-place")
    spheres.execute_script(
        "arguments[0].value = 30; arguments[0].dispatchEvent(new Event('input'))", place
    )
    assert text(spheres, "film-cut-text") == "z = 30.0 mm"
    seen = picture(spheres)
    # the top layer lies above the plane
    assert whole > 0.02
    assert share(seen, LAYERS["green"]) < 0.1 * whole
    assert share(seen, LAYERS["orange"]) > 0.02
    choose(spheres, "film-cut", "none")


def test_a_near_sphere_hides_a_far_one(spheres: webdriver.Chrome) -> None:
    """From above only the top layer is seen, from every side all three."""
    spheres.find_element(By.ID, "film-solids").click()
    slide(spheres, 4)  # the fill is whole and nothing has moved
    spheres.find_element(By.ID, "film-top").click()
    wait(lambda: "tilted 90°" in text(spheres, "film-look"))
    seen = picture(spheres)
    assert share(seen, LAYERS["green"]) > 0.02
    assert share(seen, LAYERS["orange"]) < 0.1 * share(seen, LAYERS["green"])
    spheres.find_element(By.ID, "film-side").click()
    wait(lambda: "turned 90°" in text(spheres, "film-look"))
    assert min(share(picture(spheres), rgb) for rgb in LAYERS.values()) > 0.01
    spheres.find_element(By.ID, "film-solids").click()


def test_spheres_are_coloured_by_what_is_chosen(spheres: webdriver.Chrome) -> None:
    for value, low, high in (
        ("density", "kg/m³", "kg/m³"), ("speed", "0", "m/s"), ("size", "0", "mm wide"),
    ):  # fmt: skip
        choose(spheres, "film-colour", value)
        wait(lambda: text(spheres, "film-low").endswith(low))  # noqa: B023
        assert text(spheres, "film-high").endswith(high)
        assert not spheres.find_element(By.ID, "film-layers").is_displayed()
        assert share(picture(spheres), LAYERS["orange"]) < 0.01
    choose(spheres, "film-colour", "layer")
    assert spheres.find_element(By.ID, "film-layers").is_displayed()


def test_the_wheel_scrolls_the_page_until_the_view_is_clicked(spheres: webdriver.Chrome) -> None:
    canvas = spheres.find_element(By.ID, "film-canvas")
    spheres.execute_script("document.activeElement.blur()")
    wheel = ActionChains(spheres).scroll_from_origin
    from_canvas = ScrollOrigin.from_element(canvas)
    look = text(spheres, "film-look")
    wheel(from_canvas, 0, 40).perform()
    assert text(spheres, "film-look") == look
    canvas.click()
    wheel(from_canvas, 0, -400).perform()
    wait(lambda: text(spheres, "film-look") != look)
    assert float(text(spheres, "film-look").split()[-1]) > 1.5


def test_controls_have_names(spheres: webdriver.Chrome) -> None:
    unnamed = """
    return [...document.querySelectorAll("#film-view :is(button, select, input, canvas)")].filter(
      (e) => !(e.textContent.trim() || e.ariaLabel || (e.labels && e.labels.length))).length"""
    assert spheres.execute_script(unnamed) == 0


def test_play_is_slow_where_motion_is_to_be_reduced(spheres: webdriver.Chrome) -> None:
    calm = {"features": [{"name": "prefers-reduced-motion", "value": "reduce"}]}
    count = """
    const done = arguments[0], slider = document.getElementById("film-slider");
    slider.value = 0;
    document.getElementById("film-play").click();
    setTimeout(() => {
      document.getElementById("film-play").click();
      done(Number(slider.value));
    }, 800);
    """
    # a busy machine shows fewer
    assert spheres.execute_async_script(count) >= 2
    spheres.execute_cdp_cmd("Emulation.setEmulatedMedia", calm)
    assert spheres.execute_async_script(count) == 1
    spheres.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_a_script_that_is_gone_is_said(spheres: webdriver.Chrome) -> None:
    folder = Path(url2pathname(urlparse(spheres.current_url).path)).parent
    packed = spheres.find_elements(By.CSS_SELECTOR, "script.film")[1].get_property("textContent")
    script = json.loads(str(packed))["beside"]
    (folder / script).unlink()
    choose(spheres, "film-run", "1")
    button = spheres.find_element(By.ID, "film-all")
    wait(button.is_displayed)
    button.click()
    wait(lambda: text(spheres, "film-shown") == f"{script} is not beside this page.")


def test_without_webgl_there_is_a_picture(spheres: webdriver.Chrome) -> None:
    added = spheres.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": NO_WEBGL})
    spheres.refresh()
    wait(lambda: spheres.find_element(By.ID, "film-missing").is_displayed())
    assert not spheres.find_element(By.ID, "film-view").is_displayed()
    shown = spheres.find_element(By.CSS_SELECTOR, "#film-missing img")
    assert shown.get_property("naturalWidth") == 200
    spheres.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)


def test_scene_before_anything_runs(browser: webdriver.Chrome, tmp_path: Path) -> None:
    browser.get_log("browser")
    sand = Sand(size_scale=16)
    few = scenario(50.0, 3).model_copy(
        update={"fill": Fill(layers=(Layer(count=60, repeat=2),)), "sand": sand}
    )
    draw_scene_file(few, "A tube", "base", tmp_path / "scene.html")
    for width, height in ((390, 800), (1100, 900)):
        browser.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500},
        )
        browser.get((tmp_path / "scene.html").as_uri())
        wait(lambda: text(browser, "film-look") != "")
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width
        seen = picture(browser)
        assert min(share(seen, LAYERS["orange"]), share(seen, LAYERS["blue"])) > 0.01
        assert not browser.find_element(By.ID, "film-play").is_displayed()
    assert [e for e in browser.get_log("browser") if e["level"] == "SEVERE"] == []
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
