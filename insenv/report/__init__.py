"""What findings look like outside: JSON for programs, text for a terminal, HTML and figures for people."""

from insenv.report.html import to_html, write_html
from insenv.report.json import to_json, write_json
from insenv.report.text import summary

__all__ = ["summary", "to_html", "to_json", "write_html", "write_json"]
