"""The version of insenv, which pages, files and the command line state."""

from __future__ import annotations

VERSION = "0.1.0"
