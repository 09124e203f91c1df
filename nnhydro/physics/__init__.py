"""What is known: motion, flow along the links, load terms and their coefficients, in torch float64. Nothing is learned here."""
