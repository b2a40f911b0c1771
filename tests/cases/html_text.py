"""A page of HTML as a reader sees it."""

from html.parser import HTMLParser
from unittest.mock import patch

from insenv.identify.findings import Findings
from insenv.report import to_html


def as_read(found: Findings) -> str:
    """The words of a report's page; its pictures, which are nine tenths of the work, are left white."""
    with patch("insenv.report.svg.inline", lambda *_: "<svg></svg>"):
        return Page(to_html(found)).text


class Page(HTMLParser):
    """What a page consists of; raises where tags do not nest."""

    VOID = frozenset(["meta", "link", "br", "hr", "img", "input"])

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open, f"left open: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-1:]}"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        if not {"style", "svg"} & set(self.open):
            self.texts.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.texts).split())
