"""Answers of concealed campaigns, and diagnoses to score against them."""

from nnhydro.blind_tests.scoring import Verdict, score

ANSWER = {"schema": "nnhydro/answer/1", "kind": "effect", "strength": "strong", "unseen": {}, "effects": [
    {"effect": "umbilical_stiffness", "family": "restoring", "joint": 2, "shape": "plain", "near": [],
     "parameters": {"stiffness": {"value": 0.5, "unit": "N m/rad"}, "free_angle": {"value": 0.2, "unit": "rad"}}}]}
HEALTHY = {**ANSWER, "kind": "none", "strength": None, "effects": []}
VERDICT = Verdict("campaign_000", "effect", "strong", truth=("x",), other_shape=False, named=("x",), detected=True, right=True, exact=True,
                  family=True, joint=True, false_claims=0, class_sizes=(1,), claims=((1.0, True),), pairs=(("x", "x"),), alarm=True)


def finding(effect, joint=2, alternatives=(), confidence=0.97, family="restoring", parameters=None):
    """A finding as it stands in diagnosis.json."""
    return {"effect": effect, "family": family, "class": [effect, *alternatives], "joint": joint, "confidence": confidence,
            "parameters": parameters or {}}


def said(*findings, detected=True):
    """A diagnosis.json of these findings."""
    return {"mismatch": {"detected": detected}, "findings": list(findings), "unexplained": {"detected": False}, "seconds": 3.0}


def of(answer, diagnosis):
    """The verdict on a diagnosis."""
    return score("campaign_000", answer, diagnosis, "diagnosis.json")
