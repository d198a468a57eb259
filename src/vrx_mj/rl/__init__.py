"""Learning: environments of Gymnasium and PettingZoo."""
