"""A tank on paper: recipe, controller, forward dynamics, sensors, files; and the arm as an environment of gymnasium."""
