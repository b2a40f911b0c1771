"""The next experiment: procedures that would tell confounded effects apart."""
