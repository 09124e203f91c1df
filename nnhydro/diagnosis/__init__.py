"""What is missing: one probabilistic model of baseline, effects, an unknown law and noise; docs/diagnosis.md is the method.

    y = Y z + sum_(k in S) X_k beta_k + Phi eta + e                                            rows in the cosine domain, in a band

    problem       recordings -> rows y; baseline columns Y with prior z ~ N(0, 1); hypotheses with columns X_k
    noise         e ~ N(0, v): one spectrum per joint, one scale per recording, errors of form and of timing
    model         Phi eta: a smooth unknown law that competes with every effect; log p(y | S) in closed form
    search        the set S with the highest score: log p(y | S) + log prior + mass within physical bounds
    decision      `decide`: gain beyond chance, relevance, precision, bounds, held-out recordings, a cause without a card -> Decision
    findings      equivalent effects, confidence, values with intervals, sentences
    calibration   the confidence by injection into these motions; what would be found
    unexplained   what no finding explains: on what it depends, spectral lines, recordings unlike others
    experiment    the motion that most likely distinguishes equivalent effects

`diagnose.diagnose` runs them in this order and writes baseline, corrected model and the errors of both on held-out recordings.
"""
