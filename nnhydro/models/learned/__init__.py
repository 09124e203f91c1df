"""Learned models: networks, the law of the strips, the free part, hybrids."""
