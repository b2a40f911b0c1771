"""Scale factor and bias on a rate table: estimators and policies."""
