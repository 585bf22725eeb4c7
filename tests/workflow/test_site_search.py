"""The search of the documentation finds pages where they are opened as files, without a server."""

from __future__ import annotations

from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from tests.unit.house.test_site import write_site

pytestmark = pytest.mark.browser


def test_search_finds_pages_from_a_page_in_a_folder(tmp_path: Path, browser: Chrome) -> None:
    write_site(tmp_path)
    browser.get((tmp_path / "site/how-to/python.html").as_uri())
    box = browser.find_element(By.CSS_SELECTOR, "input.md-search__input")
    if not box.is_displayed():  # a narrow window shows a button in its place
        browser.find_element(By.CSS_SELECTOR, "label.md-header__button[for=__search]").click()
    box.click()
    box.send_keys("restitution")
    found = WebDriverWait(browser, 60).until(
        lambda opened: opened.find_elements(By.CSS_SELECTOR, ".md-search-result__item a")
    )
    links = [str(link.get_attribute("href")).partition("#")[0] for link in found]
    assert (tmp_path / "site/verification.html").as_uri() in links
