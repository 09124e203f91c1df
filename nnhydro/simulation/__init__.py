"""A tank on paper: recipe, controller, forward dynamics, sensors, files; blind tests with sealed answers."""
