"""From a set of effects to statements: equivalent effects, intervals, sentences."""
