"""A real browser and the pages to drive it through; where there is no browser these tests are skipped, and say so."""

import os
import shutil
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")


def _executable():
    """The browser to drive: $NNHYDRO_BROWSER, else the first that is installed."""
    given = os.environ.get("NNHYDRO_BROWSER")
    return given or next((path for name in NAMES if (path := shutil.which(name))), None)


@pytest.fixture(scope="session")
def browser():
    """A headless Chromium."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: pip install 'nnhydro[web]'")
    executable = _executable()
    if executable is None:
        pytest.skip(f"no browser found (looked for {', '.join(NAMES)}): install Chromium or set NNHYDRO_BROWSER to its path")
    with playwright.sync_playwright() as started:
        launched = started.chromium.launch(executable_path=executable, args=["--no-sandbox", "--disable-gpu"])
        yield launched
        launched.close()


class Visit:
    """An open page; remembers whatever the browser complained about and every request that left the file."""

    def __init__(self, browser, path, **context):
        self.context = browser.new_context(**context)
        self.page = self.context.new_page()
        self.complaints, self.requests = [], []
        self.page.on("console", lambda message: self.complaints.append(message.text) if message.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("dialog", lambda dialog: (self.complaints.append(f"dialog: {dialog.message}"), dialog.dismiss()))
        self.page.goto(Path(path).as_uri())


@pytest.fixture
def visit(browser):
    """Open a file in the browser: visit(path, viewport=..., color_scheme=...); what the browser complains about fails the test."""
    opened = []

    def open_page(path, **context):
        opened.append(Visit(browser, path, **{"viewport": {"width": 1280, "height": 900}, **context}))
        return opened[-1].page

    yield open_page
    for page in opened:
        page.context.close()
    assert [complaint for page in opened for complaint in page.complaints] == []
    outside = [url for page in opened for url in page.requests if not url.startswith(("file:", "data:"))]
    assert outside == [], "the page must work offline"
