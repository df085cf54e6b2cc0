"""The dashboard's pages as files: addresses, headers, valid HTML, and nothing from other hosts."""

from __future__ import annotations

import re
from collections import Counter
from html.parser import HTMLParser
from pathlib import Path

import httpx
import pytest

from service.dashboard.assets import load_assets
from service.dashboard.routes import PAGE_POLICY

PAGES = {
    "/": "jobs", "/new": "new", "/jobs/x": "job", "/comparisons/x": "comparison",
    "/plans": "plans", "/plans/x": "plan", "/fleet": "fleet", "/wall": "wall",
    "/targets": "targets",
}  # fmt: skip
STATIC = Path(__file__).resolve().parents[3] / "service" / "dashboard" / "static"
VOID = {"input", "link", "meta"}
FIELDS = {"input", "select", "textarea"}


class Page(HTMLParser):
    """Collects a page's elements, and errors in their nesting."""

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.faults: list[str] = []
        self.ids: Counter[str] = Counter()
        self.references: list[str] = []
        self.labelled: set[str] = set()
        self.unlabelled: list[str] = []
        self.inline: list[str] = []
        self.headings: list[int] = []
        self.feed(text)
        self.close()
        self.faults += [f"<{tag}> is never closed" for tag in self.open]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = dict(attrs)
        if len(named) < len(attrs):
            self.faults.append(f"<{tag}> has an attribute twice")
        if "id" in named:
            self.ids[named["id"] or ""] += 1
        self.references += [value or "" for name, value in attrs if name in ("src", "href")]
        self.inline += [name for name in named if name == "style" or name.startswith("on")]
        if tag == "label" and "for" in named:
            self.labelled.add(named["for"] or "")
        if tag in FIELDS and "label" not in self.open and "aria-label" not in named:
            self.unlabelled.append(named.get("id") or "?")
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"</{tag}> closes something else")


@pytest.mark.parametrize("path", PAGES)
def test_a_page_is_sound_html_with_a_label_on_every_field(client: httpx.Client, path: str) -> None:
    text = client.get(path).text
    assert text.startswith("<!doctype html>\n<html lang=")
    page = Page(text)
    assert page.faults == []
    assert [name for name, count in page.ids.items() if count > 1] == []
    assert [field for field in page.unlabelled if field not in page.labelled] == []
    assert page.headings.count(1) == 1 or path == "/"
    assert page.inline == []


@pytest.mark.parametrize("path", PAGES)
def test_a_page_has_all_its_files_here_and_under_its_version(
    client: httpx.Client, path: str
) -> None:
    page = Page(client.get(path).text)
    version = load_assets().version
    files = [at for at in page.references if at.startswith("/static/")]
    assert files
    for at in page.references:
        assert re.match(r"/(?!/)|#", at), f"{at} is elsewhere"
    for at in files:
        assert at.startswith(f"/static/{version}/")
        assert client.get(at).headers["cache-control"] == "public, max-age=31536000, immutable"


@pytest.mark.parametrize("path", PAGES)
def test_a_page_lets_nothing_run_but_its_own_files(client: httpx.Client, path: str) -> None:
    policy = client.get(path).headers["content-security-policy"]
    assert policy == PAGE_POLICY
    assert "unsafe" not in policy
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["default-src"] == rules["frame-ancestors"] == "'none'"
    assert {rules[f"{kind}-src"] for kind in ("script", "style", "img", "connect")} == {"'self'"}


def test_a_page_is_asked_for_again_and_answered_304(client: httpx.Client) -> None:
    first = client.get("/new")
    assert first.headers["cache-control"] == "no-cache"
    again = client.get("/new", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_a_file_of_another_version_is_no_file_of_this_one(client: httpx.Client) -> None:
    version = load_assets().version
    assert client.get(f"/static/{version}/style.css").status_code == 200
    assert client.get("/static/0123456789abcdef/style.css").status_code == 404
    assert client.get(f"/static/{version}/no.css").status_code == 404
    assert client.get(f"/static/{version}/..%2Froutes.py").status_code == 404


def test_scripts_import_only_files_that_are_there_and_never_turn_text_into_markup() -> None:
    for script in STATIC.glob("*.js"):
        text = script.read_text(encoding="utf-8")
        assert text.startswith("// @ts-check\n"), script.name
        for name in re.findall(r'(?:from|import\()\s*"\./([^"]+)"', text):
            assert (STATIC / name).is_file(), f"{script.name} imports {name}"
        assert re.findall(r"innerHTML|outerHTML|insertAdjacentHTML|eval\(|new Function", text) == []
        assert re.findall(r"https?://", text) == [], script.name


def test_every_id_that_a_script_asks_for_is_on_its_page() -> None:
    assets = load_assets()
    for name, page in assets.pages.items():
        text = page.content.decode()
        there = set(Page(text).ids)
        entry = re.search(r'src="/static/[^/]+/([^"]+)"', text)
        assert entry is not None
        asked = set(re.findall(r'byId\("([^"]+)"\)', _with_imports(entry[1])))
        made = set(re.findall(r'\bid: "([^"]+)"', _with_imports(entry[1])))
        assert asked - there - made == set(), name


def _with_imports(name: str) -> str:
    """Return a script together with all its imports."""
    found: dict[str, str] = {}
    left = [name]
    while left:
        script = left.pop()
        if script not in found:
            found[script] = (STATIC / script).read_text(encoding="utf-8")
            left += re.findall(r'from "\./([^"]+)"', found[script])
    return "\n".join(found.values())
