"""What the estimators of several systems share."""
