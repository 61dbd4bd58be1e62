"""Makes data and weights of the prior and of the ControlNet."""
