"""The documented estimators and policies, each a plug-in that sees recordings only."""

from insenv.moved import install

install()
