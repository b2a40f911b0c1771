"""North from a gyro on a turntable: estimators and policies."""
