"""What a robot did not reach: contacts of the human that it misses, in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omni_envs.metrics.report import ReferenceReport
from omni_envs.metrics.skating import intervals

FAR = 0.05
"""A link this far (m) from the place that the human touches misses it."""

_LASTING, _PAUSE = 0.1, 0.2  # s: shorter misses are not told; shorter pauses do not part two


@dataclass(frozen=True)
class Miss:
    """A contact that the robot misses.

    Attributes:
        link: Name in ``CONTACT_LINKS``.
        start: First frame.
        stop: End of the frames.
        distance: Largest distance from the place that the human touches, m.
    """

    link: str
    start: int
    stop: int
    distance: float

    def __str__(self) -> str:
        link = self.link.replace("_", " ")
        return f"{link} by {100 * self.distance:.0f} cm (frames {self.start} to {self.stop - 1})"


def missed_contacts(report: ReferenceReport) -> list[Miss]:
    """The contacts that a motion misses by more than ``FAR`` for a tenth of a second or longer.

    Robots have limits that people do not have: shorter arms, knees and hips that bend less. What
    they cannot reach they come as near to as they can, and this says where.

    Args:
        report: The report of a motion with its source.

    Returns:
        The misses, the farthest first.
    """
    misses = []
    for link, gap in report.contact_gap.items():
        far = np.nan_to_num(gap) > FAR
        for start, stop in intervals(~far):
            inside = start > 0 and stop < len(far)
            if inside and stop - start < _PAUSE * report.fps:
                far[start:stop] = True
        misses += [
            Miss(link, start, stop, float(np.nanmax(gap[start:stop])))
            for start, stop in intervals(far)
            if stop - start >= _LASTING * report.fps
        ]
    return sorted(misses, key=lambda miss: -miss.distance)
