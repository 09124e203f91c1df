"""How good: error measures, interval coverage, held-out comparison of all models, reproduction of McLain & Rock."""
