"""check-plugin: what an estimator or a policy must keep to."""
