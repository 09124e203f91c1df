"""Every constant of the decision, once: value, meaning, reason."""

RHO = 0.3  # prior standard deviation of an effect in shares of the torque: wide, since an effect of half of the torque must not pay for it
FORM = 0.1  # relative model error of any explanation, of what there is to explain: laws of published papers differ by a tenth in form
LATE = 0.015  # s: model error in timing of any explanation, the delay of an ordinary motor drive's filter
NU = 8.0  # observations by which a noise level is drawn to its neighbours: a variance of eight is known to a factor of 2
SMALLEST_SIZE = 1e-3  # of the torque: an unknown below a thousandth of it is none
MOST_EFFECTS = 6  # effects in one campaign: beyond, a list of causes is no explanation
LEAVES = 0.5  # of what the unknown gains that a law may leave to it: a law that is one leaves less than 0.3, one that resembles it more
FEW_NATS = 10.0  # nats of the unknown below which nothing is left to take
BASELINE_FORM = 0.002  # relative model error of the baseline's own torque: strips and interpolation differ by as much
LEAST_GAIN = 3.0  # nats by which a set with a claim is more probable than without it, prior of all hypotheses included: odds of 20
NULL_QUANTILE = 0.99  # of the largest gain in campaigns drawn without the effect
NULL_DRAWS = 200  # so that the 99 % point is known to about half a nat
PRECISE = 2.0  # standard deviations by which some value of a claim differs from 0
RELEVANT = 0.003  # share of the torque's rms that a claim moves at least, where noise hides less: strips and interpolation differ by it
NEAR = 3.0  # nats behind a finding within which an alternative cannot be told from it: odds of 20
DETECTED = 16.0  # nats of the unknown from which there is a mismatch: odds of 1e7, for some 30 sizes and noise that is only nearly white
MATERIAL = 0.01  # share of a joint's torque that an unknown must hold to be told
TRUSTED_RATIO = 0.6  # of the unknown left by a standard term of a joint at which a cause on no card is as probable
LOOK_ALIKE = 0.1  # of a larger claim's gain that a look-alike on its card must gain beside it: what another form leaves looks like it first
LISTED = 0.96  # of names that fit are right: one machine in five is taken to hide what is on no card, of which one in six gets a name
