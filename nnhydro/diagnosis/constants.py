"""The constants of the model and of its decision that several modules or the manual name: value, meaning, reason.

A constant that one module alone uses stands there, with its reason.
"""

RHO = 0.3  # prior standard deviation of an effect in shares of the torque, at least: all that the baseline leaves, where that is more
FORM = 0.1  # relative model error of any effect: published laws of one effect differ by a tenth in form
LATE = 0.015  # s: timing error of any effect, by which its values are off: the delay of an ordinary motor drive's filter
NU = 8.0  # prior observations of a noise level, which fewer rows do not determine alone: eight give a variance to a factor of 2
SMALLEST_SIZE = 1e-3  # share of the torque below which an unknown counts as none
MOST_EFFECTS = 6  # most effects in one campaign: a longer list of causes is no explanation
LEAVES = 0.5  # share of the nats to explain that a law may leave to the unknown: true laws leave less than 0.3, similar ones more
FEW_NATS = 10.0  # nats of the unknown below which nothing is left to explain
MODEL_ERROR = 0.002  # relative error of any computed torque that no smooth law holds: strips and interpolation differ by as much
LEAST_GAIN = 3.0  # nats (odds of 20) of a claim against the set without it, prior included; closer rivals cannot be distinguished
NULL_QUANTILE = 0.99  # quantile of the largest gain in campaigns drawn without the effect
NULL_DRAWS = 200  # campaigns drawn, so that the 99 % point is known to about half a nat
PRECISE = 2.0  # standard deviations by which some value of a claim differs from 0
RELEVANT = 0.003  # least share of the rms torque that a claim must move, unless it explains FORM of the rest: strips differ by it
DETECTED = 16.0  # nats of the unknown from which there is a mismatch: odds of 1e7, for some 30 sizes and noise that is only nearly white
MATERIAL = 0.01  # share of a joint's torque that an unknown must hold to be reported
UNLIKE_NOISE = 3.0  # times the error of noise alone: a larger difference between recordings is no noise
P_ALARM = 1e-3  # p-value of an alarm other than the unknown (hum, unlike recordings, common cause): one healthy arm in a thousand
TRUSTED_RATIO = 0.25  # share of the nats left by a standard term, or deviation of a size between recordings: others are as probable
UNLISTED = 0.2  # share of the machines with something missing that are taken to hide a cause outside the catalogue: one in five
