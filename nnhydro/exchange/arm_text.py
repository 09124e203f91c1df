"""The text of arm.yaml as a person would write it: remarks on top, a line a link."""

from collections.abc import Sequence

import yaml

from nnhydro.recordings.arm import Arm


def arm_yaml(arm: Arm, remarks: Sequence[str] = ()) -> str:
    """Return the arm as the text of arm.yaml, `remarks` as comments on top."""
    document = arm.document()
    links = document.pop("links")
    head = "".join(f"# {' '.join(remark.split())}\n" for remark in remarks)
    body = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, default_flow_style=None, width=1000)
    rows = "".join(f"  - {yaml.safe_dump(link, sort_keys=False, default_flow_style=True, width=1000).strip()}\n" for link in links)
    return f"{head}{body}links:\n{rows}"
