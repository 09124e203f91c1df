"""A simulated tank: recipe, controller, forward dynamics, sensors, files; and the arm as an environment of gymnasium."""
