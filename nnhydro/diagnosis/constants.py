"""Every constant of the decision, once: value, meaning, reason."""

RHO = 0.3  # prior standard deviation of an effect in shares of the torque: wide, since an effect of half of the torque must not pay for it
FORM = 0.1  # relative model error of any explanation, of what there is to explain: laws of published papers differ by a tenth in form
LATE = 0.015  # s: model error in timing of any explanation, the delay of an ordinary motor drive's filter
NU = 8.0  # observations by which a noise level is drawn to its neighbours: a variance of eight is known to a factor of 2
SMALLEST_SIZE = 1e-3  # of the torque: an unknown below a thousandth of it is none
MOST_EFFECTS = 6  # effects in one campaign: beyond, a list of causes is no explanation
LEAVES = 0.5  # of what there is to explain that a law may leave to the unknown: a true one leaves less than 0.3, one that resembles it more
FEW_NATS = 10.0  # nats of the unknown below which nothing is left to take
BASELINE_FORM = 0.002  # relative model error of the baseline's own torque: strips and interpolation differ by as much
LEAST_GAIN = 3.0  # nats, odds of 20: a claim against the set without it, prior included; an alternative nearer cannot be told apart
NULL_QUANTILE = 0.99  # of the largest gain in campaigns drawn without the effect
NULL_DRAWS = 200  # so that the 99 % point is known to about half a nat
PRECISE = 2.0  # standard deviations by which some value of a claim differs from 0
RELEVANT = 0.003  # share of the torque's rms that a claim moves at least, where noise hides less: strips and interpolation differ by it
DETECTED = 16.0  # nats of the unknown from which there is a mismatch: odds of 1e7, for some 30 sizes and noise that is only nearly white
MATERIAL = 0.01  # share of a joint's torque that an unknown must hold to be reported
UNLIKE_NOISE = 3.0  # times the error of noise alone: what differs from recording to recording by more is no noise of theirs
P_ALARM = 1e-3  # p of an alarm beside the unknown (a hum, recordings unlike others): one healthy arm in a thousand
TRUSTED_RATIO = 0.6  # of the unknown left by a standard term of a joint at which a cause on no card is as probable
LISTED = 0.96  # of names that fit are right: one machine in five is taken to hide what is on no card, of which one in six gets a name
