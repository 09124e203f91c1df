"""How far the findings can be trusted, and what would be found: injection, confidence, power."""
