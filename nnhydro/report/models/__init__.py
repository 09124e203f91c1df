"""Parameters and gains of models as tables and figures."""
