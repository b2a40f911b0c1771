"""The documented estimators and policies, each a plug-in that sees recordings only."""
