"""Tests the site and reports of runs in headless Chromium, at 1400 and 400 px, for `docker/fenwear docs`.

Each page must load all its pictures, write no error to the console, and fit into the window. Formulas must have a size,
and no TeX may be left in them or in the text. The search must find pages. In a report, a picture stands on the
first screen, behind one table at most. Prints page, width and finding, and exits with 1 where there is one.
`--pictures DIR` keeps a picture of each page.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import monotonic, sleep

from selenium.webdriver import Chrome, ChromeOptions
from selenium.webdriver.chrome.service import Service

SITE = Path(__file__).parent / "_build" / "html"
WIDTHS = {1400: 1000, 400: 800}  # heights by width, px
SECONDS = 20  # that the search may take
SMALL = ("geometry.parameters.elements_along_contact=8", "geometry.degree=1", "run.half_cycles=8")
REPORTS = {"example1-heat": SMALL, "fretting": (*SMALL, "motion.positions=9"), "fretting-partial-slip": SMALL}

# Each returns what is wrong, as a list of texts.
CHECKS = {
    "overflow": """
        const width = document.documentElement.clientWidth;
        if (document.documentElement.scrollWidth <= width + 1) return [];
        const fits = (e) => { for (let p = e.parentElement; p; p = p.parentElement)
            if (p !== document.body && /auto|scroll|hidden/.test(getComputedStyle(p).overflowX)) return true; };
        const wide = [...document.querySelectorAll("body *")].filter(
            (e) => e.getBoundingClientRect().right > width + 1 && !fits(e));
        return [`${document.documentElement.scrollWidth} px wide: `
                + [...new Set(wide.map((e) => `${e.tagName.toLowerCase()}.${e.className}`))].slice(0, 4).join(", ")];
    """,
    "pictures": """
        return [...document.images].filter((i) => i.loading !== "lazy" && !i.naturalWidth)
            .map((i) => `picture missing: ${i.src.slice(0, 80)}`);
    """,
    "formulas": r"""
        const seen = (e) => e.checkVisibility();
        const wrong = [...document.querySelectorAll("math")].filter((m) => seen(m)
            && (!m.getBoundingClientRect().width || m.querySelector("merror") || m.textContent.includes("\\")));
        const walk = document.createTreeWalker(document.querySelector("article, main") || document.body, 4);
        const left = [];
        for (let node = walk.nextNode(); node; node = walk.nextNode()) {
            if (node.parentElement.closest("code, pre, script, style, math, svg, textarea, annotation")) continue;
            if (/\\[a-z]{2,}|\$[^$\s][^$]*\$/.test(node.data)) left.push(node.data.trim().slice(0, 60));
        }
        return [...wrong.map((m) => `formula: ${m.textContent.slice(0, 60)}`), ...left.map((t) => `TeX in text: ${t}`)];
    """,
}
PICTURE_FIRST = """
    const picture = document.querySelector("img, svg"), tables = [...document.querySelectorAll("table")];
    if (!picture) return ["no picture"];
    const before = tables.filter((t) => t.compareDocumentPosition(picture) & 4).length;
    const top = picture.getBoundingClientRect().top;
    return [...(before > 1 ? [`${before} tables stand before the first picture`] : []),
            ...(innerWidth > 1000 && top > innerHeight ? [`the first picture begins at ${top} px`] : [])];
"""
RESULTS = "return document.querySelectorAll('#search-results li').length"


def browser() -> Chrome:
    """Return a headless Chromium."""
    options = ChromeOptions()
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return Chrome(options, Service("/usr/bin/chromedriver"))


def show(driver: Chrome, address: str, width: int) -> None:
    """Open an address in a window of a width, px."""
    size = {"width": width, "height": WIDTHS[width], "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    driver.get(address)


def findings(driver: Chrome, *, report: bool) -> Iterator[str]:
    """Yield what is wrong with the page that is shown."""
    for check in (*CHECKS.values(), *([PICTURE_FIRST] if report else [])):
        yield from driver.execute_script(check)
    for entry in driver.get_log("browser"):
        if entry["level"] in ("SEVERE", "WARNING"):
            yield f"console: {entry['message']}"


def search_findings(driver: Chrome, site: Path) -> Iterator[str]:
    """Yield what is wrong with the search of a site."""
    show(driver, f"{(site / 'search.html').as_uri()}?q=bushing", 1400)
    end = monotonic() + SECONDS
    while not driver.execute_script(RESULTS):
        if monotonic() > end:
            yield "the search for bushing finds no page"
            return
        sleep(0.1)


def reports(folder: Path) -> Iterator[Path]:
    """Yield the reports of some short runs, computed into a folder."""
    for case, settings in REPORTS.items():
        chosen = [word for setting in settings for word in ("--set", setting)]
        subprocess.run(
            [sys.executable, "-m", "fenwear", "run", case, "-q", "-o", str(folder / case), *chosen], check=True
        )
        yield folder / case / "report.html"


def test(site: Path, folder: Path, pictures: Path | None) -> int:
    """Print all findings, and return the exit status.

    Args:
        site: The folder of the pages.
        folder: For runs whose reports are tested.
        pictures: The folder for pictures of the pages, if any.
    """
    pages = {page.relative_to(site).as_posix(): page for page in sorted(site.rglob("*.html"))}
    pages |= {f"report-{report.parent.name}": report for report in reports(folder)}
    wrong = 0
    with browser() as driver:
        for name, page in pages.items():
            for width in WIDTHS:
                show(driver, page.as_uri(), width)
                for finding in findings(driver, report=name.startswith("report-")):
                    print(f"{name}, {width} px: {finding}", flush=True)
                    wrong += 1
                if pictures is not None:
                    driver.save_screenshot(str(pictures / f"{name.replace('/', '-')}-{width}.png"))
        for finding in search_findings(driver, site):
            print(f"search.html: {finding}")
            wrong += 1
    print(f"{len(pages)} pages in Chromium at {' and '.join(map(str, WIDTHS))} px: {wrong or 'no'} findings")
    return int(wrong > 0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--site", type=Path, default=SITE)
    parser.add_argument("--pictures", type=Path)
    given = parser.parse_args()
    if given.pictures is not None:
        given.pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        sys.exit(test(given.site, Path(made), given.pictures))
