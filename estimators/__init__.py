"""The documented estimators and policies, each a plug-in that sees recordings only."""

import insenv as insenv  # finds by the names of the release before what has moved
