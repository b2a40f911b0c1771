"""The catalogue of instrument errors: each written once, to simulate, fit, bound and design."""
